"""F-bar: the volume change of a step averaged over a patch of cells, against locking of bodies that keep their volume.

A patch is one quadrilateral or hexahedron (de Souza Neto et al. 1996, doi 10.1016/0020-7683(95)00259-6, with points for
quadrature) or several simplices (``patches``). F = r (I + du/dx) F_old, r = (j_mean / j)^(1/D), where j = det(I +
du/dx) and j_mean its mean over the patch's points by volume; then T = r P F_old^T, and F keeps the mean. The mean
couples all nodes of a patch, by a matrix of rank one: (change of the forces with ln j_mean) x (gradient of ln j_mean).

Templates and arguments: see ``weakform``. volume: (patches, 2) volumes at the end and at the start of the step [m^3];
gradient: (patches, M, D) derivative of the first by the displacements of the patch's M nodes [m^2]; push: (patches, M,
D) derivative of the forces by ln j_mean [N].
"""
import numpy as np

from .laws.algebra import cofactor, determinant
from .specialise import inlined

D, K = 2, 4


@inlined
def displacement_gradient(c, q, cells, G, u, D, K, H):
    """du/dx at point q into H (D, D)."""
    for i in range(D):
        h0 = h1 = h2 = 0.0
        for b in range(K):
            d = u[cells[c, b], i]
            h0 += d * G[q, b, 0]
            h1 += d * G[q, b, 1]
            if D == 3:
                h2 += d * G[q, b, D - 1]
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


@inlined
def by_mean_volume(P, A, F, F_old, weight, D, half, S):
    """S = weight (P + A:F) F_old^T, the change of T with ln r."""
    for i in range(D):
        for j in range(D):
            half[i, j] = P[i * D + j]
            for k in range(D):
                for n in range(D):
                    half[i, j] += A[i * D + j, k * D + n] * F[k, n]
    for i in range(D):
        for j in range(D):
            S[i, j] = 0.0
            for k in range(D):
                S[i, j] += weight * half[i, k] * F_old[j, k]


def mean_changes(cell, cells, patch, place, G, V0, F_old, F33_old, u, volume, gradient):
    """Add V0 J_old j and V0 J_old to ``volume``, the derivative of the first by the displacements to ``gradient``."""
    H = np.empty((D, D))
    C = np.empty((D, D))
    for q in range(len(cell)):
        c = cell[q]
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
                s = C[i, 0] * G[q, b, 0] + C[i, 1] * G[q, b, 1]
                if D == 3:
                    s += C[i, D - 1] * G[q, b, D - 1]
                gradient[row, place[c, b], i] += s


def couple(volume, gradient, push, Kp):
    """Add to the patch matrices Kp [N/m], shape (patches, M, D, D, M), what comes of the change of j_mean."""
    M = gradient.shape[1]
    for row in range(len(volume)):
        if volume[row, 0] > 0.0:
            for b in range(M):
                for k in range(D):
                    change = gradient[row, b, k] / volume[row, 0]
                    for i in range(D):
                        for e in range(M):
                            Kp[row, b, k, i, e] += push[row, e, i] * change
