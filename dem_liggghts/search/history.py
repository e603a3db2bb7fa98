"""Tangential history of contacts with walls: where it goes when a contact ends and another one begins."""
import numpy as np

from ..compiled import compiled
from ..scene.tables import RADIUS
from .elements import PAIR, POINT, SHARE, WEIGHT, closest, corners_of

# Distance, as a fraction of the radius, within which a contact goes on: twice the way of the longest step
CLOSE = 0.1


@compiled
def transfer_history(query, i, p, radius, kept):
    """Bring the tangential history of sphere i at p [m] up to date with its contacts, ``kept`` rows of
    query.found.

    A contact that is new takes the history of the nearest one within `CLOSE` that has just ended, on whatever
    element or wall, or with which it shares the force: the sphere rolled or slid across an edge or a seam.
    LIGGGHTS does this between coplanar neighbours (FixContactHistoryMesh::handleContact); here it holds for
    ridges too, where the normal turns without a jump. Discs are contacts of their own.
    """
    near, wall, found, corner = query.near, query.wall, query.found, query.corner
    first, last, nodes = near.start[i], near.start[i + 1], wall.elements.shape[1]
    weight, point = found[kept, WEIGHT:WEIGHT + 3], found[kept, POINT:POINT + 3]  # a row not in use
    for k in range(kept):
        q, nearest2 = int(found[k, PAIR]), (CLOSE * radius) ** 2
        if near.active[q] or wall.traits[near.partner[q], RADIUS] > 0.0:
            continue
        for o in range(first, last):
            if not near.active[o] or wall.traits[near.partner[o], RADIUS] > 0.0 or \
                    (found[k, SHARE] == 1.0 and _is_contact(found, kept, o)):
                continue
            corners_of(wall, near.partner[o], query.t, corner)
            closest(corner, nodes, p, weight, point)
            distance2 = 0.0
            for c in range(3):
                distance2 += (found[k, POINT + c] - point[c]) ** 2
            if distance2 <= nearest2:
                near.shear[q], nearest2 = near.shear[o], distance2
    for o in range(first, last):
        near.active[o] = _is_contact(found, kept, o)
        if not near.active[o]:
            near.shear[o] = 0.0


@compiled
def _is_contact(found, kept, q):
    for k in range(kept):  # noqa: SIM110 - a generator does not compile
        if found[k, PAIR] == q:
            return True
    return False


@compiled
def by_number(near, first, new):
    """Partners in the list ``near`` when discs from the element ``first`` on are renumbered: each gets the
    number ``new``, shape (discs,), from there on, -1 where it is gone."""
    partner = near.partner.copy()
    for q in range(len(partner)):
        if partner[q] >= first:
            number = new[partner[q] - first]
            partner[q] = first + number if number >= 0 else -1
    return partner


@compiled
def on_new_wall(near, x, wall, first, new):
    """Partners in the list ``near`` when the elements from ``first`` on, those of ``wall``, are replaced by
    those of ``new``: the element closest to where the sphere touched takes its history, without contact there
    is none."""
    corner, weight, point, nodes = np.empty((3, 3)), np.empty(3), np.empty(3), wall.elements.shape[1]
    partner = near.partner.copy()
    for i in range(len(near.start) - 1):
        for q in range(near.start[i], near.start[i + 1]):
            if near.partner[q] < first:
                continue
            partner[q], shortest = -1, np.inf
            if not near.active[q]:
                continue
            corners_of(wall, near.partner[q] - first, 0.0, corner)
            closest(corner, nodes, x[i], weight, point)
            touched = x[i] + point
            for e in range(len(new.elements)):
                corners_of(new, e, 0.0, corner)
                r = closest(corner, nodes, touched, weight, point)[0]
                if r < shortest:
                    partner[q], shortest = first + e, r
    return partner
