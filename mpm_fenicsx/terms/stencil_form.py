"""The tangent of the weak form with a smooth basis: as in ``weakform``, but points add to the rows of the
nodes of their stencils, see ``grid.elements``. The residual is the same one.

A node takes part in a point's share only where its function does not vanish: in half the cells along an axis
that is two nodes of three. Templates and arguments: see ``weakform``.
"""
import numpy as np

from ..compiled import inlined
from ..grid.elements import PointElements
from ..laws.algebra import determinant
from .f_bar import StepGradients, by_mean_volume, deformed_gradients, spread
from .fields import Deformation, Patches, Quadrature
from .newmark import Increment
from .weakform import pull

D, K = 2, 9
CONSISTENT, FBAR = True, False
point_tangent = None


@inlined
def find_offsets(D, K, offset):
    """Place of each node of a stencil, shape (K,), among the 5^D around any of them, less that of its
    own."""
    for e in range(K):
        rest, factor = e, 1
        offset[e] = 0
        for _ in range(D):
            offset[e] += factor * (rest % 3)
            rest, factor = rest // 3, 5 * factor


@inlined
def contract(B, g, b, D, K, y):
    """y[i, k, j] = sum_l B[i, j, k, l] g_l of node b."""
    for i in range(D):
        for k in range(D):
            for j in range(D):
                s = B[i, j, k, 0] * g[b] + B[i, j, k, 1] * g[K + b]
                if D == 3:
                    s += B[i, j, k, D - 1] * g[(D - 1) * K + b]
                y[i, k, j] = s


def tangent(points: Quadrature, elements: PointElements, old: Deformation, new: Deformation, patches: Patches,
            params, increment: Increment, rows):
    """Add the points' share to the nodes' ``rows`` [N/m], shape (nodes, 5^D, D, D), see ``active_cells``;
    with FBAR also to bulk[:, 1], push and pull."""
    element, N, G, mass, V0 = points
    nodes, _, patch, place = elements
    F_old, F33_old, old_state = old
    F, F33, new_state = new
    volume, _, bulk, push, pull_sums = patches
    dt, alpha, u = increment.dt, increment.alpha, increment.u
    P, A = np.empty(D * D + 1), np.empty((D * D + 1, D * D + 1))
    half, B, y = np.empty((D, D, D, D)), np.empty((D, D, D, D)), np.empty((D, D, D))
    forth, back, g = found = StepGradients(np.empty((D, D)), np.empty((D, D)), np.empty(D * K))
    present, offset = np.empty(K, np.int64), np.empty(K, np.int64)
    find_offsets(D, K, offset)
    own_place = (5**D - 1) // 2
    for q in range(len(element)):
        F33[q] = point_tangent(params, F[q], F33[q], dt, old_state[q], new_state[q], P, A)
        c, count = element[q], 0
        for e in range(K):
            for j in range(D):
                g[j * K + e] = G[q, e, j]
            if N[q, e] != 0.0:
                present[count] = e
                count += 1
        if FBAR:
            own = patch[c]
            grown = V0[q] * determinant(F_old[q], D) * F33_old[q]
            grown *= deformed_gradients(c, q, nodes, G, u, D, K, found)
            pull(A, F[q], V0[q], D, half, B)
            bulk[own, 1] += by_mean_volume(B, P, F[q], V0[q], grown * bulk[own, 0] / volume[own, 0], D, forth,
                                           back)
            spread(forth, g, place[c], D, K, push[own])
            spread(back, g, place[c], D, K, pull_sums[own])
        else:
            pull(A, F_old[q], V0[q], D, half, B)
        for n in range(count):
            b = present[n]
            contract(B, g, b, D, K, y)
            inertia = alpha * mass[q] * N[q, b] if CONSISTENT else 0.0
            for m in range(count):
                e = present[m]
                block = rows[nodes[c, e], own_place + offset[b] - offset[e]]
                for i in range(D):
                    for k in range(D):
                        s = inertia * N[q, e] if i == k else 0.0
                        s += y[i, k, 0] * g[e] + y[i, k, 1] * g[K + e]
                        if D == 3:
                            s += y[i, k, D - 1] * g[(D - 1) * K + e]
                        block[i, k] += s


def couple(nodes, patches: Patches, rows):
    """Add to the ``rows`` what comes of the change of j_mean, see ``f_bar``; nodes: (patches, K), of patches
    that are stencils."""
    volume, gradient, bulk, push, pull_sums = patches
    offset, back = np.empty(K, np.int64), np.empty(D)
    find_offsets(D, K, offset)
    own_place = (5**D - 1) // 2
    for row in range(len(volume)):
        if volume[row, 0] <= 0.0:
            continue
        share = 1.0 / volume[row, 0]
        for b in range(K):
            for k in range(D):
                back[k] = share * (pull_sums[row, b, k] + share * bulk[row, 1] * gradient[row, b, k])
            for e in range(K):
                block = rows[nodes[row, e], own_place + offset[b] - offset[e]]
                for i in range(D):
                    for k in range(D):
                        block[i, k] += (push[row, e, i] * share * gradient[row, b, k]
                                        + gradient[row, e, i] * back[k])
