"""Residual and consistent tangent of the weak form, eq. 10 and 11, with the material points as quadrature.

Updated Lagrangian on the grid at rest: u is the displacement over the step, F = (I + du/dx) F_old, and with
T = P F_old^T (the stress that works on du/dx, per undeformed volume)

    R_I = sum_p V0 T grad N_I + m N_I a(x_p),     a = sum_J N_J a_J,
    K_IJ = sum_p V0 grad N_I (F_old A F_old^T) grad N_J + alpha m N_I N_J.

Templates: ``specialise`` fixes D, K, CONSISTENT (inertia as in eq. 11; otherwise the caller adds lumped inertia) and the
law as ``point_stress``, ``point_tangent`` or ``energy``. Arguments throughout: cell (n,) cells of the points; cells
(m, K) nodes; N (n, K), G (n, K, D) basis values and gradients [1/m]; mass (n,) [kg]; V0 (n,) undeformed volume [m^3];
F_old, F (n, D, D) and F33_old, F33 (n,) deformation at the start and the end of the step; old, new (n,) state records;
p the law's parameters; u (nodes, D) [m], a (nodes, D) [m/s^2].
"""
import numpy as np

D, K = 2, 4
CONSISTENT = True
point_stress = point_tangent = strain_energy = stress = None


def residual(cell, cells, N, G, mass, V0, F_old, F33_old, old, p, u, a, F, F33, new, R):
    """Add internal and inertia forces [N] to R, shape (nodes, D); fills F, F33 and new."""
    H = np.empty((D, D))
    acceleration = np.empty(D)
    T = np.empty((D, D))
    P = np.empty(D * D + 1)
    A = np.empty((D * D + 1, D * D + 1))
    for q in range(len(cell)):
        for i in range(D):
            acceleration[i] = 0.0
            for j in range(D):
                H[i, j] = 0.0
        for b in range(K):
            node = cells[cell[q], b]
            for i in range(D):
                acceleration[i] += N[q, b] * a[node, i]
                for j in range(D):
                    H[i, j] += u[node, i] * G[q, b, j]
        for i in range(D):
            for j in range(D):
                f = F_old[q, i, j]
                for k in range(D):
                    f += H[i, k] * F_old[q, k, j]
                F[q, i, j] = f
        F33[q] = point_stress(p, F[q], F33_old[q], old[q], new[q], P, A)
        for i in range(D):
            for j in range(D):
                t = 0.0
                for k in range(D):
                    t += P[i * D + k] * F_old[q, j, k]
                T[i, j] = V0[q] * t
        for b in range(K):
            node = cells[cell[q], b]
            for i in range(D):
                r = mass[q] * N[q, b] * acceleration[i] if CONSISTENT else 0.0
                for j in range(D):
                    r += T[i, j] * G[q, b, j]
                R[node, i] += r


def tangent(cell, slot, N, G, mass, V0, F_old, F33_old, old, p, alpha, F, F33, new, Ke):
    """Add the point's share to the element matrices Ke, shape (slots, K*D, K*D) [N/m]; slot (m,) is the row of each
    cell in Ke. F and F33 hold the deformation at which the tangent is wanted."""
    P = np.empty(D * D + 1)
    A = np.empty((D * D + 1, D * D + 1))
    B = np.empty((D, D, D, D))
    Y = np.empty((D, D, D))
    for q in range(len(cell)):
        F33[q] = point_tangent(p, F[q], F33[q], old[q], new[q], P, A)
        for i in range(D):  # B = V0 F_old A F_old^T on the second and fourth index
            for j in range(D):
                for k in range(D):
                    for l in range(D):
                        s = 0.0
                        for m in range(D):
                            for n in range(D):
                                s += F_old[q, j, m] * A[i * D + m, k * D + n] * F_old[q, l, n]
                        B[i, j, k, l] = V0[q] * s
        c = slot[cell[q]]
        for b in range(K):
            for i in range(D):
                for j in range(D):
                    for k in range(D):
                        s = 0.0
                        for l in range(D):
                            s += B[i, j, k, l] * G[q, b, l]
                        Y[i, j, k] = s
            for e in range(K):
                inertia = alpha * mass[q] * N[q, b] * N[q, e] if CONSISTENT else 0.0
                for i in range(D):
                    for k in range(D):
                        s = inertia if i == k else 0.0
                        for j in range(D):
                            s += G[q, e, j] * Y[i, j, k]
                        Ke[c, e * D + i, b * D + k] += s


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
