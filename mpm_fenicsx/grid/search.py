"""Search for the cell of a point: rounding on a lattice, a walk over neighbours on any other mesh.

Both searches answer two questions. ``locate``: the local cell of the points of this rank, and whether any is
not here. ``destinations``: for all points, rank and rank-independent number of their cell; it is asked only
when a point is not here, and it is collective. Points are in cells of their ``field``, see ``background``.
"""
import numpy as np
from mpi4py import MPI

from mpm_dem_direct import direct

from ..basis.shape import reference
from ..compiled import specialise
from . import compat
from .locate import NOWHERE, Neighbours, holds, lattice_numbers, lattice_of, locate_lattice, walk


class LatticeSearch:
    """O(1) on the regular cells of a box, however far a point moved."""

    def __init__(self, grid, background):
        self._lattice, self._lattice_numbers = lattice_of(grid, background.margin), specialise(
            lattice_numbers, D=background.dim)
        self._blocks = background.blocks
        self._per_field = len(background.whole[1])
        self._rank, self._owner = background.comm.rank, background.owner
        self._local = np.full(len(background.owner), -1, np.int32)
        self._local[background.original_cell] = np.arange(len(background.cells))

    def _numbers(self, x, field):
        number = np.empty(len(x), np.int64)
        self._lattice_numbers(x, *self._lattice, number)
        if self._blocks is not None:
            self._blocks.renumber(number)
        if np.any(field):
            number[number != NOWHERE] += self._per_field * np.broadcast_to(field, len(x))[number != NOWHERE]
        return number

    def locate(self, points, row):
        """Fill ``points.cell``; returns whether any point is elsewhere, and in a cell without a ``row``."""
        number = self._numbers(points.x, points.field)
        return locate_lattice(number, self._owner, self._local, row, self._rank, points.cell)

    def assign(self, x, field=0):
        """``destinations`` of positions x [m], shape (n, D), in the ``field``, one or (n,), that are the same
        on every rank."""
        number = self._numbers(x, field)
        return np.where(number < 0, NOWHERE, self._owner[number]).astype(np.int32), number

    def destinations(self, points):
        """Rank (-1: outside the grid), shape (n,), and number of the cell, shape (n,), of every point."""
        return self.assign(points.x, points.field)

    relocate = destinations  # after a new distribution the old cells mean nothing; here they never did

    def local(self, number):
        """Local cells of numbers that belong here."""
        return self._local[number]


class WalkSearch:
    """On any mesh: from the last cell over neighbours; points that the walk lost, by bounding-box tree."""

    longest_walk = 50

    def __init__(self, background):
        self._background = b = background
        behind = compat.cells_behind_facets(b.mesh, len(b.cells))
        self._neighbours = Neighbours(behind, *_facets_of_axes(b.dim, b.cells.shape[1]))
        size = dict(D=b.dim, K=b.cells.shape[1])
        to_reference = specialise(reference, **size, AFFINE=b.affine)
        walk_in, self._holds = (specialise(f, **size, to_reference=to_reference) for f in (walk, holds))
        self._walk = direct(walk_in)
        self._number, self._first = b.cell_numbering.in_whole, b.cell_numbering.first
        self._starts = np.array(b.comm.allgather(self._first))
        owned = np.full(b.cells_owned, b.comm.rank)
        self._owner = np.concatenate([owned, b.cell_numbering.owners]).astype(np.int32)
        self._tree = self._around = None

    def _found(self, points):
        b, found = self._background, np.empty(len(points), np.int32)
        self._walk(points.x, points.cell, b.maps, self._neighbours, self.longest_walk, b.tolerance, found)
        return found

    def locate(self, points, row):
        """See ``LatticeSearch.locate``."""
        found = self._found(points)
        here = (found >= 0) & (found < self._background.cells_owned)
        points.cell[here] = found[here]
        return int(not here.all()), int((row[found[here]] < 0).any())

    def destinations(self, points):
        """See ``LatticeSearch.destinations``; all ranks look in their trees for points that a walk lost."""
        found = self._found(points)
        rank, number = self._owner[found], self._number[found]  # of lost points these are overwritten below
        return self._by_tree(points, np.flatnonzero(found < 0), rank, number)

    def _by_tree(self, points, lost, rank, number):
        """Rank and number of the points ``lost`` into their places; ranks look in their trees for those
        inside the box around their cells."""
        comm, x = self._background.comm, points.x[lost]
        field = np.broadcast_to(points.field, len(points))[lost]
        asked = [np.flatnonzero(((x >= low) & (x <= high)).all(axis=1)) for low, high in self._boxes()]
        answers = comm.alltoall([self._in_tree(*of_rank) for of_rank in
                                 comm.alltoall([(x[some], field[some]) for some in asked])])
        found = np.full(len(lost), -1, np.int64)
        for some, answer in zip(asked, answers):
            found[some] = np.maximum(found[some], answer)
        rank[lost], number[lost] = self._ranks_of(found), found
        return rank, number

    def _boxes(self):
        """Of each rank lowest and highest corner of the box around its cells and what the tree adds to them
        [m], (ranks, 2, D)."""
        if self._around is None:
            b = self._background
            x = b.x[b.cells[:b.cells_owned]].reshape(-1, b.dim)
            reach = 2.0 * b.tolerance * b.h.max()
            box = np.stack([x.min(axis=0) - reach, x.max(axis=0) + reach]) if len(x) else \
                np.array([[np.inf] * b.dim, [-np.inf] * b.dim])
            self._around = np.array(b.comm.allgather(box))
        return self._around

    def middles(self):
        """Of all cells that are there [m], shape (n, D)."""
        vertices, cells = self._background.whole
        return vertices[cells].mean(axis=1)

    def relocate(self, points):
        """``destinations`` when ``points.cell`` means nothing: by tree alone."""
        return self._by_tree(points, np.arange(len(points)), np.zeros(len(points), np.int32),
                             np.zeros(len(points), np.int64))

    def assign(self, x, field=0):
        """See ``LatticeSearch.assign``."""
        mine = self._in_tree(x, field)
        number = np.empty_like(mine)
        self._background.comm.Allreduce(mine, number, MPI.MAX)
        return self._ranks_of(number), number

    def _ranks_of(self, number):
        """Whose cells those are, NOWHERE of -1."""
        rank = np.searchsorted(self._starts, number, side="right") - 1
        return np.where(number < 0, NOWHERE, rank).astype(np.int32)

    def _in_tree(self, x, field):
        """Global number of an owned cell of the ``field`` that holds each point x, shape (n, D), or -1."""
        b, best = self._background, np.full(len(x), -1, np.int64)
        if len(x) and b.cells_owned:
            if self._tree is None:
                self._tree = compat.cell_tree(b.mesh, np.arange(b.cells_owned), b.tolerance * b.h.max())
            point, c = compat.candidates(self._tree, x)
            if b.fields > 1:
                own = b.field_of[c] == np.broadcast_to(field, len(x))[point]
                point, c = point[own], c[own]
            inside = np.empty(len(point), np.bool_)
            self._holds(x[point], c, b.maps, b.tolerance, inside)
            np.maximum.at(best, point[inside], self._number[c[inside]])
        return best

    def local(self, number):
        """See ``LatticeSearch.local``."""
        return (number - self._first).astype(np.int32)


def _facets_of_axes(dim, nodes_per_cell):
    """Facet below and above each reference coordinate, in dolfinx's order of facets."""
    if nodes_per_cell == dim + 1:  # facet i lies opposite vertex i
        return np.arange(1, dim + 2), np.array([-1] * dim + [0])
    if dim == 2:
        return np.array([1, 0, -1]), np.array([2, 3, -1])
    return np.array([2, 1, 0, -1]), np.array([3, 4, 5, -1])
