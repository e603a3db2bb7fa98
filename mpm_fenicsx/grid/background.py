"""The distributed background grid.

No function space is made: the mesh's geometry already has nodes, cells and their index maps, and the form
compiler stays out of the start.
"""
import zlib
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from mpi4py import MPI

from ..basis.shape import CellMaps, cell_maps
from ..basis.smooth import LINEAR, StencilGrid
from ..collective import Part, together
from ..compiled import specialise
from ..scene.bodies import Grid
from ..scene.column_grid import Columns
from ..scene.frame import shifted
from ..scene.lattice import lattice
from . import compat
from .distribution import EMPTY_CELL, POINT, Cells, bisect, bisect_together, ghosts
from .domain import Domain
from .joined import join
from .locate import lattice_numbers, lattice_of
from .patches import patches
from .search import LatticeSearch, WalkSearch


def whole_mesh(grid, blocks=None):
    """Vertices, shape (n, D), and cells, shape (m, K), of a ``Grid`` or a ``Mesh``; blocks: all that is there
    of a grid, see ``Blocks``, or None."""
    if blocks is not None:
        return blocks.mesh()
    if isinstance(grid, Grid):
        return lattice(grid.box, grid.cells, grid.cell)
    return grid.vertices, grid.cells


def _repeat(numbers, times, count):
    """The ``numbers`` below ``count`` that many ``times``, each time larger by ``count``."""
    return (numbers + count * np.arange(times).reshape(-1, *[1] * numbers.ndim)).reshape(
        -1, *numbers.shape[1:])


def _copies(mesh, fields):
    """Vertices and cells of so many copies of a ``mesh``, one after the other."""
    vertices, cells = mesh
    return (mesh if fields == 1 else
            (np.tile(vertices, (fields, 1)), _repeat(cells, fields, len(vertices))))


INSIDE = 1e-12  # of a cell's size: points on a facet belong to both cells


def check_inside(grid, x, what, origin, comm):
    """ValueError for the first of the positions x [m], shape (n, D), of the ranks of ``comm`` that is not
    inside the grid; what: lies there; origin: of both, see ``frame``. Collective."""
    together(comm, lambda: _check_box(grid, x, what, origin))


def _check_box(grid, x, what, origin):
    outside = ~((x >= grid.box.lower) & (x <= grid.box.upper)).all(axis=1)
    if outside.any():
        box = shifted(grid.box, origin) if np.any(origin) else grid.box
        raise ValueError(f"{what} lies at {x[outside][0] + origin} m, the grid covers {box.lower} to "
                         f"{box.upper} m: enlarge the grid")


class Needs(NamedTuple):
    """What bodies need of the grid: whether F-bar has patches, ``averaged``, which then stay on one rank, and
    the number of ``fields``."""

    averaged: bool = False
    fields: int = 1


ALIKE = Needs()  # of a body without F-bar, or of several that stick


class Choice(NamedTuple):
    """Of a distribution: ``owner``, the rank of each cell as in an earlier one, None: by what fills them; the
    ``blocks`` of a large grid that are there, None: all."""

    owner: Any = None
    blocks: Any = None


BY_FILLING = Choice()


class Background:
    """Distributed background grid.

    Bodies that do not stick have ``fields`` of their own: the mesh is so many copies of the grid, in the same
    place and not joined, and points of a field are in cells of its copy. All copies are shared out alike over
    the ranks.

    blocks: ``Blocks`` of a large grid, or None; whole: vertices and cells of the grid, or of its blocks;
    copies: the same of all its copies, one after the other; owner: rank of each of their cells; cells: nodes
    of this rank's cells, shape (m, K), owned ones first, then ghosts; original_cell: (m,) their numbers in
    the copies; x: nodes [m], shape (n, D), likewise; vertex_of: (n,) their numbers in the copies; h: (D,)
    size of a cell [m]; maps, affine: see ``shape.cell_maps``; regular: all cells are the same box; patch:
    patch of each cell of the copies, see ``patches``, or None; origin: of all these coordinates in the user's
    [m], shape (D,); tolerance: by which a point may lie outside a cell, of the cell's size, for the round-off
    in the user's coordinates.
    Collective.
    """

    def __init__(self, grid, comm, filling, needs=ALIKE, origin=0.0, margin=None, basis=LINEAR,
                 choice=BY_FILLING):
        """grid: ``Grid`` or ``Mesh``; filling: positions [m], shape (n, D), of what makes a cell expensive;
        each rank may give its own share; needs: of the bodies; margin: beyond the edge of a ``Grid`` [cells],
        shape (D, 2), see ``scene.margin``; basis: at the material points; choice: see
        ``Choice``."""
        self.grid, self.comm, self.dim, self.basis = grid, comm, grid.box.dim, basis
        owner, self.blocks = choice
        self.whole, self.fields = whole_mesh(grid, self.blocks), needs.fields
        patch, fields = patches(grid, *self.whole) if needs.averaged else None, needs.fields
        self.owner = np.tile(self._share_out(filling, patch), fields) if owner is None else owner
        self.copies = vertices, cells = _copies(self.whole, fields)
        self.patch = patch if patch is None else _repeat(patch, fields, patch.max() + 1)
        self.mesh = self.distribute(vertices, cells)
        self._place = None
        self.cell_numbering = compat.cell_numbering(self.mesh)
        self.node_numbering = compat.node_numbering(self.mesh)
        self.cells_owned, self.nodes_owned = self.cell_numbering.owned, self.node_numbering.owned
        self.x = compat.node_positions(self.mesh)
        self.cells = compat.nodes_of_cells(self.mesh, cells.shape[1])
        self.maps, affine = cell_maps(self.x, self.cells)
        told = isinstance(grid, Columns) and self.blocks is not None  # all cells, not only those here
        self.affine = grid.affine if told else bool(comm.allreduce(affine, MPI.LAND))
        self.regular = isinstance(grid, Grid) and self.cells.shape[1] == 2**self.dim
        if self.affine and isinstance(grid, Grid):  # what nobody asks for would take 0.15 kB per point
            inverse = np.diag(grid.cells / grid.box.size)[None] if self.regular else self.maps.inverse
            self.maps = CellMaps(self.maps.corner[:, :1].copy(), inverse)
        self.original_cell = compat.original_cells(self.mesh)
        self.vertex_of = np.empty(len(self.x), np.int64)
        self.vertex_of[self.cells] = cells[self.original_cell]
        sizes = np.ptp(vertices[cells], axis=1)
        self.h = grid.cell_size if isinstance(grid, Columns) else sizes.mean(axis=0)
        self.origin = np.broadcast_to(np.asarray(origin, float), (self.dim,))
        self.tolerance = max(INSIDE, 8 * np.finfo(float).eps * np.abs(vertices + self.origin).max()
                             / sizes.min())
        self.margin = np.maximum(np.zeros((self.dim, 2)) if margin is None else margin, self.tolerance)
        self.search = LatticeSearch(grid, self) if isinstance(grid, Grid) else WalkSearch(self)
        self.neighbours = self._ranks_around()

    def _share_out(self, filling, patch):
        """Rank of each cell of the whole grid, (cells,), by what fills them."""
        (vertices, cells), comm = self.whole, self.comm
        if comm.size == 1:
            return np.zeros(len(cells), np.int32)
        number, mine = self._cells_near(filling), Part(comm.rank, comm.size).of(len(cells))
        if patch is not None:
            count = comm.allreduce(np.bincount(number, minlength=len(cells)))
            return bisect(vertices[cells].mean(axis=1), EMPTY_CELL + POINT * count, comm.size, patch)
        ends = [Part(rank, comm.size).of(len(cells)).stop for rank in range(comm.size)]
        filled, count = np.unique(number, return_counts=True)
        cuts = np.searchsorted(filled, ends)[:-1]
        weights = np.full(mine.stop - mine.start, EMPTY_CELL, np.int64)
        for which, many in comm.alltoall(list(zip(np.split(filled, cuts), np.split(count, cuts)))):
            weights[which - mine.start] += POINT * many
        own = bisect_together(comm, Cells(vertices[cells[mine]].mean(axis=1), weights, mine.start))
        return np.concatenate(comm.allgather(own))

    @property
    def field_of(self):
        """Field of each of this rank's cells, shape (m,)."""
        return self.original_cell // len(self.whole[1])

    def in_field(self, cells, field):
        """The copies in ``field`` of this rank's ``cells``, numbers (n,); they are this rank's, too."""
        if self._place is None:
            self._place = np.empty(len(self.owner), np.int32)
            self._place[self.original_cell] = np.arange(len(self.cells))
        count = len(self.whole[1])
        return self._place[self.original_cell[cells] % count + field * count]

    @cached_property
    def domain(self):
        """The grid for functions of FEniCSx, see ``Domain``. Collective."""
        return Domain(self)

    @property
    def checksum(self):
        """Of the distribution: with the same one, numbers of this rank's cells and nodes are the same."""
        blocks = b"" if self.blocks is None else self.blocks.numbers.tobytes()
        return zlib.crc32(np.ascontiguousarray(self.owner), zlib.crc32(blocks))

    def _cells_near(self, x):
        """Numbers of the cells of the whole grid that points x [m], shape (n, D), are in; of a mesh those
        whose middles are nearest."""
        if isinstance(self.grid, Grid):
            number = np.empty(len(x), np.int64)
            specialise(lattice_numbers, D=self.dim)(
                x, *lattice_of(self.grid, np.full((self.dim, 2), np.inf)), number)
            if self.blocks is not None:
                self.blocks.renumber(number)
            return number[number >= 0]
        from scipy.spatial import cKDTree  # takes time to import, and one rank does not need it

        vertices, cells = self.whole
        return cKDTree(vertices[cells].mean(axis=1)).query(x)[1] if len(x) else np.zeros(0, np.int64)

    def distribute(self, vertices, cells):
        """Every cell to its owner and, as a ghost, to all ranks that share one of its vertices."""
        comm, n, m = self.comm, len(cells), len(vertices)
        mine = slice(n * comm.rank // comm.size, n * (comm.rank + 1) // comm.size)
        owners = ghosts(cells, m, self.owner[:n], comm.size, mine)
        part = vertices[m * comm.rank // comm.size:m * (comm.rank + 1) // comm.size]
        return compat.create_mesh(comm, cells[mine].astype(np.int64), part, self.grid.cell, owners)

    def stencil_grid(self, nodes):
        """``StencilGrid`` with the ``nodes`` of this rank's cells, shape (m, K)."""
        lower, upper = (np.asarray(corner, float) for corner in (self.grid.box.lower, self.grid.box.upper))
        return StencilGrid(lower, upper, (upper - lower) / self.grid.cells, self.maps.corner, nodes)

    def keep_mine(self, points, names):
        """Of points made alike on every rank, keep those in its own cells. names: what each belongs to."""
        rank, number = self.search.assign(points.x, points.field)
        if (rank < 0).any():
            p = np.argmin(rank)
            raise ValueError(f"particle {p} of {names[p]} lies at {points.x[p] + self.origin} m, outside the "
                             "grid: enlarge the grid or shorten the surface")
        mine = rank == self.comm.rank
        points.take(mine)
        points.cell[:] = self.search.local(number[mine])

    def deal(self, points, router):
        """The points, of which each rank has some, go to the ranks of their cells. Collective."""
        rank, number = self.search.relocate(points)
        together(self.comm, lambda: self._check_found(points, rank))
        points.cell[:] = self.search.local(points.migrate(router, rank, number))

    def _check_found(self, points, rank):
        if (rank < 0).any():
            p = np.argmin(rank)
            raise ValueError(f"particle {points.gid[p]} of the body lies at {points.x[p] + self.origin} m, "
                             "outside the grid: enlarge the grid")

    def groups(self, cells):
        """Number of groups without common nodes in the ``cells`` of all ranks, on rank 0. Collective."""
        cells = self.comm.gather(self.original_cell[cells])
        if cells is None:
            return 0
        nodes = self.copies[1][np.concatenate(cells)]
        n, nodes = len(nodes), np.unique(nodes, return_inverse=True)[1].reshape(nodes.shape)
        return join(np.repeat(np.arange(n), nodes.shape[1]), n + nodes.ravel(), n + nodes.max() + 1)[0]

    def _ranks_around(self):
        """Ranks with which this one shares cells, in both directions alike."""
        owners = np.concatenate([self.cell_numbering.owners, self.node_numbering.owners])
        mine = set(owners.tolist()) - {self.comm.rank}
        shared = self.comm.allgather(sorted(mine))
        return sorted(mine | {rank for rank, others in enumerate(shared) if self.comm.rank in others})
