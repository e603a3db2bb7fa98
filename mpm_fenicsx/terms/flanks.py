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

from ..compiled import called
from ..points.box_tree import LEAF, BoxTree, descend, square_from
from ..points.closest import closest
from .wall_elements import TIE, WallElements

ANGLE = 15.0  # [degrees]
ALIKE = float(np.cos(np.radians(ANGLE)))
ASIDE = float(np.tan(np.radians(ANGLE)))
HALF_ALIKE = float(np.cos(np.radians(0.5 * ANGLE)))
D, S = 2, 2  # dimensions, most feet of a point on one wall; fixed by specialise


class Seen(NamedTuple):
    """Of the feet of one point, at most S: ``element`` (S,); ``weight`` (S, D), barycentric coordinates of
    its place there; ``arm`` (S, D), from there to the point [m]; ``along`` (S,), of that along the normal
    [m]; ``work`` (3, D) and ``stack`` (ROOM,), room."""

    element: np.ndarray
    weight: np.ndarray
    arm: np.ndarray
    along: np.ndarray
    work: np.ndarray
    stack: np.ndarray


class Turns(NamedTuple):
    """Least and greatest components of the normals below each node of the tree of a wall, see ``BoxTree``."""

    lower: np.ndarray
    upper: np.ndarray


class Slots(NamedTuple):
    """What the S slots of n points know of one wall: ``element`` (n, S), in which each had its foot, or -1;
    ``turns`` of the wall's normals. Both are empty when S is 1."""

    element: np.ndarray
    turns: Turns


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
    and a sphere around the middle of its corners, (D, D): cheaper than its nearest place. What looks at the
    point is seen within ``ANGLE`` of the normal, so no farther beside it than the distance allows."""
    ahead, away, size = 0.0, 0.0, 0.0
    for i in range(D):
        middle = 0.0
        for a in range(D):
            middle += corner[a, i] / D
        r = x[p, i] - middle
        ahead += r * normal[i]
        away += r * r
        for a in range(D):
            size += (D - 1) / D * (corner[a, i] - middle) ** 2  # no corner is farther: they add up to none
    within = ASIDE * abs(ahead) + np.sqrt(size)
    return ahead * ahead > best * (1.0 + TIE) or away * (1.0 - TIE) > ahead * ahead + within * within


def next_flank(p, x, tree: BoxTree, elements: WallElements, far, count, slots: Slots, seen: Seen):
    """Put the nearest element of another flank than the first ``count`` that are ``seen`` of point p there,
    with its place, if it is within ``far`` [m]. Returns whether there is one. x: (n, D) [m]."""
    order, leaves = tree.order, tree.leaves
    corners, normal = elements.corners, elements.normal
    best, found, top = far * far, -1, 1
    weight, arm, stack = seen.weight[count], seen.arm[count], seen.stack
    stack[0] = 1
    while top > 0:
        top -= 1
        node = stack[top]
        too_far_away = square_from(p, x, tree, node, D) > best * (1.0 + TIE)
        if too_far_away or all_agree(slots.turns, node, normal, count, seen):
            continue
        if node < leaves:
            top = descend(p, x, tree, node, top, stack, D)
            continue
        for item in range(LEAF * (node - leaves), min(LEAF * (node - leaves + 1), len(order))):
            e, other = order[item], True
            for k in range(count):
                agree = 0.0
                for i in range(D):
                    agree += normal[seen.element[k], i] * normal[e, i]
                other = other and agree <= ALIKE
            if not other or too_far(p, x, corners[e], normal[e], best):
                continue
            find_arm(p, x, corners[e], weight, arm, seen.work)
            square, seen.along[count] = dot(arm, arm), dot(arm, normal[e])
            if square > best * (1.0 + TIE) or (found >= 0 and square >= best * (1.0 - TIE) and e > found):
                continue
            if is_other(p, x, e, count, elements, slots.element, seen):
                best, found = square, e
    if found < 0:
        return False
    seen.element[count] = found
    find_arm(p, x, corners[found], weight, arm, seen.work)
    seen.along[count] = dot(arm, normal[found])
    return True


def all_agree(turns: Turns, node, normal, count, seen: Seen):
    """Whether all elements below a ``node`` are of the flank of one of the first ``count`` that are seen."""
    for k in range(count):
        least = 0.0
        for i in range(D):
            n = normal[seen.element[k], i]
            least += min(n * turns.lower[node, i], n * turns.upper[node, i])
        if least > ALIKE:
            return True
    return False


def find_arm(p, x, corners, weight, arm, work):
    """Fill ``weight`` and ``arm``, (D,) each, of the place of an element with these ``corners`` that is
    nearest to point p, see ``Seen``."""
    closest(x[p], corners, D, weight, work)
    for i in range(D):
        arm[i] = x[p, i]
        for a in range(D):
            arm[i] -= weight[a] * corners[a, i]


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
