"""The points of the residual in groups of whole elements: what an element has is read and written once for
all its points, and what one loop over a group leaves for the next stays in fast memory.

Templates, arguments and formulas: see ``weakform`` and ``f_bar``. part: the numbers of the points in a group,
element by element.
"""
from typing import NamedTuple

import numpy as np

from ..basis.shape import invert
from ..compiled import inlined, multiply, prefetch, within
from ..grid.elements import PointElements
from ..laws.algebra import cofactor, determinant
from ..laws.batches import SIZE
from .f_bar import volume_change
from .fields import Deformation, Patches, Quadrature

GROUP = 4 * SIZE  # points, whole batches of the law; ``Group`` then takes 21 kB in space
LINE = 8  # numbers in a line of the cache
D, K = 2, 4
CONSISTENT, FBAR, CELLS_ARE_PATCHES = True, False, False


class Group(NamedTuple):
    """Of at most m points, one after the other: ``H`` (m, D, D), du/dx transposed; ``V_old`` (m,), volume at
    the start of the step [m^3], where cells are patches; ``P`` (m, D D + 1), stress [Pa]; ``mean`` (m,), V0
    tr(tau) / D [J]. Of one point: ``T`` (D, D), the stress that works on du/dx times the volume [J]. Of one
    element: ``own`` (K, D), values of its nodes, and ``force`` (D, K) on them [N]."""

    H: np.ndarray
    V_old: np.ndarray
    P: np.ndarray
    mean: np.ndarray
    T: np.ndarray
    own: np.ndarray
    force: np.ndarray


@inlined
def new_group(m, D, K):
    """Arrays for groups of at most m points."""
    return Group(np.empty((m, D, D)), np.empty(m), np.empty((m, D * D + 1)), np.empty(m), np.empty((D, D)),
                 np.empty((K, D)), np.empty((D, K)))


@inlined
def end_of_group(element, order, first):
    """Where in ``order`` the group ends that begins at ``first``: at most GROUP points, or one element."""
    end = min(first + GROUP, len(order))
    inside = end
    while first < inside < len(order) and element[order[inside]] == element[order[inside - 1]]:
        inside -= 1
    if inside > first:
        return inside
    while end < len(order) and element[order[end]] == element[order[end - 1]]:
        end += 1
    return end


@inlined
def most_points(element, order):
    """Of the largest group, rounded up to whole batches of the law."""
    first = most = 0
    while first < len(order):
        end = end_of_group(element, order, first)
        most, first = max(most, end - first), end
    return (most + SIZE - 1) // SIZE * SIZE


@inlined
def fetch(part, G, old, new, D, K):
    """Have the fields of points come from memory while others are at work."""
    for n in range(len(part)):
        q = part[n]
        for line in range(0, K * D, LINE):
            prefetch(G, q * K * D + line)
        for line in range(0, D * D + LINE - 1, LINE):
            prefetch(old.F, q * D * D + line)
            prefetch(new.F, q * D * D + line)
        prefetch(old.state, q)
        prefetch(new.state, q)


@inlined
def gather(nodal, nodes, D, K, own):
    """Values of the ``nodes`` of an element."""
    for b in range(K):
        for i in range(D):
            own[b, i] = nodal[nodes[b], i]


@inlined
def deform(H, F_old, r, D, F):
    """F = r (1 + H^T) F_old."""
    for i in range(D):
        for j in range(D):
            f = F_old[i, j]
            for k in range(D):
                f += H[k, i] * F_old[k, j]
            F[i, j] = r * f


@inlined
def mean_stress(P, F, D):
    """tr(P F^T) / D."""
    s = 0.0
    for i in range(D):
        for k in range(D):
            s += P[i * D + k] * F[i, k] / D
    return s


@inlined
def inner_force(P, F_old, weight, D, T):
    """T = weight P F_old^T."""
    for i in range(D):
        for j in range(D):
            t = 0.0
            for k in range(D):
                t += P[i * D + k] * F_old[j, k]
            T[i, j] = weight * t


@inlined
def mean_force(P, F, H, weight, mean, shared, D, T):
    """T = (weight P F^T - mean + shared j) f^-T, f = (1 + H)^T, j = det f; H becomes f^T."""
    for i in range(D):
        H[i, i] += 1.0
    j = determinant(H, D)
    for i in range(D):
        for m in range(D):
            tau = shared - mean / j if i == m else 0.0
            for k in range(D):
                tau += weight / j * P[i * D + k] * F[m, k]
            for k in range(D):
                T[i, k] = (T[i, k] if m > 0 else 0.0) + tau * cofactor(H, k, m, D)


@within
def deformed_gradients(own, G, q, found):
    """Fill ``found``, see ``f_bar.StepGradients``, with g = G f^-1 at point q, from the displacements
    ``own`` (K, D) of its element's nodes. Returns det f."""
    turned, inverse, g = found
    multiply((D, K, D), False, (turned, 0, D), (G, q * K * D, K, 1), (own, 0, D))
    for i in range(D):
        turned[i, i] += 1.0
    invert(turned, D, inverse)
    multiply((D, D, K), False, (g, 0, K), (inverse, 0, D, 1), (G, q * K * D, K))
    return determinant(turned, D)


def strain(points: Quadrature, elements: PointElements, old: Deformation, new: Deformation, patches: Patches,
           u, part, group: Group):
    """Fill H and the new F of the points; where cells are patches, add to their ``volume``."""
    element, _, G, _, V0, _ = points
    nodes, patch, volume = elements.nodes, elements.patch, patches.volume
    H, V_old, _, _, _, own, _ = group
    for n in range(len(part)):
        q = part[n]
        c = element[q]
        if n == 0 or element[part[n - 1]] != c:
            gather(u, nodes[c], D, K, own)
        multiply((D, K, D), False, (H, n * D * D, D), (G, q * K * D, K, 1), (own, 0, D))
        if CELLS_ARE_PATCHES:
            V_old[n] = V0[q] * determinant(old.F[q], D) * old.F33[q]
            volume[patch[c], 0] += V_old[n] * volume_change(H[n], D)
            volume[patch[c], 1] += V_old[n]
    for n in range(len(part)):
        q, r = part[n], 1.0
        if FBAR:
            row = patch[element[q]]
            r = (volume[row, 0] / volume[row, 1] / volume_change(H[n], D)) ** (1.0 / D)
        deform(H[n], old.F[q], r, D, new.F[q])


def load(points: Quadrature, elements: PointElements, F, patches: Patches, a, part, group: Group, R):
    """Add the forces of the points, whose stress is P, to R; with FBAR add to bulk[:, 0]. F: at the start of
    the step, with FBAR at its end."""
    element, N, G, mass, V0, _ = points
    nodes, patch, volume, bulk = elements.nodes, elements.patch, patches.volume, patches.bulk
    H, V_old, P, mean, T, own, force = group
    inertia = np.empty(D)
    if FBAR:
        for n in range(len(part)):
            q = part[n]
            mean[n] = V0[q] * mean_stress(P[n], F[q], D)
            bulk[patch[element[q]], 0] += mean[n]
    for n in range(len(part)):
        q = part[n]
        c = element[q]
        if n == 0 or element[part[n - 1]] != c:
            force[:] = 0.0
            if CONSISTENT:
                gather(a, nodes[c], D, K, own)
        if FBAR:
            shared = 0.0
            if CELLS_ARE_PATCHES:
                shared = bulk[patch[c], 0] / volume[patch[c], 0] * V_old[n]
            mean_force(P[n], F[q], H[n], V0[q], mean[n], shared, D, T)
        else:
            inner_force(P[n], F[q], V0[q], D, T)
        multiply((D, D, K), True, (force, 0, K), (T, 0, D, 1), (G, q * K * D, K))
        if CONSISTENT:
            multiply((1, K, D), False, (inertia, 0, D), (N, q * K, 0, 1), (own, 0, D))
            for i in range(D):
                inertia[i] *= mass[q]
            multiply((D, 1, K), True, (force, 0, K), (inertia, 0, 1, 0), (N, q * K, K))
        if n + 1 == len(part) or element[part[n + 1]] != c:
            for b in range(K):
                for i in range(D):
                    R[nodes[c, b], i] += force[i, b]
