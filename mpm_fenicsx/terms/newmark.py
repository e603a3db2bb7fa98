"""Newmark's method with the displacement over the step as unknown: pure functions of arrays.

beta = 1/4 and gamma = 1/2, the paper's average acceleration (eq. 10: alpha = 1 / (0.25 dt^2)).
"""
BETA = 0.25


def alpha(dt):
    """da/du [1/s^2]."""
    return 1.0 / (BETA * dt * dt)


def acceleration(u, v, a, dt):
    """Acceleration at the end of the step from its displacement u and from velocity v and acceleration a at its
    start, arrays of one shape."""
    return alpha(dt) * (u - dt * v) - (0.5 / BETA - 1.0) * a
