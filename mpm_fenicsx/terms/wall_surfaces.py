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


class WallElements(NamedTuple):
    """m elements of walls: ``corners`` (m, D, D) [m]; ``normal`` (m, D), to the front; ``wall`` (m,), number
    of the wall; ``rim`` (m, D, 2), whether the wall ends at each corner, and at the edge opposite."""

    corners: np.ndarray
    normal: np.ndarray
    wall: np.ndarray
    rim: np.ndarray


class Surface(NamedTuple):
    """A wall: its ``record`` and ``name``, particles x (n, D) [m], ``motion`` or None, ``elements`` (m, D),
    and ``front`` (n, D), directions to the front; names of its force ``cells``; of each element the ``cell``
    and the coefficients of ``friction``, mu [-] and ``xi`` [m/s^2], (m,)."""

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
    """Several ``surfaces``, of the same dimension, in bins for places up to ``far`` [m] from them. ``bins``
    and ``walls``, the ``WallElements``: as last placed. h: size of a cell [m]; box: around all places that
    are looked at, a ``Box``: of what moves only elements near it are in bins."""

    def __init__(self, surfaces, h, far, box):
        self.names, self.far = [s.name for s in surfaces], far
        self.moves = any(s.motion for s in surfaces)
        counts = np.cumsum([0, *(len(s.elements) for s in surfaces)])
        wall = np.repeat(np.arange(len(surfaces)), np.diff(counts))
        x = np.concatenate([s.x for s in surfaces])
        starts = np.cumsum([0, *(len(s.x) for s in surfaces)])
        elements = np.concatenate([s.elements + start for s, start in zip(surfaces, starts)])
        self.walls = WallElements(x[elements], np.empty(elements.shape), wall,
                                  find_rim(x, elements, h))
        own = [slice(*ends) for ends in zip(counts, counts[1:])]
        self._placed = [PlacedSurface(s, self.walls.corners[part], self.walls.normal[part], box, h)
                        for s, part in zip(surfaces, own)]
        self._first, self._binned = counts[:-1], None
        self.place(0.0)

    @property
    def deforms(self):
        """Whether a surface moves otherwise than as a whole along a way."""
        return any(placed.deforms for placed in self._placed)

    def corners_at(self, time, wall, elements):
        """Corners [m], shape (k, D, D), of the ``elements`` of one of the walls at ``time`` [s]."""
        return self._placed[wall].corners_at(time, elements)

    def place(self, time):
        """Take the walls to where they are at ``time`` [s]. Returns whether bins are made anew: not where all
        have moved alike, as the bins go along."""
        changed = [placed.place(time) for placed in self._placed]
        shifts = np.array([placed.shift for placed in self._placed])
        if self._binned is None or any(changed) or np.ptp(shifts - self._binned, axis=0).any():
            near = np.concatenate([placed.near + first for placed, first in zip(self._placed, self._first)])
            corners = self.walls.corners[near]
            bins = make_bins(corners.min(axis=1) - self.far, corners.max(axis=1) + self.far, self.far)
            self._made, self._binned = bins._replace(items=near[bins.items]), shifts
            self.bins = self._made
            return True
        self.bins = self._made._replace(origin=self._made.origin + (shifts - self._binned)[0])
        return False


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
            surfaces.append(_of_structure(condition, background))
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


def _of_structure(structure, background):
    """Each element has vertices of its own, and its own side of them is the front, which turns with it. Of
    one at rest only elements count that a point in the grid may be near to: a terrain reaches beyond it."""
    given = structure.motion
    kept = slice(None) if given else _near_grid(structure, background)
    elements = structure.elements[kept]

    def motion(time):
        w = np.asarray(given(time), float)
        return w if w.ndim == 1 else w[elements.ravel()]

    own = np.arange(elements.size).reshape(elements.shape)
    x = structure.x[elements].reshape(elements.size, -1)
    return Surface(structure, structure.name, x, None if given is None else motion, own, np.zeros_like(x),
                   structure.cells, structure.cell[kept],
                   *(np.broadcast_to(np.asarray(values, float), len(structure.elements))[kept]
                     for values in (structure.friction, structure.xi)))


def _near_grid(structure, background):
    """Numbers of the elements within ``REACH`` cells of the box of the grid; at least one."""
    corners = structure.x[structure.elements]
    return near_box(corners.min(axis=1), corners.max(axis=1), background.grid.box,
                    REACH * background.h.max())


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
