"""Material points that have gone through a wall: they are counted, and named in a warning.

Every point near a wall remembers on which side of it it is. One that was in front and is more than ``DEEP``
cells behind has gone through, until it comes back to the front; one that came around the wall's rim has not.
The springs of a wall give by pressure / k, so that a point just behind it means nothing.
"""
import warnings
from typing import NamedTuple

import numpy as np

from ..collective import somewhere
from ..compiled import specialise
from ..points.bins import Bins, bin_of, make_bins
from ..points.closest import closest
from ..points.surface import normal_areas
from ..scene.conditions import GridWall
from ..scene.mesh import FACETS

D = 2  # fixed by specialise
BEHIND, UNKNOWN, FRONT, THROUGH = -1, 0, 1, 2  # sides; THROUGH plus the number of the wall
DEEP, FAR = 0.5, 2.0  # cells behind a wall, and from it
# of two elements equally near, as at their common corner, the one that looks more straight at the point
TIE = 1e-9


class WallElements(NamedTuple):
    """m elements of walls: ``corners`` (m, D, D) [m]; ``normal`` (m, D), to the front; ``wall`` (m,), number
    of the wall; ``rim`` (m, D, 2), whether the wall ends at each corner, and at the edge opposite."""

    corners: np.ndarray
    normal: np.ndarray
    wall: np.ndarray
    rim: np.ndarray


def look(x, bins: Bins, elements: WallElements, deep, far, side):
    """Bring the ``side`` of each point, shape (n,), up to date; returns how many have just gone through a
    wall.

    x: (n, D) [m]; bins: of the elements; deep, far: [m].
    """
    start, items = bins.start, bins.items
    corners, normal, wall, rim = elements
    weight, work, best_weight = np.empty(D), np.empty((3, D)), np.empty(D)
    gone = 0
    for p in range(len(x)):
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
        if element < 0 or on_rim:
            side[p] = side[p] if side[p] >= THROUGH else UNKNOWN
        elif along >= 0.0:
            side[p] = FRONT
        elif side[p] == FRONT and along < -deep:
            side[p] = THROUGH + wall[element]
            gone += 1
        elif side[p] == UNKNOWN:
            side[p] = BEHIND
    return gone


class Behind:
    """Keeps the ``side`` of the points of ``bodies`` and counts those that have gone through a wall.

    surfaces: of each wall its name, positions [m], shape (n, D), motion or None, elements, shape (m, D), and
    directions to the front, shape (n, D). Collective.
    """

    def __init__(self, surfaces, h, bodies, comm):
        """h: size of a cell [m]."""
        self._bodies, self._comm, self._h, self._told = bodies, comm, h, set()
        self.names = [name for name, *_ in surfaces]
        self._moves = any(motion for _, _, motion, _, _ in surfaces)
        starts = np.cumsum([0, *(len(s[1]) for s in surfaces)])
        self._places, self._motions = [s[1] for s in surfaces], [s[2] for s in surfaces]
        self._elements = np.concatenate([s[3] + start for s, start in zip(surfaces, starts)])
        self._wall = np.repeat(np.arange(len(surfaces)), [len(s[3]) for s in surfaces])
        self._front = np.concatenate([s[4] for s in surfaces])[self._elements].sum(axis=1)
        self._rim = find_rim(np.concatenate(self._places), self._elements, h)
        self._look = specialise(look, D=self._elements.shape[1])
        self._place(0.0)
        for body in bodies:
            body.points.add(side=np.zeros(len(body.points), np.int16))
        self._update()  # where they are at the start

    def _place(self, time):
        x = np.concatenate([x if motion is None else x + motion(time)
                            for x, motion in zip(self._places, self._motions)])
        corners = x[self._elements]
        normal = normal_areas(x, self._elements)
        normal *= np.where(np.sum(normal * self._front, axis=1) < 0.0, -1.0, 1.0)[:, None]
        normal /= np.maximum(np.linalg.norm(normal, axis=1), 1e-300)[:, None]
        self._walls = WallElements(corners, normal, self._wall, self._rim)
        far = FAR * self._h
        self._bins = make_bins(corners.min(axis=1) - far, corners.max(axis=1) + far, far)

    def _update(self):
        return sum(self._look(body.points.x, self._bins, self._walls, DEEP * self._h, FAR * self._h,
                              body.points.side) for body in self._bodies)

    def __call__(self, time):
        """After a step that ends at ``time`` [s]: warn of every wall through which the first points have
        gone."""
        if self._moves:
            self._place(time)
        if somewhere(self._comm, self._update() > 0)[0]:
            self._tell(time)

    def _tell(self, time):
        for wall, count in enumerate(self.counts()):
            if count and wall not in self._told:
                self._told.add(wall)
                if self._comm.rank == 0:
                    warnings.warn(f"{count} material point{'s have' if count > 1 else ' has'} gone through "
                                  f"{self.names[wall]}, more than {DEEP} cells deep, at t = {time:.6g} s: "
                                  "take a smaller dt, smaller cells or a stiffer wall", stacklevel=2)

    def counts(self):
        """Points now behind each wall."""
        side = np.concatenate([body.points.side for body in self._bodies])
        mine = np.bincount(side[side >= THROUGH] - THROUGH, minlength=len(self.names))
        return self._comm.allreduce(mine) if self._comm.size > 1 else mine


def find_rim(x, elements, h):
    """Whether a surface ends at each corner of its elements, and at the edge opposite, shape (m, D, 2).
    Particles in one place are one."""
    place = np.unique(np.round(x / (1e-6 * h)).astype(np.int64), axis=0,
                      return_inverse=True)[1].ravel()[elements]
    D = elements.shape[1]
    facets = np.stack([np.delete(place, a, axis=1) for a in range(D)], axis=1)  # opposite each corner
    facets.sort(axis=2)
    _, number, count = np.unique(facets.reshape(-1, D - 1), axis=0, return_inverse=True, return_counts=True)
    ends = (count == 1)[number.ravel()].reshape(len(elements), D)
    at_rim = np.isin(place, np.unique(facets[ends]))
    return np.stack([at_rim, ends], axis=2)


def watch(scene, background, bodies):
    """``Behind`` of a scene's ``Penalty`` and ``GridWall`` records: of those in space with a front side; None
    when there are none."""
    surfaces = []
    for condition in scene:
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
            surfaces.append((condition.name, x, motion, facets, front))
    return Behind(surfaces, background.h.max(), bodies, background.comm) if surfaces else None


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
