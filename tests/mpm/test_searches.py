"""An attempt of Newton's method whose line search stalls at kinks goes on with full steps, and back."""
import numpy as np
import pytest
from petsc4py import PETSc

from mpm_fenicsx.grid import compat
from mpm_fenicsx.solve import searches as rules
from mpm_fenicsx.solve.searches import STALLED, Searches

SOFT, STIFF, SPRINGS = 0.1, 100.0, 40


def close_springs(follows):
    """Iterations in which unit forces on weak springs close gaps of all sizes up to stiff ones."""
    gap = np.geomspace(1e-3, 1.0, SPRINGS)
    snes, matrix = PETSc.SNES().create(PETSc.COMM_SELF), PETSc.Mat().createAIJ(
        (SPRINGS, SPRINGS), nnz=1, comm=PETSc.COMM_SELF)

    def residual(snes, x, out):
        out.array_w[:] = SOFT * x.array_r + STIFF * np.maximum(x.array_r - gap, 0.0) - 1.0

    def tangent(snes, x, matrix, same):
        for i, place in enumerate(np.array(x.array_r)):
            matrix.setValue(i, i, SOFT + (STIFF if place > gap[i] else 0.0))
        matrix.assemble()

    x, out = matrix.createVecs()
    snes.setFunction(residual, out)
    snes.setJacobian(tangent, matrix)
    snes.setTolerances(rtol=0.0, atol=1e-9, stol=0.0, max_it=25)
    snes.getKSP().getPC().setType("jacobi")
    searches = Searches(snes, kinks=True, flows=False)
    if follows:
        snes.setUpdate(lambda snes, iteration: searches.follow(iteration))
    searches.begin(0.0)
    snes.solve(None, x)
    converged, count = snes.getConvergedReason() > 0, snes.getIterationNumber()
    if converged:
        np.testing.assert_allclose(x.array, gap + (1.0 - SOFT * gap) / (SOFT + STIFF), rtol=1e-9)
    snes.destroy()
    return count if converged else None


@pytest.mark.parametrize("follows, most", [(False, None), (True, 8)], ids=["search", "both"])
def test_many_springs_that_close(follows, most):
    count = close_springs(follows)
    assert count is None if most is None else count <= most


def go_to_and_fro(follows):
    """Iterations in which sign(x) sqrt(abs x) = 0 is solved, where a full step leads from x to -x; None where
    that goes on for ever."""
    snes = PETSc.SNES().create(PETSc.COMM_SELF)
    matrix = PETSc.Mat().createAIJ((1, 1), nnz=1, comm=PETSc.COMM_SELF)

    def residual(snes, x, out):
        out.array_w[:] = np.sign(x.array_r) * np.sqrt(np.abs(x.array_r))

    def tangent(snes, x, matrix, same):
        matrix.setValue(0, 0, 0.5 / np.sqrt(np.abs(x.array_r[0])))
        matrix.assemble()

    x, out = matrix.createVecs()
    x.set(1.0)
    snes.setFunction(residual, out)
    snes.setJacobian(tangent, matrix)
    snes.setTolerances(rtol=0.0, atol=1e-6, stol=0.0, max_it=25)
    searches = Searches(snes, kinks=False, flows=False)
    searches.exchange()
    assert searches.full_steps_first
    if follows:
        snes.setUpdate(lambda snes, iteration: searches.follow(iteration))
    searches.begin(0.0)
    snes.solve(None, x)
    converged, count = snes.getConvergedReason() > 0, snes.getIterationNumber()
    snes.destroy()
    return count if converged else None


def test_full_steps_to_and_fro_end_in_a_search():
    assert go_to_and_fro(False) is None and STALLED < go_to_and_fro(True) < 25


@pytest.mark.parametrize("kinks, soil, stiffness_over_inertia, search", [
    (True, False, 0.0, "cp"), (False, True, 2.0 * rules.STIFF, "cp"), (False, True, 0.5 * rules.STIFF, "bt"),
    (False, False, 2.0 * rules.STIFF, "bt")])
def test_contact_and_stiff_soil_look_for_the_minimum_along_the_line(kinks, soil, stiffness_over_inertia,
                                                                    search, monkeypatch):
    snes, used = PETSc.SNES().create(PETSc.COMM_SELF), []
    monkeypatch.setattr(compat, "set_line_search", lambda snes, *search: used.append(search[0]))
    searches = Searches(snes, kinks, soil)
    searches.begin(stiffness_over_inertia)
    assert used[-1] == search and searches.follows == (kinks or soil)
    searches.want(True)
    searches.begin(stiffness_over_inertia)
    assert used[-1] == "basic"
    searches.exchange()
    searches.begin(stiffness_over_inertia)
    assert used[-1] == search
    snes.destroy()
