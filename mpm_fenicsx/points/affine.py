"""Transfers of velocities that vary around each material point: APIC and TPIC.

A point has the affine moment B = sum_I N_I v_I (x_I - x_p)^T [m^2/s] and the velocity gradient C [1/s] of the
field that it has taken from the grid; D_p = sum_I N_I (x_I - x_p)(x_I - x_p)^T [m^2] is the spread of its
basis.

APIC (Jiang, Schroeder & Teran 2017, doi 10.1016/j.jcp.2017.02.050) keeps B: node I gets the velocity v_p + B
D_p^-1 (x_I - x_p), so that the nodes have the angular momentum of the points, sum m (x_p × v_p + what is skew
in B). TPIC (Nakamura, Matsumura & Mizutani 2023, doi 10.1016/j.cma.2022.115720) keeps C: v_p + C (x_I - x_p)
needs no inverse of D_p, which is singular where the basis is not smooth, but the moment C D_p changes with
the place of a point in its cell.

Templates: ``specialise`` fixes D, K and APIC. Arguments throughout: element (n,), rows of ``nodes``, (m, K);
N (n, K) basis values; places (nodes, D) of the nodes and x (n, D) of the points [m].
"""
import numpy as np

from ..basis.shape import invert
from ..compiled import inlined

D, K, APIC = 2, 4, True
FLAT = 1e-9  # of its trace: below that a spread has no extent along an axis


@inlined
def basis_spread(stencil, N, places, x, D, K, S):
    """D_p of one point into S (D, D) [m^2]; stencil (K,): numbers of its nodes, N (K,), x (D,)."""
    for i in range(D):
        for j in range(D):
            S[i, j] = 0.0
    for q in range(K):
        for i in range(D):
            for j in range(D):
                S[i, j] += N[q] * (places[stencil[q], i] - x[i]) * (places[stencil[q], j] - x[j])


@inlined
def invert_spread(S, D, inverse):
    """Inverse of S = D_p; zero along axes without extent, as at the edge of a grid, where the domains of
    points end. Changes S."""
    least = 0.0
    for i in range(D):
        least += FLAT * S[i, i]
    flat = 0
    for i in range(D):
        if S[i, i] <= least:
            flat += 1 << i
            for j in range(D):
                S[i, j] = S[j, i] = 0.0
            S[i, i] = 1.0
    invert(S, D, inverse)
    for i in range(D):
        if (flat >> i) & 1:
            inverse[i, i] = 0.0


@inlined
def _product(A, M, D, AM):
    """AM = A M, all (D, D)."""
    for i in range(D):
        for j in range(D):
            AM[i, j] = 0.0
            for k in range(D):
                AM[i, j] += A[i, k] * M[k, j]


def start(element, nodes, N, places, x, C, B):
    """Fill the affine moments B = C D_p of points with velocity gradients C; both (n, D, D)."""
    S = np.empty((D, D))
    for p in range(len(element)):
        basis_spread(nodes[element[p]], N[p], places, x[p], D, K, S)
        _product(C[p], S, D, B[p])


def to_grid(element, nodes, N, places, x, mass, field, nodal):
    """Phase I: add the momentum [kg m/s] of the velocity around each point to ``nodal``, see
    ``transfer.to_grid``.

    mass: (n,) [kg]; field: (n, D, D), with APIC the affine moments B, else the velocity gradients C.
    """
    S = np.empty((D, D))
    inverse = np.empty((D, D))
    around = np.empty((D, D))
    for p in range(len(element)):
        if APIC:
            basis_spread(nodes[element[p]], N[p], places, x[p], D, K, S)
            invert_spread(S, D, inverse)
            _product(field[p], inverse, D, around)
        else:
            around[:] = field[p]
        for q in range(K):
            node = nodes[element[p], q]
            w = N[p, q] * mass[p]
            for i in range(D):
                for j in range(D):
                    nodal[node, 1 + i] += w * around[i, j] * (places[node, j] - x[p, j])


def deform(element, nodes, G, u, F_old, F):
    """Deformation gradients (I + du/dx) F_old into F, both (n, D, D); G: (n, D, K) [1/m]; u: displacement of
    the nodes, shape (nodes, D) [m]."""
    H = np.empty((D, D))
    for p in range(len(element)):
        for i in range(D):
            for j in range(D):
                H[i, j] = 1.0 if i == j else 0.0
        for q in range(K):
            node = nodes[element[p], q]
            for i in range(D):
                for j in range(D):
                    H[i, j] += u[node, i] * G[p, j, q]
        _product(H, F_old[p], D, F[p])


def to_points(element, nodes, N, G, places, increment, C, B):
    """Phase III: fill C [1/s] and B [m^2/s], both (n, D, D), with those of the nodes' velocity at the end of
    the step, see ``midpoint``, at their places then.

    One of the two is taken from the moved grid: with APIC B = sum N_I v_I (x_I + u_I - x_p)^T and C = B
    D_p^-1, else C = (sum v_I grad N_I^T)(I + du/dx)^-1 and B = C D_p. G: (n, D, K) gradients on the grid at
    rest [1/m].
    """
    dt, u, a = increment.dt, increment.u, increment.a
    middle = np.empty(D)
    r = np.empty(D)
    S = np.empty((D, D))
    T = np.empty((D, D))
    F = np.empty((D, D))
    inverse = np.empty((D, D))
    for p in range(len(element)):
        for i in range(D):
            middle[i] = 0.0
            for q in range(K):
                node = nodes[element[p], q]
                middle[i] += N[p, q] * (places[node, i] + u[node, i])
            for j in range(D):
                S[i, j] = T[i, j] = 0.0
                F[i, j] = 1.0 if i == j else 0.0
        for q in range(K):
            node = nodes[element[p], q]
            for i in range(D):
                r[i] = places[node, i] + u[node, i] - middle[i]
            for i in range(D):
                v = u[node, i] / dt + 0.5 * dt * a[node, i]
                for j in range(D):
                    S[i, j] += N[p, q] * r[i] * r[j]
                    T[i, j] += v * (N[p, q] * r[j] if APIC else G[p, j, q])
                    if not APIC:
                        F[i, j] += u[node, i] * G[p, j, q]
        if APIC:
            B[p] = T
            invert_spread(S, D, inverse)
            _product(T, inverse, D, C[p])
        else:
            invert(F, D, inverse)
            _product(T, inverse, D, C[p])
            _product(C[p], S, D, B[p])
