"""The driver of a single point against closed forms, and what it says where a law cannot follow."""
import numpy as np
import pytest

from mpm_fenicsx import (
    LAWS,
    PATHS,
    MPMDivergedError,
    Stage,
    drive,
    drucker_prager,
    herschel_bulkley,
    linear,
    mohr_coulomb,
    neo_hooke,
    von_mises,
)
from mpm_fenicsx.laws.paths import AXES, COMPONENTS
from tests.mpm.conftest import TOO_STRONG_TO_YIELD

E, NU, PHI, PSI, C, P0 = 5e7, 0.3, 30.0, 10.0, 1e3, 1e5
N = np.tan(np.radians(45 + PHI / 2)) ** 2  # K_p
G, K = E / (2 * (1 + NU)), E / (3 * (1 - 2 * NU))
SOIL = mohr_coulomb(E, NU, PHI, PSI, C)
FLUIDS = {"herschel_bulkley"}  # without Young's modulus


@pytest.fixture(params=sorted({"linear", "neo_hooke", *TOO_STRONG_TO_YIELD} & set(LAWS) - FLUIDS))
def elastic(request):
    """A law in its elastic range."""
    return LAWS[request.param](E, NU, **TOO_STRONG_TO_YIELD.get(request.param, {}))


def led(law, name, **keys):
    """Table of a named path, its last row and its change of volume."""
    table = drive(law, PATHS[name](**keys))
    return table, {column: values[-1] for column, values in table.items()}, np.exp(table["volume"])


def test_oedometer_of_small_strain(elastic):
    """K_0 = nu / (1 - nu), modulus E (1 - nu) / (1 + nu) (1 - 2 nu)."""
    _, end, _ = led(elastic, "oedometer", shortening=1e-7, steps=2)
    assert end["s_xx"] / end["s_yy"] == pytest.approx(NU / (1 - NU), rel=1e-6)
    assert end["s_xx"] == pytest.approx(end["s_zz"], rel=1e-12)
    assert end["s_yy"] / end["e_yy"] == pytest.approx(E * (1 - NU) / ((1 + NU) * (1 - 2 * NU)), rel=1e-6)


def test_uniaxial_plane_and_isotropic_stress_of_small_strain(elastic):
    _, end, _ = led(elastic, "triaxial", shortening=1e-7, steps=2)
    assert end["s_yy"] / end["e_yy"] == pytest.approx(E, rel=1e-6)
    assert end["e_xx"] / end["e_yy"] == pytest.approx(-NU, rel=1e-6) and abs(end["s_xx"]) < 1e-6
    _, end, _ = led(elastic, "plane_strain", shortening=1e-7, steps=2)
    assert end["s_yy"] / end["e_yy"] == pytest.approx(E / (1 - NU**2), rel=1e-6) and end["e_zz"] == 0.0
    assert end["s_zz"] / end["s_yy"] == pytest.approx(NU, rel=1e-6)
    _, end, _ = led(elastic, "isotropic", pressure=100.0, steps=2)
    assert end["volume"] == pytest.approx(-100.0 / K, rel=1e-5) and end["p"] == pytest.approx(100.0, rel=1e-8)


def test_undrained_keeps_the_volume(elastic):
    table, end, _ = led(elastic, "undrained", shortening=1e-5, pressure=P0, steps=4)
    assert end["volume"] == pytest.approx(table["volume"][4], rel=1e-12)
    assert end["q"] == pytest.approx(3 * G * 1e-5, rel=0.01)


def test_simple_shear_of_neo_hooke():
    """sigma_xy = mu gamma, sigma_xx = mu gamma^2, exact for any shear."""
    table, _, _ = led(neo_hooke(E, NU), "simple_shear", shear=2.0, steps=8)
    gamma = table["e_xy"]
    np.testing.assert_allclose(gamma, np.linspace(0.0, 2.0, 9), rtol=1e-12)
    np.testing.assert_allclose(table["s_xy"], G * gamma, rtol=1e-12)
    np.testing.assert_allclose(table["s_xx"], G * gamma**2, rtol=1e-12)
    np.testing.assert_allclose(table["energy"], 0.5 * G * gamma**2, rtol=1e-12)
    np.testing.assert_allclose(table["work"], table["energy"], rtol=1e-12)  # the stress is linear in gamma
    assert abs(table["s_yy"]).max() < 1e-7 and abs(table["s_zz"]).max() < 1e-7


@pytest.mark.parametrize("law", [SOIL, drucker_prager(E, NU, PHI, PSI, C)], ids=["mohr_coulomb", "cone"])
def test_triaxial_peak(law):
    """-sigma_yy = K_p p_0 + 2 c sqrt(K_p) in Kirchhoff's stress, J sigma, in which the laws yield."""
    table, _, J = led(law, "triaxial", shortening=0.1, pressure=P0, steps=40)
    last = table["e_yy"] < -0.02
    np.testing.assert_allclose(-(J * table["s_yy"])[last], N * P0 * J[last] + 2 * C * np.sqrt(N), rtol=1e-8)
    np.testing.assert_allclose(table["s_xx"][41:], -P0, rtol=1e-9)
    np.testing.assert_allclose(table["e_xx"], table["e_zz"], rtol=1e-9, atol=1e-12)
    M = np.tan(np.radians(45 + PSI / 2)) ** 2
    # the elastic change of volume under a growing J is the rest
    np.testing.assert_allclose(np.diff(table["volume"][last]), (M - 1) * 0.0025, rtol=0.02)


def test_plane_strain_peak():
    table, _, J = led(SOIL, "plane_strain", shortening=0.1, pressure=P0, steps=40)
    last = table["e_yy"] < -0.02
    np.testing.assert_allclose(-(J * table["s_yy"])[last], N * P0 * J[last] + 2 * C * np.sqrt(N), rtol=1e-8)


def test_yield_of_a_metal_in_tension():
    """J sigma = E e up to the yield stress, which it keeps; the plastic strain is what is beyond."""
    table, end, J = led(von_mises(210e9, NU, 235e6), "triaxial", shortening=-0.01, steps=50)
    expected = np.minimum(210e9 * table["e_yy"], 235e6)
    np.testing.assert_allclose(J * table["s_yy"], expected, rtol=1e-8)
    assert end["plastic_strain"] == pytest.approx(0.01 - 235e6 / 210e9, rel=1e-6)
    assert end["work"] == pytest.approx(end["energy"] + end["plastic_work"], rel=0.01)


def test_a_fluid_feels_the_rate():
    """tau = tau_y + k g^n after the delay k / G, and tau_y when it is slow."""
    mud = herschel_bulkley(1e6, 20.0, 50.0, 0.5)
    for time, tau in ((0.25, 50.0 + 20.0 * 4.0**0.5), (1.0, 70.0), (None, 50.0)):
        table, end, _ = led(mud, "simple_shear", shear=1.0, time=time, steps=200)
        assert end["s_xy"] == pytest.approx(tau, rel=1e-3)
        assert table["time"][-1] == pytest.approx(time or 0.0, rel=1e-12)


def test_shear_box_keeps_its_pressure():
    table, end, _ = led(SOIL, "direct_shear", shear=0.2, pressure=P0, steps=50)
    np.testing.assert_allclose(table["s_yy"][51:], -P0, rtol=1e-9)
    assert (table["e_xx"][51:] == table["e_xx"][50]).all() and table["e_yy"][-1] > table["e_yy"][50]
    assert end["s_xy"] < P0 * np.tan(np.radians(PHI)) + C  # Coulomb's plane is another one


def test_cycles_end_where_they_began_and_dissipate():
    for name, strain, keys in (("cyclic", "e_yy", dict(shortening=0.01)), ("cyclic_shear", "e_xy",
                                                                            dict(shear=0.02))):
        table, _, _ = led(SOIL, name, pressure=P0, cycles=2, steps=20, **keys)
        first, middle, last = table["work"][[20, 80, 140]]
        size = np.ptp(table[strain][20:])
        assert table[strain][-1] == pytest.approx(table[strain][20], abs=1e-14)
        assert size == pytest.approx(2 * sum(keys.values()), rel=1e-12) and first < middle < last
        elastic, _, _ = led(neo_hooke(E, NU), name, pressure=P0, cycles=1, steps=20, **keys)
        assert abs(elastic["work"][-1] - elastic["work"][20]) < 1e-3 * np.ptp(elastic["energy"])


def test_strains_that_were_found_give_the_stresses_back():
    """All six components mixed."""
    path = [Stage(stress=dict(xx=-P0, yy=-1.5 * P0, zz=-P0, xy=0.2 * P0), steps=5),
            Stage({"yy": -0.01, "yz": 0.005}, {"xx": -P0, "xz": 0.05 * P0}, steps=20, time=1.0)]
    mixed = drive(SOIL, path)
    assert mixed["plastic_strain"][-1] > 1e-3 and mixed["s_xz"][-1] == pytest.approx(0.05 * P0, rel=1e-9)
    strains = np.diff([mixed[f"e_{name}"] for name in COMPONENTS])
    table = drive(SOIL, [Stage(dict(zip(COMPONENTS, change)), steps=1) for change in strains.T])
    for name in COMPONENTS:
        np.testing.assert_allclose(table[f"s_{name}"], mixed[f"s_{name}"], rtol=0, atol=1e-6 * P0)


# ---------------------------------------------------------------- in the plane

PLANE = {"linear": linear(E, NU), "mohr_coulomb": SOIL, "drucker_prager": drucker_prager(E, NU, PHI, PSI, C),
         "von_mises": von_mises(E, NU, P0), "herschel_bulkley": herschel_bulkley(1e6, 20.0, 50.0, 0.5)}


@pytest.mark.parametrize("name", sorted(PLANE))
def test_kernels_of_plane_scenes_agree_with_those_in_space(name):
    """Plane strain compression and shear: one law, compiled for two and for three dimensions."""
    law = PLANE[name]
    for path in (PATHS["plane_strain"](shortening=0.01, pressure=P0, steps=10, time=1.0),
                 PATHS["direct_shear"](shear=0.02, pressure=P0, steps=10, time=1.0)):
        plane, space = drive(law, path, dimensions=2), drive(law, path)
        assert set(space) - set(plane) >= {"e_yz", "e_xz", "s_yz", "s_xz"} and "e_zz" in plane
        for column in ("s_xx", "s_yy", "s_zz", "s_xy"):
            np.testing.assert_allclose(plane[column], space[column], rtol=1e-8, atol=1e-8 * P0)


@pytest.mark.parametrize("dimensions", [2, 3])
def test_plane_stress_of_a_sheet(dimensions):
    """Small strain: E along y, -nu of it the stretch across; then yield at Y of uniaxial stress."""
    sheet = von_mises(210e9, NU, 235e6)
    table = drive(sheet, PATHS["plane_stress"](shortening=-0.01, steps=50), dimensions)
    assert table["s_yy"][5] / table["e_yy"][5] == pytest.approx(210e9, rel=2e-3)
    assert table["e_zz"][5] / table["e_yy"][5] == pytest.approx(-NU, rel=2e-3)
    assert abs(table["s_zz"]).max() < 1e-6 * 235e6 and abs(table["s_xx"]).max() < 1e-6 * 235e6
    assert (np.exp(table["volume"]) * table["s_yy"])[-1] == pytest.approx(235e6, rel=1e-8)


# ---------------------------------------------------------------- where it ends

def test_a_limit_point_is_told():
    """Stress beyond the strength: the last state is on the yield surface."""
    cell = dict(xx=-P0, zz=-P0)
    with pytest.raises(MPMDivergedError, match=r"path of mohr_coulomb ends at 67\.\d% of stage 1, at s_xx = "
                       r"-100000 Pa, s_yy = -303.* e_yy = -0.00.*limit point.* prescribe strains") as stopped:
        drive(SOIL, [Stage(stress={**cell, "yy": -P0}, steps=10), Stage(stress={**cell, "yy": -4 * P0})])
    reached = float(str(stopped.value).split("s_yy = ")[1].split()[0])
    assert -reached == pytest.approx(N * P0 + 2 * C * np.sqrt(N), rel=2e-4)


def test_the_tension_that_a_soil_bears_is_told():
    apex = C / np.tan(np.radians(PHI))
    with pytest.raises(MPMDivergedError) as stopped:
        drive(SOIL, [Stage(stress=dict.fromkeys(AXES, 5e3), steps=10)])
    assert float(str(stopped.value).split("s_xx = ")[1].split()[0]) == pytest.approx(apex, rel=1e-3)


def test_the_end_of_a_law_s_domain_is_told():
    """Saint Venant–Kirchhoff softens in compression and turns back."""
    with pytest.raises(MPMDivergedError, match=r"path of linear ends at .* of stage 0, at s_yy = -"):
        drive(linear(E, NU), [Stage(stress={"yy": -E})])


@pytest.mark.parametrize("make, words", [
    (lambda: Stage({"rr": 1.0}), "component of the strain is 'rr': choose one of xx, yy, zz, xy, yz, xz"),
    (lambda: Stage({"yy": -1.0}, {"yy": 1.0}), "yy has its strain and its stress prescribed"),
    (lambda: Stage({"yy": 30.0}), "strain yy is 30.0: give a number from -10.0 to 10.0"),
    (lambda: Stage(-0.1), "strain of the stage is -0.1: give a dict by component"),
    (lambda: Stage(steps=0), "steps is 0: give a whole number of at least 1"),
    (lambda: Stage(time=0.0), "time is 0.0 s: give a positive number, or None"),
    (lambda: PATHS["triaxial"](0.1, -1.0), "pressure is -1.0 Pa: give 0 or a positive number"),
    (lambda: PATHS["cyclic"](0.1, cycles=0), "cycles is 0"),
    (lambda: drive(SOIL, [0.1]), "one of the stages of the path is 0.1: give a Stage"),
    (lambda: drive("soil", []), "law of the body is 'soil': give a Law"),
    (lambda: drive(SOIL, [], dimensions=1), "dimensions is 1: choose one of 2, 3"),
    (lambda: drive(SOIL, [Stage({"xz": 0.1})], 2), "component of stage 0 is 'xz': in the plane choose one")],
    ids=["component", "both", "strain", "number", "steps", "time", "pressure", "cycles", "path", "law",
         "dimensions", "across"])
def test_impossible_paths(make, words):
    with pytest.raises(ValueError, match=words):
        make()
