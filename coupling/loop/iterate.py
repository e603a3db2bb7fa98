"""One coupling window, iterated: repeated until the force on the solid is the one that the grains answer."""
from typing import NamedTuple

import numpy as np

from .relaxation import RELAXATIONS, norm
from .window import Clock, Window, check_finite, energy_of_dent

MOST_REPETITIONS = 1000  # of a window: what has not converged by then does not


class NotConverged(RuntimeError, ArithmeticError):
    """The iteration of a window did not converge."""


class Memory(NamedTuple):
    """What goes over to the next window: ``owed``, the mean force over the last one that the grains answered and the
    solid did not get [N], shape (n, dim), the state of the relaxation, and the last force on the wall [N]."""

    owed: np.ndarray
    relax: tuple
    wall_force: np.ndarray = None


class Iterated:
    """In each window the MPM goes first, under the force predicted from the last ones, and the wall moves linearly to
    where the interface then is. The residual is what the DEM answers less that force. Both partitions are set back and
    the window is repeated with a corrected force, at most ``iterate`` times, until the residual is at most ``tol``
    times the force in this window plus the mean force of the run so far.

    Both sides move alike to the last bit. Their forces differ by the residual, which the solid gets in the next window:
    its impulse is short of that of one residual at any time. NotConverged when it takes more repetitions.
    """

    def __init__(self, solid, grains, mapping, memory=None, *, iterate=20, tol=1e-4, relax="aitken"):
        self._solid, self._grains, self._mapping = solid, grains, mapping
        self._most, self._tol, self._relax = iterate, tol, RELAXATIONS[relax]()
        self._change, (self._x, self._v) = None, solid.surface()
        self._memory = memory or Memory(np.zeros_like(self._x), self._relax.get_state())

    def resample(self, change):
        """The interface has other points from the coming window on: forces go over, directions are forgotten."""
        self._change, (self._x, self._v) = change, self._solid.surface()
        self._relax.set_state(self._memory.relax)
        self._relax.forget()
        self._memory = Memory(change.redistribute(self._memory.owed), self._relax.get_state())

    def accept(self, window):
        """Go on from the end of ``window``."""
        self._memory, self._change, self._x, self._v = window.memory.scheme, None, window.x, window.v

    def __call__(self, number, time, dt, substeps, rewind, trend):
        """The ``Window`` of ``dt`` [s] that ends at ``time`` [s]. rewind: sets both partitions back to its start;
        trend: of the force so far."""
        force, clock, repeated = trend.predict(dt), Clock(), 0
        force = np.zeros_like(self._x) if force is None else force
        self._relax.set_state(self._memory.relax)
        self._relax.start()
        self._wall_force = self._memory.wall_force
        while True:
            moved, after = self._sides(number, time, dt, substeps, force, clock)
            answer = self._mapping.force(after["wall_force"])
            residual = answer + self._memory.owed - force
            off, scale = norm(residual), norm(answer) + trend.mean()
            if off <= self._tol * scale:
                break
            if repeated == self._most:
                raise NotConverged(self._complaint(number, time, off, scale))
            force = self._relax(force, residual, answer)
            rewind()
            clock.lap("mapping")
            repeated += 1
        particles = self._grains.particles()
        check_finite(number, time, position_of_a_particle=particles["x"], velocity_of_a_particle=particles["v"])
        return Window(number, time, dt, force=force, moved=moved, v_start=self._v, particles=particles,
                      seconds=clock.seconds, resampled=self._change, substeps=substeps, iterations=repeated + 1,
                      memory=Memory(residual, self._relax.get_state(), self._wall_force),
                      twice=energy_of_dent(self._mapping, self._wall_force), **after)

    def _sides(self, number, time, dt, substeps, force, clock):
        """One computation of the window by both partitions: motion of the interface [m], and what they are then."""
        x, v = self._solid.advance(dt, force)
        check_finite(number, time, position_of_the_interface=x, velocity_of_the_interface=v)
        clock.lap("MPM")
        moved = x - self._x
        wall_x, wall_v = self._mapping.motion(self._x, moved / dt)
        clock.lap("mapping")
        undented = wall_x
        if self._mapping.takes_out and self._wall_force is not None:
            undented = wall_x - self._mapping.dent(self._wall_force)
        wall_force = self._wall_force = self._grains.advance(substeps, undented, wall_v)
        check_finite(number, time, force_on_the_wall=wall_force)
        clock.lap("DEM")
        return moved, dict(wall_x=wall_x, wall_v=wall_v, wall_force=wall_force, x=x, v=v)

    def _complaint(self, number, time, off, scale):
        most = 2 * self._most
        more = f"more repetitions (iterate={most}), " if most <= MOST_REPETITIONS else ""
        return (f"the coupling did not converge in window {number}, which ends at t = {time:.6g} s: after {self._most} "
                f"repetitions the forces of both sides still differ by {off:.3g} N, {off / scale:.2g} of their scale "
                f"(tol={self._tol:g}): take {more}a smaller dt, or shorter "
                "windows where they are needed (adapt=0)")
