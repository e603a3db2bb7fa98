"""Residual and consistent tangent of the weak form, eq. 10 and 11, with the material points as quadrature.

Updated Lagrangian on the grid at rest: u is the displacement over the step, F = (I + du/dx) F_old, and with
T = P F_old^T (the stress that works on du/dx, per undeformed volume)

    R_I = sum_p V0 T grad N_I + m N_I a(x_p),     a = sum_J N_J a_J,
    K_IJ = sum_p V0 grad N_I (F_old A F_old^T) grad N_J + alpha m N_I N_J.

With FBAR the volume change of a step is averaged over each cell against locking (de Souza Neto et al. 1996, doi
10.1016/0020-7683(95)00259-6, with points for quadrature): F = r (I + du/dx) F_old, r = (j_mean / j)^(1/D), where
j = det(I + du/dx) and j_mean its mean over the cell's points by volume; then T = r P F_old^T, and F keeps the mean.

Templates: ``specialise`` fixes D, K, FBAR, CONSISTENT (inertia as in eq. 11; otherwise the caller adds lumped inertia) and the
law as ``point_stress``, ``point_tangent`` or ``energy``. Arguments throughout: cell (n,) cells of the points; cells
(m, K) nodes; N (n, K), G (n, K, D) basis values and gradients [1/m]; mass (n,) [kg]; V0 (n,) undeformed volume [m^3];
F_old, F (n, D, D) and F33_old, F33 (n,) deformation at the start and the end of the step; old, new (n,) state records;
p the law's parameters; u (nodes, D) [m], a (nodes, D) [m/s^2].
"""
import numpy as np
from numba import njit

from .shape import invert

D, K = 2, 4
CONSISTENT, FBAR = True, False
point_stress = point_tangent = strain_energy = stress = None


@njit(inline="always")
def _gradient(c, q, cells, G, u, D, K, H):
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


@njit(inline="always")
def _volume_change(H, D):
    """j = det(I + H)."""
    if D == 2:
        return (1.0 + H[0, 0]) * (1.0 + H[1, 1]) - H[0, 1] * H[1, 0]
    a, b, c = 1.0 + H[0, 0], 1.0 + H[1, 1], 1.0 + H[D - 1, D - 1]
    return (a * (b * c - H[1, D - 1] * H[D - 1, 1]) - H[0, 1] * (H[1, 0] * c - H[1, D - 1] * H[D - 1, 0])
            + H[0, D - 1] * (H[1, 0] * H[D - 1, 1] - b * H[D - 1, 0]))


def mean_changes(cell, cells, slot, G, V0, F_old, F33_old, u, volume, gradient):
    """Volumes at the end of the step, V0 J_old j, and at its start, summed per cell into ``volume``, shape (slots, 2); with
    them the derivative of the first by the displacements into ``gradient``, shape (slots, K, D), all set to zero before."""
    H = np.empty((D, D))
    inverse = np.empty((D, D))
    for q in range(len(cell)):
        c = cell[q]
        _gradient(c, q, cells, G, u, D, K, H)
        J_old = np.linalg.det(F_old[q]) * F33_old[q]
        j = _volume_change(H, D)
        row = slot[c]
        volume[row, 0] += V0[q] * J_old * j
        volume[row, 1] += V0[q] * J_old
        for i in range(D):
            H[i, i] += 1.0
        invert(H, D, inverse)
        for b in range(K):
            for i in range(D):
                s = 0.0
                for k in range(D):
                    s += inverse[k, i] * G[q, b, k]
                gradient[row, b, i] += V0[q] * J_old * j * s


def residual(cell, cells, slot, volume, N, G, mass, V0, F_old, F33_old, old, p, u, a, F, F33, new, R):
    """Add internal and inertia forces [N] to R, shape (nodes, D); fills F, F33 and new."""
    H = np.empty((D, D))
    P = np.empty(D * D + 1)
    A = np.empty((D * D + 1, D * D + 1))
    T = np.empty((D, D))
    for q in range(len(cell)):
        c = cell[q]
        _gradient(c, q, cells, G, u, D, K, H)
        r = 1.0
        if FBAR:
            r = (volume[slot[c], 0] / volume[slot[c], 1] / _volume_change(H, D)) ** (1.0 / D)
        for i in range(D):
            for j in range(D):
                f = F_old[q, i, j]
                for k in range(D):
                    f += H[i, k] * F_old[q, k, j]
                F[q, i, j] = r * f
        F33[q] = point_stress(p, F[q], F33_old[q], old[q], new[q], P, A)
        for i in range(D):
            for j in range(D):
                t = 0.0
                for k in range(D):
                    t += P[i * D + k] * F_old[q, j, k]
                T[i, j] = V0[q] * r * t
        for i in range(D):
            inertia = 0.0
            if CONSISTENT:
                for b in range(K):
                    inertia += N[q, b] * a[cells[c, b], i]
                inertia *= mass[q]
            t0, t1, t2 = T[i, 0], T[i, 1], T[i, D - 1]
            for b in range(K):
                force = inertia * N[q, b] + t0 * G[q, b, 0] + t1 * G[q, b, 1]
                if D == 3:
                    force += t2 * G[q, b, D - 1]
                R[cells[c, b], i] += force


@njit(inline="always")
def _by_mean_volume(P, A, F, F_old, weight, D, half, S):
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


@njit(inline="always")
def _pull(A, F_old, weight, D, half, B):
    """B = weight F_old A F_old^T on the second and fourth index, one after the other."""
    for i in range(D):
        for j in range(D):
            for k in range(D):
                for n in range(D):
                    s = 0.0
                    for m in range(D):
                        s += F_old[j, m] * A[i * D + m, k * D + n]
                    half[i, j, k, n] = weight * s
    for i in range(D):
        for j in range(D):
            for k in range(D):
                for l in range(D):
                    s = 0.0
                    for n in range(D):
                        s += half[i, j, k, n] * F_old[l, n]
                    B[i, j, k, l] = s


def tangent(cell, cells, slot, volume, gradient, N, G, mass, V0, F_old, F33_old, old, p, alpha, u, F, F33, new, Ke):
    """Add the point's share to the element matrices Ke [N/m], shape (slots, K, D, D, K): Ke[c, b, k, i, e] is the
    derivative of the force on node e in direction i by the displacement of node b in direction k. slot (m,) is the row of
    each cell in Ke. F and F33 hold the deformation at which the tangent is wanted.

    Sums in scalars and one flat index per element matrix: half the time of the same loops over small arrays.
    """
    P = np.empty(D * D + 1)
    A = np.empty((D * D + 1, D * D + 1))
    half = np.empty((D, D, D, D))
    B = np.empty((D, D, D, D))
    H = np.empty((D, D))
    f_inverse = np.empty((D, D))
    S = np.empty((D, D))
    g = np.empty(D * K)  # gradients, one direction after the other
    w = np.empty(K)
    for q in range(len(cell)):
        F33[q] = point_tangent(p, F[q], F33[q], old[q], new[q], P, A)
        row = slot[cell[q]]
        r = 1.0
        if FBAR:
            _gradient(cell[q], q, cells, G, u, D, K, H)
            r = (volume[row, 0] / volume[row, 1] / _volume_change(H, D)) ** (1.0 / D)
            for i in range(D):
                H[i, i] += 1.0
            invert(H, D, f_inverse)
            _by_mean_volume(P, A, F[q], F_old[q], V0[q] * r, D, H, S)
        _pull(A, F_old[q], V0[q] * r * r, D, half, B)
        for e in range(K):
            w[e] = alpha * mass[q] * N[q, e] if CONSISTENT else 0.0
            for j in range(D):
                g[j * K + e] = G[q, e, j]
        flat = Ke[row].reshape(K * D * D * K)
        start = 0
        for b in range(K):
            for k in range(D):
                for i in range(D):
                    y0 = y1 = y2 = 0.0
                    for l in range(D):
                        y0 += B[i, 0, k, l] * g[l * K + b]
                        y1 += B[i, 1, k, l] * g[l * K + b]
                        if D == 3:
                            y2 += B[i, D - 1, k, l] * g[l * K + b]
                    if FBAR:
                        change = gradient[row, b, k] / volume[row, 0]
                        for n in range(D):
                            change -= f_inverse[n, k] * G[q, b, n]
                        y0 += S[i, 0] * change / D
                        y1 += S[i, 1] * change / D
                        if D == 3:
                            y2 += S[i, D - 1] * change / D
                    inertia = N[q, b] if i == k else 0.0
                    for e in range(K):
                        s = inertia * w[e] + g[e] * y0 + g[K + e] * y1
                        if D == 3:
                            s += g[(D - 1) * K + e] * y2
                        flat[start + e] += s
                    start += K


def energies(mass, V0, v, F, F33, old, p):
    """Kinetic energy of the points and strain energy [J]."""
    kinetic = 0.0
    strain = 0.0
    for q in range(len(mass)):
        for i in range(D):
            kinetic += 0.5 * mass[q] * v[q, i] * v[q, i]
        strain += V0[q] * strain_energy(p, F[q], F33[q], old[q])
    return kinetic, strain


def cauchy(p, F, F33, state, sigma):
    """Cauchy stress sigma = P F^T / J [Pa], shape (n, D, D)."""
    P = np.empty(D * D + 1)
    new = state[:1].copy()  # a law fills it; the points' own states stay as they are
    for q in range(len(F)):
        stress(p, F[q], F33[q], state[q], new[0], P)
        J = np.linalg.det(F[q]) * F33[q]
        for i in range(D):
            for j in range(D):
                s = 0.0
                for k in range(D):
                    s += P[i * D + k] * F[q, j, k]
                sigma[q, i, j] = s / J
