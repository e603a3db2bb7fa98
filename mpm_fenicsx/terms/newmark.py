"""Newmark's method with the displacement over the step as unknown: pure functions of arrays.

beta = 1/4 and gamma = 1/2, the paper's average acceleration (eq. 10: alpha = 1 / (0.25 dt^2)).
"""
from typing import NamedTuple

import numpy as np

BETA = 0.25
PLACE = 1.0  # part of the step at which forces act


class Increment(NamedTuple):
    """A step of length ``dt`` [s] with the displacement ``u`` of the nodes over it [m], their acceleration
    ``a`` at its end [m/s^2], both (nodes, D), and ``alpha`` = da/du [1/s^2]."""

    dt: float
    alpha: float
    u: np.ndarray
    a: np.ndarray


def alpha(dt):
    """da/du [1/s^2]."""
    return 1.0 / (BETA * dt * dt)


def velocity(grid, increment):
    """Of the nodes at the end of the step [m/s], shape (nodes, D), by the trapezoidal rule."""
    return grid.v + 0.5 * increment.dt * (grid.a + increment.a)


def acceleration(u, v, a, dt):
    """Acceleration at the end of the step from its displacement u and from velocity v and acceleration a at
    its start, arrays of one shape."""
    return alpha(dt) * (u - dt * v) - (0.5 / BETA - 1.0) * a
