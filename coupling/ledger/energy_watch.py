"""Energy that a solid gains out of nothing: its energy less the work done on it at its interface can only
fall.

The exact scheme conserves it in an elastic body; what rises is an error of the step's length, of Newton's
method or of the formulation. The measure is the energy that the run has had to spend so far,

    kinetic and strain energy at the start + the most that potential energy has fallen + the sum of |work|
    + the largest kinetic energy of the grains.

The grains' is in it because a grain that strikes a point of the surface sets single nodes in motion, whose
energy is that of the grid and not yet that of the body: in the first windows of a contact much more than the
little work done so far, later a few per cent of what the grain has brought.
"""
from typing import Any

import numpy as np

from .exchange import UnstableError
from .limit import say

EVERY = 10  # windows from look to look: an energy costs about as much as a residual
WARN, STOP = 0.1, 1.0  # of the measure; the examples stay at a hundredth
ROUND_OFF = 1e-9  # of the energies themselves


class EnergyWatch:
    """Observer of a run: warns once when the ``solid`` has gained ``WARN`` of its energy, and raises
    UnstableError at ``STOP``. Looks at solids that say that nothing ``driven`` brings in energy that is not
    booked here. Those that store energy in ``springs`` may give it back: they are held against the start,
    others against the least so far. Collective."""

    def __init__(self, solid: Any) -> None:
        self._solid, self._warned, self._work, self._spent, self._brought = solid, False, 0.0, 0.0, 0.0
        self._least = self._potential = self._lowest = 0.0
        self._count, self._looks = 0, not getattr(solid, "driven", True)
        if self._looks:
            self._restart()

    def _restart(self) -> None:
        energy, self._count = self._solid.energy(), self._solid.count
        self._least = sum(energy.values()) - self._work
        self._potential = self._lowest = energy["potential"]
        self._spent = max(self._spent, energy["kinetic"] + energy["strain"])

    def get_state(self) -> tuple:
        """What has been seen so far, as numbers."""
        return (self._warned, self._work, self._spent, self._brought, self._least, self._potential,
                self._lowest, self._count)

    def set_state(self, state: tuple) -> None:
        """The counterpart."""
        (self._warned, self._work, self._spent, self._brought, self._least, self._potential, self._lowest,
         self._count) = state

    def __call__(self, window: Any) -> None:
        """Look at the energy after a ``Window``, every ``EVERY`` ones."""
        if not self._looks:
            return
        work = float(np.vdot(window.force, window.moved))
        self._work += work
        self._spent += abs(work)
        self._brought = max(self._brought, _kinetic(window.particles))
        if window.number % EVERY == 0:
            self._look(window.time)

    def _look(self, time: float) -> None:
        if self._solid.count != self._count:  # points came or went with their energy
            self._restart()
            return
        energy = self._solid.energy()
        now = sum(energy.values()) - self._work
        self._lowest = min(self._lowest, energy["potential"])
        spent = self._spent + self._brought + self._potential - self._lowest
        gained, rest = now - self._least, ROUND_OFF * sum(map(abs, energy.values()))
        if not self._solid.springs:
            self._least = min(self._least, now)
        text = (f"{gained:.3g} J until t = {time:.6g} s, {gained / (spent or 1.0):.0%} of the {spent:.3g} J "
                "it had to spend")
        if gained > STOP * spent + rest:
            raise UnstableError(f"the solid has gained energy out of nothing, {text}: take a smaller dt, or "
                                "f_bar=False, inertia=\"lumped\" or a finer grid if that does not help")
        if gained > WARN * spent + rest and not self._warned:
            self._warned = True
            say(f"the solid has gained energy out of nothing, {text}: take a smaller dt or "
                "inertia=\"lumped\", and compare")


def _kinetic(particles: np.ndarray) -> float:
    """Energy of the particles' translation [J]."""
    return 0.5 * float(np.vdot(particles["mass"], (particles["v"] ** 2).sum(axis=1)))
