"""One coupling window: of a solid alone, and weakly coupled (algorithm 1 of the paper, with several DEM
steps)."""
from time import perf_counter
from typing import Any, Dict, NamedTuple, Optional, Tuple

import numpy as np

from ..ledger.limit import LimitWatch
from ..maps.mapping import Mapping
from ..protocols import Grains, InterfaceChange, Solid
from .ladder import Ladder
from .trend import Trend


class Window(NamedTuple):
    """What happened in one coupling window. ``number`` counts from 1, ``time`` [s] is its end, ``dt`` [s] its
    length, ``fraction`` the same as a part of the longest.

    Wall nodes moved from ``wall_x`` with ``wall_v``, the mean force on them was ``wall_force`` [N], shape (m,
    dim); the interface got ``force`` [N], moved by ``moved`` [m], is now at ``x`` with ``v``, and had
    ``v_start`` before, shape (n, dim); ``particles``: the grains at its end; ``seconds``: run time of the
    DEM, the mapping and the MPM. Of a solid alone there is no wall and are no particles (m = p = 0), and the
    force is zero.

    ``change``: how the interface's points before the window became those in it, see ``InterfaceChange``,
    or None; ``substeps`` of the DEM in it; ``iterations``: how often both partitions computed it, the
    attempts that were given up left out: ``failed`` of them failed, ``refused`` were too long for the
    accuracy asked for; ``acceleration`` of the interface's mean velocity from window to window [m/s^2], shape
    (n, dim), with weak coupling; ``wall_force_before`` [N]: in the window before; ``indentation_energy``:
    elastic energy of the indentation that both partitions hold [J], where a map subtracts it from the motion,
    see ``spread``: ``wall_x`` is the wall without that; ``arms`` [m], shape (m, dim): mean place of each wall
    node in the window less that of the interface's points which get its force, None where there is none;
    ``owed`` [N], (n, dim): by how much the force that the grains answered exceeds ``force``, None with weak
    coupling; ``state``: what the loop goes on from besides.

    >>> one = np.ones((1, 2))
    >>> window = Window(1, 1e-3, 1e-3, *3 * [one], 5.0 * one, *4 * [one], particles=one, seconds={})
    >>> float(window.force[:, 1].sum()), window.iterations
    (5.0, 1)
    """

    number: int
    time: float
    dt: float
    wall_x: np.ndarray
    wall_v: np.ndarray
    wall_force: np.ndarray
    force: np.ndarray
    moved: np.ndarray
    x: np.ndarray
    v: np.ndarray
    v_start: np.ndarray
    particles: np.ndarray
    seconds: Dict[str, float]
    change: Optional[InterfaceChange] = None
    substeps: int = 0
    fraction: float = 1.0
    iterations: int = 1
    failed: int = 0
    refused: int = 0
    acceleration: Optional[np.ndarray] = None
    wall_force_before: Optional[np.ndarray] = None
    indentation_energy: float = 0.0
    arms: Optional[np.ndarray] = None
    owed: Optional[np.ndarray] = None
    state: Any = None


class Clock:
    """Seconds per phase."""

    def __init__(self) -> None:
        self.seconds, self._last = dict.fromkeys(("DEM", "mapping", "MPM"), 0.0), perf_counter()

    def lap(self, name: str) -> None:
        """Add the time since the last lap to the phase ``name``."""
        now = perf_counter()
        self.seconds[name] += now - self._last
        self._last = now


class Alone:
    """The windows of a solid that nothing touches."""

    trend = None

    def __init__(self, solid: Solid, ladder: Ladder) -> None:
        self._ladder, (self._x, self._v) = ladder, solid.surface()
        dim = self._x.shape[1]
        self._no_nodes = np.zeros((0, dim))
        self._no_force = np.zeros_like(self._x)
        self._no_particles = np.zeros(0, [("x", float, dim), ("v", float, dim), ("mass", float)])

    def __call__(self, number: int, time: float, dt: float, steps: int) -> Window:
        """The ``Window`` of ``dt`` [s] that ends at ``time`` [s]. steps: parts of a window, see
        ``StepControl``."""
        before, none = perf_counter(), self._no_nodes
        x, v = self._ladder.advance(dt)
        seconds = {"MPM": perf_counter() - before}
        return Window(number, time, dt, none, none, none, self._no_force, x - self._x, x, v, self._v,
                      self._no_particles, seconds)

    def accept(self, window: Window) -> None:
        """Go on from the end of ``window``."""
        self._x, self._v = window.x, window.v

    def error(self, window: Window) -> float:
        """No force, no error of its extrapolation."""
        return 0.0

    def get_state(self) -> None:
        """Nothing goes over to the next window besides the solid's state."""


class Sides(NamedTuple):
    """What is coupled: ``ladder`` advances the solid."""

    solid: Solid
    grains: Grains
    mapping: Mapping
    ladder: Ladder


class Coupled:
    """The windows of a solid and grains. trend: of the force so far, None where nobody needs it."""

    def __init__(self, sides: Sides, trend: Optional[Trend]) -> None:
        self._solid, self._grains, self._mapping, self._ladder = sides
        self.trend, (self._x, self._v) = trend, self._solid.surface()
        self._change: Optional[InterfaceChange] = None

    def transfer(self, change: InterfaceChange) -> None:
        """The interface has other points from the coming window on."""
        self._change, (self._x, self._v) = change, self._solid.surface()
        self.trend = self.trend and self.trend.transferred(change)

    def accept(self, window: Window) -> None:
        """Go on from the end of ``window``."""
        self.trend = self.trend and self.trend.after(window.force, window.dt)
        self._change, self._x, self._v = None, window.x, window.v

    def _arms(self, wall: Tuple[np.ndarray, np.ndarray, np.ndarray], dt: float,
              middle: np.ndarray) -> Optional[np.ndarray]:
        """See ``Window``. wall: its places at the start [m], velocities and forces in the window, shape (m,
        dim); middle: mean place of the interface's points in it [m], (n, dim)."""
        x, v, force = wall
        return x + 0.5 * dt * v - self._mapping.mean_places(middle) if force.any() else None

    def error(self, window: Window) -> float:
        """Of the extrapolated force in a ``window`` that is not accepted yet, see ``Trend``."""
        return self.trend.error(window.force, window.dt) if self.trend else 0.0


class Weak(Coupled):
    """In each window the DEM goes first, with the wall carried on at the interface's mean velocity,
    extrapolated from those of the last two windows; its mean force then drives the MPM (momentum is exact:
    force times window is the impulse). The mean is that of the displacement. The velocity itself would not
    do: of boundary particles it differs from their motion by what the grid smooths away, so that a wall that
    follows it jumps back in every window, and in windows longer than the periods of the grid it jumps from
    window to window around its mean (Newmark's method keeps these periods at full amplitude), which damping
    in the contact then feeds."""

    def __init__(self, sides: Sides, trend: Optional[Trend] = None, last: Optional[Window] = None,
                 state: Any = None) -> None:
        super().__init__(sides, trend)
        self._last, self._watch = last, LimitWatch(sides.solid, sides.grains)
        if state is not None:
            self._watch.set_state(state)

    def __call__(self, number: int, time: float, dt: float, steps: int) -> Window:
        """The ``Window`` of ``dt`` [s] and ``steps`` DEM steps that ends at ``time`` [s]."""
        clock = Clock()
        wall_x, wall_v = self._mapping.motion(self._x, self._coming(dt))
        clock.lap("mapping")
        inner = self._without_indentation(wall_x)
        wall_force = self._grains.advance(steps, inner, wall_v)
        particles = self._grains.particles()
        check_finite(number, time, force_on_the_wall=wall_force, position_of_a_particle=particles["x"],
                     velocity_of_a_particle=particles["v"])
        clock.lap("DEM")
        force = self._mapping.force(wall_force)
        self._watch.look(time, dt, force)
        clock.lap("mapping")
        x, v = self._ladder.advance(dt, force)
        check_finite(number, time, position_of_the_interface=x, velocity_of_the_interface=v)
        clock.lap("MPM")
        moved = x - self._x
        return Window(number, time, dt, wall_x, wall_v, wall_force, force, moved, x, v, self._v, particles,
                      clock.seconds, self._change, steps, acceleration=self._acceleration(moved, dt),
                      wall_force_before=None if self._last is None else self._last.wall_force,
                      indentation_energy=indentation_energy(self._mapping, wall_force),
                      arms=self._arms((inner, wall_v, wall_force), dt, x - 0.5 * moved))

    def accept(self, window: Window) -> None:
        """See ``Coupled``."""
        self._watch.look(window.time, window.dt, window.force)  # once more: a new grid knows its mass now
        self._watch.judge(window, self._last)
        super().accept(window)
        self._last = window

    def get_state(self) -> Any:
        """What goes over to the next window besides the last ``Window``."""
        return self._watch.get_state()

    def _without_indentation(self, wall_x: np.ndarray) -> np.ndarray:
        """Places of the wall [m] without the indentation under the force that is extrapolated from the last
        two windows."""
        if not self._mapping.compliance or self._last is None:
            return wall_x
        force, before = self._last.wall_force, self._last.wall_force_before
        return wall_x - self._mapping.indentation(force if before is None else 2.0 * force - before)

    def _coming(self, dt: float) -> np.ndarray:
        """Velocity of the interface in the coming window [m/s], shape (n, dim)."""
        last = self._last
        if last is None:
            return self._v
        assert last.acceleration is not None  # of every window of this scheme
        coming = last.moved / last.dt + last.acceleration * (0.5 * (last.dt + dt))
        return coming if self._change is None else self._change.interpolate(coming) + _new(self._change)

    def _acceleration(self, moved: np.ndarray, dt: float) -> np.ndarray:
        """How fast the mean velocity has risen since the last window, or since the start [m/s^2], shape (n,
        dim)."""
        last = self._last
        before, between = self._v, 0.5 * dt
        if last is not None:
            before, between = last.moved / last.dt, 0.5 * (last.dt + dt)
        if last is not None and self._change is not None:
            before = self._change.interpolate(before) + _new(self._change)
        return (moved / dt - before) / between


def _new(change: InterfaceChange) -> Any:
    """Velocity of points that have come out of nothing, of themselves [m/s], zero of others, shape (n,
    dim)."""
    return getattr(change, "new_velocity", 0.0)


def indentation_energy(mapping: Mapping, wall_force: np.ndarray) -> float:
    """What the solid holds of it [J], under ``wall_force`` [N], shape (m, dim)."""
    return 0.5 * float(np.vdot(wall_force, mapping.indentation(wall_force))) if mapping.compliance else 0.0


def check_finite(number: int, time: float, **quantities: np.ndarray) -> None:
    """FloatingPointError naming the first array that holds NaN or infinity."""
    if np.isfinite(sum(float(np.vdot(values, values)) for values in quantities.values())):
        return  # sums of squares do not warn, as sums do
    lost = next((name for name, values in quantities.items() if not np.isfinite(values).all()), None)
    if lost:
        raise FloatingPointError(f"the {lost.replace('_', ' ')} is not a finite number in window {number}, "
                                 f"which ends at t = {time:.6g} s: take a smaller dt or more substeps")
