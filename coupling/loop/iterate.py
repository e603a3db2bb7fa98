"""One coupling window, iterated: repeated until the force on the solid is the one that the grains answer."""
from typing import Any, Dict, NamedTuple, Optional, Tuple

import numpy as np

from ..protocols import InterfaceChange
from ..scheme import Scheme
from .relaxation import RELAXATIONS, norm
from .trend import Trend
from .window import Clock, Coupled, Sides, Window, check_finite, indentation_energy

MOST_REPETITIONS = 1000  # of a window: what has not converged by then does not


class NotConvergedError(RuntimeError, ArithmeticError):
    """The iteration of a window did not converge."""


class IterationState(NamedTuple):
    """What goes over to the next window: the ``residual``, the mean force over the last one that the grains
    answered and the solid did not get [N], shape (n, dim), the state of the relaxation, and the last force on
    the wall [N]."""

    residual: np.ndarray
    relaxation: Tuple
    wall_force: Optional[np.ndarray] = None


class Iterated(Coupled):
    """In each window the MPM goes first, under the force predicted from the last ones, and the wall moves
    linearly to where the interface then is. The residual is what the DEM answers less that force. Both
    partitions are set back and the window is repeated with a corrected force, at most ``iterate`` times,
    until the residual is at most ``tol`` times the force in this window plus the mean force of the run so
    far.

    Both sides move alike to the last bit. Their forces differ by the residual, which the solid gets in the
    next window: its impulse is short of that of one residual at any time. NotConvergedError when it takes
    more repetitions.
    """

    trend: Trend

    def __init__(self, sides: Sides, trend: Trend, scheme: Scheme,
                 state: Optional[IterationState] = None) -> None:
        super().__init__(sides, trend)
        self._scheme, self._relax = scheme, RELAXATIONS[scheme.relax]()
        self._state = self._next = state or IterationState(np.zeros_like(self._x), self._relax.get_state())
        self._wall_force: Optional[np.ndarray] = None

    def transfer(self, change: InterfaceChange) -> None:
        """The interface has other points from the coming window on: forces go over, directions are
        forgotten."""
        super().transfer(change)
        self._relax.set_state(self._state.relaxation)
        self._relax.forget()
        self._state = IterationState(change.redistribute(self._state.residual), self._relax.get_state())

    def accept(self, window: Window) -> None:
        """See ``Coupled``."""
        super().accept(window)
        self._state = self._next

    def get_state(self) -> IterationState:
        """What goes over to the next window."""
        return self._state

    def __call__(self, number: int, time: float, dt: float, steps: int) -> Window:
        """The ``Window`` of ``dt`` [s] and ``steps`` DEM steps that ends at ``time`` [s]."""
        clock, repeated = Clock(), 0
        force = self.trend.predict(dt)
        if force is None:
            force = np.zeros_like(self._x)
        self._relax.set_state(self._state.relaxation)
        self._relax.start()
        self._wall_force = self._state.wall_force
        while True:
            moved, after = self._compute(number, time, dt, steps, force, clock)
            answer = self._mapping.force(after["wall_force"])
            residual = answer + self._state.residual - force
            off, scale = norm(residual), norm(answer) + self.trend.mean()
            if off <= self._scheme.tol * scale:
                break
            if repeated == self._scheme.iterate:
                raise NotConvergedError(self._complaint(number, time, off, scale))
            force = self._relax(force, residual, answer)
            self._ladder.rewind()
            clock.lap("mapping")
            repeated += 1
        particles = self._grains.particles()
        check_finite(number, time, position_of_a_particle=particles["x"],
                     velocity_of_a_particle=particles["v"])
        self._next = IterationState(residual, self._relax.get_state(), self._wall_force)
        return Window(number, time, dt, force=force, moved=moved, v_start=self._v, particles=particles,
                      seconds=clock.seconds, change=self._change, substeps=steps, iterations=repeated + 1,
                      indentation_energy=indentation_energy(self._mapping, after["wall_force"]),
                      owed=residual - self._state.residual, **after)

    def _compute(self, number: int, time: float, dt: float, steps: int, force: np.ndarray,
                 clock: Clock) -> Tuple[np.ndarray, Dict[str, Any]]:
        """One computation of the window by both: motion of the interface [m], and what they are then."""
        x, v = self._ladder.advance(dt, force)
        check_finite(number, time, position_of_the_interface=x, velocity_of_the_interface=v)
        clock.lap("MPM")
        moved = x - self._x
        wall_x, wall_v = self._mapping.motion(self._x, moved / dt)
        clock.lap("mapping")
        inner = wall_x
        if self._mapping.compliance and self._wall_force is not None:
            inner = wall_x - self._mapping.indentation(self._wall_force)
        wall_force = self._wall_force = self._grains.advance(steps, inner, wall_v)
        check_finite(number, time, force_on_the_wall=wall_force)
        clock.lap("DEM")
        arms = self._arms((inner, wall_v, wall_force), dt, x - 0.5 * moved)
        return moved, dict(wall_x=wall_x, wall_v=wall_v, wall_force=wall_force, x=x, v=v, arms=arms)

    def _complaint(self, number: int, time: float, off: float, scale: float) -> str:
        most = 2 * self._scheme.iterate
        more = f"more repetitions (iterate={most}) or " if most <= MOST_REPETITIONS else ""
        return (f"the coupling did not converge in window {number}, which ends at t = {time:.6g} s: after "
                f"{self._scheme.iterate} repetitions the forces of both sides still differ by {off:.3g} N, "
                f"{off / scale:.2g} of their scale (tol={self._scheme.tol:g}): take {more}a smaller dt")
