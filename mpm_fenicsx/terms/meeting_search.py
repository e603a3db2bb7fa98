"""The search for where a body meets others: which points are near, and along which directions, see
``meeting``; on several ranks together, as points of all of them are near a node that they share."""
import numpy as np

from mpm_dem_direct import direct

from ..collective import somewhere
from ..compiled import specialise
from .meeting import BETTER, NONE, TILTS, Meetings, NearPoints, Sides, around, meet, outward, reach_out
from .penalty import LIGHT

NEAR = 1.0  # cells between bodies at which a step looks


class MeetingSearch:
    """Finds where the ``body``, a term of a step, meets those in another field."""

    def __init__(self, body, background):
        self._body, self._dim, self._h = body, background.dim, background.h.max()
        size = dict(D=self._dim, K=background.cells.shape[1])
        self._outward, self._meet = (direct(specialise(kernel, **size)) for kernel in (outward, meet))
        self._reach_out = direct(specialise(reach_out, **size, DIRECTIONS=2 * self._dim - 1))

    def __call__(self, grid, other):
        """``Meetings`` with the bodies in the field ``other``, their points numbered as the body's, and the
        pair of cells of each; None where nothing is near. Collective."""
        cells, K = grid.active_cells, grid.active_cells.cells.shape[1]
        row = cells.pairs.row[self._body.field, other]
        mine, theirs = cells.pairs.nodes[row[row >= 0]].reshape(-1, 2, K).transpose(1, 0, 2).reshape(2, -1)
        heavy = grid.mass > LIGHT * grid.full_mass
        both = heavy[mine] & heavy[theirs]
        if not somewhere(cells.comm, both.any())[0]:
            return None
        shared = np.full((len(heavy), 1), NONE)
        shared[mine[both]] = shared[theirs[both]] = 1.0
        cells.largest(shared)  # points in cells that are no pair may be near a node of one
        number = np.full(len(heavy), -1, np.int32)
        self._nodes = np.flatnonzero(shared > 0.0)
        number[self._nodes] = np.arange(len(self._nodes))
        mine, first = np.unique(number[mine[both]], return_index=True)
        theirs = number[theirs[both]][first]
        fields = self._body.field, other
        near = [[self._near(grid, body, number) for body in grid.bodies if body.field == field]
                for field in fields]
        sides = self._look_around(grid, near, number, (mine, theirs))
        index, points, _ = next(part for part, body in zip(
            near[0], (body for body in grid.bodies if body.field == fields[0])) if body is self._body)
        n = len(index)
        found = Meetings(np.empty(n, np.int64), np.empty((n, 2 * K)), np.empty((n, self._dim)), np.empty(n))
        count = self._meet(points, row, cells.pairs.nodes, sides, found)
        chosen = np.flatnonzero(found.gap[:count] < NEAR * self._h)
        found = Meetings(*(values[chosen] for values in found))
        return found._replace(point=index[found.point]), row[points.cell[found.point]]

    def _near(self, grid, body, number):
        """Numbers of the points of ``body`` in cells with a node that both bodies reach, see ``Sides``, and
        these as ``NearPoints``, and their volumes."""
        p, cells = body.points, grid.active_cells.cells
        index = np.flatnonzero(((number[cells] >= 0) & (cells >= 0)).any(axis=1)[p.cell])
        cell, x, n, K = p.cell[index], p.x[index], len(index), cells.shape[1]
        N, G = np.empty((n, K)), np.empty((n, self._dim, K))
        grid.shapes(cell, x, N, G)
        return index, NearPoints(cell, x, p.half[index], N, G), p.V0[index]

    def _look_around(self, grid, near, number, nodes):
        """``Sides`` with the best directions found first. nodes: of both fields, two arrays. Collective."""
        mine, theirs = nodes
        D, cells, n = self._dim, grid.active_cells, len(self._nodes)
        sides = Sides(number, cells.places[self._nodes], np.empty((n, 2 * D - 1, D)),
                      np.empty((n, 2 * D - 1)))
        normals = self._directions(grid, near, number, nodes)
        for tilt in (*TILTS, None):
            sides.reach[:], sides.normals[:] = NONE, NONE
            sides.normals[mine] = sides.normals[theirs] = normals
            self._take_largest(cells, sides.normals)
            for sign, of_field in zip((-1.0, 1.0), near):
                for _, points, _ in of_field:
                    self._reach_out(points, cells.cells, sign, sides)
            self._take_largest(cells, sides.reach)
            gap = -(sides.reach[mine] + sides.reach[theirs])
            wide = gap >= gap.max(axis=1, keepdims=True) - BETTER * self._h
            best = np.arange(len(mine)), np.argmax(wide, axis=1)  # the first: ties are no matter of luck
            if tilt is None:
                sides.normals[mine, 0] = sides.normals[theirs, 0] = normals[best]
                sides.reach[mine, 0], sides.reach[theirs, 0] = (sides.reach[some][best] for some in nodes)
                return sides
            normals = normals[best][:, None] + tilt * np.pad(around(normals[best]), ((0, 0), (1, 0), (0, 0)))
            normals /= np.linalg.norm(normals, axis=2)[..., None]

    def _take_largest(self, cells, values):
        """Of all ranks, in place; values: (n, …), see ``Sides``. Collective."""
        if cells.comm.size > 1:
            whole = np.full((len(cells.node), int(np.prod(values.shape[1:]))), NONE)
            whole[self._nodes] = values.reshape(len(values), whole.shape[1])
            cells.largest(whole)
            values[:] = whole[self._nodes].reshape(values.shape)

    def _directions(self, grid, near, number, nodes):
        """To start from, shape (m, 2 D - 1, D), see ``meeting``. Collective."""
        mine, theirs = nodes
        area = np.zeros((len(self._nodes), self._dim))
        for of_field in near:
            for _, points, volume in of_field:
                self._outward(points, volume, grid.active_cells.cells, number, area)
        if grid.active_cells.comm.size > 1:
            whole = np.zeros_like(grid.v)
            whole[self._nodes] = area
            grid.active_cells.accumulate(whole)
            area = whole[self._nodes]
        n = np.stack([area[theirs] - area[mine], -area[mine], area[theirs]], axis=1)
        n /= np.maximum(np.linalg.norm(n, axis=2), 1e-300)[..., None]
        return n if self._dim == 2 else n[:, [0, 1, 2, 0, 0]]
