"""The matrix of the active cells against sums over a dense one."""
import numpy as np
import pytest
from mpi4py import MPI
from scipy.sparse import csr_matrix

from mpm_fenicsx.grid.entries import Group
from mpm_fenicsx.grid.matrix import CellMatrix

RANDOM = np.random.default_rng(3)
# quadrilaterals in a row, nodes below and above, and one triple with a node that is not there
CELLS = np.array([[0, 1, 4, 5], [1, 2, 5, 6], [2, 3, 6, 7]], np.int32)
PATCH = np.array([[0, 3, -1], [7, 1, 4]], np.int32)
FACETS = np.array([[0, 2, 5], [1, 3, 4]], np.int32)
NODES, D = 8, 2


def dense(dofs, matrices, fixed):
    """Sum of ``matrices`` (m, n, n) by the numbers ``dofs`` (m, n), -1: none, without what is fixed."""
    out = np.zeros((NODES * D, NODES * D))
    for dof, matrix in zip(dofs, matrices):
        for a, row in enumerate(dof):
            for b, column in enumerate(dof):
                if row >= 0 and column >= 0 and not fixed.ravel()[[row, column]].any():
                    out[row, column] += matrix[a, b]
    return out


def of_elements(nodes, matrices):
    """The arguments of ``dense`` for element matrices (m, K, D, D, K)."""
    dofs = np.where(nodes[..., None] < 0, -1, nodes[..., None] * D + np.arange(D)).reshape(len(nodes), -1)
    return dofs, matrices.transpose(0, 4, 3, 1, 2).reshape(len(nodes), dofs.shape[1], -1)


@pytest.mark.parametrize("fixed", [[], [0], [3, 5, 6], [8, 9, 15]])
def test_sum_of_all_that_adds_to_it(fixed):
    """Elements, some of them again, patches, thin matrices and a diagonal; supports in some directions or
    all of a node."""
    held = np.zeros((NODES, D), bool)
    held.ravel()[fixed] = True
    groups = [Group(CELLS, CELLS), Group(PATCH, PATCH), Group(FACETS, FACETS, thin=True)]
    sums = CellMatrix(MPI.COMM_SELF, np.arange(NODES), NODES, held, False, groups)
    patches, facets = sums.keep_elements(PATCH), sums.keep_thin(FACETS)
    sums.complete()
    for _ in range(2):  # the second time after clearing
        sums.clear()
        patches[:], facets[:] = RANDOM.random(patches.shape), RANDOM.random(facets.shape)
        given = RANDOM.random((2, 4, D, D, 4))

        def add(row, matrices, given=given):
            assert row[[0, 2]].tolist() == [0, 1]
            matrices += given

        sums.add_to_some([2, 0, 2], CELLS, np.arange(len(CELLS)), add)
        diagonal = RANDOM.random((NODES, D))
        sums.finish(diagonal)
        expected = np.diag(diagonal.ravel())
        for nodes, matrices in ((CELLS[[0, 2]], given), (PATCH, patches)):
            expected += dense(*of_elements(nodes, matrices), held)
        for i in range(D):
            expected += dense(FACETS * D + i, facets[:, i], held)
        start, columns, values = sums.petsc.getValuesCSR()
        np.testing.assert_allclose(csr_matrix((values, columns, start)).toarray(), expected, atol=1e-14)
    kept = sums.get_values()
    sums.set_values(2.0 * kept)
    assert sums.petsc.norm() == pytest.approx(2.0 * np.linalg.norm(expected))
    sums.petsc.destroy()


def test_rows_hold_what_couples_and_no_more():
    """Nodes at the ends of the row of three cells have 4 neighbours, the others 6; a thin one, of which there
    is one for node 0, takes one column; what is fixed has its diagonal alone."""
    fixed = np.zeros((NODES, D), bool)
    fixed[7] = True
    groups = [Group(CELLS, CELLS), Group(FACETS[:1], FACETS[:1], thin=True)]
    sums = CellMatrix(MPI.COMM_SELF, np.arange(NODES), NODES, fixed, False, groups)
    start, columns, _ = sums.petsc.getValuesCSR()
    assert np.diff(start).tolist() == [9, 9, 12, 12, 11, 11, 6, 6, 8, 8, 12, 12, 10, 10, 1, 1]
    assert columns[:9].tolist() == [0, 1, 2, 3, 4, 8, 9, 10, 11]
    sums.petsc.destroy()
