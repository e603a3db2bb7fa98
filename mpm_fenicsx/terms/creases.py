"""Creases of a wall, where a point may touch several flanks, see ``flanks``: found once, and looked at only
there."""
import numpy as np

from ..compiled import specialise
from ..points.bins import Bins, make_bins
from ..points.box_tree import bounds
from .flanks import HALF_ALIKE, Turns, dot
from .placed_surface import normals

D = 2  # dimensions, fixed by specialise


def find_creased(bins: Bins, normal, creased):
    """Which bins have elements whose normals, (m, D), may differ by more than ``ANGLE``: one of them lies
    half of that from their mean. Fills ``creased``, (bins,)."""
    mean = np.empty(D)
    for b in range(len(creased)):
        mean[:] = 0.0
        for item in range(bins.start[b], bins.start[b + 1]):
            for i in range(D):
                mean[i] += normal[bins.items[item], i]
        size, creased[b] = np.sqrt(dot(mean, mean)), False
        for item in range(bins.start[b], bins.start[b + 1]):
            if dot(normal[bins.items[item]], mean) < HALF_ALIKE * size or size == 0.0:
                creased[b] = True


class Creases:
    """Where a ``wall``, ``WallSurfaces`` of one, may have several flanks within reach of a point. ``most``:
    feet of a point there; ``bins`` of the wall as last placed, and ``creased``, mask of those where it may;
    ``turns`` of its normals. Bins, mask and turns are of nothing when ``most`` is 1."""

    def __init__(self, wall):
        self._wall, dim = wall, wall.walls.normal.shape[1]
        self._find = specialise(find_creased, D=dim)
        # one that deforms may become a valley
        self.most = dim if wall.deforms or has_creases(wall.surfaces[0], wall.far) else 1
        self.bins, self.creased = make_bins(np.zeros((1, dim)), np.zeros((1, dim)), 1.0), np.zeros(0, bool)
        self._made, self.turns = self.bins, Turns(np.zeros((0, dim)), np.zeros((0, dim)))
        self.place()

    def place(self):
        """After the wall has been placed and its tree made anew."""
        if self.most > 1:
            self.bins = self._made = self._wall.bins()
            self.creased = np.empty(len(self.bins.start) - 1, bool)
            normal = self._wall.walls.normal
            self._find(self.bins, normal, self.creased)
            self.turns = Turns(*bounds(self._wall.tree.order, normal, normal))

    def shift(self):
        """After the wall has been placed and its tree has moved along."""
        self.bins = self._made._replace(origin=self._made.origin + self._wall.tree.shift)


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
