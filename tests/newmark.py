"""Newmark's sliding block on a slope that shakes: the reference of both solvers."""
import numpy as np

FRICTION, SHAKEN, OFTEN, SLOPE = 0.3, 5.0, 2.0, np.radians(10.0)
GRAVITY = 9.81 * np.array([np.sin(SLOPE), -np.cos(SLOPE)])


def shaking(t):
    return SHAKEN * np.sin(2.0 * np.pi * OFTEN * t), 0.0


def newmark(end, dt=2e-5):
    """Displacement of Newmark's sliding block down a slope [m]: rigid, Coulomb (Newmark 1965)."""
    x = v = 0.0
    most = -FRICTION * GRAVITY[1]
    for n in range(round(end / dt)):
        pull = GRAVITY[0] - SHAKEN * np.sin(2.0 * np.pi * OFTEN * (n + 0.5) * dt)
        if v == 0.0:
            v = np.sign(pull) * max(abs(pull) - most, 0.0) * dt
        else:
            later = v + (pull - np.sign(v) * most) * dt
            v = later if later * v > 0.0 else 0.0
        x += v * dt
    return x


def gone(t):
    """How far ground that shakes as ``shaking`` says has gone from rest [m]."""
    often = 2.0 * np.pi * OFTEN
    return SHAKEN / often**2 * (often * t - np.sin(often * t))
