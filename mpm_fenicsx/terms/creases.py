"""Creases of a wall, where a point may touch several flanks, see ``flanks``."""
import numpy as np

from ..points.box_tree import bounds
from .flanks import HALF_ALIKE, Turns
from .placed_surface import normals


class Creases:
    """Of a ``wall``, ``WallSurfaces`` of one. ``most``: feet of a point there; ``turns`` of the wall as last
    placed, of nothing when ``most`` is 1."""

    def __init__(self, wall):
        self._wall, dim = wall, wall.walls.normal.shape[1]
        # one that deforms may become a valley
        self.most = dim if wall.deforms or has_creases(wall.surfaces[0], wall.far) else 1
        self.turns = Turns(np.zeros((0, dim)), np.zeros((0, dim)))
        self.place()

    def place(self):
        """After the wall has been placed and its tree made anew."""
        if self.most > 1:
            normal = self._wall.walls.normal
            self.turns = Turns(*bounds(self._wall.tree.order, normal, normal))


def has_creases(surface, far):
    """Whether any elements of a ``surface``, a ``wall_surfaces.Surface``, that are within ``far`` [m] of one
    place have normals that may differ by more than ``ANGLE``, wherever points are. Space is halved until
    those within reach of a part agree, or the part is as small as that."""
    corners = surface.x[surface.elements]
    lower, upper = corners.min(axis=1) - far, corners.max(axis=1) + far
    normal = normals(surface, slice(None), corners)
    parts = [(lower.min(axis=0), upper.max(axis=0), np.arange(len(normal)))]
    while parts:
        low, high, items = parts.pop()
        items = items[((upper[items] >= low) & (lower[items] <= high)).all(axis=1)]
        mean = normal[items].sum(axis=0)
        size, axis = np.linalg.norm(mean), np.argmax(high - low)
        if size > 0.0 and (normal[items] @ mean).min() >= HALF_ALIKE * size or not len(items):
            continue
        if (high - low)[axis] <= far:
            return True
        first, second = high.copy(), low.copy()
        first[axis] = second[axis] = 0.5 * (low + high)[axis]
        parts += (low, first, items), (second, high, items)
    return False
