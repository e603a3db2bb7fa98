"""A free body that spins: APIC on a smooth basis keeps its angular momentum, Newmark's transfers do not."""
import numpy as np
import pytest
from petsc4py import PETSc

from coupling import Scheme, couple, nearest
from coupling.ledger.exchange import Ledger
from dem_liggghts import Interaction, Material, Scene, Spheres, Wall
from mpm_fenicsx import MPM, Body, Box, Grid, Interface, Numerics, neo_hooke
from studies.crossing import spinning


@pytest.fixture
def exact():
    """Newton's method to round-off: angular momentum is kept to its tolerance."""
    options = PETSc.Options("mpm_")
    options["snes_rtol"], options["snes_atol"] = 1e-12, 1e-13
    yield
    options.delValue("snes_rtol")
    options.delValue("snes_atol")


def test_seeds_have_the_area_and_nearly_the_moment_of_inertia_of_the_body():
    for shape, area, square in (("disc", np.pi * 0.04, 0.02), ("square", 0.16, 0.08 / 3)):
        cloud = spinning.seeds(shape, 0.0125)
        x = cloud.x - spinning.CENTRE
        assert cloud.volume.sum() == pytest.approx(area, rel=1e-12)
        assert cloud.volume @ (x**2).sum(axis=1) / area == pytest.approx(square, rel=5e-3)


def test_closed_form_is_in_equilibrium():
    """d sigma_r / dr + (sigma_r - sigma_t) / r + rho w^2 r = 0, free rim; the mean of the sum is rho w^2
    R^2 / 2 (virial)."""
    r, step = np.linspace(0.01, 0.19, 50), 1e-6
    at = lambda r: spinning.closed_form(np.column_stack([r, 0 * r])).T  # noqa: E731
    (radial, tangential), R = at(r), spinning.R
    slope = (at(r + step)[0] - at(r - step)[0]) / (2 * step)
    np.testing.assert_allclose(slope + (radial - tangential) / r + r / R**2, 0.0, atol=1e-7)
    assert at(np.array([R]))[0, 0] == pytest.approx(0.0, abs=1e-15)


@pytest.mark.parametrize("shape", ["disc", "square"])
@pytest.mark.parametrize("basis", ["ugimp", "bspline"])
def test_apic_keeps_angular_momentum_and_energy(basis, shape, exact):
    found = spinning.run(basis, h=0.1, transfer="apic", shape=shape, turns=0.5, points=2)
    assert found["angular_momentum"] < 1e-11
    assert -0.005 < found["energy"] < 0.0


def test_newmark_loses_what_apic_keeps():
    newmark, tpic = (
        spinning.run("ugimp", h=0.1, transfer=way, turns=0.25, points=2) for way in ("newmark", "tpic"))
    assert newmark["angular_momentum"] > 0.02 and newmark["energy"] < -0.04
    assert tpic["angular_momentum"] < 1e-3 and abs(tpic["energy"]) < 2e-3


def test_ledger_closes_for_a_free_square_struck_by_a_sphere(exact):
    """The angular momentum that the square gains is the angular impulse at its interface; its history has
    what the transfers lose."""
    box = Box((0.1, 0.1), (0.5, 0.3))
    square = Body(box, (8, 4), 2, neo_hooke(1e6, 0.3), 1000.0)
    grid, top = Grid(Box((-0.2, -0.2), (0.8, 0.6)), (20, 16)), Interface.top(box, 8, 0.0125)
    solid = MPM(grid, square, interface=top, inertia="lumped",
                numerics=Numerics(basis="bspline", transfer="apic", losses=True))
    sphere = Spheres([(0.4, 0.3375)], [(0.5, -2.0)], radius=0.05, rho=2000.0)
    soft = Material(1e6, 0.3)
    x, _ = solid.surface()
    scene = Scene(sphere, Wall(x, solid.interface.elements), soft, soft, at_wall=Interaction(0.9, 0.3))
    grains, rows = scene.open("reference", 1e-5), []
    ledger = Ledger(solid, grains)
    couple(solid, grains, nearest(x, x), Scheme(2e-4, 0.02, substeps=20), on_window=[
        lambda window: rows.append({**ledger(window), **{
            name: value() for name, (_, _, value) in solid.columns().items()}})])
    last = rows[-1]
    assert abs(last["angular_solid_z"]) > 0.1 and last["impulse_grains"] > 0.0
    assert last["angular_momentum_z"] == pytest.approx(last["angular_solid_z"], rel=1e-9)
    assert abs(last["angular_to_grid_z"]) + abs(last["angular_to_points_z"]) < 1e-12
    assert last["kinetic_to_grid"] < 0.0
    solid.close()
