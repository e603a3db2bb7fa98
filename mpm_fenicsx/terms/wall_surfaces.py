"""Walls as surfaces of segments or triangles, of which those near material points count."""
from typing import NamedTuple

import numpy as np

from ..points.box_tree import make_tree
from ..points.surface import normal_areas
from ..scene.conditions import GridWall
from ..scene.mesh import FACETS
from ..scene.structures import Structure
from .placed_surface import REACH, PlacedSurface, near_box
from .wall_elements import WallElements, find_rim

AROUND = 8.0  # cells around points in which walls are looked up, until the points have left them


class Surface(NamedTuple):
    """A wall: its ``record`` and ``name``, particles x (n, D) [m], ``motion`` or None, ``elements`` (m, D),
    and ``front`` (n, D), directions to the front, or None where it is the side of the elements' normals;
    names of its force ``cells``; of each element the ``cell`` and the coefficients of ``friction``, mu [-]
    and ``xi`` [m/s^2], (m,)."""

    record: object
    name: str
    x: np.ndarray
    motion: object
    elements: np.ndarray
    front: np.ndarray
    cells: tuple
    cell: np.ndarray
    friction: np.ndarray
    xi: np.ndarray


class WallSurfaces:
    """Several ``surfaces``, of the same dimension: those of their elements that are near material points, in
    a tree for places up to ``far`` [m] from them. So what a rank has follows its points, and not the walls.

    ``tree`` and ``walls``, the ``WallElements``: as last placed; ``number`` (m,): of each of these among the
    elements of its surface. h: size of a cell [m]; box: of the grid, in which all points are; x: of points
    now, a list of (n, D) [m]."""

    def __init__(self, surfaces, h, far, box, x):
        self.names, self.surfaces, self.far = [s.name for s in surfaces], surfaces, far
        self.moves = any(s.motion for s in surfaces)
        self._h, self._box, self._around = h, box, None
        self._placed = [PlacedSurface(surface, h) for surface in surfaces]
        self._near, self._time = None, 0.0
        self.follow(x)

    @property
    def deforms(self):
        """Whether a surface moves otherwise than as a whole along a way."""
        return any(placed.deforms for placed in self._placed)

    def corners_at(self, time, wall, elements):
        """Corners [m], shape (k, D, D), of the ``elements`` of one of the walls at ``time`` [s]."""
        return self._placed[wall].corners_at(time, elements)

    def among(self, elements):
        """Place of ``elements`` of the first surface, numbers of any shape, among those that are near; -1
        where it is not."""
        place = np.minimum(np.searchsorted(self.number, elements), len(self.number) - 1)
        return np.where(self.number[place] == elements, place, -1)

    def follow(self, x):
        """Have all elements that are near points at the places of the list x. Returns whether ``walls`` and
        ``tree`` are others than before."""
        there = [places for places in x if len(places)] or [self._placed[0].corners_at(0.0, [0])[0]]
        lower, upper = (end([end(places, axis=0) for places in there], axis=0) for end in (np.min, np.max))
        known = self._around
        if known and not (any(map(len, x)) and ((lower < known[0]) | (upper > known[1])).any()):
            return False
        ends = np.array([self._box.lower, self._box.upper]) + REACH * self._h * np.array([[-1.0], [1.0]])
        beside = AROUND * self._h
        self._around = np.clip(lower - beside, *ends), np.clip(upper + beside, *ends)
        for placed in self._placed:
            placed.look_between(*self._around)
        return self.place(self._time)

    def place(self, time):
        """Take the walls to where they are at ``time`` [s]. Returns whether the tree is made anew: not where
        all have moved alike, as it goes along."""
        self._time = time
        changed = [placed.place(time) for placed in self._placed]
        if any(changed):
            self._choose()
        elif self.moves:
            self.walls.corners[:] = np.concatenate([placed.corners for placed in self._placed])
        shifts = np.array([placed.shift for placed in self._placed])
        if any(changed) or np.ptp(shifts - self._made_at, axis=0).any():
            corners, self._made_at = self.walls.corners, shifts
            self.tree = make_tree(corners.min(axis=1), corners.max(axis=1))
            return True
        self.tree = self.tree._replace(shift=(shifts - self._made_at)[0])
        return False

    def _choose(self):
        """``walls`` of the elements that count now."""
        near = [placed.near for placed in self._placed]
        corners, normal = (np.concatenate([getattr(placed, what) for placed in self._placed])
                           for what in ("corners", "normal"))
        if self._near is None or not all(map(np.array_equal, near, self._near)):
            self._near, self.number = near, np.concatenate(near)
            self._wall = np.repeat(np.arange(len(near)), [len(one) for one in near])
            self._rim = find_rim_of(self.surfaces, near, self._h)
        self.walls = WallElements(corners, normal, self._wall, self._rim)


def find_rim_of(surfaces, near, h):
    """``find_rim`` of the elements ``near``, numbers by surface, of all ``surfaces`` together: by these and
    the elements that may touch them."""
    corners = np.concatenate([s.x[s.elements[chosen]] for s, chosen in zip(surfaces, near)])
    ends = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    touching = [near_box(s.x, s.elements, *ends, h) for s in surfaces]
    x = np.concatenate([s.x[s.elements[one]] for s, one in zip(surfaces, touching)])
    rim = find_rim(x.reshape(-1, x.shape[2]), np.arange(x.shape[0] * x.shape[1]).reshape(x.shape[:2]), h)
    first = np.cumsum([0, *map(len, touching)])
    return rim[np.concatenate([start + np.searchsorted(one, chosen)
                               for one, chosen, start in zip(touching, near, first)])]


def find_surfaces(scene, background):
    """A ``Surface`` of each of a scene's ``Penalty``, ``GridWall`` and ``Structure`` records that is in
    space, has a front side and elements."""
    surfaces = []
    for condition in scene:
        if isinstance(condition, Structure):
            surfaces.append(_of_structure(condition))
            continue
        if isinstance(condition, GridWall):
            x, cells = background.whole
            wall = condition.penalty(x)
            facets, motion = wall_facets(x, cells, background.grid.cell, condition.holds(x),
                                         wall.normal[0]), None
            front = np.broadcast_to(wall.normal[0], x.shape)
        else:
            x, motion = np.asarray(condition.surface.x, float), condition.motion
            facets, front = np.asarray(condition.surface.elements), condition.normal
        watched = front is not None and not getattr(condition, "follows", False)
        if watched and len(facets) and facets.shape[1] == background.dim:
            surfaces.append(Surface(condition, condition.name, x, motion, facets, front, (condition.name,),
                                    np.zeros(len(facets), int), np.full(len(facets), condition.friction),
                                    np.full(len(facets), np.inf)))
    return surfaces


def _of_structure(structure):
    """Its elements' own side is the front, which turns with them."""
    friction, xi = (np.broadcast_to(np.asarray(values, float), len(structure.elements))
                    for values in (structure.friction, structure.xi))
    return Surface(structure, structure.name, structure.x, structure.motion, structure.elements, None,
                   structure.cells, structure.cell, friction, xi)


def wall_facets(x, cells, kind, on_wall, normal):
    """Segments or triangles of a wall along grid nodes, shape (m, D): the facets between nodes ``on_wall``,
    mask of shape (n,), of cells in front of it. normal: to the front, shape (D,)."""
    cells = cells[~on_wall[cells].all(axis=1)]
    facets = np.concatenate([cells[:, list(facet)] for facet in FACETS[kind]])
    inside = np.tile(x[cells].mean(axis=1), (len(FACETS[kind]), 1))
    chosen = on_wall[facets].all(axis=1)
    facets, inside = facets[chosen], inside[chosen]
    if facets.shape[1] == 4:
        facets, inside = np.concatenate([facets[:, [0, 1, 2]], facets[:, [0, 2, 3]]]), np.tile(inside, (2, 1))
    if not len(facets):
        return facets
    n = normal_areas(x, facets)
    across = np.abs(n @ normal) > 0.5 * np.linalg.norm(n, axis=1)
    return facets[across & ((inside - x[facets].mean(axis=1)) @ normal > 0.0)]


def places(walls, feet, number, time):
    """Of the ``walls``, a list of ``WallSurfaces``, at ``feet``, see ``feet.Feet``, at ``time`` [s], (m, D)
    [m]; number: (m,), of the wall of each foot, ascending."""
    starts = np.searchsorted(number, np.arange(len(walls) + 1))
    parts = [slice(*ends) for ends in zip(starts, starts[1:])]
    return np.concatenate([
        np.einsum("qk,qki->qi", feet.weight[part], wall.corners_at(time, 0, feet.element[part]))
        for part, wall in zip(parts, walls)])
