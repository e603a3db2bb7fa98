"""Geometric multigrid on a regular grid: interpolation from grids of twice, four times … its cells.

Interpolation is linear along each direction. A coarse node is where a finer one next to it is, so that the
coarse grids follow the active cells; PETSc makes Galerkin's matrices on them. Compared with the aggregates of
gamg, interpolation is known beforehand and sparser: with as many iterations, the products of matrices
that make the coarse ones take half the time (docs/solvers.md).
"""
from itertools import product
from typing import Any, List, NamedTuple, Tuple

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

COARSEST = 100  # nodes of a grid that is solved directly


class Nodes(NamedTuple):
    """The owned nodes of the unknowns, by their numbers in the ``background``."""

    background: Any
    number: np.ndarray  # (owned,)

    @property
    def x(self) -> np.ndarray:
        """Their places [m], shape (owned, D)."""
        return self.background.x[self.number]

    @property
    def regular(self) -> bool:
        """Whether their grid is a regular one of quadrilaterals or hexahedra."""
        return bool(self.background.regular)

    def lattice(self) -> np.ndarray:
        """Their places in a regular grid, whole numbers, shape (owned, D + 1), the last of which is their
        field."""
        b = self.background
        at = np.rint((self.x - b.grid.box.lower) / b.h).astype(np.int64)
        return np.column_stack([at, b.vertex_of[self.number] // len(b.whole[0])])


def interpolations(comm: Any, lattice: np.ndarray) -> List[PETSc.Mat]:
    """Matrices from the unknowns of each coarser grid to those of the finer one, from the finest on. lattice:
    of this rank's nodes, see ``Nodes``. Collective."""
    found, count = [], comm.allreduce(len(lattice))
    while count > COARSEST:
        matrix, lattice = _coarsen(comm, lattice)
        before, count = count, comm.allreduce(len(lattice))
        found.append(matrix)
        if count == before:
            break
    return found


def _coarsen(comm: Any, lattice: np.ndarray) -> Tuple[PETSc.Mat, np.ndarray]:
    """The interpolation to nodes at ``lattice`` from every second place, and those of this rank there."""
    n, D = len(lattice), lattice.shape[1] - 1
    sides = np.array([(*side, 0) for side in product((0, 1), repeat=D)])
    # (i + 0) // 2 and (i + 1) // 2 are the places on both sides of an odd i, and twice that of an even one
    parents = ((lattice[:, None] + sides) // [*[2] * D, 1]).reshape(-1, D + 1)
    size = np.empty(D + 1, np.int64)
    comm.Allreduce(parents.max(axis=0, initial=0) + 1, size, MPI.MAX)
    key = np.ravel_multi_index(parents.T, size)
    keys, first, place = np.unique(key, return_index=True, return_inverse=True)
    number, own = _number(comm, keys)
    odd = lattice[:, :D] % 2
    rows, side = np.nonzero((sides[None, :, :D] <= odd[:, None]).all(axis=2))  # each parent once
    columns = number[place].reshape(n, len(sides))[rows, side]
    order = np.lexsort((columns, rows))
    count, columns = np.bincount(rows, minlength=n), columns[order]
    start = np.concatenate([[0], np.cumsum(np.repeat(count, D))])
    indices, values = np.empty((2, D * len(rows)))
    for k in range(D):  # of all unknowns of a node
        to = start[D * rows + k] + np.arange(len(rows)) - start[D * rows] // D
        indices[to], values[to] = D * columns + k, 0.5 ** odd.sum(axis=1)[rows]
    matrix = PETSc.Mat().createAIJ(
        ((n * D, PETSc.DETERMINE), (int(own.sum()) * D, PETSc.DETERMINE)), bsize=D, comm=comm,
        csr=(start.astype(PETSc.IntType), indices.astype(PETSc.IntType), values))
    return matrix, parents[first[own]]


def _number(comm: Any, keys: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Numbers of the ``keys``, rising, across the ranks, which may have the same ones, and which of them are
    this rank's: the first that has one. Rank ``key % ranks`` knows of a key. Collective."""
    where = keys % comm.size
    order = np.argsort(where, kind="stable")
    cuts = np.cumsum(np.bincount(where, minlength=comm.size))[:-1]

    def to_all(values: np.ndarray) -> List[np.ndarray]:
        return comm.alltoall(np.split(values[order], cuts))

    def answered(values: np.ndarray) -> np.ndarray:
        back = np.empty(len(keys), np.int64)
        back[order] = np.concatenate(comm.alltoall(np.split(values, ends)))
        return back

    asked = to_all(keys)
    ends = np.cumsum([len(some) for some in asked])[:-1]
    rank = np.repeat(np.arange(comm.size), [len(some) for some in asked])
    _, first, place = np.unique(np.concatenate(asked), return_index=True, return_inverse=True)
    own = answered(rank[first][place]) == comm.rank
    count = int(own.sum())
    mine = np.full(len(keys), -1)
    mine[own] = comm.scan(count) - count + np.arange(count)
    known = np.full(len(first), -1)
    np.maximum.at(known, place, np.concatenate(to_all(mine)))
    return answered(known[place]), own
