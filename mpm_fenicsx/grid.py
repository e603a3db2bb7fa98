"""The distributed background grid and the search for the cell of a point.

No function space is made: the mesh's geometry already has nodes, cells and their index maps, and the form compiler
stays out of the start. The regular lattice of a box is its own search structure: the cell of a point is a matter of
rounding, whatever the distance it moved.
"""
import numpy as np
from numba import njit

from . import compat
from .scene import Grid
from .shape import affine_maps


def bisect(centres, weights, ranks):
    """Recursive coordinate bisection: the rank of each cell, shape (n,), so that every rank gets about the same sum of
    ``weights``. Ties are broken by the cell's number, so the answer does not depend on who asks."""
    owner = np.zeros(len(centres), np.int32)

    def split(members, first, count):
        if count == 1:
            owner[members] = first
            return
        axis = np.argmax(np.ptp(centres[members], axis=0)) if len(members) else 0
        order = members[np.lexsort((members, np.round(centres[members, axis], 12)))]
        filling = np.cumsum(weights[order])
        half = count // 2
        cut = np.searchsorted(filling, filling[-1] * half / count) + 1 if len(order) else 0
        split(order[:cut], first, half)
        split(order[cut:], first + half, count - half)

    split(np.arange(len(centres)), 0, ranks)
    return owner


def lattice(grid: Grid):
    """Vertices, shape (n, D), and cells, shape (m, K), of the regular grid; direction 0 runs fastest in both."""
    axes = [np.linspace(lo, hi, n + 1) for lo, hi, n in zip(grid.box.lower, grid.box.upper, grid.cells)]
    vertices = np.stack(np.meshgrid(*axes, indexing="ij"), -1).transpose(1, 0, 2).reshape(-1, 2)
    nx, ny = grid.cells
    corner = (np.arange(ny)[:, None] * (nx + 1) + np.arange(nx)).ravel()
    quads = corner[:, None] + np.array([0, 1, nx + 1, nx + 2])
    if grid.cell == "quadrilateral":
        return vertices, quads
    return vertices, quads[:, [0, 1, 3, 0, 3, 2]].reshape(-1, 3)  # below, then above the rising diagonal


@njit(cache=True)
def _lattice_cell(x, lower, h, counts, halves, target):
    """Number of the lattice cell of each point into target, -1 outside."""
    for p in range(len(x)):
        c = 0
        stride = 1
        fx = 0.0
        fy = 0.0
        for d in range(x.shape[1]):
            s = (x[p, d] - lower[d]) / h[d]
            i = int(np.floor(s))
            if i == counts[d] and s <= counts[d]:
                i -= 1  # the far edge belongs to the last cell
            if not 0 <= i < counts[d]:  # also catches NaN
                c = -1
                break
            c += stride * i
            stride *= counts[d]
            if d == 0:
                fx = s - i
            else:
                fy = s - i
        if c >= 0 and halves == 2:
            c = 2 * c + (1 if fy > fx else 0)
        target[p] = c


@njit(cache=True)
def settle(target, owner_of, local_of, slot, rank, cell):
    """Local cell of each point from its number ``target`` in the whole lattice.

    Returns the first point outside the grid (or -1), whether any point belongs to another rank, and whether any lies
    in a cell without a row in ``slot``.
    """
    moved = 0
    bare = 0
    for p in range(len(target)):
        c = target[p]
        if c < 0:
            return p, moved, bare
        if owner_of[c] != rank:
            moved = 1
            continue
        cell[p] = local_of[c]
        if slot[cell[p]] < 0:
            bare = 1
    return -1, moved, bare


class Background:
    """Distributed background grid.

    whole: vertices and cells of the whole grid; x: nodes here [m], shape (n, D), owned first, then ghosts; vertex_of:
    their numbers in the whole; cells: shape (m, K), likewise; owner_of: rank of every cell of the whole; local_of: its
    number here or -1. Collective.
    """

    def __init__(self, grid: Grid, comm, weight_at):
        """weight_at: positions [m], shape (n, D), of the points that make a cell expensive."""
        self.grid, self.comm, self.dim = grid, comm, grid.box.dim
        self.whole = vertices, cells = lattice(grid)
        self.lower, self.h = np.asarray(grid.box.lower, float), grid.box.size / grid.cells
        self._counts = np.asarray(grid.cells, np.int64)
        self._halves = len(cells) // int(np.prod(grid.cells))
        filling = np.bincount(np.maximum(self.find(weight_at), 0), minlength=len(cells))
        self.owner_of = bisect(vertices[cells].mean(axis=1), 0.02 + filling, comm.size)
        self.mesh = self._distribute(vertices, cells)
        topology = self.mesh.topology
        cell_map = topology.index_map(self.dim)
        self.cells_owned = cell_map.size_local
        self.node_map = self.mesh.geometry.index_map()
        self.nodes_owned = self.node_map.size_local
        self.x = np.ascontiguousarray(self.mesh.geometry.x[:, :self.dim])
        self.cells = compat.geometry_cells(self.mesh, cells.shape[1])
        self.origin, self.inverse = affine_maps(self.x, self.cells, grid.cell)
        self.local_of = np.full(len(cells), -1, np.int32)
        original = np.asarray(topology.original_cell_index)
        self.local_of[original] = np.arange(len(self.cells))
        self.vertex_of = np.empty(len(self.x), np.int64)
        self.vertex_of[self.cells] = cells[original]

    def _distribute(self, vertices, cells):
        """Every cell to its owner and, as a ghost, to all ranks that share one of its vertices."""
        comm, n, m = self.comm, len(cells), len(vertices)
        ranks_of = np.zeros((m, comm.size), bool)
        ranks_of[cells.ravel(), np.repeat(self.owner_of, cells.shape[1])] = True
        mine = slice(n * comm.rank // comm.size, n * (comm.rank + 1) // comm.size)
        sharing = ranks_of[cells[mine]].any(axis=1)
        owners = [[owner, *(r for r in np.flatnonzero(row) if r != owner)]
                  for owner, row in zip(self.owner_of[mine], sharing)]
        part = vertices[m * comm.rank // comm.size:m * (comm.rank + 1) // comm.size]
        return compat.create_mesh(comm, cells[mine].astype(np.int64), part, self.grid.cell, owners)

    def find(self, x):
        """Number in the whole lattice of the cell of each point x, shape (n, D); -1 outside the grid."""
        target = np.empty(len(x), np.int64)
        _lattice_cell(x, self.lower, self.h, self._counts, self._halves, target)
        return target
