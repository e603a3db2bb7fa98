"""The tangent of the weak form with a smooth basis: as in ``weakform``, but points add to the rows of the
nodes of their stencils, see ``grid.elements``. The residual is the same one.

A node takes part in a point's share only where its function does not vanish: in half the cells along an axis
that is two nodes of three. Templates and arguments: see ``weakform``.
"""
from typing import NamedTuple

import numpy as np

from ..compiled import inlined
from ..grid.elements import PointElements
from ..laws.algebra import determinant
from ..laws.batches import SIZE
from .f_bar import by_mean_volume, new_gradients
from .fields import Deformation, Patches, Quadrature
from .groups import gather
from .newmark import Increment
from .weakform import time_of_law

D, K = 2, 9
CONSISTENT, FBAR = True, False
deformed_gradients = batch_tangent = new_tangent_work = None


class Present(NamedTuple):
    """Of one point, the nodes whose functions do not vanish: ``index`` (K,) in the stencil; ``value`` (K,)
    and ``gradient`` (K, D) [1/m] of these; ``place`` (K,) of a node's row in the rows laid flat, at the block
    of a node with ``shift`` 0, and ``shift`` (K,) from there to the block of each."""

    index: np.ndarray
    value: np.ndarray
    gradient: np.ndarray
    place: np.ndarray
    shift: np.ndarray


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
def find_present(N, g, of_element, offset, D, K, present):
    """Fill ``present`` from basis values N (K,) and gradients g (D K,); returns the number of nodes."""
    index, value, gradient, place, shift = present
    count = 0
    for e in range(K):
        if N[e] != 0.0:
            index[count], value[count] = e, N[e]
            for j in range(D):
                gradient[count, j] = g[j * K + e]
            place[count] = (5**D * of_element[e] + (5**D - 1) // 2 - offset[e]) * D * D
            shift[count] = offset[e] * D * D
            count += 1
    return count


@inlined
def spread(S, count, present, D, forces):
    """Add S g to the ``forces`` of a patch, shape (D, K)."""
    for n in range(count):
        for i in range(D):
            s = 0.0
            for j in range(D):
                s += S[i, j] * present.gradient[n, j]
            forces[i, present.index[n]] += s


@inlined
def add_block(y, gradient, inertia, D, block):
    """Add to the ``block`` (D D,) of a pair of nodes y (D, D D), contracted with the ``gradient`` (D,), and
    ``inertia``. Sums first, as stores into one array keep LLVM from holding the other in registers."""
    for i in range(D):
        first = inertia if i == 0 else 0.0
        second = inertia if i == 1 else 0.0
        third = inertia if i == 2 else 0.0
        for j in range(D):
            first += y[j, D * i] * gradient[j]
            second += y[j, D * i + 1] * gradient[j]
            if D == 3:
                third += y[j, D * i + D - 1] * gradient[j]
        block[D * i] += first
        block[D * i + 1] += second
        if D == 3:
            block[D * i + D - 1] += third


@inlined
def add_point(B, count, present, inertia, y, D, flat):
    """Add the share of a point to the rows, ``flat``: those of its ``count`` nodes that are present. inertia:
    alpha m [N/m]; y (D, D D): work."""
    _, value, gradient, place, shift = present
    size = np.uint64(D * D)  # indices without a sign save the test whether they count from the end
    for b in range(count):
        for i in range(D):
            for k in range(D):
                for j in range(D):
                    s = 0.0
                    for n in range(D):
                        s += B[i, j, k, n] * gradient[b, n]
                    y[j, D * i + k] = s
        for e in range(count):
            start = place[e] + shift[b]
            add_block(y, gradient[e], inertia * value[b] * value[e], D, flat[start:start + size])


def tangent(points: Quadrature, elements: PointElements, old: Deformation, new: Deformation, patches: Patches,
            params, increment: Increment, rows):
    """Add the points' share to the nodes' ``rows`` [N/m], shape (nodes, 5^D, D, D), see ``active_cells``;
    with FBAR also to bulk[:, 1], push and pull."""
    element, N, G, mass, V0, order = points
    nodes = elements.nodes
    volume, _, bulk, push, pull_sums = patches
    dt, alpha, u = time_of_law(increment.dt), increment.alpha, increment.u
    P, moduli, work = np.empty((SIZE, D * D + 1)), np.empty((SIZE, D, D, D, D)), new_tangent_work()
    y = np.empty((D, D * D))
    forth, back, g = found = new_gradients(D, K)
    own = np.empty((K, D))
    present = Present(np.empty(K, np.int64), np.empty(K), np.empty((K, D)), np.empty(K, np.uint64),
                      np.empty(K, np.uint64))
    offset, flat = np.empty(K, np.int64), rows.reshape(rows.size)
    find_offsets(D, K, offset)
    for n in range(len(order)):
        q, at = order[n], n % SIZE
        if at == 0:
            batch_tangent(params, dt, old, new, order[n:n + SIZE], V0, work, (P, moduli))
        c, B = element[q], moduli[at]
        if n == 0 or element[order[n - 1]] != c:
            gather(u, nodes[c], D, K, own)
        grown = V0[q] * deformed_gradients(own, G, q, found)
        if FBAR:
            grown *= determinant(old.F[q], D) * old.F33[q]
            shared = grown * bulk[c, 0] / volume[c, 0]
            bulk[c, 1] += by_mean_volume(B, P[at], new.F[q], V0[q], shared, D, forth, back)
        count = find_present(N[q], g, nodes[c], offset, D, K, present)
        if FBAR:
            spread(forth, count, present, D, push[c])
            spread(back, count, present, D, pull_sums[c])
        add_point(B, count, present, alpha * mass[q] if CONSISTENT else 0.0, y, D, flat)


@inlined
def add_pair(push, gradient, forth, back, D, block):
    """Add to the ``block`` (D D,) of a pair of nodes push_i forth_k + gradient_i back_k."""
    for i in range(D):
        first = push[i] * forth[0] + gradient[i] * back[0]
        second = push[i] * forth[1] + gradient[i] * back[1]
        third = push[i] * forth[D - 1] + gradient[i] * back[D - 1]
        block[D * i] += first
        block[D * i + 1] += second
        if D == 3:
            block[D * i + D - 1] += third


def couple(nodes, patches: Patches, rows):
    """Add to the ``rows`` what comes of the change of j_mean, see ``f_bar``; nodes: (patches, K), of patches
    that are stencils."""
    volume, gradient, bulk, push, pull_sums = patches
    offset, forth, back = np.empty(K, np.int64), np.empty(D), np.empty(D)
    place, shift = np.empty(K, np.uint64), np.empty(K, np.uint64)
    present = np.empty(K, np.int64)
    find_offsets(D, K, offset)
    flat, size = rows.reshape(rows.size), np.uint64(D * D)
    for row in range(len(volume)):
        if volume[row, 0] <= 0.0:
            continue
        count = 0
        for e in range(K):
            if gradient[row, 0, e] != 0.0 or gradient[row, 1, e] != 0.0 or gradient[row, D - 1, e] != 0.0:
                present[count] = e
                place[count] = (5**D * nodes[row, e] + (5**D - 1) // 2 - offset[e]) * D * D
                shift[count] = offset[e] * D * D
                count += 1
        share = 1.0 / volume[row, 0]
        for b in range(count):
            for k in range(D):
                forth[k] = share * gradient[row, k, present[b]]
                back[k] = share * (pull_sums[row, k, present[b]] + bulk[row, 1] * forth[k])
            for e in range(count):
                node, start = present[e], place[e] + shift[b]
                add_pair(push[row, :, node], gradient[row, :, node], forth, back, D, flat[start:start + size])
