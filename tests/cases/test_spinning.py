"""A free body that spins: APIC on a smooth basis keeps its angular momentum, Newmark's transfers do not."""
import numpy as np
import pytest
from petsc4py import PETSc

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
@pytest.mark.parametrize("basis", ["gimp", "bspline"])
def test_apic_keeps_angular_momentum_and_energy(basis, shape, exact):
    found = spinning.run(basis, h=0.1, transfer="apic", shape=shape, turns=0.5, points=2)
    assert found["angular_momentum"] < 1e-11
    assert -0.005 < found["energy"] < 0.0


def test_newmark_loses_what_apic_keeps():
    newmark, tpic = (
        spinning.run("gimp", h=0.1, transfer=way, turns=0.25, points=2) for way in ("newmark", "tpic"))
    assert newmark["angular_momentum"] > 0.02 and newmark["energy"] < -0.04
    assert tpic["angular_momentum"] < 1e-3 and abs(tpic["energy"]) < 2e-3
