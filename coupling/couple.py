"""The partitioned loop: windows of an MPM step and several DEM steps, weakly coupled or iterated."""
from typing import NamedTuple

import numpy as np

from .control import StepControl
from .gain import Gain
from .iterate import Iterated, NotConverged
from .relaxation import RELAXATIONS
from .resampling import resample
from .trend import Trend
from .window import Weak, Window

__all__ = ["NotConverged", "Window", "count_windows", "couple"]


def count_windows(t_end, dt, substeps=1, start=0.0):
    """Number of windows from ``start`` [s] on; ValueError unless dt > 0 divides the time and substeps is at least 1."""
    if substeps < 1 or substeps != int(substeps):
        raise ValueError(f"substeps is {substeps}: give a whole number of at least 1")
    if not (dt > 0 and np.isfinite(dt)):
        raise ValueError(f"dt is {dt} s: the window must be positive")
    if not (t_end > start and np.isfinite(t_end)):
        raise ValueError(f"t_end is {t_end} s: it must lie after the start at {start} s")
    if (t_end - start) / dt > 1e12:
        raise ValueError(f"dt is {dt} s: that makes more than 1e12 windows until {t_end} s, take a longer one")
    count = round((t_end - start) / dt)
    if count < 1 or abs(start + count * dt - t_end) > 1e-9 * t_end:
        raise ValueError(f"t_end is {t_end} s, which is not a multiple of dt = {dt} s: take t_end="
                         f"{start + max(count, 1) * dt:.10g}")
    return count


def couple(solid, grains, mapping, *, dt, t_end, substeps=1, iterate=0, tol=1e-4, relax="aitken", adapt=None,
           on_window=(), last=None):
    """Advance both partitions to ``t_end`` [s] in windows of ``dt`` [s] of one MPM step and ``substeps`` DEM steps.
    Before each window the solid may renew its interface, see ``resampling``.

    iterate: how often a window may be repeated until both sides agree to ``tol``, with the relaxation named ``relax``,
    see ``Iterated``; 0 for weak coupling, see ``Weak``. adapt: None for windows of one length; 0 halves those that fail
    (ArithmeticError), down to one DEM step, and grows back; above, the change of the force in a window against its
    extrapolation, relative to the largest so far, stays near it, and ``dt`` is the longest.

    ``on_window`` are called with each ``Window``; those with a method ``begin`` are told before the first one, when all
    keywords have been checked. A run that stopped goes on bit for bit from the states of both
    partitions and its ``last`` window. FloatingPointError when a number is no longer finite, NotConverged when a window
    needs more repetitions, Unstable when the solid gains energy, see ``gain``.
    """
    start, number, done, control = solid.time, 0, 0, StepControl(substeps, adapt)
    if control.active and last is not None:  # shorter windows may have left any number of DEM steps
        total = count_windows(t_end, dt / substeps, 1, start)
    else:
        total = count_windows(t_end, dt, substeps, start) * substeps
    _check(dt, grains.dt, substeps, iterate, tol, relax)
    trend, known = Trend(), None
    if last is not None and last.memory is not None:
        trend, known, size = last.memory
        control.set_state(size)
    scheme = Iterated(solid, grains, mapping, known, iterate=iterate, tol=tol, relax=relax) if iterate else \
        Weak(solid, grains, mapping, last)
    keeps = iterate > 0 or control.active
    on_window = begin(solid, on_window)
    while done < total:
        number, change = number + 1, resample(solid, grains, mapping)
        if change is not None:
            scheme.resample(change)
            trend = trend.resampled(change)
        rewind = Rewind(solid, grains) if keeps else None

        def attempt(steps):
            return scheme(number, start + (done + steps) / substeps * dt, dt * (steps / substeps), steps, rewind, trend)

        window = _succeed(attempt, control, total - done, rewind, trend) if control.active else attempt(substeps)
        done += window.substeps
        if keeps:
            trend = trend.after(window.force, window.dt)
            window = window._replace(memory=Memory(trend, window.memory, control.get_state()))
        scheme.accept(window)
        for report in on_window:
            report(window)


def begin(solid, on_window):
    """Tell the observers that want to know it that the first window is about to begin; returns them and the one that
    watches the energy of the solid."""
    for report in on_window:
        if hasattr(report, "begin"):
            report.begin()
    return *on_window, Gain(solid)


def _succeed(attempt, control, left, rewind, trend):
    """The ``Window`` of the first of ever shorter attempts that neither fails nor is refused. left: DEM steps to go."""
    failed = refused = 0
    while True:
        steps = control.next(left)
        try:
            window = attempt(steps)
        except ArithmeticError:
            if not control.shorten(steps):
                raise
            failed += 1
        else:
            if not control.refuses(trend.error(window.force, window.dt), steps):
                return window._replace(failed=failed, refused=refused)
            refused += 1
        rewind()


class Memory(NamedTuple):
    """What goes over to the next window besides the states of the partitions: the trend of the force, what the iterated
    scheme knows, and the state of the step control."""

    trend: Trend
    scheme: tuple
    control: tuple


class Rewind:
    """Sets both partitions back to where they were when it was made."""

    def __init__(self, solid, grains):
        self._kept = [(partition, partition.get_state()) for partition in (solid, grains)]

    def __call__(self):
        for partition, state in self._kept:
            partition.set_state(state)


def _check(dt, inner, substeps, iterate, tol, relax):
    """ValueError for keywords that make no sense."""
    if abs(substeps * inner - dt) > 1e-9 * dt:
        raise ValueError(f"{substeps} substeps of the DEM's {inner} s do not make a window of {dt} s: let them fit")
    if iterate < 0 or iterate != int(iterate):
        raise ValueError(f"iterate is {iterate}: give the most repetitions of a window, or 0 for weak coupling")
    if not 0 < tol < 1:
        raise ValueError(f"tol is {tol}: give a part of the force between 0 and 1, such as 1e-4")
    if relax not in RELAXATIONS:
        raise ValueError(f"relax is {relax!r}: choose one of {', '.join(RELAXATIONS)}")
