"""Residual and consistent tangent of the weak form, eq. 10 and 11, with the material points as quadrature.

Updated Lagrangian on the grid at rest: u is the displacement over the step, F = (I + du/dx) F_old, and with
T = P F_old^T (the stress that works on du/dx, per undeformed volume)

    R_I = sum_p V0 T grad N_I + m N_I a(x_p),     a = sum_J N_J a_J,
    K_IJ = sum_p V0 grad N_I (F_old A F_old^T) grad N_J + alpha m N_I N_J.

With FBAR, F = r (I + du/dx) F_old with a mean volume change in r, and what follows from it for R and K:
``f_bar``.

Templates: ``specialise`` fixes D, K, FBAR, CONSISTENT (inertia as in eq. 11; otherwise the caller adds lumped
inertia) and the law as ``batch_stress``, ``batch_tangent`` or ``energy``. Arguments throughout: points,
elements, patches: see ``fields``; old, new: ``Deformation`` at the start and the end of the step; params: of
the law; increment: see ``newmark``.
"""
import numpy as np

from ..compiled import inlined, multiply
from ..grid.elements import PointElements
from ..grid.entries import Rows, add_element
from ..laws.algebra import determinant
from ..laws.batches import SIZE
from .f_bar import (
    StepGradients,
    by_mean_volume,
    couple_patch,
    deformed_gradients,
    deviatoric_force,
    displacement_gradient,
    spread,
    volume_change,
)
from .fields import Deformation, Patches, Quadrature
from .newmark import Increment

D, K = 2, 4
DD = 4  # D * D, of ``pull``
CONSISTENT, FBAR, CELLS_ARE_PATCHES = True, False, False
batch_stress = batch_tangent = new_work = new_tangent_work = strain_energy = stress = None


@inlined
def time_of_law(dt):
    """Length of the step for the law: a load step, dt = 0, is infinitely slow."""
    return dt if dt > 0.0 else np.inf


@inlined
def deform(H, F_old, r, D, F):
    """F = r (1 + H) F_old."""
    for i in range(D):
        for j in range(D):
            f = F_old[i, j]
            for k in range(D):
                f += H[i, k] * F_old[k, j]
            F[i, j] = r * f


@inlined
def inner_force(P, F_old, weight, D, T):
    """T = weight P F_old^T."""
    for i in range(D):
        for j in range(D):
            t = 0.0
            for k in range(D):
                t += P[i * D + k] * F_old[j, k]
            T[i, j] = weight * t


def residual(points: Quadrature, elements: PointElements, old: Deformation, new: Deformation,
             patches: Patches, params, increment: Increment, R):
    """Add internal and inertia forces [N] to R, shape (nodes, D), with FBAR all but the mean pressure's, for
    which bulk[:, 0] is added to; fills ``new``."""
    element, N, G, mass, V0, _ = points
    cells, patch, volume, bulk = elements.nodes, elements.patch, patches.volume, patches.bulk
    F_old, F, u, a = old.F, new.F, increment.u, increment.a
    dt = time_of_law(increment.dt)
    H, P, work = np.empty((SIZE, D, D)), np.empty((SIZE, D * D + 1)), new_work()
    T, numbers = np.empty((D, D)), np.empty(SIZE, np.int32)
    for first in range(0, len(element), SIZE):
        count = min(SIZE, len(element) - first)
        for q in range(first, first + count):
            numbers[q - first] = q
            c, h = element[q], H[q - first]
            displacement_gradient(c, q, cells, G, u, D, K, h)
            r = 1.0
            if FBAR:
                r = (volume[patch[c], 0] / volume[patch[c], 1] / volume_change(h, D)) ** (1.0 / D)
            deform(h, F_old[q], r, D, F[q])
        batch_stress(params, dt, old, new, numbers[:count], work, P)
        for q in range(first, first + count):
            c = element[q]
            if FBAR:
                bulk[patch[c], 0] += deviatoric_force(P[q - first], F[q], H[q - first], V0[q], D, T)
            else:
                inner_force(P[q - first], F_old[q], V0[q], D, T)
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


def tangent(points: Quadrature, elements: PointElements, old: Deformation, new: Deformation, patches: Patches,
            params, increment: Increment, rows: Rows):
    """Add the points' share to the ``rows`` of the matrix [N/m], with FBAR that of the patches as well where
    these are cells; else it is added to bulk[:, 1], push and pull. ``new`` and bulk[:, 0] are those of the
    residual at u.

    E[b, k, i, e] of an element is the derivative of the force on node e in direction i by the displacement of
    node b in direction k."""
    element, N, G, mass, V0, order = points
    cells, row, patch, place = elements
    volume, _, bulk, push, pull_sums = patches
    dt, alpha, u = time_of_law(increment.dt), increment.alpha, increment.u
    P, moduli, work = np.empty((SIZE, D * D + 1)), np.empty((SIZE, D, D, D, D)), new_tangent_work()
    forth, back, g = found = StepGradients(np.empty((D, D)), np.empty((D, D)), np.empty(D * K))
    y, w, E, of_patch = np.empty(D * K), np.empty(K), np.zeros((K, D, D, K)), np.empty((2, D, K))
    for n in range(len(order)):
        q, at = order[n], n % SIZE
        if at == 0:
            batch_tangent(params, dt, old, new, order[n:n + SIZE], V0, work, (P, moduli))
        c, B = element[q], moduli[at]
        grown = V0[q] * deformed_gradients(c, q, cells, G, u, D, K, found)
        if FBAR:
            own = patch[c]
            grown *= determinant(old.F[q], D) * old.F33[q]
            shared = grown * bulk[own, 0] / volume[own, 0]
            bulk[own, 1] += by_mean_volume(B, P[at], new.F[q], V0[q], shared, D, forth, back)
            at = 0 if CELLS_ARE_PATCHES else own
            spread(forth, g, place[c], D, K, push[at])
            spread(back, g, place[c], D, K, pull_sums[at])
        for e in range(K):
            w[e] = alpha * mass[q] * N[q, e] if CONSISTENT else 0.0
        for k in range(D):
            for i in range(D):
                to = (E, (k * D + i) * K, D * D * K)
                multiply((D, D, K), False, (y, 0, K), (B, (i * D * D + k) * D, D * D, 1), (g, 0, K))
                multiply((K, D, K), True, to, (y, 0, 1, K), (g, 0, K))
                if CONSISTENT and i == k:
                    multiply((K, 1, K), True, to, (N[q], 0, 1, 0), (w, 0, 0))
        if n + 1 == len(order) or element[order[n + 1]] != c:  # that was the last one in its element
            if CELLS_ARE_PATCHES:
                couple_patch(patches, patch[c], 0, D, K, of_patch, E)
                push[0], pull_sums[0] = 0.0, 0.0
            add_element(E, c, cells, rows, rows.block[row[c]], K, D)
            E[:] = 0.0


def energies(mass, V0, v, now: Deformation, params):
    """Kinetic energy of the points with mass (n,) [kg], V0 (n,) [m^3] and v (n, D) [m/s], and strain energy
    [J]."""
    F, F33, state = now
    kinetic = 0.0
    strain = 0.0
    for q in range(len(mass)):
        for i in range(D):
            kinetic += 0.5 * mass[q] * v[q, i] * v[q, i]
        strain += V0[q] * strain_energy(params, F[q], F33[q], state[q])
    return kinetic, strain


def cauchy(now: Deformation, params, sigma):
    """Cauchy stress sigma = P F^T / J [Pa], shape (n, D, D)."""
    F, F33, state = now
    P = np.empty(D * D + 1)
    new = state[:1].copy()  # a law fills it; the points' own states stay as they are
    for q in range(len(F)):
        stress(params, F[q], F33[q], 0.0, state[q], new[0], P)
        J = determinant(F[q], D) * F33[q]
        for i in range(D):
            for j in range(D):
                s = 0.0
                for k in range(D):
                    s += P[i * D + k] * F[q, j, k]
                sigma[q, i, j] = s / J
