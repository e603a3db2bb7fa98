"""Feet of material points: where they meet a wall, and the basis there."""
from typing import NamedTuple

import numpy as np

from ..compiled import specialise
from ..points.box_tree import BoxTree
from .flanks import Seen, Slots, all_agree, find_arm, is_other, next_flank, share_slots, too_far
from .springs import CLOSED, FREE, Answer, Springs, spring_matrix
from .stencil_form import find_offsets
from .wall_elements import WallElements, make_room, nearest

D, K, S = 2, 4, 1  # fixed by specialise; S: most feet of a point on one wall
SMOOTH = False  # whether the points have a smooth basis
WIDEST = float(np.sqrt(3.0))  # reach of a point in parts of its largest half-width, at most
DEFORMS = 0.5  # most by which the reach of a point changes, in parts of it
BEHIND, UNKNOWN, FRONT = -1, 0, 1  # sides of a wall


class Feet(NamedTuple):
    """m feet of points, see ``surface_contact``: ``point`` (m,), number of the point; ``slot`` (m,), of
    the point, that keeps their state; ``element`` (m,), the nearest of the flank, and ``weight`` (m, D), the
    barycentric coordinates there; ``normal`` (m, D); ``reach`` (m,), r [m]; ``gap`` (m,), g_n [m]."""

    point: np.ndarray
    slot: np.ndarray
    element: np.ndarray
    weight: np.ndarray
    normal: np.ndarray
    reach: np.ndarray
    gap: np.ndarray

    @staticmethod
    def room(n, dim):
        """For as many as n."""
        whole, real = (lambda: np.empty(n, np.int64)), (lambda *shape: np.empty((n, *shape)))
        return Feet(whole(), whole(), whole(), real(dim), real(dim), real(), real())


class ThickPoints(NamedTuple):
    """n points at x (n, D) [m] with half-widths ``half`` (n, D) [m]; ``sunk`` (n,), by which each reached
    into a wall at the start [m], where it was by intent."""

    x: np.ndarray
    half: np.ndarray
    sunk: np.ndarray


def find_feet(points: ThickPoints, tree: BoxTree, elements: WallElements, reach, side, slots: Slots,
              feet: Feet):
    """Fill ``feet`` with those of the points in front of one wall; returns how many. reach: how far points
    look for the wall, and largest gap of a foot [m]; side: (n,), of the wall, on which each point was;
    brought up to date."""
    x, half, sunk = points
    far, near = reach
    room, of_foot = make_room(D), np.empty(S, np.int64)
    seen = Seen(np.empty(S, np.int64), np.empty((S, D)), np.empty((S, D)), np.empty(S), room.work, room.stack)
    count = 0
    for p in range(len(x)):
        e, square, along, on_rim = nearest(p, x, tree, elements, far, seen.weight[0], room)
        if e < 0:
            side[p] = UNKNOWN
            continue
        r = reach_of(p, points, elements.normal[e])
        if on_rim and square - along * along > r * r:
            side[p] = UNKNOWN
            continue
        if along >= 0.0:
            side[p] = FRONT
        elif side[p] == UNKNOWN:
            side[p] = BEHIND
        if side[p] != FRONT:
            continue
        seen.element[0], seen.along[0], found, of_foot[0] = e, along, 1, 0
        most = near  # distance of a further foot: its gap is less than near
        for i in range(D):
            most = max(most, near + WIDEST * points.half[p, i])
        if S > 1 and square < most * most:
            for i in range(D):
                seen.arm[0, i] = x[p, i]
                for a in range(D):
                    seen.arm[0, i] -= seen.weight[0, a] * elements.corners[e, a, i]
            while found < S and next_flank(p, x, tree, elements, most, found, slots, seen):
                found += 1
        if S > 1:
            share_slots(p, found, elements.normal, slots.element, seen, of_foot)
        for k in range(found):
            add_foot(p, points, elements.normal, seen, k, count, feet)
            feet.slot[count] = of_foot[k]
            if feet.gap[count] < near:
                count += 1
    return count


def reach_of(p, points: ThickPoints, normal):
    """Of point p toward a wall with a ``normal`` [m]."""
    r = 0.0
    for i in range(D):
        r += (normal[i] * points.half[p, i]) ** 2
    return np.sqrt(r) - points.sunk[p]


def add_foot(p, points: ThickPoints, normal, seen: Seen, k, q, feet: Feet):
    """Foot k of point p becomes number q of the ``feet``."""
    e, distance = seen.element[k], seen.along[k]
    if k > 0:
        square = 0.0
        for i in range(D):
            square += seen.arm[k, i] ** 2
        distance = np.sqrt(square) if distance >= 0.0 else -np.sqrt(square)
    feet.point[q], feet.element[q], feet.reach[q] = p, e, reach_of(p, points, normal[e])
    feet.gap[q] = distance - feet.reach[q]
    for i in range(D):
        feet.weight[q, i], feet.normal[q, i] = seen.weight[k, i], normal[e, i]


def finder(dim, most):
    """``find_feet`` for at most so many feet of each point on one wall."""
    size = dict(D=dim, S=most)
    reach = specialise(reach_of, D=dim)
    add = specialise(add_foot, D=dim, reach_of=reach)
    another = specialise(next_flank, **size, is_other=specialise(is_other, S=most),
                         too_far=specialise(too_far, D=dim), find_arm=specialise(find_arm, D=dim),
                         all_agree=specialise(all_agree, D=dim))
    return specialise(find_feet, **size, reach_of=reach, add_foot=add, nearest=specialise(nearest, D=dim),
                      next_flank=another, share_slots=specialise(share_slots, S=most))


def deform(feet: Feet, kept, pressed):
    """Give the ``feet`` the reach that their points have. r deforms with the strain across the wall while the
    wall presses on the point, a mask (m,), from that of a point alone: by ``kept`` so far [m], (m,). Strain
    changes it the less the more it has changed, and never by more than ``DEFORMS``, as soil flows without
    end. A point that is no longer pressed gets its reach back as the wall makes room.

    Returns by how much it has changed, and the length that deforms, both (m,) [m]."""
    most = DEFORMS * feet.reach
    recovered = np.minimum(np.maximum(kept, np.minimum(feet.gap, 0.0)), 0.0)
    changed = np.clip(np.where(pressed, kept, recovered), -most, most)
    deforming = feet.reach - abs(changed) / DEFORMS
    feet.reach[:] += changed
    feet.gap[:] -= changed
    return changed, deforming


class FootBasis(NamedTuple):
    """Of m feet: ``element`` (m,) of the point, with its ``nodes`` (elements, K); values ``across`` the wall,
    where the reach deforms, and ``along`` it, the foot's, both (m, K); ``normal`` (m, D)."""

    element: np.ndarray
    nodes: np.ndarray
    across: np.ndarray
    along: np.ndarray
    normal: np.ndarray


def foot_basis(feet: Feet, deforming, N, G, across, along):
    """Fill both, see ``FootBasis``, from values N (n, K) and gradients G (n, D, K) at the points; deforming:
    length that takes part in the strain across the wall [m], (m,)."""
    point, normal, reach = feet.point, feet.normal, feet.reach
    for q in range(len(point)):
        for a in range(K):
            s = 0.0
            for i in range(D):
                s += normal[q, i] * G[point[q], i, a]
            across[q, a] = N[point[q], a] - deforming[q] * s
            along[q, a] = N[point[q], a] - reach[q] * s


def follow(basis: FootBasis, factor, nodal, values):
    """Add to ``values``, (m, D), ``factor`` times what the feet do in the field with ``nodal`` values,
    (nodes, D)."""
    element, nodes, across, along, normal = basis
    for q in range(len(element)):
        ahead = 0.0
        for a in range(K):
            for i in range(D):
                value = factor * nodal[nodes[element[q], a], i]
                values[q, i] += along[q, a] * value
                ahead += (across[q, a] - along[q, a]) * normal[q, i] * value
        for i in range(D):
            values[q, i] += ahead * normal[q, i]


def spread(basis: FootBasis, force, nodal):
    """The transpose: subtract the ``force`` on the feet, (m, D) [N], from the nodes' ``nodal``, (nodes,
    D)."""
    element, nodes, across, along, normal = basis
    for q in range(len(element)):
        pushed = 0.0
        for i in range(D):
            pushed += force[q, i] * normal[q, i]
        for a in range(K):
            for i in range(D):
                nodal[nodes[element[q], a], i] -= along[q, a] * force[q, i] + (
                    across[q, a] - along[q, a]) * pushed * normal[q, i]


def tangent(basis: FootBasis, row, springs: Springs, answer: Answer, matrices):
    """Add -df/du of the feet to the ``matrices`` of the points, see ``active_cells``: those of elements, with
    their ``row``, or with SMOOTH the rows of nodes."""
    element, nodes, across, along, normal = basis
    C, offset = np.empty((D, D)), np.empty(K, np.int64)
    find_offsets(D, K, offset)
    for q in range(len(element)):
        if answer.status[q] == FREE:
            continue
        c = element[q]
        spring_matrix(answer.gap[q], normal[q], springs.limit[q], answer.status[q], C)
        push = 1.0 if answer.status[q] >= CLOSED else 0.0
        w = springs.lead * springs.stiffness[q]
        for b in range(K):
            for k in range(D):
                for i in range(D):
                    nn = push * normal[q, i] * normal[q, k]
                    s, t = w * along[q, b] * (C[i, k] - nn), w * across[q, b] * nn
                    for a in range(K):
                        if SMOOTH:
                            at = (5**D - 1) // 2 + offset[b] - offset[a]
                            matrices[nodes[c, a], at, i, k] += along[q, a] * s + across[q, a] * t
                        else:
                            matrices[row[c], b, k, i, a] += along[q, a] * s + across[q, a] * t
