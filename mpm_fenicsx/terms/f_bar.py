"""F-bar: the volume change of a step averaged over a patch of cells, against locking of bodies that keep
their volume.

A patch is one quadrilateral or hexahedron (de Souza Neto et al. 1996, doi 10.1016/0020-7683(95)00259-6, with
points for quadrature) or several simplices (``patches``). F = r f F_old, f = I + du/dx, r = (j_mean /
j)^(1/D), where j = det f and j_mean its mean over the patch's points by volume; F keeps the mean.

The forces are those that do the work of the stress at this F: the residual is the derivative of sum V0 W(F)
by u, that of j_mean included. (In the method's first form the stress at F works on the local gradient. That
is no derivative of an energy, and soil that dilates gains energy by it.) With tau = P F^T and gradients grad
by the deformed places, to first order

    sum V0 [dev tau : grad du + tr(tau) / D d ln j_mean],

and to second order, a_ijkl = F_jM A_iMkN F_lN, u = a : I + tau, w = I : a + tau, s = tr u, per point

    V0 [a_ijkl - (u_ij I_kl + I_ij w_kl) / D + I_ij I_kl s / D^2 + tr(tau) / D I_il I_jk]
    + q V_old j (I_ij I_kl - I_il I_jk),

q being the patch's sum of V0 tr(tau) / D over its volume, sum V_old j, and per patch

    d ln j_mean (sum V0 dev(w) / D : grad du) + its transpose with u + (d ln j_mean)^2 sum V0 (s / D^2 -
    tr(tau) / D),

which couples all nodes of the patch. Where A is symmetric so is the whole. The pressure that acts is the mean
of the patch, as in the method of mean dilatation (Simo, Taylor & Pister 1985, doi
10.1016/0045-7825(85)90033-7).

Templates and arguments: see ``weakform``.
"""
from typing import NamedTuple

import numpy as np

from ..compiled import inlined
from ..grid.elements import PointElements
from ..laws.algebra import cofactor, determinant
from .fields import Deformation, Patches, Quadrature

D, K = 2, 4


@inlined
def displacement_gradient(c, q, cells, G, u, D, K, H):
    """du/dx at point q into H (D, D)."""
    for i in range(D):
        h0 = h1 = h2 = 0.0
        for b in range(K):
            d = u[cells[c, b], i]
            h0 += d * G[q, 0, b]
            h1 += d * G[q, 1, b]
            if D == 3:
                h2 += d * G[q, D - 1, b]
        H[i, 0], H[i, 1] = h0, h1
        if D == 3:
            H[i, D - 1] = h2


@inlined
def volume_change(H, D):
    """j = det(I + H)."""
    if D == 2:
        return (1.0 + H[0, 0]) * (1.0 + H[1, 1]) - H[0, 1] * H[1, 0]
    a, b, c = 1.0 + H[0, 0], 1.0 + H[1, 1], 1.0 + H[D - 1, D - 1]
    return (a * (b * c - H[1, D - 1] * H[D - 1, 1]) - H[0, 1] * (H[1, 0] * c - H[1, D - 1] * H[D - 1, 0])
            + H[0, D - 1] * (H[1, 0] * H[D - 1, 1] - b * H[D - 1, 0]))


class StepGradients(NamedTuple):
    """At one point: ``turned`` (D, D), the transposed deformation over the step, f^T, and its ``inverse``;
    ``g`` (D K,), gradients of the basis by the deformed places, one direction after the other [1/m]."""

    turned: np.ndarray
    inverse: np.ndarray
    g: np.ndarray


@inlined
def new_gradients(D, K):
    """Arrays for one point."""
    return StepGradients(np.empty((D, D)), np.empty((D, D)), np.empty(D * K))


@inlined
def spread(S, g, place, D, K, forces):
    """Add S g to the ``forces`` of a patch, shape (D, M)."""
    for i in range(D):
        for e in range(K):
            s = S[i, 0] * g[e] + S[i, 1] * g[K + e]
            if D == 3:
                s += S[i, D - 1] * g[(D - 1) * K + e]
            forces[i, place[e]] += s


@inlined
def by_mean_volume(B, P, F, weight, shared, D, u, w):
    """Turn B = weight a into the point's part at constant j_mean, see above, and fill u with weight dev(u) /
    D, w with weight dev(w) / D; shared: q V_old j. Returns weight (s / D^2 - tr(tau) / D)."""
    s = pressure = 0.0
    for i in range(D):
        for j in range(D):
            tau = of_row = of_column = 0.0
            for k in range(D):
                tau += P[i * D + k] * F[j, k]
                of_row += B[i, j, k, k]
                of_column += B[k, k, i, j]
            u[i, j], w[i, j] = (of_row + weight * tau) / D, (of_column + weight * tau) / D
            if i == j:
                s += (of_row + weight * tau) / (D * D)
                pressure += weight * tau / D
    for i in range(D):
        u[i, i] -= s
        w[i, i] -= s
    for i in range(D):
        for j in range(D):
            forth, back = u[i, j], w[i, j]
            for k in range(D):
                B[i, j, k, k] -= forth
                B[k, k, i, j] -= back
            B[i, i, j, j] += shared - s
            B[i, j, j, i] += pressure - shared
    return s - pressure


def mean_changes(points: Quadrature, elements: PointElements, old: Deformation, u, patches: Patches):
    """Add V0 J_old j and V0 J_old to the patches' ``volume``, the derivative of the first by the
    displacements u (nodes, D) [m] to their ``gradient``."""
    element, G, V0, F_old, F33_old = points.element, points.G, points.V0, old.F, old.F33
    cells, patch, place = elements.nodes, elements.patch, elements.place
    volume, gradient = patches.volume, patches.gradient
    H = np.empty((D, D))
    C = np.empty((D, D))
    for q in range(len(element)):
        c = element[q]
        displacement_gradient(c, q, cells, G, u, D, K, H)
        V_old = V0[q] * determinant(F_old[q], D) * F33_old[q]
        row = patch[c]
        volume[row, 0] += V_old * volume_change(H, D)
        volume[row, 1] += V_old
        for i in range(D):
            H[i, i] += 1.0
        for i in range(D):
            for k in range(D):
                C[i, k] = V_old * cofactor(H, i, k, D)  # derivative of V_old j by du_i/dx_k
        for b in range(K):
            for i in range(D):
                s = C[i, 0] * G[q, 0, b] + C[i, 1] * G[q, 1, b]
                if D == 3:
                    s += C[i, D - 1] * G[q, D - 1, b]
                gradient[row, i, place[c, b]] += s


def add_pressure(nodes, patches: Patches, R):
    """Add to R [N], shape (nodes, D), the forces that do work on j_mean. nodes: (patches, M) of the
    patches."""
    volume, gradient, bulk = patches.volume, patches.gradient, patches.bulk
    for row in range(len(volume)):
        if volume[row, 0] > 0.0:
            pressure = bulk[row, 0] / volume[row, 0]
            for e in range(nodes.shape[1]):
                for i in range(D):
                    R[nodes[row, e], i] += pressure * gradient[row, i, e]


@inlined
def couple_patch(patches, row, at, volume, D, M, E):
    """Add to the matrix E (M, D, D, M) of one patch what comes of the change of j_mean. at: row of its
    gradient, push and pull; volume: that of the points, as they count in the gradient [m^3]."""
    _, gradient, bulk, push, pull = patches
    share = 1.0 / volume
    for b in range(M):
        for k in range(D):
            change = share * gradient[at, k, b]
            back = share * (pull[at, k, b] + bulk[row, 1] * change)
            for i in range(D):
                for e in range(M):
                    E[b, k, i, e] += push[at, i, e] * change + gradient[at, i, e] * back


def couple(nodes, patches: Patches, Kp):
    """``couple_patch`` for all patches, into Kp [N/m], shape (patches, M, D, D, M). nodes: (patches, M) of
    the patches, which have rows of their own here."""
    for row in range(len(nodes)):
        if patches.volume[row, 0] > 0.0:
            couple_patch(patches, row, row, patches.volume[row, 0], D, nodes.shape[1], Kp[row])
