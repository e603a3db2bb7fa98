"""Two partitions of one mass each: an oscillator and a ball on a Hertz spring, and the solution of both
together."""
import numpy as np
from scipy.integrate import solve_ivp

from coupling import nearest

MASS, SPRING = 2.0, 50.0  # of the oscillator
BALL, CONTACT, SPEED, WEIGHT = 1.0, 400.0, 1.0, -2.0  # Hertz stiffness, downward speed at the start, gravity
T_END, INNER = 0.48, 1.5e-4  # first contact: 0 to about 0.45; the inner step's own error is below 1e-7


class Oscillator:
    """Newmark's method (average acceleration) under a constant load; moves up and down at one interface
    point."""

    def __init__(self, mass=MASS):
        self.mass, self.time, self.u, self.v = mass, 0.0, 0.0, 0.0
        self.applied = np.zeros(2)

    def surface(self):
        return np.array([[0.0, self.u]]), np.array([[0.0, self.v]])

    def advance(self, dt, force):
        f, u, v = force[0, 1], self.u, self.v
        a = (f - SPRING * u) / self.mass
        a_end = (f - SPRING * (u + dt * v + 0.25 * dt**2 * a)) / (self.mass + 0.25 * dt**2 * SPRING)
        self.u, self.v = u + dt * v + 0.25 * dt**2 * (a + a_end), v + 0.5 * dt * (a + a_end)
        self.applied = force[0].copy()
        self.time += dt
        return self.surface()

    def energy(self):
        return {"kinetic": 0.5 * self.mass * self.v**2, "strain": 0.5 * SPRING * self.u**2}

    def get_state(self):
        return dict(self.__dict__)

    def set_state(self, state):
        self.__dict__.update(state)


class Ball:
    """Velocity Verlet of a ball that touches the wall point at the start."""

    def __init__(self, gravity=0.0, contact=CONTACT):
        self.contact = contact
        self.dt, self.y, self.v, self.wall, self.gravity = INNER, 0.0, -SPEED, 0.0, gravity

    def _force(self, wall):
        return self.contact * max(wall - self.y, 0.0) ** 1.5

    def advance(self, steps, x, v):
        kick, impulse = self._force(x[0, 1]), 0.0
        for step in range(1, steps + 1):
            half = self.v + 0.5 * self.dt * (kick / BALL + self.gravity)
            self.y += self.dt * half
            before, kick = kick, self._force(x[0, 1] + step * self.dt * v[0, 1])
            self.v = half + 0.5 * self.dt * (kick / BALL + self.gravity)
            impulse += 0.5 * self.dt * (before + kick)
        self.wall = x[0, 1] + steps * self.dt * v[0, 1]
        return np.array([[0.0, -impulse / (steps * self.dt)]])

    def particles(self):
        out = np.zeros(1, [("x", float, 2), ("v", float, 2), ("mass", float)])
        out["x"][0, 1], out["v"][0, 1], out["mass"] = self.y, self.v, BALL
        return out

    def energy(self):
        return {"kinetic": 0.5 * BALL * self.v**2, "contact": 0.4 * self.contact * max(self.wall - self.y,
                                                                                       0.0) ** 2.5,
                "potential": -BALL * self.gravity * self.y}

    def get_state(self):
        return dict(self.__dict__)

    def set_state(self, state):
        self.__dict__.update(state)


COPY = nearest(np.zeros((1, 2)), np.zeros((1, 2)))


def exact(mass=MASS, contact=CONTACT, t_end=T_END):
    """u, its velocity, y and its velocity at ``t_end``."""
    def rate(t, s):
        force = contact * max(s[0] - s[2], 0.0) ** 1.5
        return s[1], (-force - SPRING * s[0]) / mass, s[3], force / BALL
    return solve_ivp(rate, (0, t_end), (0, 0, 0, -SPEED), "DOP853", rtol=1e-12, atol=1e-14,
                     max_step=1e-3).y[:, -1]
