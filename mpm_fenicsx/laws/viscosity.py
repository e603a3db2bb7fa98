"""Viscosity beside a law: Newton's viscous stress is added to the Kirchhoff stress of a soil.

    tau = tau of the soil + 2 eta dev(d),    2 d = F^-T (C - C_old) F^-1 / dt = (1 - c) / dt,
    C = F^T F,    c = F^-T C_old F^-1

The rate is Euler's backward one, exactly zero for a step in which a body only turns (Simo & Hughes,
Computational Inelasticity, section 8.3: Green's strain of the step, pushed forward). With l = dF F^-1, dc =
-l^T c - c l, and the tangent follows in closed form; it is symmetric in the limit of small steps only.

Yield and plastic flow are those of the soil without viscosity (Kelvin's arrangement): flowing at the rate g
it bears eta g more shear than its strength, held no more than without. What the viscous stress takes counts
as plastic work. The law remembers C and (C - C_old) / dt, which a turn of the body does not change: the
stress of a state that is there, dt = 0, has the viscous part of the step that led to it, with -F^-T (dC/dt)
F^-1 in place of c / dt in all formulas.
"""
import math

import numpy as np

import mpm_dem_checks as check

from ..compiled import called
from .algebra import cofactor, determinant
from .law import Law

# C - 1 at the end of the step, and its change over the length of the step [1/s]
PAST, RATE = "right_cauchy_green", "right_cauchy_green_rate"

D = 2  # fixed by specialise, as is the law within
inverse = strain_of_step = soil_stress = soil_tangent = soil_energy = None


def inverse(F):  # noqa: F811
    """F^-1, row by row, as a tuple."""
    J = determinant(F, D)
    if D == 2:
        return F[1, 1] / J, -F[0, 1] / J, -F[1, 0] / J, F[0, 0] / J
    return (cofactor(F, 0, 0, 3) / J, cofactor(F, 1, 0, 3) / J, cofactor(F, 2, 0, 3) / J,
            cofactor(F, 0, 1, 3) / J, cofactor(F, 1, 1, 3) / J, cofactor(F, 2, 1, 3) / J,
            cofactor(F, 0, 2, 3) / J, cofactor(F, 1, 2, 3) / J, cofactor(F, 2, 2, 3) / J)


@called
def _pushed(past, one, x, i, j, D):
    """Component ij of F^-T (one + past) F^-1, x being F^-1."""
    s = 0.0
    for m in range(D):
        row = one * x[D * m + j]
        for n in range(D):
            row += past[m, n] * x[D * n + j]
        s += x[D * m + i] * row
    return s


def strain_of_step(old, x, F33, dt):  # noqa: F811
    """c, row by row, as a tuple, and its component across the plane (0 in space); for dt = 0 what takes the
    place of c / dt."""
    one, sign = (0.0, -1.0) if dt == 0.0 else (1.0, 1.0)
    C = old.right_cauchy_green_rate if dt == 0.0 else old.right_cauchy_green
    if D == 2:
        return ((sign * _pushed(C, one, x, 0, 0, 2), sign * _pushed(C, one, x, 0, 1, 2),
                 sign * _pushed(C, one, x, 1, 0, 2), sign * _pushed(C, one, x, 1, 1, 2)),
                sign * (one + C[2, 2]) / (F33 * F33))
    xx, yy, zz = (sign * _pushed(C, one, x, 0, 0, 3), sign * _pushed(C, one, x, 1, 1, 3),
                  sign * _pushed(C, one, x, 2, 2, 3))
    xy, yz, zx = (sign * _pushed(C, one, x, 0, 1, 3), sign * _pushed(C, one, x, 1, 2, 3),
                  sign * _pushed(C, one, x, 2, 0, 3))
    return (xx, xy, zx, xy, yy, yz, zx, yz, zz), 0.0


@called
def _mean(c, c33, D):
    """A third of the trace of c."""
    s = c33
    for i in range(D):
        s += c[D * i + i]
    return s / 3.0


@called
def _row(c, x, i, n, D):
    """Component i, n of c F^-T: row i of c with row n of x."""
    s = 0.0
    for k in range(D):
        s += c[D * i + k] * x[D * n + k]
    return s


@called
def _remember(F, F33, dt, old, new, D):
    """C - 1 at the end of the step and its rate, which stays where the state does."""
    for i in range(D):
        for j in range(D):
            s = -1.0 if i == j else 0.0
            for k in range(D):
                s += F[k, i] * F[k, j]
            new.right_cauchy_green[i, j] = s
    if D == 2:
        new.right_cauchy_green[2, 2] = F33 * F33 - 1.0
    for i in range(3):
        for j in range(3):
            rate = old.right_cauchy_green_rate[i, j]
            if dt > 0.0:
                rate = (new.right_cauchy_green[i, j] - old.right_cauchy_green[i, j]) / dt
            new.right_cauchy_green_rate[i, j] = rate


def stress(p, F, F33, dt, old, new, P):
    """Returns what the soil's returns."""
    found = soil_stress(p, F, F33, dt, old, new, P)
    _remember(F, F33, dt, old, new, D)
    if dt < math.inf:
        x = inverse(F)
        c, c33 = strain_of_step(old, x, F33, dt)
        mean, eta = _mean(c, c33, D), p.viscosity / (dt if dt > 0.0 else 1.0)
        square = (mean - c33) ** 2 if D == 2 else 0.0  # of the deviator of 1 - c
        for i in range(D):
            for j in range(D):
                P[i * D + j] += eta * (mean * x[D * j + i] - _row(c, x, i, j, D))
                square += ((mean if i == j else 0.0) - c[D * i + j]) ** 2
        if D == 2:
            P[D * D] += eta * (mean - c33) / F33
        if dt > 0.0:
            new.plastic_work += 0.5 * eta * square
    return found


def tangent(p, F, F33, dt, old, new, P, A):
    """Of the viscous stress, with x = F^-1 and g = (1 - c) / dt, eta times

        (x_Li (c x^T)_kJ + c_ik (x x^T)_JL - 2/3 x_Ji (c x^T)_kL) / dt - (dev(g) x^T)_iL x_Jk
    """
    soil_tangent(p, F, F33, dt, old, new, P, A)
    stress(p, F, F33, dt, old, new, P)
    if not dt < math.inf:
        return
    x, last = inverse(F), D * D
    c, c33 = strain_of_step(old, x, F33, dt)
    mean, eta = _mean(c, c33, D), p.viscosity / (dt if dt > 0.0 else 1.0)
    for i in range(D):
        for k in range(D):
            for m in range(D):
                turned = mean * x[D * m + i] - _row(c, x, i, m, D)
                along = _row(c, x, k, m, D)
                for j in range(D):
                    A[D * i + j, D * k + m] += eta * (
                        x[D * m + i] * _row(c, x, k, j, D) + c[D * i + k] * _row(x, x, j, m, D)
                        - 2.0 / 3.0 * x[D * j + i] * along - turned * x[D * j + k])
        if D == 2:
            for j in range(D):
                A[D * i + j, last] -= 2.0 / 3.0 * eta * c33 * x[D * j + i] / F33
                A[last, D * i + j] -= 2.0 / 3.0 * eta * _row(c, x, i, j, D) / F33
    if D == 2:
        A[last, last] += eta * (4.0 / 3.0 * c33 - (mean - c33)) / (F33 * F33)


def energy(p, F, F33, old):
    """That of the soil."""
    return soil_energy(p, F, F33, old)


def with_viscosity(law: Law) -> Law:
    """The soil ``law``, one of ``laws.hencky``, with the ``viscosity`` [Pa s] among its parameters; as it is
    where that is 0. Raises ValueError for a negative one.

    >>> from mpm_fenicsx.laws import von_mises
    >>> von_mises(1e6, 0.3, 1e3, viscosity=50.0).state.names[-2:]
    ('right_cauchy_green', 'right_cauchy_green_rate')
    """
    if check.not_negative("viscosity", law.params.viscosity, "Pa s") == 0.0:
        return law
    state = np.dtype([*((name, law.state[name]) for name in law.state.names),
                      *((name, np.float64, (3, 3)) for name in (PAST, RATE))])
    return law._replace(state=state, stress=stress, tangent=tangent, energy=energy, thickness=None,
                        symmetric=False, parts=(("soil", law), ("inverse", inverse),
                                                ("strain_of_step", strain_of_step)))
