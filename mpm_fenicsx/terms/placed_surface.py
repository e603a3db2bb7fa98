"""The surface of a wall where it is, of which those elements count that are near a box around points.

A terrain reaches far beyond the points of a rank, which needs nothing of it but what is near them. One that
moves along a way as a whole, as the ground in an earthquake, keeps its normals; which of its elements are
near is looked up anew when it has gone by a cell. One whose vertices move each for themselves is taken as a
whole in each step.
"""
import numpy as np

from ..points.surface import normal_areas

REACH = 3.0  # cells, more than contacts look for walls
SLACK = 1.0  # cells that a surface may go until its elements near the box are looked up anew


class PlacedSurface:
    """Of a ``surface``, see ``wall_surfaces.Surface``. ``near`` (k,): numbers of the elements that count, in
    their order; ``corners`` (k, D, D) [m] and ``normal`` (k, D) of these; ``shift``: its way, if it moves as
    a whole [m], (D,); ``deforms``: whether it has moved otherwise. h: size of a cell [m]."""

    def __init__(self, surface, h):
        self._surface, self._h, self._box, self._chosen = surface, h, None, None
        self.near, self.shift = np.zeros(0, int), np.zeros(surface.x.shape[1])
        self.deforms = surface.motion is not None and np.ndim(surface.motion(0.0)) == 2

    def look_between(self, lower, upper):
        """From the next placing on elements near the box between these corners [m], (D,), count."""
        self._box, self._chosen = (lower, upper), None

    def corners_at(self, time, elements):
        """Corners of some ``elements`` at ``time`` [s], shape (k, D, D) [m]."""
        x, vertices = self._surface.x, self._surface.elements[elements]
        if self._surface.motion is None:
            return x[vertices]
        w = np.asarray(self._surface.motion(time), float)
        return x[vertices] + (w if w.ndim == 1 else w[vertices])

    def place(self, time):
        """Go where the surface is at ``time`` [s]. Returns whether its elements do not lie as they did, up to
        its ``shift``."""
        if self._surface.motion is None:
            if self._chosen is None:
                self._choose(self.shift)
                return True
            return False
        w = np.asarray(self._surface.motion(time), float)
        if w.ndim == 2:
            self.shift, self.deforms = 0.0 * self.shift, True
            self.near = np.arange(len(self._surface.elements))
            self.corners = (self._surface.x + w)[self._surface.elements]
            self.normal = normals(self._surface, self.near, self.corners)
            return True
        self.shift = w
        anew = self._chosen is None or self.deforms or abs(w - self._chosen).max() > SLACK * self._h
        if anew:
            self._choose(w)
        self.corners = self._start + w
        return anew

    def _choose(self, way):
        """The elements that are near the box when the surface has gone this ``way`` [m], (D,)."""
        surface, ends = self._surface, [end - way for end in self._box]
        self._chosen = way
        self.near = near_box(surface.x, surface.elements, *ends, (REACH + SLACK) * self._h)
        self._start = self.corners = surface.x[surface.elements[self.near]]
        self.normal = normals(surface, self.near, self._start)


def normals(surface, chosen, corners):
    """To the front, of the ``chosen`` elements of a ``surface`` with these ``corners``, shape (k, D)."""
    k, D = corners.shape[:2]
    normal = normal_areas(corners.reshape(k * D, D), np.arange(k * D).reshape(k, D))
    if surface.front is not None:
        front = surface.front[surface.elements[chosen]].sum(axis=1)
        normal *= np.where(np.sum(normal * front, axis=1) < 0.0, -1.0, 1.0)[:, None]
    return normal / np.maximum(np.linalg.norm(normal, axis=1), 1e-300)[:, None]


def near_box(x, elements, lower, upper, margin):
    """Numbers of the ``elements`` (m, D) between vertices x (n, D) [m] within ``margin`` [m] of the box from
    ``lower`` to ``upper`` [m], at least one, in their order."""
    near = np.arange(len(elements))
    for axis in range(x.shape[1]):
        at = x[:, axis][elements[near]]
        near = near[(at.max(axis=1) >= lower[axis] - margin) & (at.min(axis=1) <= upper[axis] + margin)]
    return near if len(near) else np.zeros(1, int)
