"""Flanks of a wall: in a crease, such as that of a valley or the corner of a box, a point touches several.

Two elements belong to different flanks where their normals differ by more than ``ANGLE``. Beside its nearest
element a point meets the nearest one of another flank that

    lies on the concave side:    each of the two is in front of the other's plane, by the places that are
                                 nearest to the point, or by the middles of the elements,
    and looks at the point:      it is seen from there within ``ANGLE`` of the normal,

and in space a third one in the same way. So at a convex edge a point has one foot; on a plane or a smooth
surface, in however many elements, too, as what lies at another angle does not look at it. The gap of a
further foot is measured to its nearest place, by which it comes and goes without a jump: where a ball that
touches one flank loses sight of the other, it is no longer touched.

A foot keeps its memory, force and gap along the wall, in one of the slots of the point. Slots go to feet by
the normals of the elements that they had last: from element to element of a flank, and from flank to flank
where the point has but one foot.
"""
from typing import NamedTuple

import numpy as np

from ..compiled import called, specialise
from ..points.bins import Bins, bin_of
from ..points.closest import closest
from .placed_surface import normals
from .wall_surfaces import TIE, WallElements

ANGLE = 15.0  # [degrees]
ALIKE = float(np.cos(np.radians(ANGLE)))
HALF_ALIKE = float(np.cos(np.radians(0.5 * ANGLE)))
D, S = 2, 2  # dimensions, most feet of a point on one wall; fixed by specialise


class Seen(NamedTuple):
    """Of the feet of one point, at most S: ``element`` (S,); ``weight`` (S, D), barycentric coordinates of
    its place there; ``arm`` (S, D), from there to the point [m]; ``along`` (S,), of that along the normal
    [m]; ``work`` (3, D), room."""

    element: np.ndarray
    weight: np.ndarray
    arm: np.ndarray
    along: np.ndarray
    work: np.ndarray


@called
def dot(a, b):
    """Of two vectors."""
    s = 0.0
    for i in range(len(a)):
        s += a[i] * b[i]
    return s


@called
def in_front(x, corners, arm, along, normal):
    """Distance of an element with ``corners`` (D, D) in front of the plane with a ``normal`` that the point
    at x is ``along`` before [m]: of its place nearest to the point, by its ``arm``, or of its middle."""
    middle = along
    for i in range(len(normal)):
        for a in range(len(normal)):
            middle += (corners[a, i] - x[i]) * normal[i] / len(normal)
    return max(along - dot(arm, normal), middle)


def is_other(p, x, e, count, elements: WallElements, held, seen: Seen):
    """Whether element e, whose place is number ``count`` of those ``seen``, is another flank than the first
    ``count``, on the concave side of each, and looks at the point. held: elements of the slots, (n, S)."""
    corners, normal = elements.corners, elements.normal
    arm, along = seen.arm[count], seen.along[count]
    if abs(along) < ALIKE * np.sqrt(dot(arm, arm)):
        return False
    if along < 0.0:  # only a flank that it was in front of pushes it back
        known = False
        for s in range(S):
            if held[p, s] >= 0 and dot(normal[held[p, s]], normal[e]) > ALIKE:
                known = True
        if not known:
            return False
    least = TIE * np.sqrt(dot(seen.arm[0], seen.arm[0]))
    for k in range(count):
        f = seen.element[k]
        if in_front(x[p], corners[e], arm, seen.along[k], normal[f]) <= least:
            return False
        if in_front(x[p], corners[f], seen.arm[k], along, normal[e]) <= least:
            return False
    return True


def too_far(p, x, corner, normal, best):
    """Whether an element cannot look at point p, or not from nearer than the root of ``best``, by its plane
    and the distance of its first ``corner``, (D, D): cheaper than its nearest place."""
    ahead, away, size = 0.0, 0.0, 0.0
    for i in range(D):
        r = x[p, i] - corner[0, i]
        ahead += r * normal[i]
        away += r * r
    for a in range(1, D):
        edge = 0.0
        for i in range(D):
            edge += (corner[a, i] - corner[0, i]) ** 2
        size = max(size, edge)
    within = abs(ahead) / ALIKE + np.sqrt(size)
    return ahead * ahead >= best * (1.0 - TIE) or away > within * within * (1.0 + TIE)


def next_flank(p, x, bins: Bins, elements: WallElements, count, held, seen: Seen):
    """Put the nearest element of another flank than the first ``count`` that are ``seen`` of point p there,
    with its place. Returns whether there is one. x (n, D) [m]; held: see ``is_other``."""
    start, items = bins.start, bins.items
    corners, normal = elements.corners, elements.normal
    b, best, found = bin_of(p, x, bins, D), np.inf, -1
    weight, arm = seen.weight[count], seen.arm[count]
    for item in range(start[b], start[b + 1]):
        e, other = items[item], True
        for k in range(count):
            agree = 0.0
            for i in range(D):
                agree += normal[seen.element[k], i] * normal[e, i]
            other = other and agree <= ALIKE
        if not other or too_far(p, x, corners[e], normal[e], best):
            continue
        closest(x[p], corners[e], D, weight, seen.work)
        for i in range(D):
            arm[i] = x[p, i]
            for a in range(D):
                arm[i] -= weight[a] * corners[e, a, i]
        square, seen.along[count] = dot(arm, arm), dot(arm, normal[e])
        if square < best * (1.0 - TIE) and is_other(p, x, e, count, elements, held, seen):
            best, found = square, e
    if found < 0:
        return False
    seen.element[count] = found
    closest(x[p], corners[found], D, weight, seen.work)
    for i in range(D):
        arm[i] = x[p, i]
        for a in range(D):
            arm[i] -= weight[a] * corners[found, a, i]
    seen.along[count] = dot(arm, normal[found])
    return True


def share_slots(p, count, normal, held, seen: Seen, slot):
    """Fill ``slot`` (S,) for the first ``count`` that are ``seen`` of point p: the pair of foot and slot
    whose normals agree best comes first, empty slots come last."""
    for k in range(count):
        slot[k] = -1
    for _ in range(count):
        best, foot, place = -3.0, -1, -1
        for k in range(count):
            for s in range(S):
                free = slot[k] < 0
                for other in range(count):
                    free = free and slot[other] != s
                if not free:
                    continue
                agree = dot(normal[seen.element[k]], normal[held[p, s]]) if held[p, s] >= 0 else -2.0
                if agree > best:
                    best, foot, place = agree, k, s
        slot[foot] = place


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
    feet of a point there; ``bins``: mask of those of the wall as last placed, empty when ``most`` is 1."""

    def __init__(self, wall):
        self._wall, self.bins = wall, np.zeros(0, bool)
        dim = wall.walls.normal.shape[1]
        self._find = specialise(find_creased, D=dim)
        # one that deforms may become a valley
        self.most = dim if wall.deforms or has_creases(wall.surfaces[0], wall.far) else 1
        self.place()

    def place(self):
        """After the wall has been placed."""
        if self.most > 1:
            self.bins = np.empty(len(self._wall.bins.start) - 1, bool)
            self._find(self._wall.bins, self._wall.walls.normal, self.bins)


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
