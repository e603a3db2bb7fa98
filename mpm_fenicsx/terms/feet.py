"""Feet of material points: where they meet a wall, and the basis there."""
from typing import NamedTuple

import numpy as np

from ..points.bins import Bins
from .springs import CLOSED, Answer, Springs, spring_matrix
from .stencil_form import find_offsets
from .wall_surfaces import WallElements, nearest

D, K = 2, 4  # fixed by specialise
SMOOTH = False  # whether the points have a smooth basis
BEHIND, UNKNOWN, FRONT = -1, 0, 1  # sides of a wall


class Feet(NamedTuple):
    """Where m points have their feet, see ``surface_contact``: ``point`` (m,), number of the point;
    ``element`` (m,), the nearest of the wall, and ``weight`` (m, D), the barycentric coordinates there;
    ``normal`` (m, D); ``reach`` (m,), r [m]; ``gap`` (m,), g_n [m]."""

    point: np.ndarray
    element: np.ndarray
    weight: np.ndarray
    normal: np.ndarray
    reach: np.ndarray
    gap: np.ndarray

    @staticmethod
    def room(n, dim):
        """For as many as n."""
        whole = lambda: np.empty(n, np.int64)
        return Feet(whole(), whole(), np.empty((n, dim)), np.empty((n, dim)), np.empty(n), np.empty(n))


class ThickPoints(NamedTuple):
    """n points at x (n, D) [m] with half-widths ``half`` (n, D) [m]; ``sunk`` (n,), by which each reached
    into a wall at the start [m], where it was by intent."""

    x: np.ndarray
    half: np.ndarray
    sunk: np.ndarray


def find_feet(points: ThickPoints, bins: Bins, elements: WallElements, far, side, feet: Feet):
    """Fill ``feet`` with those of the points in front of one wall; returns how many. side: (n,), of the wall,
    on which each point was; brought up to date."""
    x, half, sunk = points
    point, element, weight, normal, reach, gap = feet
    trial, work, place = np.empty(D), np.empty((3, D)), np.empty(D)
    count = 0
    for p in range(len(x)):
        e, square, along, on_rim = nearest(p, x, bins, elements, far, trial, place, work)
        if e < 0:
            side[p] = UNKNOWN
            continue
        r = 0.0
        for i in range(D):
            r += (elements.normal[e, i] * half[p, i]) ** 2
        r = np.sqrt(r) - sunk[p]
        if on_rim and square - along * along > r * r:
            side[p] = UNKNOWN
            continue
        if along >= 0.0:
            side[p] = FRONT
        elif side[p] == UNKNOWN:
            side[p] = BEHIND
        if side[p] != FRONT:
            continue
        point[count], element[count], reach[count], gap[count] = p, e, r, along - r
        for i in range(D):
            weight[count, i], normal[count, i] = place[i], elements.normal[e, i]
        count += 1
    return count


class FootBasis(NamedTuple):
    """Of m feet: ``element`` (m,) of the point, with its ``nodes`` (elements, K); values ``across`` the wall,
    the point's, and ``along`` it, the foot's, both (m, K); ``normal`` (m, D)."""

    element: np.ndarray
    nodes: np.ndarray
    across: np.ndarray
    along: np.ndarray
    normal: np.ndarray


def foot_basis(feet: Feet, N, G, across, along):
    """Fill both, see ``FootBasis``, from values N (n, K) and gradients G (n, K, D) at the points."""
    point, _, _, normal, reach, _ = feet
    for q in range(len(point)):
        for a in range(K):
            s = 0.0
            for i in range(D):
                s += normal[q, i] * G[point[q], a, i]
            across[q, a] = N[point[q], a]
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


def spread_feet(basis: FootBasis, force, nodal):
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
        c = element[q]
        spring_matrix(answer.gap[q], normal[q], springs.limit[q], answer.status[q], C)
        push = 1.0 if answer.status[q] >= CLOSED else 0.0
        for a in range(K):
            for b in range(K):
                w = springs.lead * springs.stiffness[q]
                rub = w * along[q, a] * along[q, b]
                push_more = push * (w * across[q, a] * across[q, b] - rub)
                if rub == 0.0 and push_more == 0.0:
                    continue
                for i in range(D):
                    for k in range(D):
                        s = rub * C[i, k] + push_more * normal[q, i] * normal[q, k]
                        if SMOOTH:
                            matrices[nodes[c, a], (5**D - 1) // 2 + offset[b] - offset[a], i, k] += s
                        else:
                            matrices[row[c], b, k, i, a] += s
