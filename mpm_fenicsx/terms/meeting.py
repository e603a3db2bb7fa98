"""Where the points of one body meet those of another: normals and gaps from the points of both, on the nodes
that both reach, see ``body_contact``.

The sum over a body's points of V grad N_i is the integral of N_i over its surface, times the outward normal.
Of a node that two bodies reach it gives three directions from one to the other: against that of the first,
along that of the second, and along their difference. Each is tried: of all points near the node, how far do
those of either body reach along it, half-widths and all, and which gap is left between the two? The direction
with the widest gap separates them best (as separating axes do for convex bodies), and the search goes on with
others around it: of a block's edge on flat ground it finds the normal of the ground. A direction that is off
by an angle sees what lies beside a node as higher by that angle times the cell."""
from typing import NamedTuple

import numpy as np

D, K = 2, 4  # fixed by specialise
DIRECTIONS = 3  # to try at a time, as many in the plane; fixed by specialise
TILTS = 0.4 / 3.0 ** np.arange(5)  # by which others are tried, one after the other [rad]
BETTER = 1e-6  # cells, by which a direction must leave a wider gap than those before it
NONE = -1e300  # nothing reaches a node


class NearPoints(NamedTuple):
    """n points of a body near another one: ``cell`` (n,); ``x`` (n, D) and ``half``-widths (n, D) [m]; basis
    values ``N`` (n, K) and gradients ``G`` (n, K, D) [1/m] of the linear basis."""

    cell: np.ndarray
    x: np.ndarray
    half: np.ndarray
    N: np.ndarray
    G: np.ndarray


class Sides(NamedTuple):
    """What is known of the n nodes that both bodies reach: ``number`` (nodes,) of the nodes of the active
    cells among them, -1 of others; ``places`` (n, D) [m]; ``normals`` (n, directions, D), from the second
    body to the first; ``reach`` (n, directions), how far the points of the node's own body reach along it
    toward the other [m]."""

    number: np.ndarray
    places: np.ndarray
    normals: np.ndarray
    reach: np.ndarray


class Meetings(NamedTuple):
    """Where m points meet the other body: ``point`` (m,), its number among the near ones; ``weights`` (m, 2K)
    of the nodes of both cells, of the second one less than zero; ``normal`` (m, D) into the first body;
    ``gap`` (m,) [m]."""

    point: np.ndarray
    weights: np.ndarray
    normal: np.ndarray
    gap: np.ndarray


def outward(points: NearPoints, V, cells, number, nodal):
    """Add V grad N, V (n,) volumes [m^3], to ``nodal``, shape (n, D); number: see ``Sides``."""
    for p in range(len(points.cell)):
        for a in range(K):
            node = number[cells[points.cell[p], a]]
            if node >= 0:
                for i in range(D):
                    nodal[node, i] += V[p] * points.G[p, i, a]


def reach_out(points: NearPoints, cells, sign, sides: Sides):
    """Raise ``reach`` of the nodes to that of the points, along ``sign`` times the normals."""
    number, places, normals, reach = sides
    for p in range(len(points.cell)):
        for a in range(K):
            node = number[cells[points.cell[p], a]]
            if node < 0:
                continue
            for c in range(DIRECTIONS):
                along, square = 0.0, 0.0
                for i in range(D):
                    n = normals[node, c, i]
                    along += sign * n * (points.x[p, i] - places[node, i])
                    square += (n * points.half[p, i]) ** 2
                reach[node, c] = max(reach[node, c], along + np.sqrt(square))


def around(normals):
    """Unit vectors across the ``normals``, shape (n, D), and against these: shape (n, 2 (D - 1), D)."""
    if normals.shape[1] == 2:
        across = [np.column_stack([-normals[:, 1], normals[:, 0]])]
    else:
        axis = np.eye(3)[np.argmin(np.round(np.abs(normals), 6), axis=1)]
        first = np.cross(normals, axis)
        first /= np.linalg.norm(first, axis=1)[:, None]
        across = [first, np.cross(normals, first)]
    return np.stack([sign * t for t in across for sign in (1.0, -1.0)], axis=1)


def meet(points: NearPoints, row, pairs, sides: Sides, meetings: Meetings):
    """Fill ``meetings`` with those of the near points of the first body; returns how many. row: (cells,), of
    each cell its number among the ``pairs``, (pairs, 2K) nodes; of the directions the first one counts."""
    number, places, normals, reach = sides
    point, weights, normal, gap = meetings
    n, count = np.empty(D), 0
    for p in range(len(points.cell)):
        r = row[points.cell[p]]
        if r < 0:
            continue
        n[:], length = 0.0, 0.0
        for a in range(K):
            node = number[pairs[r, a]]
            if node >= 0:
                for i in range(D):
                    n[i] += points.N[p, a] * normals[node, 0, i]
        for i in range(D):
            length += n[i] * n[i]
        if length == 0.0:
            continue
        half, share, along = 0.0, 0.0, 0.0
        for i in range(D):
            n[i] /= np.sqrt(length)
            half += (n[i] * points.half[p, i]) ** 2
        half = np.sqrt(half)
        for a in range(K):
            node, other, w = number[pairs[r, a]], number[pairs[r, K + a]], 0.0
            if node >= 0 and other >= 0:
                w = points.N[p, a]
                for i in range(D):
                    w -= half * n[i] * points.G[p, i, a]  # at the foot
                w = max(w, 0.0)
                distance = -reach[other, 0]
                for i in range(D):
                    distance += normals[node, 0, i] * (points.x[p, i] - places[node, i])
                along += w * distance
            weights[count, a] = w
            share += w
        if share < 0.5 - 1e-9:
            continue
        for a in range(K):
            weights[count, a] /= share
            weights[count, K + a] = -weights[count, a]
        point[count], gap[count] = p, along / share - half
        for i in range(D):
            normal[count, i] = n[i]
        count += 1
    return count
