"""How exactly Newton's method solves its linear systems."""
import numpy as np
import pytest
from petsc4py import PETSc

from mpm_fenicsx.solve.tolerance import LATE, Kind, Norms, Tolerance

UNKNOWNS, LOOSE, GOAL = 200, 1e-3, 3e-7


def solve(aims, **options):
    """Tolerances of the linear systems of a linear problem, solved to GOAL of the first residual."""
    stiffness = np.diag(np.linspace(1.0, 30.0, UNKNOWNS))
    stiffness[:-1, 1:] += 0.4 * np.eye(UNKNOWNS - 1)
    stiffness[1:, :-1] += 0.4 * np.eye(UNKNOWNS - 1)
    matrix = PETSc.Mat().createDense((UNKNOWNS, UNKNOWNS), array=stiffness, comm=PETSc.COMM_SELF)
    matrix.assemble()
    snes, seen = PETSc.SNES().create(PETSc.COMM_SELF), []
    given = PETSc.Options("mpm_")
    for name, value in options.items():
        given[name] = value

    def residual(snes, x, out):
        out.array_w[:] = stiffness @ x.array_r - 1.0

    def tangent(snes, x, matrix, same):
        if aims:
            tolerance.aim(snes)
        seen.append(snes.getKSP().getTolerances()[0])
        matrix.assemble()

    x, out = matrix.createVecs()
    snes.setFunction(residual, out)
    snes.setJacobian(tangent, matrix)
    snes.setTolerances(rtol=GOAL, atol=0.0, stol=0.0)
    snes.getKSP().setType("cg")
    snes.getKSP().setTolerances(rtol=LOOSE)
    snes.getKSP().getPC().setType("none")
    tolerance = Tolerance(Kind())
    tolerance.begin(snes, Norms(0.0, 0.0, 0.0))
    snes.solve(None, x)
    assert snes.getConvergedReason() > 0
    np.testing.assert_allclose(stiffness @ x.array, 1.0, atol=GOAL * np.sqrt(UNKNOWNS))
    snes.destroy()
    for name in options:
        given.delValue(name)
    return seen


def test_an_iteration_that_can_be_the_last_one_is():
    """The first one cannot; the second one would leave a thousandth of a thousandth."""
    first, second = solve(True)
    assert first == LOOSE and GOAL < second < LOOSE
    assert solve(False) == [LOOSE] * 3


def test_the_user_s_tolerance_stays():
    assert solve(True, ksp_rtol=LOOSE) == [LOOSE] * 3


@pytest.mark.parametrize("reach", [0.5, 2.0])
def test_what_is_out_of_reach_is_solved_loosely(monkeypatch, reach):
    """That a system be solved better than FINEST for it, is not worth it."""
    monkeypatch.setattr("mpm_fenicsx.solve.tolerance.FINEST", reach * 0.3 * GOAL)
    assert (solve(True)[0] == LOOSE) == (reach > 1.0)


@pytest.mark.parametrize("flows, given, end, late", [
    (False, {}, 1e-6 * 50.0, 1e-4 * 50.0),
    (True, {}, 1e-4 * 30.0, 1e-4 * 50.0),
    (True, {"snes_rtol": 1e-9}, 1e-9 * 50.0, 1e-9 * 50.0),
    (True, {"snes_rtol": 1e-2}, 1e-4 * 30.0, 1e-4 * 30.0),
    (True, {"snes_atol": 7.0}, 7.0, 7.0)], ids=str)
def test_newton_s_method_ends_at_a_part_of_loads_and_inertia(options, flows, given, end, late):
    """Of soil that moves, at more of its inertia; after ten iterations with contact at more; the user's
    options win, and one for the first residual holds of loads and inertia where it is smaller."""
    options(**given)
    snes = PETSc.SNES().create(PETSc.COMM_SELF)
    snes.setTolerances(atol=given.get("snes_atol", 0.0))
    tolerance = Tolerance(Kind(LATE, flows))
    tolerance.begin(snes, Norms(50.0, 30.0, 1e-12))
    assert snes.getTolerances()[1] == pytest.approx(end)
    tolerance.loosen(snes, 10)
    assert snes.getTolerances()[1] == pytest.approx(late)
    tolerance.begin(snes, Norms(0.0, 0.0, 8.0))
    assert snes.getTolerances()[1] == (7.0 if "snes_atol" in given else 8.0)
    snes.destroy()
