"""What material points remember of their feet on walls, see ``surface_contact``, and its sums.

Few points touch a wall, and few of those more than one: what is looked at are the slots that have a foot,
whose ``wall_element`` is not negative. In all others force, gap and change of reach are zero.
"""
import numpy as np

from ..compiled import compiled
from ..points.moments import wrenches


@compiled
def forget(kept, element, status, force, gap, deformed):
    """Empty the slots that are not ``kept``, a mask (n, M), of n points; the other arrays are theirs, see
    ``SurfaceContact``. Returns whether one of them had a status."""
    left = False
    for p in range(len(kept)):
        for slot in range(kept.shape[1]):
            if kept[p, slot] or (element[p, slot] < 0 and status[p, slot] == 0):
                continue
            left = left or status[p, slot] != 0
            element[p, slot], status[p, slot], deformed[p, slot] = -1, 0, 0.0
            force[p, slot], gap[p, slot] = 0.0, 0.0
    return left


class FootMemory:
    """That of the ``points``, whose slots, M in all, belong to the walls of the numbers ``wall``, (M,).
    surfaces: a ``wall_surfaces.Surface`` of each wall."""

    def __init__(self, points, surfaces, wall):
        self._points, self._wall = points, wall
        self.cell_names = [name for surface in surfaces for name in surface.cells]
        self._of_wall = [surface.name for surface in surfaces for _ in surface.cells]
        cells, elements = ([len(getattr(one, what)) for one in surfaces] for what in ("cells", "cell"))
        self._first = np.cumsum([0, *elements])  # element of each wall among those of all
        self._cell = np.concatenate([surface.cell + first for surface, first in zip(
            surfaces, np.cumsum([0, *cells]))])  # of each element, among those of all walls

    def keep(self, point, slot):
        """Forget all feet but those of the points in these slots, (m,). Returns whether another one had a
        status."""
        p = self._points
        kept = np.zeros(p.wall_status.shape, np.bool_)
        kept[point, slot] = True
        return bool(forget(kept, p.wall_element, p.wall_status, p.wall_force, p.wall_gap, p.wall_deformed))

    def stored(self):
        """Energy in the springs of this rank [J]."""
        p = self._points
        point, slot = np.nonzero(p.wall_element >= 0)
        square = np.sum(p.wall_force[point, slot] ** 2, axis=1)
        return 0.5 * np.sum(square / p.wall_stiffness[point, self._wall[slot]])

    def _sums(self):
        """Force [N] and moment about the origin [N m] of each force cell, at the feet, (cells, D + 1) in a
        plane, (cells, 6) in space."""
        p = self._points
        point, slot = np.nonzero(p.wall_element >= 0)
        rows = wrenches(p.x[point] + p.wall_foot[point, slot], p.wall_force[point, slot])
        cell = self._cell[self._first[self._wall[slot]] + p.wall_element[point, slot]]
        return np.stack([np.bincount(cell, part, len(self.cell_names)) for part in rows.T], axis=1)

    def held(self):
        """See ``penalty.Penalties.held``, at the feet of the points."""
        found = {}
        for name, row in zip(self.cell_names, self._sums()):
            found[name] = found.get(name, 0.0) + row
        return found

    def reaction(self, name):
        """Force of the walls, or of the force cell of one, of that name on the points of this rank [N], shape
        (D,)."""
        named = [name in pair for pair in zip(self.cell_names, self._of_wall)]
        return self._sums()[named, :self._points.x.shape[1]].sum(axis=0)
