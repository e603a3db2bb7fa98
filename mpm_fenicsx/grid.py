"""The distributed background grid.

No function space is made: the mesh's geometry already has nodes, cells and their index maps, and the form compiler stays
out of the start.
"""
import numpy as np
from scipy.spatial import cKDTree

from . import compat
from .partition import EMPTY_CELL, bisect, ghosts
from .scene import Grid
from .search import LatticeSearch, WalkSearch
from .shape import affine_maps


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


class Background:
    """Distributed background grid.

    whole: vertices and cells of the whole grid; owner: rank of each of its cells; cells: nodes of this rank's cells,
    shape (m, K), owned ones first, then ghosts; original_cell: (m,) their numbers in the whole; x: nodes [m], shape
    (n, D), likewise; vertex_of: (n,) their numbers in the whole; h: (D,) size of a cell [m]; origin, inverse: affine
    maps of the cells. Collective.
    """

    def __init__(self, grid, comm, filling):
        """grid: ``Grid`` or ``MeshGrid``; filling: positions [m], shape (n, D), of what makes a cell expensive; each
        rank may give its own share."""
        self.grid, self.comm, self.dim = grid, comm, grid.box.dim
        self.whole = vertices, cells = lattice(grid) if isinstance(grid, Grid) else (grid.vertices, grid.cells)
        centres = vertices[cells].mean(axis=1)
        weights = EMPTY_CELL + self._points_per_cell(centres, filling)
        self.owner = bisect(centres, weights, comm.size)
        self.mesh = self._distribute(vertices, cells)
        self.cell_map = self.mesh.topology.index_map(self.dim)
        self.cells_owned = self.cell_map.size_local
        self.node_map = self.mesh.geometry.index_map()
        self.nodes_owned = self.node_map.size_local
        self.x = np.ascontiguousarray(self.mesh.geometry.x[:, :self.dim])
        self.cells = compat.geometry_cells(self.mesh, cells.shape[1])
        self.origin, self.inverse = affine_maps(self.x, self.cells, grid.cell)
        self.original_cell = np.asarray(self.mesh.topology.original_cell_index)
        self.vertex_of = np.empty(len(self.x), np.int64)
        self.vertex_of[self.cells] = cells[self.original_cell]
        self.h = np.ptp(vertices[cells], axis=1).mean(axis=0)
        self.search = LatticeSearch(grid, self) if isinstance(grid, Grid) else WalkSearch(self)
        self.neighbours = self._ranks_around()

    def _points_per_cell(self, centres, filling):
        """Number of points near the middle of each cell of the whole grid, over all ranks; shape (cells,)."""
        count = np.zeros(len(centres))
        if self.comm.size > 1:
            nearest = cKDTree(centres).query(filling)[1] if len(filling) else np.zeros(0, int)
            count = self.comm.allreduce(np.bincount(nearest, minlength=len(centres)).astype(float))
        return count

    def _distribute(self, vertices, cells):
        """Every cell to its owner and, as a ghost, to all ranks that share one of its vertices."""
        comm, n, m = self.comm, len(cells), len(vertices)
        mine = slice(n * comm.rank // comm.size, n * (comm.rank + 1) // comm.size)
        owners = ghosts(cells, m, self.owner, comm.size, mine)
        part = vertices[m * comm.rank // comm.size:m * (comm.rank + 1) // comm.size]
        return compat.create_mesh(comm, cells[mine].astype(np.int64), part, self.grid.cell, owners)

    def _ranks_around(self):
        """Ranks with which this one shares cells, in both directions alike."""
        mine = set(np.concatenate([self.cell_map.owners, self.node_map.owners]).tolist()) - {self.comm.rank}
        shared = self.comm.allgather(sorted(mine))
        return sorted(mine | {rank for rank, others in enumerate(shared) if self.comm.rank in others})
