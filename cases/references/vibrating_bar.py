"""A bar held at one end vibrates along its axis: a fine Lagrangian mesh of finite elements in one dimension.

The law is the neo-Hookean one without Poisson's ratio, P = E/2 (F - 1/F), and time goes on by Newmark's
method (beta 1/4, gamma 1/2), as in the material point method; what is left of a difference is the space
discretisation. Linear elements with consistent mass, one quadrature point each, on which F is constant.
"""
from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_banded

LONGEST = 30  # Newton iterations


class BarHistory(NamedTuple):
    """Per section of 1 m^2, after each step: momentum [kg/m^2/s], kinetic and strain energy in all [J/m^2],
    displacement of the free end [m], shape (steps,) each."""

    momentum: np.ndarray
    energy: np.ndarray
    end: np.ndarray


def vibrate(length: float, E: float, rho: float, speed: float, dt: float, steps: int,
            elements: int = 400) -> BarHistory:
    """The bar from ``length`` [m], ``E`` [Pa], ``rho`` [kg/m^3], held at X = 0, with v = speed sin(pi X / (2
    length)) [m/s] at the start; ``steps`` of ``dt`` [s]."""
    h = length / elements
    x = h * np.arange(1, elements + 1)
    v, a, u = speed * np.sin(0.5 * np.pi / length * x), np.zeros(elements), np.zeros(elements)
    mass = rho * h / 6 * _tridiagonal(np.ones(elements), 2.0, 1.0)
    rows = np.zeros((steps, 3))
    for step in range(steps):
        start = u.copy()
        u = u + dt * v
        for _ in range(LONGEST):
            F = 1 + np.diff(u, prepend=0.0) / h
            stress, modulus = 0.5 * E * (F - 1 / F), 0.5 * E * (1 + 1 / F**2)
            new = 4 / dt**2 * (u - start - dt * v) - a
            residual = _times(mass, new) + stress - np.append(stress[1:], 0.0)
            change = solve_banded((1, 1), 4 / dt**2 * mass + _tridiagonal(modulus / h, 1.0, -1.0), -residual)
            u = u + change
            if np.abs(change).max() < 1e-13 * length:
                break
        else:
            raise ArithmeticError(f"no convergence in step {step + 1} of the bar: take a shorter dt")
        new = 4 / dt**2 * (u - start - dt * v) - a
        v, a = v + 0.5 * dt * (a + new), new
        F = 1 + np.diff(u, prepend=0.0) / h
        strain = 0.5 * E * h * (0.5 * (F**2 - 1) - np.log(F)).sum()
        rows[step] = _times(mass, v).sum() + rho * h / 6 * v[0], 0.5 * v @ _times(mass, v) + strain, u[-1]
    return BarHistory(*rows.T)


def period(time: np.ndarray, values: np.ndarray) -> float:
    """Mean period [s] between the first and the last change of sign of ``values``, shape (n,), at ``time``
    [s]; NaN with fewer than two."""
    i = np.flatnonzero(values[1:] * values[:-1] < 0)
    zeros = time[i] + (time[i + 1] - time[i]) * values[i] / (values[i] - values[i + 1])
    return 2 * (zeros[-1] - zeros[0]) / (len(zeros) - 1) if len(zeros) > 1 else np.nan


def _tridiagonal(element: np.ndarray, own: float, other: float) -> np.ndarray:
    """Element values times (own, other; other, own), assembled without the held node: bands for
    ``solve_banded``, shape (3, n)."""
    bands = np.zeros((3, len(element)))
    bands[1] = own * element
    bands[1, :-1] += own * element[1:]
    bands[0, 1:] = bands[2, :-1] = other * element[1:]
    return bands


def _times(bands: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Matrix of ``bands`` times x."""
    y = bands[1] * x
    y[:-1] += bands[0, 1:] * x[1:]
    y[1:] += bands[2, :-1] * x[:-1]
    return y
