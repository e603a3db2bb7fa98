"""Compressible neo-Hookean law (Bonet & Wood, section 6.4.3).

    W = mu/2 (F:F - 3 - 2 ln J) + lam/2 (ln J)^2,    P = mu (F - F^-T) + lam ln J F^-T
"""
import math
from typing import NamedTuple

from .algebra import cofactor, determinant
from .law import ELASTIC_STATE, Law, lame


class Params(NamedTuple):
    """Lamé parameters [Pa] of the undeformed state."""

    lam: float
    mu: float


D = 2  # fixed by specialise


def stress(p, F, F33, dt, old, new, P):
    """P = mu (F - F^-T) + lam ln J F^-T; NaN for J <= 0."""
    J = determinant(F, D)
    volume = J * F33
    log_J = math.log(volume) if volume > 0.0 else math.nan
    for i in range(D):
        for j in range(D):
            P[i * D + j] = p.mu * F[i, j] + (p.lam * log_J - p.mu) * cofactor(F, i, j, D) / J
    P[D * D] = p.mu * F33 + (p.lam * log_J - p.mu) / F33


def tangent(p, F, F33, dt, old, new, P, A):
    """dP_iJ/dF_kL = mu delta_ik delta_JL + lam F^-T_iJ F^-T_kL + (mu - lam ln J) F^-T_iL F^-T_kJ."""
    stress(p, F, F33, dt, old, new, P)
    J = determinant(F, D)
    volume = J * F33
    shear = p.mu - p.lam * (math.log(volume) if volume > 0.0 else math.nan)
    last = D * D
    for i in range(D):
        for j in range(D):
            inverse = cofactor(F, i, j, D) / J
            for k in range(D):
                for m in range(D):
                    a = (p.lam * inverse * cofactor(F, k, m, D)
                         + shear * cofactor(F, i, m, D) * cofactor(F, k, j, D) / J) / J
                    if i == k and j == m:
                        a += p.mu
                    A[i * D + j, k * D + m] = a
            A[i * D + j, last] = p.lam * inverse / F33
            A[last, i * D + j] = p.lam * inverse / F33
    A[last, last] = p.mu + (p.lam + shear) / (F33 * F33)


def energy(p, F, F33, old):
    """W = mu/2 (F:F - 3 - 2 ln J) + lam/2 (ln J)^2 [J/m^3]."""
    volume = determinant(F, D) * F33
    log_J = math.log(volume) if volume > 0.0 else math.nan
    square = F33 * F33 - 3.0 if D == 2 else -3.0
    for i in range(D):
        for j in range(D):
            square += F[i, j] * F[i, j]
    return p.mu * (0.5 * square - log_J) + 0.5 * p.lam * log_J * log_J


def neo_hooke(E: float, nu: float) -> Law:
    """Neo-Hookean law with Young's modulus E [Pa] and Poisson's ratio nu of the undeformed state; raises
    ValueError outside -1 < nu < 0.5.

    >>> neo_hooke(E=2.0, nu=0.25).params
    Params(lam=0.8, mu=0.8)
    """
    return Law("neo_hooke", Params(*lame(E, nu)), ELASTIC_STATE, stress, tangent, energy)
