"""What benchmarks count of a kernel, against operations and bytes counted by hand."""
import importlib
import sys
from pathlib import Path

import numpy as np
import pytest

from mpm_fenicsx.compiled import merged, multiply, specialise
from mpm_fenicsx.points import transfer
from mpm_fenicsx.terms.newmark import Increment


@pytest.fixture
def operations(monkeypatch):
    """The module tests/benchmarks/operations.py."""
    monkeypatch.setattr(sys, "path", [str(Path(__file__).parent / "benchmarks"), *sys.path])
    return importlib.import_module("operations")


@pytest.mark.parametrize("D, K", [(2, 4), (3, 8), (3, 4)])
def test_transfers(operations, D, K):
    n, nodes = 6, 20
    random = np.random.default_rng(0)
    cells = random.integers(nodes, size=(5, K)).astype(np.int32)
    N, u, x = random.random((n, K)), random.random((nodes, D)), random.random((n, D))
    given = np.arange(n, dtype=np.int32) % 5, cells, N
    nodal = np.zeros((nodes, 1 + 2 * D))
    found = operations.work(specialise(transfer.to_grid, D=D, K=K), (*given, np.ones(n), x, x, nodal), n,
                            slice(None))
    # per node: N + TOUCH, times the mass, added; v and a: a product that is added, each
    assert found.operations == K * (3 + 4 * D)
    assert found.read * n == n * (4 + 8 * K + 8 + 16 * D) + cells.nbytes + nodal.nbytes
    assert found.written * n == nodal.nbytes and not nodal.any()
    moved = Increment(0.1, 400.0, u, u)
    found = operations.work(specialise(transfer.to_points, D=D, K=K), (*given, moved, x, x.copy(), x.copy()),
                            n, slice(0, n, 2))
    assert found.operations == D * (4 * K + 1 + 3)  # u and a; x; the trapezoidal rule, 0.5 dt being constant
    assert found.read * n == n * (4 + 8 * K + 24 * D) + cells.nbytes + 2 * u.nbytes
    assert found.written * n == n * 24 * D


D = 2  # fixed by specialise


@merged
def _root(x):
    return np.sqrt(x) if x > 1.0 else -x


def _small(A, B, C):
    for q in range(len(A)):
        multiply((D, D, D), True, (C[q], 0, D), (A[q], 0, D, 1), (B[q], 0, D))
        C[q, 0, 0] = _root(C[q, 0, 0])


@pytest.mark.parametrize("size, roots", [(1.0, 1), (0.1, 0)])
def test_small_products_and_functions(operations, size, roots):
    A = np.full((4, 3, 3), size)
    found = operations.work(specialise(_small, D=3), (A, A.copy(), np.zeros_like(A)), 4, slice(None))
    assert found == (2 * 27 + roots, 3 * 72, 72)
