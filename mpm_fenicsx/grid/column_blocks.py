"""The blocks of a large grid of columns: cut along the plan and along the layers, so that the air over a flow
is left out as well as the ground beside it."""
import numpy as np

from ..compiled import compiled
from ..scene.lattice import SIDE
from .blocks import Blocks, Division


@compiled
def straighten(x, lower, step, z, h, lowest, levels):
    """Places x [m], shape (n, D), where the layers of cells lie level: the last coordinate becomes the
    ``levels`` (n, D) of cells of ``h`` [m] under it, of which ``lowest`` are below the surface. The plan has
    its ``lower`` corner [m] and squares of ``step`` [m], (D - 1,); z: heights of the surface at their
    corners [m], in the plane of shape (columns + 1, 1). Beyond the edge the surface goes on as at it."""
    D = x.shape[1]
    i, t = np.zeros(2, np.int64), np.zeros(2)
    for p in range(len(x)):
        for d in range(D - 1):
            levels[p, d] = x[p, d]
            s = (x[p, d] - lower[d]) / step[d]
            i[d], t[d] = 0, 0.0
            if s > 0.0:  # not so for what is not a number
                i[d] = int(min(s, z.shape[d] - 2.0))
                t[d] = min(s - i[d], 1.0)
        surface = 0.0
        for a in range(2 ** (D - 1)):
            u, v = a & 1, a >> 1
            share = (t[0] if u else 1.0 - t[0]) * (t[1] if v else 1.0 - t[1])
            surface += share * z[i[0] + u, i[1] + v]
        levels[p, D - 1] = (x[p, D - 1] - surface) / h + lowest


class ColumnBlocks(Blocks):
    """``Blocks`` of a grid of ``Columns``, whose cells are counted by columns and levels."""

    @staticmethod
    def divide(grid):
        """``Division`` of the columns and levels of ``Columns``."""
        D, counts = grid.dim, np.array([*grid.down.shape, grid.levels], np.int64)
        lower = np.array([*(line[0] for line in grid.lines), 0.0])
        ends = np.array([*(line[-1] for line in grid.lines), float(grid.levels)])
        side = np.full(D, SIDE[D], np.int64)
        return Division(lower, (ends - lower) / counts, counts, side, -(-counts // side), 1)

    @staticmethod
    def straight(grid, division, x):
        """See ``straighten``."""
        levels = np.empty_like(x)
        straighten(np.ascontiguousarray(x), division.lower, division.h, grid.z.reshape(len(grid.z), -1),
                   grid.h, grid.lowest, levels)
        return levels

    def _find_cells(self):
        """Columns of each block, and their levels there. Where no block has any cells, as for points beyond
        all columns, one is there that has."""
        self._parts = self._columns()
        if not self._parts[2].any():
            grid, side = self.grid, self.division.side
            column = np.unravel_index(np.argmax(grid.down + grid.up > 0), grid.down.shape)
            first = [*column, grid.lowest - grid.down[column]]
            self.numbers = np.array([np.ravel_multi_index(first // side, self.division.blocks, order="F")])
            self._parts = self._columns()
        self.count = int(self._parts[2].sum())
        self.grid.check_whole(self.count)

    def _columns(self):
        """Number of the column, first level and count of cells of all columns in the blocks, (k,) each."""
        grid, side = self.grid, self.division.side
        at = np.stack(np.unravel_index(self.numbers, self.division.blocks, order="F"), axis=1)
        squares = np.stack(np.meshgrid(*map(np.arange, side[:-1]), indexing="ij"), axis=-1).reshape(
            -1, len(side) - 1)
        place = (at[:, None, :-1] * side[:-1] + squares).reshape(-1, len(side) - 1)
        low = np.repeat(at[:, -1] * side[-1], len(squares))
        there = (place < self.division.counts[:-1]).all(axis=1)
        column, low = np.ravel_multi_index(place[there].T, grid.down.shape), low[there]
        first = np.maximum(low, grid.lowest - grid.down.ravel()[column])
        last = np.minimum(low + side[-1], grid.lowest + grid.up.ravel()[column])
        return column, first, np.maximum(last - first, 0)

    def mesh(self):
        """Vertices, shape (n, D), and cells, shape (m, K), block by block."""
        return self.grid.cells_between(*self._parts)
