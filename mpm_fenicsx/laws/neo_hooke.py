"""Compressible neo-Hookean law (Bonet & Wood, section 6.4.3).

    W = mu/2 (F:F - 3 - 2 ln J) + lam/2 (ln J)^2,    P = mu (F - F^-T) + lam ln J F^-T
"""
import math
from typing import NamedTuple

from numba import njit

from . import ELASTIC_STATE, Law, lame


class Params(NamedTuple):
    """Lamé parameters [Pa] of the undeformed state."""

    lam: float
    mu: float


D = 2  # fixed by specialise


@njit(inline="always")
def _determinant(F, D):
    if D == 2:
        return F[0, 0] * F[1, 1] - F[0, 1] * F[1, 0]
    return (F[0, 0] * (F[1, 1] * F[2, 2] - F[1, 2] * F[2, 1]) - F[0, 1] * (F[1, 0] * F[2, 2] - F[1, 2] * F[2, 0])
            + F[0, 2] * (F[1, 0] * F[2, 1] - F[1, 1] * F[2, 0]))


@njit(inline="always")
def _cofactor(F, i, j, D):
    """Component ij of the cofactor matrix: F^-T = cofactor / det F."""
    if D == 2:
        return F[1 - i, 1 - j] if i == j else -F[1 - i, 1 - j]
    a, b = (i + 1) % 3, (i + 2) % 3
    c, d = (j + 1) % 3, (j + 2) % 3
    return F[a, c] * F[b, d] - F[a, d] * F[b, c]


def stress(p, F, F33, old, new, P):
    J = _determinant(F, D)
    volume = J * F33
    log_J = math.log(volume) if volume > 0.0 else math.nan
    for i in range(D):
        for j in range(D):
            P[i * D + j] = p.mu * F[i, j] + (p.lam * log_J - p.mu) * _cofactor(F, i, j, D) / J
    P[D * D] = p.mu * F33 + (p.lam * log_J - p.mu) / F33


def tangent(p, F, F33, old, new, P, A):
    """dP_iJ/dF_kL = mu delta_ik delta_JL + lam F^-T_iJ F^-T_kL + (mu - lam ln J) F^-T_iL F^-T_kJ."""
    stress(p, F, F33, old, new, P)
    J = _determinant(F, D)
    volume = J * F33
    shear = p.mu - p.lam * (math.log(volume) if volume > 0.0 else math.nan)
    last = D * D
    for i in range(D):
        for j in range(D):
            inverse = _cofactor(F, i, j, D) / J
            for k in range(D):
                for l in range(D):
                    a = (p.lam * inverse * _cofactor(F, k, l, D)
                         + shear * _cofactor(F, i, l, D) * _cofactor(F, k, j, D) / J) / J
                    if i == k and j == l:
                        a += p.mu
                    A[i * D + j, k * D + l] = a
            A[i * D + j, last] = p.lam * inverse / F33
            A[last, i * D + j] = p.lam * inverse / F33
    A[last, last] = p.mu + (p.lam + shear) / (F33 * F33)


def energy(p, F, F33, old):
    volume = _determinant(F, D) * F33
    log_J = math.log(volume) if volume > 0.0 else math.nan
    square = F33 * F33 - 3.0 if D == 2 else -3.0
    for i in range(D):
        for j in range(D):
            square += F[i, j] * F[i, j]
    return p.mu * (0.5 * square - log_J) + 0.5 * p.lam * log_J * log_J


def neo_hooke(E: float, nu: float) -> Law:
    """Neo-Hookean law with Young's modulus E [Pa] and Poisson's ratio nu of the undeformed state; raises ValueError
    outside -1 < nu < 0.5."""
    return Law("neo_hooke", Params(*lame(E, nu)), ELASTIC_STATE, stress, tangent, energy)
