"""Search for the cell of a point: rounding on a lattice, a walk over neighbours on any other mesh.

Both searches answer two questions. ``settle``: the local cell of the points of this rank, and whether any is not here.
``destinations``: for all points, rank and rank-independent number of their cell; it is asked only when a point is not
here, and it is collective.
"""
import numpy as np
from dolfinx.geometry import BoundingBoxTree, compute_collisions
from mpi4py import MPI
from numba import njit

from .specialise import specialise

D, K = 2, 4  # fixed by specialise
NOWHERE = -1


@njit(cache=True)
def lattice_numbers(x, lower, h, counts, halves, number):
    """Number of the lattice cell of each point into ``number``, NOWHERE outside the lattice."""
    for p in range(len(x)):
        c = 0
        stride = 1
        first = 0.0
        last = 0.0
        for d in range(x.shape[1]):
            s = (x[p, d] - lower[d]) / h[d]
            i = int(np.floor(s))
            if i == counts[d] and s <= counts[d]:
                i -= 1  # the far edge belongs to the last cell
            if not 0 <= i < counts[d]:  # also catches NaN
                c = NOWHERE
                break
            c += stride * i
            stride *= counts[d]
            if d == 0:
                first = s - i
            else:
                last = s - i
        if c >= 0 and halves == 2:
            c = 2 * c + (1 if last > first else 0)
        number[p] = c


@njit(cache=True)
def settle_lattice(number, owner, local, slot, rank, cell):
    """Local cell of each point from its number; whether any point is not of this rank, and whether any lies in a cell
    without a row in ``slot``."""
    away = 0
    bare = 0
    for p in range(len(number)):
        c = number[p]
        if c == NOWHERE or owner[c] != rank:
            away = 1
            continue
        cell[p] = local[c]
        if slot[cell[p]] < 0:
            bare = 1
    return away, bare


class LatticeSearch:
    """O(1) on the regular cells of a box, however far a point moved."""

    def __init__(self, grid, background):
        self._lower, self._h = np.asarray(grid.box.lower, float), grid.box.size / grid.cells
        self._counts = np.asarray(grid.cells, np.int64)
        self._halves = len(background.owner) // int(np.prod(grid.cells))
        self._rank, self._owner = background.comm.rank, background.owner
        self._local = np.full(len(background.owner), -1, np.int32)
        self._local[background.original_cell] = np.arange(len(background.cells))

    def _numbers(self, x):
        number = np.empty(len(x), np.int64)
        lattice_numbers(x, self._lower, self._h, self._counts, self._halves, number)
        return number

    def settle(self, points, slot):
        """Fill ``points.cell``; returns whether any point is not here and whether any is in a cell outside ``slot``."""
        return settle_lattice(self._numbers(points.x), self._owner, self._local, slot, self._rank, points.cell)

    def assign(self, x):
        """``destinations`` of positions x [m], shape (n, D), that are the same on every rank."""
        number = self._numbers(x)
        return np.where(number < 0, NOWHERE, self._owner[number]).astype(np.int32), number

    def destinations(self, points):
        """Rank (-1: outside the grid), shape (n,), and number of the cell, shape (n,), of every point."""
        return self.assign(points.x)

    relocate = destinations  # after a new partition the old cells mean nothing; here they never did

    def local(self, number):
        """Local cells of numbers that belong here."""
        return self._local[number]


def walk(x, cell, origin, inverse, neighbour, facet_of_lower, facet_of_upper, most, found):
    """Cell of each point by walking from ``cell`` over the facet that the point violates most.

    neighbour: (cells, facets) cell behind each facet, -1 where this rank sees no more, -2 at the boundary; facet_of_*:
    (D + 1,) facet that bounds each reference coordinate from below and above (of a simplex the last entry of the upper
    one is the facet sum(xi) = 1); most: steps before giving up. Fills ``found`` with the cell, or -1 when not reached.
    """
    xi = np.empty(D)
    for p in range(len(x)):
        c = cell[p]
        reached = False
        for _ in range(most):
            if c < 0:
                break
            total = 0.0
            worst = -1e-12
            facet = -1
            for i in range(D):
                s = 0.0
                for j in range(D):
                    s += inverse[c, i, j] * (x[p, j] - origin[c, j])
                total += s
                if not s >= worst:  # also for NaN
                    worst, facet = s, facet_of_lower[i]
                if K != D + 1 and 1.0 - s < worst:
                    worst, facet = 1.0 - s, facet_of_upper[i]
            if K == D + 1 and 1.0 - total < worst:
                facet = facet_of_upper[D]
            if facet < 0:
                reached = True
                break
            c = neighbour[c, facet]
        found[p] = c if reached else -1


class WalkSearch:
    """On any mesh of affine cells: from the last cell over neighbours; points the walk lost, by bounding-box tree."""

    longest_walk = 50

    def __init__(self, background):
        self._background = b = background
        topology, dim = b.mesh.topology, b.dim
        topology.create_connectivity(dim, dim - 1)
        topology.create_connectivity(dim - 1, dim)
        self._neighbour = _neighbours(topology, dim, len(b.cells))
        self._walk = specialise(walk, D=dim, K=b.cells.shape[1])
        self._lower, self._upper = _facets_of_axes(dim, b.cells.shape[1])
        self._number = b.cell_map.local_to_global(np.arange(len(b.cells), dtype=np.int32))
        self._first = b.cell_map.local_range[0]
        self._starts = np.array(b.comm.allgather(self._first))
        self._owner = np.concatenate([np.full(b.cells_owned, b.comm.rank), b.cell_map.owners]).astype(np.int32)
        self._tree = None

    def _found(self, points):
        b, found = self._background, np.empty(len(points), np.int32)
        self._walk(points.x, points.cell, b.origin, b.inverse, self._neighbour, self._lower, self._upper,
                   self.longest_walk, found)
        return found

    def settle(self, points, slot):
        """See ``LatticeSearch.settle``."""
        found = self._found(points)
        here = (found >= 0) & (found < self._background.cells_owned)
        points.cell[here] = found[here]
        return int(not here.all()), int((slot[found[here]] < 0).any())

    def destinations(self, points):
        """See ``LatticeSearch.destinations``; all ranks look in their trees for points that a walk lost."""
        found = self._found(points)
        rank, number = self._owner[found], self._number[found]  # of lost points these are overwritten below
        return self._by_tree(points, np.flatnonzero(found < 0), rank, number)

    def _by_tree(self, points, lost, rank, number):
        """Put rank and number of the points ``lost`` in their places; every rank looks in its tree for all of them."""
        comm = self._background.comm
        everybody = comm.allgather(points.x[lost])
        start = sum(len(part) for part in everybody[:comm.rank])
        answers = self.assign(np.concatenate(everybody))
        rank[lost], number[lost] = (values[start:start + len(lost)] for values in answers)
        return rank, number

    def relocate(self, points):
        """``destinations`` when ``points.cell`` means nothing: by tree alone."""
        return self._by_tree(points, np.arange(len(points)), np.zeros(len(points), np.int32),
                             np.zeros(len(points), np.int64))

    def assign(self, x):
        """See ``LatticeSearch.assign``."""
        mine = self._in_tree(x)
        number = np.empty_like(mine)
        self._background.comm.Allreduce(mine, number, MPI.MAX)
        rank = np.searchsorted(self._starts, number, side="right") - 1
        return np.where(number < 0, NOWHERE, rank).astype(np.int32), number

    def _in_tree(self, x):
        """Global number of an owned cell that holds each point x, shape (n, D), or -1."""
        b, best = self._background, np.full(len(x), -1, np.int64)
        if len(x) and b.cells_owned:
            if self._tree is None:
                self._tree = BoundingBoxTree(b.mesh, b.dim, np.arange(b.cells_owned, dtype=np.int32), padding=1e-12)
            candidates = compute_collisions(self._tree, np.column_stack([x, np.zeros((len(x), 3 - b.dim))]))
            point = np.repeat(np.arange(len(x)), np.diff(candidates.offsets))
            c = candidates.array
            xi = np.einsum("pij,pj->pi", b.inverse[c], x[point] - b.origin[c])
            upper = 1 - xi.sum(axis=1) if b.cells.shape[1] == b.dim + 1 else 1 - xi.max(axis=1)
            inside = (xi.min(axis=1) >= -1e-12) & (upper >= -1e-12)
            np.maximum.at(best, point[inside], self._number[c[inside]])
        return best

    def local(self, number):
        return (number - self._first).astype(np.int32)


def _neighbours(topology, dim, cell_count):
    """Cell behind each facet, shape (cells, facets): -1 where this rank sees none."""
    facets = topology.connectivity(dim, dim - 1)
    cells = topology.connectivity(dim - 1, dim)
    of_cell = facets.array.reshape(cell_count, -1) if cell_count else np.zeros((0, dim + 1), np.int32)
    first, count = cells.offsets[:-1], np.diff(cells.offsets)
    pair = np.full((len(count), 2), -1, np.int32)
    pair[:, 0] = cells.array[first]
    two = count == 2
    pair[two, 1] = cells.array[first[two] + 1]
    both = pair[of_cell]
    return np.where(both[..., 0] == np.arange(cell_count)[:, None], both[..., 1], both[..., 0]).astype(np.int32)


def _facets_of_axes(dim, nodes_per_cell):
    """Facet below and above each reference coordinate, in dolfinx's order of facets."""
    if nodes_per_cell == dim + 1:  # facet i lies opposite vertex i
        return np.arange(1, dim + 2), np.array([-1] * dim + [0])
    if dim == 2:
        return np.array([1, 0, -1]), np.array([2, 3, -1])
    return np.array([2, 1, 0, -1]), np.array([3, 4, 5, -1])
