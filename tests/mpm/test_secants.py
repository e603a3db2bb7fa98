"""Steps with a kept tangent, corrected by the steps before."""
import numpy as np
import pytest
from mpi4py import MPI
from petsc4py import PETSc

from mpm_fenicsx.solve.secants import MOST, Secants


def solve(n, correct):
    """Residuals of u -> u - K^-1 (A u - b) with a K that is A but for a few per cent."""
    random = np.random.default_rng(3)
    A = np.diag(np.linspace(1.0, 2.0, n)) + 0.1 * random.standard_normal((n, n)) / n
    K, b, u = A * (1.0 + 0.05 * random.standard_normal((n, n))), np.ones(n), np.zeros(n)
    secants, left = Secants(MPI.COMM_SELF), []
    for _ in range(6):
        y = np.linalg.solve(K, A @ u - b)
        if correct:
            x, step = PETSc.Vec().createWithArray(u.copy()), PETSc.Vec().createWithArray(y)
            assert secants.correct(x, step) == (len(left) > 0)
        u = u - y
        left.append(np.linalg.norm(A @ u - b))
    return left


@pytest.mark.parametrize("n", [1, 40])
def test_secants_leave_less(n):
    kept, corrected = solve(n, False), solve(n, True)
    assert corrected[0] == kept[0]
    assert corrected[-1] < 0.05 * kept[-1] or corrected[-1] < 1e-15


def test_no_more_secants_than_that():
    secants, random = Secants(MPI.COMM_SELF), np.random.default_rng(0)
    for _ in range(MOST + 3):
        secants.correct(*(PETSc.Vec().createWithArray(random.random(9)) for _ in range(2)))
    assert len(secants._secants) == MOST
    secants.forget()
    y = PETSc.Vec().createWithArray(np.ones(9))
    assert not secants.correct(PETSc.Vec().createWithArray(np.zeros(9)), y) and (y.array == 1.0).all()
