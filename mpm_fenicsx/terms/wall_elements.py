"""Elements of walls, segments or triangles: which one a place is nearest to, and where their surface ends."""
from typing import NamedTuple

import numpy as np

from ..compiled import called
from ..points.box_tree import LEAF, ROOM, BoxTree, descend, square_from
from ..points.closest import closest
from ..scene.facets import alike, same_places

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


class Room(NamedTuple):
    """For a search: ``weight`` (D,), ``work`` (3, D), and ``stack`` (ROOM,) of nodes."""

    weight: np.ndarray
    work: np.ndarray
    stack: np.ndarray


@called
def make_room(dim):
    """For searches in so many dimensions."""
    return Room(np.empty(dim), np.empty((3, dim)), np.empty(ROOM, np.int64))


def nearest(p, x, tree: BoxTree, elements: WallElements, far, best_weight, room: Room):
    """Element nearest to point p of x, shape (n, D), within ``far`` [m], or -1; its distance squared; the
    distance along the element's normal; whether the wall ends where it is nearest. best_weight, shape (D,):
    barycentric coordinates of that place."""
    order, leaves = tree.order, tree.leaves
    weight, work, stack = room
    corners, normal, wall, rim = elements
    best, along, element, top = far * far, 0.0, -1, 1
    stack[0] = 1
    while top > 0:
        top -= 1
        node = stack[top]
        if square_from(p, x, tree, node, D) > best * (1.0 + TIE):
            continue
        if node < leaves:
            top = descend(p, x, tree, node, top, stack, D)
            continue
        for item in range(LEAF * (node - leaves), min(LEAF * (node - leaves + 1), len(order))):
            e = order[item]
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
                if abs(ahead) < abs(along) * (1.0 - TIE):
                    continue
                if abs(ahead) <= abs(along) * (1.0 + TIE):
                    opposite = (ahead < 0.0) != (along < 0.0)
                    if (opposite and ahead < along) or (not opposite and e < element):
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
