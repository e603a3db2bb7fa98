"""Feet of material points: where they meet a wall, and the basis there."""
from typing import NamedTuple

import numpy as np

from ..points.bins import Bins
from .springs import Answer, Springs, spring_matrix
from .stencil_form import find_offsets
from .wall_surfaces import WallElements, nearest

D, K = 2, 4  # fixed by specialise
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


class Thickness(NamedTuple):
    """Of n points: half-widths ``half`` at rest (n, D) [m], deformation ``F`` (n, D, D); ``skin`` (n,), by
    which a point reached into a wall at the start [m], where it was by intent; ``most`` that one reaches
    [m]."""

    half: np.ndarray
    F: np.ndarray
    skin: np.ndarray
    most: float


def find_feet(x, thickness: Thickness, bins: Bins, elements: WallElements, far, side, feet: Feet):
    """Fill ``feet`` with those of the points at x [m], shape (n, D), in front of one wall; returns how many.
    side: (n,), of the wall, on which each point was; brought up to date."""
    half, F, skin, most = thickness
    point, element, weight, normal, reach, gap = feet
    trial, work, place = np.empty(D), np.empty((3, D)), np.empty(D)
    count = 0
    for p in range(len(x)):
        e, square, along, on_rim = nearest(p, x, bins, elements, far, trial, place, work)
        if e < 0:
            side[p] = UNKNOWN
            continue
        r = 0.0
        for j in range(D):
            s = 0.0
            for i in range(D):
                s += F[p, i, j] * elements.normal[e, i]
            r += (s * half[p, j]) ** 2
        r = min(np.sqrt(r), most) - skin[p]
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


def foot_basis(feet: Feet, N, G, at_foot):
    """Fill at_foot (m, K) with N_foot, from values N (n, K) and gradients G (n, K, D) at the points."""
    point, _, _, normal, reach, _ = feet
    for q in range(len(point)):
        for a in range(K):
            s = 0.0
            for i in range(D):
                s += normal[q, i] * G[point[q], a, i]
            at_foot[q, a] = N[point[q], a] - reach[q] * s


def stencil_tangent(element, nodes, N, springs: Springs, answer: Answer, rows):
    """As ``springs.tangent``, to the ``rows`` of nodes, see ``stencil_form``."""
    normal, stiffness, limit = springs.normal, springs.stiffness, springs.limit
    C, offset = np.empty((D, D)), np.empty(K, np.int64)
    find_offsets(D, K, offset)
    for p in range(len(element)):
        c = element[p]
        spring_matrix(answer.gap[p], normal[p], limit[p], answer.status[p], C)
        for a in range(K):
            for b in range(K):
                w = springs.lead * stiffness[p] * N[p, a] * N[p, b]
                if w != 0.0:
                    block = rows[nodes[c, a], (5**D - 1) // 2 + offset[b] - offset[a]]
                    for i in range(D):
                        for k in range(D):
                            block[i, k] += w * C[i, k]
