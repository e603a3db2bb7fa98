"""The implicit midpoint rule with the displacement over the step as unknown, as ``newmark``: pure functions
of arrays.

Forces are those of the middle of the step, of points with F = (I + 1/2 du/dx) F_old. As the Kirchhoff stress
is symmetric, inner forces have no moment about the places of the nodes there, x_I + u_I / 2. With

    u = dt/2 (v + v'),   m (v' - v) / dt = f,

sum (x_I + u_I) × m v'_I = sum x_I × m v_I + dt sum (x_I + u_I / 2) × f_I follows for lumped masses m,
whatever the length of the step: angular momentum changes by the moment of loads alone, to the tolerance of
Newton's method (Simo & Tarnow 1992, doi 10.1007/BF00913408). Newmark's average acceleration takes half of the
inner forces with the body at x_I and half with it at x_I + u_I, and so turns a body by dt/4 sum u_I × (f_I -
f'_I) in each step. The acceleration is the mean of the step, (v' - v) / dt; the next step needs it only for
its first guess.
"""
from .newmark import Increment

PLACE = 0.5  # part of the step at which forces act


def alpha(dt):
    """da/du [1/s^2]."""
    return 2.0 / (dt * dt)


def acceleration(u, v, a, dt):
    """Mean acceleration over the step from its displacement u and from the velocity v at its start; that of
    the step before, a, has no part."""
    return alpha(dt) * (u - dt * v)


def velocity(grid, increment):
    """Of the nodes at the end of the step [m/s], shape (nodes, D)."""
    return increment.u / increment.dt + 0.5 * increment.dt * increment.a


def half(increment):
    """The step to the middle, where the forces are; its acceleration and inertia are those of the whole. A
    load step without inertia takes no time, and is whole: its equilibrium is that of the end."""
    if increment.dt == 0.0:
        return increment
    return Increment(0.5 * increment.dt, increment.alpha, 0.5 * increment.u, increment.a)
