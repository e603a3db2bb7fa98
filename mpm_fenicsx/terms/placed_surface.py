"""The surface of a wall where it is, and which of its elements are near the grid.

A terrain reaches far beyond the grid. One that moves along a way as a whole, as the ground in an earthquake,
keeps its normals, and only the corners of elements near the grid are moved; which these are is looked up anew
when it has gone by a cell. One whose vertices move each for themselves is taken as a whole in each step.
"""
import numpy as np

from ..points.surface import normal_areas

REACH = 3.0  # cells, more than contacts look for walls
SLACK = 1.0  # cells that a surface may go until its elements near the grid are looked up anew


class PlacedSurface:
    """Of a ``surface``, see ``wall_surfaces.Surface``: fills ``corners`` (m, D, D) [m] and ``normal`` (m, D).
    ``near``: numbers of the elements that count; ``shift``: its way, if it moves as a whole [m], (D,);
    ``deforms``: whether it has moved otherwise. box: of the grid, a ``Box``; h: size of a cell [m]."""

    def __init__(self, surface, corners, normal, box, h):
        self._surface, self.corners, self.normal = surface, corners, normal
        self._front = surface.front[surface.elements].sum(axis=1)
        self._box, self._h, self._chosen = box, h, None
        self.shift, self.near = np.zeros(corners.shape[2]), np.arange(len(corners))
        self.deforms = surface.motion is not None and np.ndim(surface.motion(0.0)) == 2
        if surface.motion is not None:
            self._start = corners.copy()
        self._turn()

    def _turn(self):
        """Normals of the corners as they are."""
        elements = np.arange(self.corners.shape[0] * self.corners.shape[1]).reshape(self.corners.shape[:2])
        normal = normal_areas(self.corners.reshape(-1, self.corners.shape[2]), elements)
        normal *= np.where(np.sum(normal * self._front, axis=1) < 0.0, -1.0, 1.0)[:, None]
        self.normal[:] = normal / np.maximum(np.linalg.norm(normal, axis=1), 1e-300)[:, None]

    def corners_at(self, time, elements):
        """Corners of some ``elements`` at ``time`` [s], shape (k, D, D) [m]."""
        if self._surface.motion is None:
            return self.corners[elements]
        w = np.asarray(self._surface.motion(time), float)
        return self._start[elements] + (w if w.ndim == 1 else w[self._surface.elements[elements]])

    def place(self, time):
        """Go where the surface is at ``time`` [s]. Returns whether its elements do not lie as they did, up to
        its ``shift``."""
        if self._surface.motion is None:
            return False
        w = np.asarray(self._surface.motion(time), float)
        if w.ndim == 2:
            self.corners[:] = self._start + w[self._surface.elements]
            self._turn()
            self.near, self.shift, self.deforms = self._find(self.corners, 0.0), 0.0 * self.shift, True
            return True
        self.shift = w
        anew = self._chosen is None or self.deforms or abs(w - self._chosen).max() > SLACK * self._h
        if anew:
            self._chosen, self.near = w, self._find(self._start, w)
        self.corners[self.near] = self._start[self.near] + w
        return anew

    def _find(self, corners, shift):
        """Numbers of the elements within reach of the grid, at least one."""
        lower, upper = corners.min(axis=1) + shift, corners.max(axis=1) + shift
        return near_box(lower, upper, self._box, (REACH + SLACK) * self._h)


def near_box(lower, upper, box, margin):
    """Numbers of the things in boxes from ``lower`` to ``upper`` [m], (n, D), that are within ``margin`` [m]
    of a ``Box``, at least one."""
    near = ((upper >= box.lower - margin) & (lower <= box.upper + margin)).all(axis=1)
    return np.flatnonzero(near) if near.any() else np.zeros(1, int)
