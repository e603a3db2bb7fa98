"""Softening: a straight fall of strength in closed form, bands on three grids, and what cannot be meant."""
import numpy as np
import pytest

from mpm_fenicsx import (
    MPM,
    PATHS,
    Body,
    Box,
    Grid,
    Soil,
    drive,
    drucker_prager,
    linear,
    mohr_coulomb,
    softened,
    von_mises,
)
from tests.mpm import shear_layer
from tests.mpm.conftest import make_distorted

E, NU = 50e6, 0.3
G = E / (2 * (1 + NU))
PRESSURE, STRAIN = 1e3, 1e-3  # so small that strains of second order do not count
PEAK, RESIDUAL = dict(friction_angle=35.0, cohesion=2e3), dict(friction_angle=25.0, cohesion=5e2)
LAWS = {"mohr_coulomb": mohr_coulomb, "drucker_prager": drucker_prager}


def soft(make, peak=None, residual=None, strain=STRAIN, length=0.1, cell=0.1, **others):
    peak, residual = {**PEAK, **(peak or {})}, {**RESIDUAL, **(residual or {})}
    return softened(make(E, NU, **peak, **others), make(E, NU, **residual, **others), strain, length, cell)


def strength(law, k):
    """Shear stress that flows under PRESSURE without dilation, whose pressure in the plane then stays."""
    p, share = law.params, min(k / law.params.full, 1.0)
    now = {name: value - share * law.params.full * getattr(p, f"{name}_falls")
           for name, value in p._asdict().items() if f"{name}_falls" in p._fields}
    if "xi" in now:
        return now["xi"] + now["eta"] * PRESSURE
    return (now["S"] + (now["N"] - 1.0) * PRESSURE) / (now["N"] + 1.0)


@pytest.mark.parametrize("cell", [0.1, 0.05, 0.2])
@pytest.mark.parametrize("name", LAWS)
def test_simple_shear_follows_the_stated_line(name, cell):
    """Slide gamma = tau / G + sqrt(3) k with tau the strength at k: N, M, S (eta, xi) fall in a line until
    the plastic slide is strain length / cell, from where on tau stays."""
    law = soft(LAWS[name], cell=cell)
    full = STRAIN * 0.1 / cell
    table = drive(law, PATHS["simple_shear"](shear=1.5 * full, pressure=PRESSURE, steps=60))
    sheared = table["stage"] == table["stage"].max()
    k, tau, slide = (table[key][sheared] for key in ("plastic_strain", "s_xy", "e_xy"))
    flows = k > 0.0
    exact = np.array([strength(law, one) for one in k])
    np.testing.assert_allclose(tau[flows], exact[flows], rtol=4e-3)
    np.testing.assert_allclose(slide, tau / G + np.sqrt(3.0) * k, rtol=2e-3)
    assert tau[-1] == pytest.approx(strength(law, np.inf), rel=4e-3) and tau.max() > 1.5 * tau[-1]
    assert np.sqrt(3.0) * law.params.full == pytest.approx(full, rel=1e-12)


@pytest.mark.parametrize("name", LAWS)
def test_long_steps_end_where_short_ones_do(name):
    """The strength is that of the end of a step, and a slide in one direction has one end."""
    ends = [drive(soft(LAWS[name]), PATHS["simple_shear"](shear=0.6 * STRAIN, pressure=PRESSURE, steps=steps))
            for steps in (2, 200)]
    for key in ("s_xy", "plastic_strain"):
        assert ends[0][key][-1] == pytest.approx(ends[1][key][-1], rel=2e-3)


def test_a_band_dissipates_the_same_on_every_grid():
    """Plastic work of a band per area, cell times that per volume."""
    work = []
    for cell in (0.025, 0.05, 0.1, 0.2):
        law = soft(mohr_coulomb, dict(friction_angle=0.0), dict(friction_angle=0.0), cell=cell)
        table = drive(law, PATHS["simple_shear"](shear=1.3 * STRAIN * 0.1 / cell, steps=200))
        done = np.searchsorted(table["plastic_strain"], law.params.full)
        work.append(cell * table["plastic_work"][done])
    np.testing.assert_allclose(work, 0.5 * (2e3 + 5e2) * STRAIN * 0.1, rtol=0.02)


@pytest.mark.parametrize("n", [4, 8, 16])
def test_a_band_is_as_strong_on_every_grid(n):
    """The slide of the top is that of the elastic layer and of the band, whatever the size of its cell."""
    u, tau = shear_layer.sheared(n)
    exact = shear_layer.exact(u)
    np.testing.assert_allclose(tau, exact, atol=0.01 * exact.max())


def test_without_the_length_a_band_breaks_the_sooner_the_finer_the_grid():
    half = [u[np.flatnonzero(tau > 0.5 * tau.max())[-1]] for u, tau in
            (shear_layer.sheared(n, regular=False, slide=0.012) for n in (4, 8))]
    assert half[0] > 1.6 * half[1]


@pytest.mark.parametrize("name", LAWS)
def test_under_great_pressure_friction_is_lost_at_once(name):
    """Where it falls faster than the soil unloads, no stress lies between peak and residual strength: the
    first slide beyond the peak ends at the residual one."""
    law = soft(LAWS[name], strain=0.005)
    table = drive(law, PATHS["simple_shear"](shear=0.06, pressure=1e6, steps=100))
    sheared = table["stage"] == table["stage"].max()
    k = table["plastic_strain"][sheared]
    assert not ((k > 0.02 * law.params.full) & (k < law.params.full)).any() and k[-1] > law.params.full
    tau = table["s_xy"][sheared]
    assert tau[-1] < 0.8 * tau.max()


def test_a_law_that_does_not_soften_has_nothing_of_it():
    plain = [name for name, _ in mohr_coulomb(E, NU, **PEAK).parts]
    assert "weakened" not in plain and "after" not in plain
    assert [name for name, _ in soft(mohr_coulomb).parts][:len(plain) - 2] == plain[:-2]


@pytest.mark.parametrize("law, wrong, words", [
    ("mohr_coulomb", dict(residual=dict(cohesion=3e3, friction_angle=35.0)),
     "cohesion of the residual soil is"),
    ("drucker_prager", dict(residual=dict(friction_angle=36.0)), "friction_angle of the residual soil is"),
    ("mohr_coulomb", dict(residual=dict(dilation_angle=1.0)), "dilation_angle of the residual soil is"),
    ("mohr_coulomb", dict(length=0.0), "length of softening is 0.0 m: give the width of the band"),
    ("mohr_coulomb", dict(length=np.nan), "length of softening is nan m"),
    ("mohr_coulomb", dict(strain=-1.0), "strain of softening is -1.0: give the plastic shear strain"),
    ("mohr_coulomb", dict(cell=0.0), "cell of softening is 0.0 m: give the size of the background cells"),
    ("mohr_coulomb", dict(cell=100.0), "cell is 100 m: within bands so wide .* faster than the soil unloads; "
                                       "give cells of less than"),
    ("drucker_prager", dict(cell=100.0), "cell is 100 m: within bands so wide")])
def test_what_cannot_be_meant_is_told(law, wrong, words):
    with pytest.raises(ValueError, match=words):
        soft(LAWS[law], **wrong)


@pytest.mark.parametrize("peak, residual, words", [
    (linear(E, NU), linear(E, NU), "peak is the law linear: give one of mohr_coulomb, drucker_prager"),
    (mohr_coulomb(E, NU, 30.0), drucker_prager(E, NU, 30.0), "peak is the law mohr_coulomb, residual"),
    (mohr_coulomb(E, NU, 30.0), mohr_coulomb(2 * E, NU, 30.0), "give both the same E, nu and viscosity"),
    (mohr_coulomb(E, NU, 30.0), von_mises(E, NU, 1e3), "residual is the law von_mises"),
    (3.0, mohr_coulomb(E, NU, 30.0), "peak is 3.0")])
def test_laws_that_do_not_go_together(peak, residual, words):
    with pytest.raises(ValueError, match=words):
        softened(peak, residual, STRAIN, 0.1, 0.1)


SOIL = dict(E=E, nu=NU, rho=1800.0, phi=35.0, cohesion=2e3)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("dim", [2, 3])
def test_a_soil_of_a_case_softens(law, dim):
    keys = dict(softening=0.05, softening_length=0.1, residual_phi=25.0, residual_cohesion=5e2)
    one = Soil(**SOIL, law=law, psi=5.0, **keys).material(dim).by_cell(0.05)
    match = {} if law == "mohr_coulomb" else {"match": "plane_strain" if dim == 2 else "compression"}
    other = soft(LAWS[law], dict(dilation_angle=5.0), strain=0.05, length=0.1, cell=0.05, **match)
    assert one.name == other.name == f"softening_{law}" and one.params == other.params


@pytest.mark.parametrize("keys, words", [
    (dict(softening=0.1), "softening_length is none: softening=0.1 needs it"),
    (dict(softening=0.1, softening_length=0.1, residual_phi=36.0),
     "residual_phi is 36.0 degrees: .* at most phi"),
    (dict(softening=0.1, softening_length=0.1, residual_cohesion=3e3),
     "residual_cohesion is 3000.0 Pa: give"),
    (dict(softening=0.1, softening_length=-0.1), "length of softening is -0.1 m"),
    (dict(softening=0.0, softening_length=0.1), "strain of softening is 0.0")])
def test_numbers_of_a_soil_that_cannot_be_meant(keys, words):
    with pytest.raises(ValueError, match=words):
        Soil(**SOIL, **keys).material(2)


def scene(law, grid):
    """A block of that soil."""
    return MPM(grid, Body(Box((0.0, 0.0), (0.2, 0.2)), (4, 4), 2, law, 1800.0))


def test_without_a_size_the_cells_are_those_of_the_grid():
    law = Soil(**SOIL, softening=0.1, softening_length=0.1).material(2)
    assert law.params.full == pytest.approx(0.1 / 3**0.5)  # of a point, a sample as wide as the length
    room = Box((0.0, 0.0), (0.4, 0.4))
    fine = make_distorted("triangle", (8, 8), by=0.0, box=room)
    for grid, cell in ((Grid(room, (8, 8)), 0.05), (Grid(room, (4, 16)), 0.05), (fine, 0.05),
                       (Grid(room, (4, 4)), 0.1)):
        solid = scene(law, grid)
        assert solid.bodies[0].body.law.cell == pytest.approx(cell)
        assert solid.bodies[0].body.law.params.full == pytest.approx(0.1 / 3**0.5 * 0.1 / cell)
        solid.close()


def test_cells_of_another_size_are_told():
    law = soft(LAWS["mohr_coulomb"], cell=0.05)
    room = Box((0.0, 0.0), (0.4, 0.4))
    scene(law, Grid(room, (8, 4))).close()  # of cells that are not square, any size in between
    for counts in ((4, 4), (16, 16)):
        with pytest.raises(ValueError, match="softening_mohr_coulomb of body 0 is made for cells of 0.05 m, "
                           "and those of the grid are .* m: leave cell= out"):
            scene(law, Grid(room, counts))
    brittle = soft(LAWS["mohr_coulomb"], length=1e-4, cell=None)
    with pytest.raises(ValueError, match="cell is 0.1 m: within bands so wide"):
        scene(brittle, Grid(room, (4, 4)))
