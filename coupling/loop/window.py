"""One coupling window, weakly coupled: algorithm 1 of the paper, with substeps of the DEM."""
from time import perf_counter
from typing import NamedTuple

import numpy as np

from ..ledger.limit import Watch


class Window(NamedTuple):
    """What happened in one coupling window. ``number`` counts from 1, ``time`` [s] is its end, ``dt`` [s] its length.

    Wall nodes moved from ``wall_x`` with ``wall_v``, the mean force on them was ``wall_force`` [N], shape (m, dim); the
    interface got ``force`` [N], moved by ``moved`` [m], is now at ``x`` with ``v``, and had ``v_start`` before, shape
    (n, dim); ``particles``: the grains at its end; ``seconds``: run time of the DEM, the mapping and the MPM;
    ``resampled``: how the interface's points before the window became those in it, see ``resample``, or None.

    ``substeps`` of the DEM in it; ``iterations``: how often both partitions computed it, the attempts that were given
    up left out: ``failed`` of them failed, ``refused`` were too long for the accuracy asked for; ``gain``: of the
    interface's mean velocity from window to window [m/s^2], shape (n, dim), with weak coupling; ``memory``: what the
    loop goes on from besides; ``earlier``: the force on the wall in the window before [N]. ``twice``: energy of the dent
    that both partitions hold [J], where a map takes out its motion, see ``spread``: ``wall_x`` is the wall without that.
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
    seconds: dict
    resampled: object = None
    substeps: int = 1
    iterations: int = 1
    failed: int = 0
    refused: int = 0
    gain: np.ndarray = None
    memory: object = None
    earlier: np.ndarray = None
    twice: float = 0.0


class Clock:
    """Seconds per partition."""

    def __init__(self):
        self.seconds, self._last = dict.fromkeys(("DEM", "mapping", "MPM"), 0.0), perf_counter()

    def lap(self, name):
        now = perf_counter()
        self.seconds[name] += now - self._last
        self._last = now


class Weak:
    """In each window the DEM goes first, with the wall carried on at the interface's mean velocity, extrapolated from
    those of the last two windows; its mean force then drives the MPM (momentum is exact: force times window is the
    impulse). The mean is that of the displacement. The velocity itself would not do: of boundary particles it differs
    from their motion by what the grid smooths away, so that a wall that follows it jumps back in every window, and in
    windows longer than the periods of the grid it jumps from window to window around its mean (Newmark's method keeps
    these periods at full amplitude), which damping in the contact then feeds."""

    def __init__(self, solid, grains, mapping, last=None):
        self._solid, self._grains, self._mapping, self._last = solid, grains, mapping, last
        self._change, (self._x, self._v) = None, solid.surface()
        self._watch = Watch(solid, grains)

    def __call__(self, number, time, dt, substeps, rewind=None, trend=None):
        """The ``Window`` of ``dt`` [s] that ends at ``time`` [s]. rewind, trend: what ``Iterated`` needs."""
        clock = Clock()
        wall_x, wall_v = self._mapping.motion(self._x, self._coming(dt))
        clock.lap("mapping")
        wall_force, particles = self._grains.advance(substeps, self._undented(wall_x), wall_v), self._grains.particles()
        check_finite(number, time, force_on_the_wall=wall_force, position_of_a_particle=particles["x"],
                     velocity_of_a_particle=particles["v"])
        clock.lap("DEM")
        force = self._mapping.force(wall_force)
        self._watch.look(time, dt, force)
        clock.lap("mapping")
        x, v = self._solid.advance(dt, force)
        check_finite(number, time, position_of_the_interface=x, velocity_of_the_interface=v)
        clock.lap("MPM")
        moved = x - self._x
        return Window(number, time, dt, wall_x, wall_v, wall_force, force, moved, x, v, self._v, particles,
                      clock.seconds, self._change, substeps, gain=self._gain(moved, dt),
                      earlier=None if self._last is None else self._last.wall_force,
                      twice=energy_of_dent(self._mapping, wall_force))

    def resample(self, change):
        """The interface has other points from the coming window on."""
        self._change, (self._x, self._v) = change, self._solid.surface()

    def accept(self, window):
        """Go on from the end of ``window``."""
        self._watch.look(window.time, window.dt, window.force)  # once more: now a new grid knows its mass, too
        self._watch.judge(window, self._last)
        self._last, self._change, self._x, self._v = window, None, window.x, window.v

    def _undented(self, wall_x):
        """Places of the wall [m] without the dent under the force that is extrapolated from the last two windows."""
        if not self._mapping.takes_out or self._last is None:
            return wall_x
        force = self._last.wall_force
        return wall_x - self._mapping.dent(force if self._last.earlier is None else 2.0 * force - self._last.earlier)

    def _coming(self, dt):
        """Velocity of the interface in the coming window [m/s], shape (n, dim)."""
        last = self._last
        if last is None:
            return self._v
        coming = last.moved / last.dt + last.gain * (0.5 * (last.dt + dt))
        return coming if self._change is None else self._change.interpolate(coming)

    def _gain(self, moved, dt):
        """How fast the mean velocity has risen since the last window, or since the start [m/s^2], shape (n, dim)."""
        last = self._last
        before, between = (self._v, 0.5 * dt) if last is None else (last.moved / last.dt, 0.5 * (last.dt + dt))
        if last is not None and self._change is not None:
            before = self._change.interpolate(before)
        return (moved / dt - before) / between


def energy_of_dent(mapping, wall_force):
    """What the solid holds of it [J]."""
    return 0.5 * float(np.vdot(wall_force, mapping.dent(wall_force))) if mapping.takes_out else 0.0


def check_finite(number, time, **quantities):
    """FloatingPointError naming the first array that holds NaN or infinity."""
    with np.errstate(all="ignore"):
        if np.isfinite(sum(values.sum() for values in quantities.values())):
            return
    lost = next((name for name, values in quantities.items() if not np.isfinite(values).all()), None)
    if lost:
        raise FloatingPointError(f"the {lost.replace('_', ' ')} is not a finite number in window {number}, which ends "
                                 f"at t = {time:.6g} s: take a smaller dt or more substeps")
