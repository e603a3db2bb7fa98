"""Motion from the solid's interface points to the wall nodes (eq. 22) and forces back by the transpose (eq. 23).

Each rank keeps and multiplies a block of rows of the matrix H and a block of rows of its transpose, and the results are
put together in the order of the ranks. A product with the transpose of a distributed matrix, as libraries offer it, adds
what other ranks contribute in the order in which it arrives; with the transpose in rows of its own, every sum runs over
ascending columns on one rank, and the result is the same to the last bit on any number of ranks.
"""
import numpy as np
from mpi4py import MPI
from scipy.sparse import coo_matrix, csr_matrix
from scipy.spatial import cKDTree


def share(n, comm):
    """The rows, of n in all, that this rank keeps: a slice; and where the ranks' shares begin and end, shape (ranks + 1,)."""
    bounds = n * np.arange(comm.size + 1) // comm.size
    return slice(bounds[comm.rank], bounds[comm.rank + 1]), bounds


class Mapping:
    """The matrix H of eq. 22, shape (wall nodes, interface points), and the places where both sides started.

    rows: this rank's rows of H, those of ``share``. Everything is collective, except where the mapping ``is_copy``:
    that costs nothing.
    """

    def __init__(self, rows, x_solid, x_wall, comm=MPI.COMM_WORLD):
        self._x_solid, self._x_wall, self._comm = np.array(x_solid, float), np.array(x_wall, float), comm
        (mine, self._wall_bounds), (_, self._solid_bounds) = share(len(x_wall), comm), share(len(x_solid), comm)
        self._rows = rows.tocsr()
        self._rows.sum_duplicates()  # also sorts the columns
        self._transpose = self._transposed(mine.start)
        entries = self._rows.tocoo()
        same = len(x_solid) == len(x_wall) and np.array_equal(self._x_solid, self._x_wall) \
            and len(entries.data) == rows.shape[0] and (entries.data == 1.0).all() \
            and np.array_equal(entries.row + mine.start, entries.col)
        self.is_copy = bool(comm.allreduce(same, MPI.LAND))

    def _transposed(self, first):
        """This rank's rows of the transpose, from the entries that the ranks have in its columns."""
        entries, bounds, comm = self._rows.tocoo(), self._solid_bounds, self._comm
        keeper = np.searchsorted(bounds, entries.col, side="right") - 1
        parts = comm.alltoall([(entries.row[to] + first, entries.col[to], entries.data[to])
                               for to in (keeper == rank for rank in range(comm.size))])
        wall, solid, values = map(np.concatenate, zip(*parts))
        start, stop = bounds[comm.rank:comm.rank + 2]
        block = coo_matrix((values, (solid - start, wall)), (stop - start, len(self._x_wall))).tocsr()
        block.sort_indices()
        return block

    def _whole(self, block, bounds):
        """The shares of all ranks, one after the other."""
        if self._comm.size == 1:
            return block
        whole = np.empty((bounds[-1], block.shape[1]))
        self._comm.Allgatherv(np.ascontiguousarray(block), [whole, np.diff(bounds) * block.shape[1]])
        return whole

    def motion(self, x, v):
        """Wall positions [m] and velocities [m/s] from those of the interface; displacements are mapped, so that a wall
        that starts elsewhere keeps its shape."""
        if self.is_copy:
            return x, v
        dim = x.shape[1]
        moved = self._whole(self._rows @ np.hstack([x - self._x_solid, v]), self._wall_bounds)
        return self._x_wall + moved[:, :dim], moved[:, dim:].copy()

    def force(self, wall_force):
        """Forces on the interface points [N] from those on the wall nodes: same sum, same work."""
        return wall_force if self.is_copy else self._whole(self._transpose @ wall_force, self._solid_bounds)


def nearest(x_solid, x_wall, comm=MPI.COMM_WORLD):
    """Each wall node follows the nearest interface point: a copy where positions coincide."""
    mine = np.asarray(x_wall)[share(len(x_wall), comm)[0]]
    partner = cKDTree(x_solid).query(mine)[1] if len(mine) else np.zeros(0, int)
    n = len(mine)
    return Mapping(csr_matrix((np.ones(n), (np.arange(n), partner)), (n, len(x_solid))), x_solid, x_wall, comm)


def linear(x_solid, elements, x_wall, comm=MPI.COMM_WORLD):
    """Each wall node follows the closest point of the interface's segments ``elements``, shape (k, 2), by linear
    interpolation between the segment's ends."""
    a, b = np.asarray(x_solid)[np.asarray(elements).T]
    edge = b - a
    length2 = np.einsum("ki,ki->k", edge, edge)
    if not (length2 > 0).all():
        raise ValueError(f"interface segment {np.argmin(length2)} has no length: remove it")
    mine = np.asarray(x_wall)[share(len(x_wall), comm)[0]]
    t = np.clip(np.einsum("ki,mki->mk", edge, mine[:, None] - a) / length2, 0.0, 1.0)
    away = mine[:, None] - (a + t[..., None] * edge)
    segment = np.argmin(np.einsum("mki,mki->mk", away, away), axis=1)
    n = np.arange(len(mine))
    weight = t[n, segment]
    rows, columns = np.repeat(n, 2), np.asarray(elements)[segment].ravel()
    H = csr_matrix((np.column_stack([1 - weight, weight]).ravel(), (rows, columns)), (len(n), len(x_solid)))
    H.eliminate_zeros()
    return Mapping(H, x_solid, x_wall, comm)
