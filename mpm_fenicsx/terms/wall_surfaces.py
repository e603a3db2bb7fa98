"""Walls as surfaces of segments or triangles, and what a place is nearest to on them."""
from typing import NamedTuple

import numpy as np

from ..points.bins import Bins, bin_of, make_bins
from ..points.closest import closest
from ..points.surface import normal_areas
from ..scene.conditions import GridWall
from ..scene.facets import alike, same_places
from ..scene.mesh import FACETS
from ..scene.structures import Structure
from .placed_surface import REACH, PlacedSurface, near_box

D = 2  # fixed by specialise
# of two elements equally near, as at their common corner, the one that looks more straight at the point
TIE = 1e-9
AROUND = 8.0  # cells around points in which walls are looked up, until the points have left them


class WallElements(NamedTuple):
    """m elements of walls: ``corners`` (m, D, D) [m]; ``normal`` (m, D), to the front; ``wall`` (m,), number
    of the wall; ``rim`` (m, D, 2), whether the wall ends at each corner, and at the edge opposite."""

    corners: np.ndarray
    normal: np.ndarray
    wall: np.ndarray
    rim: np.ndarray


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


def nearest(p, x, bins: Bins, elements: WallElements, far, weight, best_weight, work):
    """Element nearest to point p of x, shape (n, D), within ``far`` [m], or -1; its distance squared; the
    distance along the element's normal; whether the wall ends where it is nearest. best_weight, shape (D,):
    barycentric coordinates of that place; weight, (D,), and work, (3, D): room."""
    start, items = bins.start, bins.items
    corners, normal, wall, rim = elements
    b = bin_of(p, x, bins, D)
    best, along, element = far * far, 0.0, -1
    for item in range(start[b] if b >= 0 else 0, start[b + 1] if b >= 0 else 0):
        e = items[item]
        closest(x[p], corners[e], D, weight, work)
        square, ahead = 0.0, 0.0
        for i in range(D):
            r = x[p, i]
            for a in range(D):
                r -= weight[a] * corners[e, a, i]
            square += r * r
            ahead += r * normal[e, i]
        if square > best * (1.0 + TIE) or square > far * far:
            continue
        if element >= 0 and square >= best * (1.0 - TIE):
            if abs(ahead) < abs(along) * (1.0 - TIE) or (abs(ahead) <= abs(along) * (1.0 + TIE)
                                                         and ahead < along):
                continue
        best, along, element = square, ahead, e
        for a in range(D):
            best_weight[a] = weight[a]
    on_rim, zeros = False, 0
    for a in range(D if element >= 0 else 0):
        zeros += 1 if best_weight[a] == 0.0 else 0
    for a in range(D if element >= 0 else 0):
        if zeros == D - 1 and best_weight[a] > 0.0 and rim[element, a, 0]:
            on_rim = True
        if zeros == 1 and best_weight[a] == 0.0 and D == 3 and rim[element, a, 1]:
            on_rim = True
    return element, best, along, on_rim


class WallSurfaces:
    """Several ``surfaces``, of the same dimension: those of their elements that are near material points, in
    bins for places up to ``far`` [m] from them. So what a rank has follows its points, and not the walls.

    ``bins`` and ``walls``, the ``WallElements``: as last placed; ``number`` (m,): of each of these among the
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
        ``bins`` are others than before."""
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
        """Take the walls to where they are at ``time`` [s]. Returns whether bins are made anew: not where all
        have moved alike, as the bins go along."""
        self._time = time
        changed = [placed.place(time) for placed in self._placed]
        if any(changed):
            self._choose()
        elif self.moves:
            self.walls.corners[:] = np.concatenate([placed.corners for placed in self._placed])
        shifts = np.array([placed.shift for placed in self._placed])
        if any(changed) or np.ptp(shifts - self._binned, axis=0).any():
            corners = self.walls.corners
            within = self._around[0] - self.far, self._around[1] + self.far
            lower, upper = (np.clip(end(corners, axis=1) + side * self.far, *within)
                            for end, side in ((np.min, -1.0), (np.max, 1.0)))
            self._made, self._binned = make_bins(lower, upper, self.far), shifts
            self.bins = self._made
            return True
        self.bins = self._made._replace(origin=self._made.origin + (shifts - self._binned)[0])
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


def find_rim(x, elements, h):
    """Whether a surface ends at each corner of its elements, and at the edge opposite, shape (m, D, 2).
    Particles in one place are one."""
    place = same_places(x, 1e-6 * h)[elements]
    D = elements.shape[1]
    facets = np.stack([np.delete(place, a, axis=1) for a in range(D)], axis=1)  # opposite each corner
    facets.sort(axis=2)
    order, first, count = alike(facets.reshape(-1, D - 1))
    ends = np.empty(len(order), bool)
    ends[order] = np.repeat(count == 1, count)
    ends = ends.reshape(len(elements), D)
    at_rim = np.isin(place, np.unique(facets[ends]))
    return np.stack([at_rim, ends], axis=2)


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
