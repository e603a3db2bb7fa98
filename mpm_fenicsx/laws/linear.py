"""Linear elasticity for finite rotations (Saint Venant–Kirchhoff).

The second Piola–Kirchhoff stress is linear in the Green–Lagrange strain,

    E = (F^T F - I) / 2,    S = lam tr(E) I + 2 mu E,    P = F S,    W = lam tr(E)^2 / 2 + mu E:E

(Bonet & Wood, Nonlinear Continuum Mechanics for Finite Element Analysis, section 6.3): Hooke's law as long as
strains are small, and no stress under any rotation. It softens and finally fails in strong compression, where
``neo_hooke`` is the choice.
"""
import math
from typing import NamedTuple

from ..compiled import inlined, within
from .law import ELASTIC_STATE, Law, lame


class Params(NamedTuple):
    """Lamé parameters [Pa]."""

    lam: float
    mu: float


D = 2  # fixed by specialise


@inlined
def _green_lagrange(F, i, j, D):
    """Component ij of the Green–Lagrange strain."""
    s = -1.0 if i == j else 0.0
    for k in range(D):
        s += F[k, i] * F[k, j]
    return 0.5 * s


@inlined
def _trace(F, D):
    """Trace of the in-plane (or three-dimensional) Green–Lagrange strain."""
    s = 0.0
    for i in range(D):
        s += _green_lagrange(F, i, i, D)
    return s


@inlined
def _second_piola(F, pressure, mu, D):
    """Rows of S = pressure I + 2 mu E; in the plane no loop over D reads what is across it. All at once, as
    LLVM computes them anew after each number that is written to an array."""
    xx, xy, yy = (2.0 * mu * _green_lagrange(F, 0, 0, D) + pressure, 2.0 * mu * _green_lagrange(F, 0, 1, D),
                  2.0 * mu * _green_lagrange(F, 1, 1, D) + pressure)
    if D == 2:
        return (xx, xy, 0.0), (xy, yy, 0.0), (0.0, 0.0, 0.0)
    xz, yz, zz = (2.0 * mu * _green_lagrange(F, 0, 2, D), 2.0 * mu * _green_lagrange(F, 1, 2, D),
                  2.0 * mu * _green_lagrange(F, 2, 2, D) + pressure)
    return (xx, xy, xz), (xy, yy, yz), (xz, yz, zz)


@within
def thickness(p, F):
    """Stretch across the plane that makes S_33 = 0: E_33 = -lam / (lam + 2 mu) (E_11 + E_22)."""
    stretch2 = 1.0 - 2.0 * p.lam / (p.lam + 2.0 * p.mu) * _trace(F, D)
    return math.sqrt(stretch2) if stretch2 > 0.0 else math.nan


@within
def stress(p, F, F33, dt, old, new, P):
    """P = F S, with P_33 = F_33 S_33."""
    E33 = 0.5 * (F33 * F33 - 1.0)
    pressure = p.lam * (_trace(F, D) + E33)
    S = _second_piola(F, pressure, p.mu, D)
    for i in range(D):
        for j in range(D):
            s = 0.0
            for k in range(D):
                s += F[i, k] * S[k][j]
            P[i * D + j] = s
    P[D * D] = F33 * (pressure + 2.0 * p.mu * E33)


def tangent(p, F, F33, dt, old, new, P, A):
    """dP_iJ/dF_kL = delta_ik S_JL + F_iM C_MJLN F_kN, with C of Hooke's law."""
    stress(p, F, F33, dt, old, new, P)
    E33 = 0.5 * (F33 * F33 - 1.0)
    pressure = p.lam * (_trace(F, D) + E33)
    S, last = _second_piola(F, pressure, p.mu, D), D * D
    for i in range(D):
        for k in range(D):
            b = 0.0  # (F F^T)_ik
            for m in range(D):
                b += F[i, m] * F[k, m]
            for j in range(D):
                for m in range(D):
                    a = p.lam * F[i, j] * F[k, m] + p.mu * F[i, m] * F[k, j]
                    if j == m:
                        a += p.mu * b
                    if i == k:
                        a += S[j][m]
                    A[i * D + j, k * D + m] = a
            A[i * D + k, last] = p.lam * F[i, k] * F33
            A[last, i * D + k] = p.lam * F[i, k] * F33
    A[last, last] = pressure + 2.0 * p.mu * E33 + (p.lam + 2.0 * p.mu) * F33 * F33


def energy(p, F, F33, old):
    """W = lam tr(E)^2 / 2 + mu E:E [J/m^3]."""
    E33 = 0.5 * (F33 * F33 - 1.0)
    trace = _trace(F, D) + E33
    square = E33 * E33
    for i in range(D):
        for j in range(D):
            square += _green_lagrange(F, i, j, D) ** 2
    return 0.5 * p.lam * trace * trace + p.mu * square


def linear(E: float, nu: float) -> Law:
    """Linear elastic law with Young's modulus E [Pa] and Poisson's ratio nu; raises ValueError outside -1 <
    nu < 0.5.

    >>> linear(E=2.0, nu=0.25).params
    Params(lam=0.8, mu=0.8)
    """
    return Law("linear", Params(*lame(E, nu)), ELASTIC_STATE, stress, tangent, energy, thickness)
