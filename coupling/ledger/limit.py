"""Weak coupling at its limit: how long a window may be, and whether the exchange makes energy.

A mass m that moves freely over a window dt under the force of a contact of stiffness k and damping c, with a
heavy particle, whose wall is carried on at the extrapolated mean velocity (``window.Weak``): with the
displacement x, the velocity v and the mean velocities u of the last windows, w = 2 u' - u'' and F = -k (x + w
dt/2) - c w. The roots of its characteristic polynomial leave the unit circle at k dt^2/m = 4/3 without
damping, at c dt/m = 2/sqrt(3) without stiffness, and in between beyond the straight line from one to the
other, by at most 6 %.
"""
import warnings
from typing import Any, Union

import numpy as np
from mpi4py import MPI

Number = Union[float, np.ndarray]

LIGHT = 0.8  # a particle lighter than this part of m cannot move it away, whatever the contact (exact: 0.87)
MADE = 0.25  # energy made at the interface, relative to what is exchanged, from which a run rings
SLOWLY, FAST = 0.99, 0.9  # weights of what a contact did one window ago
ENOUGH = 20  # windows in contact before the energy is judged: the first one alone is all error


def load(dt: Number, mass: Number, stiffness: Number, damping: Number) -> Number:
    """1 at the limit: see above. SI units, numbers or arrays."""
    return (0.75 * stiffness * dt**2 + 0.5 * np.sqrt(3.0) * damping * dt) / mass


def longest(mass: Number, stiffness: Number, damping: Number) -> Number:
    """The window [s] at the limit."""
    k, c = 0.75 * stiffness, 0.5 * np.sqrt(3.0) * damping
    return 2.0 * mass / (c + np.sqrt(c**2 + 4.0 * k * mass))


class LimitWatch:
    """Warns once of each: a contact for which the window is too long, and energy made at the interface.
    Collective."""

    def __init__(self, solid: Any, grains: Any) -> None:
        self._solid, self._grains = solid, grains
        self._looks = hasattr(solid, "window_mass") and hasattr(grains, "contact_at_wall")
        self._seen, self._count, self._judges = 0.0, 0, True
        self._made = self._exchanged = self._size = self._late = 0.0

    def get_state(self) -> tuple:
        """What has been seen so far, as numbers."""
        return (self._seen, self._count, self._judges, self._looks, self._made, self._exchanged, self._size,
                self._late)

    def set_state(self, state: tuple) -> None:
        """The counterpart."""
        (self._seen, self._count, self._judges, self._looks, self._made, self._exchanged, self._size,
         self._late) = state

    def look(self, time: float, dt: float, force: np.ndarray) -> None:
        """Is the contact under the largest of the forces [N] on the interface, shape (n, dim), beyond the
        limit of the window that ends at ``time`` [s]? Looks only when that force is twice what it has seen,
        and if the solid has a ``window_mass`` and the grains a ``contact_at_wall``, see ``protocols``."""
        size = np.einsum("ni,ni->n", force, force) if self._looks else ()
        at = int(np.argmax(size)) if len(size) else 0
        if not len(size) or not size[at] > 4.0 * self._seen**2:
            return
        mass = self._solid.window_mass()[at]
        if mass == np.inf:  # held, or not known yet
            return
        self._seen = float(np.sqrt(size[at]))
        stiffness, damping, ball = self._grains.contact_at_wall(self._seen)
        loads = np.where(ball > LIGHT * mass, load(dt, mass, stiffness, damping), 0.0)
        if not loads.max(initial=0.0) > 1.0:
            return
        self._looks, worst = False, int(loads.argmax())
        k, c = stiffness[worst], damping[worst]
        say(f"the window of {dt:.3g} s that ends at t = {time:.6g} s exceeds the {longest(mass, k, c):.3g} s "
            f"that weak coupling bears, less under more force: a contact of {k:.3g} N/m and {c:.3g} kg/s "
            f"(damping) under {self._seen:.3g} N pushes {mass:.3g} kg of the solid. The force rings and may "
            "throw particles off: repeat the windows (iterate=20), or take a smaller dt, a softer or a less "
            "damped contact")

    def judge(self, window: Any, last: Any) -> None:
        """Has more energy been made at the interface of late than a right exchange makes, and does that not
        die away? last: the window before, or None."""
        given = float(np.vdot(window.force, window.moved)) if self._judges else 0.0
        if not given:
            return
        made = given - work_on_wall(window, last)
        self._count += 1
        self._made, self._exchanged = SLOWLY * self._made + made, SLOWLY * self._exchanged + abs(given)
        self._size, self._late = SLOWLY * self._size + abs(made), FAST * self._late + abs(made)
        grows = self._late * (1.0 - FAST) * (1.0 - SLOWLY**self._count) > self._size * (1.0 - SLOWLY)  # means
        if self._count > ENOUGH and grows and self._made > MADE * self._exchanged:
            self._judges = False
            say(f"weak coupling has made {self._made:.3g} J at the interface until t = {window.time:.6g} s, "
                f"{self._made / self._exchanged:.0%} of the work exchanged there: its force rings, and "
                "particles may be thrown off: repeat the windows (iterate=20) or take a smaller dt")


def work_on_wall(window: Any, last: Any) -> float:
    """Work [J] in a window, and in the jump before it from where the wall was carried in the ``last`` one, or
    None, to where the interface went, under the mean of the forces on both sides of it; points that are new
    have jumped as their neighbours."""
    work = window.dt * float(np.vdot(window.wall_force, window.wall_v))
    if last is None:
        return work
    if window.change is None:
        jump = before = window.wall_x - last.wall_x - last.dt * last.wall_v
    else:
        before = last.x - last.wall_x - last.dt * last.wall_v
        jump = window.change.interpolate(before)
    return work + 0.5 * float(np.vdot(last.wall_force, before) + np.vdot(window.wall_force, jump))


def say(text: str) -> None:
    """Warn, once for all ranks."""
    if MPI.COMM_WORLD.rank == 0:
        warnings.warn(text, stacklevel=2)
