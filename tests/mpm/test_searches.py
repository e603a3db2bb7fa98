"""An attempt of Newton's method whose line search stalls at kinks goes on with full steps."""
import numpy as np
import pytest
from petsc4py import PETSc

from mpm_fenicsx.solve.searches import Searches

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
    searches = Searches(snes, kinks=True)
    if follows:
        snes.setUpdate(lambda snes, iteration: searches.follow(iteration))
    searches.begin()
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
