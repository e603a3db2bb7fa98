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
from ..grid.entries import Rows, add_element, fetch_element
from ..laws.algebra import determinant
from ..laws.batches import SIZE
from .f_bar import by_mean_volume, couple_patch, new_gradients, spread
from .fields import Deformation, Patches, Quadrature
from .groups import GROUP, end_of_group, fetch, gather, most_points, new_group
from .newmark import Increment

D, K = 2, 4
CONSISTENT, FBAR, CELLS_ARE_PATCHES = True, False, False
strain = load = deformed_gradients = strain_energy = stress = None
batch_stress = batch_tangent = new_work = new_tangent_work = None


@inlined
def time_of_law(dt):
    """Length of the step for the law: a load step, dt = 0, is infinitely slow."""
    return dt if dt > 0.0 else np.inf


def residual(points: Quadrature, elements: PointElements, old: Deformation, new: Deformation,
             patches: Patches, params, increment: Increment, R):
    """Add internal and inertia forces [N] to R, shape (nodes, D); fills ``new``. With FBAR it adds to bulk[:,
    0] and, where cells are patches, to ``volume``; where they are not, that is known, and the forces of the
    mean pressure are to follow, see ``f_bar.add_pressure``."""
    element, order, dt, first = points.element, points.order, time_of_law(increment.dt), 0
    group, work = new_group(most_points(element, order), D, K), new_work()
    F = new.F if FBAR else old.F
    while first < len(order):
        end = end_of_group(element, order, first)
        fetch(order[end:end + GROUP], points.G, old, new, D, K)
        strain(points, elements, old, new, patches, increment.u, order[first:end], group)
        for n in range(first, end, SIZE):
            to = n - first
            batch_stress(params, dt, old, new, order[n:min(n + SIZE, end)], work, group.P[to:to + SIZE])
        load(points, elements, F, patches, increment.a, order[first:end], group, R)
        first = end


def tangent(points: Quadrature, elements: PointElements, old: Deformation, new: Deformation, patches: Patches,
            params, increment: Increment, rows: Rows):
    """Add the points' share to the ``rows`` of the matrix [N/m], with FBAR that of the patches as well where
    these are cells; else it is added to bulk[:, 1], push and pull. ``new`` and bulk[:, 0] are those of the
    residual at u.

    E[b, k, i, e] of an element is the derivative of the force on node e in direction i by the displacement of
    node b in direction k."""
    element, N, G, mass, V0, order = points
    cells, row, patch, place = elements
    volume, gradient, bulk, push, pull_sums = patches
    dt, alpha, u = time_of_law(increment.dt), increment.alpha, increment.u
    P, moduli, work = np.empty((SIZE, D * D + 1)), np.empty((SIZE, D, D, D, D)), new_tangent_work()
    forth, back, g = found = new_gradients(D, K)
    of_cell, growth = 0.0, np.zeros((D, D))  # volume of the points in a cell; of one, times I
    y, w, E, own = np.empty(D * K), np.empty(K), np.zeros((K, D, D, K)), np.empty((K, D))
    for n in range(len(order)):
        q, at = order[n], n % SIZE
        if at == 0:
            fetch(order[n + SIZE:n + 2 * SIZE], G, old, new, D, K)
            batch_tangent(params, dt, old, new, order[n:n + SIZE], V0, work, (P, moduli))
        c, B = element[q], moduli[at]
        if n == 0 or element[order[n - 1]] != c:
            gather(u, cells[c], D, K, own)
            fetch_element(c, cells, rows, rows.block[row[c]], K, D)
        grown = V0[q] * deformed_gradients(own, G, q, found)
        if FBAR:
            at = patch[c]
            grown *= determinant(old.F[q], D) * old.F33[q]
            shared = grown * bulk[at, 0] / volume[at, 0]
            bulk[at, 1] += by_mean_volume(B, P[n % SIZE], new.F[q], V0[q], shared, D, forth, back)
            if CELLS_ARE_PATCHES:
                of_cell += grown
                for i in range(D):
                    growth[i, i] = grown
                multiply((D, D, K), True, (gradient, 0, K), (growth, 0, D, 1), (g, 0, K))
                multiply((D, D, K), True, (push, 0, K), (forth, 0, D, 1), (g, 0, K))
                multiply((D, D, K), True, (pull_sums, 0, K), (back, 0, D, 1), (g, 0, K))
            else:
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
                couple_patch(patches, patch[c], 0, of_cell, D, K, E)
                of_cell = 0.0
                gradient[0], push[0], pull_sums[0] = 0.0, 0.0, 0.0
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
