"""The partitioned loop: windows of an MPM step and several DEM steps, weakly coupled or iterated."""
from typing import NamedTuple

import mpm_dem_checks as check

from ..ledger.gain import Gain
from .control import StepControl
from .iterate import MOST_REPETITIONS, Iterated, NotConverged
from .relaxation import RELAXATIONS
from .resampling import resample
from .trend import Trend
from .window import Weak, Window

__all__ = ["NotConverged", "Window", "count_windows", "couple"]

MOST_WINDOWS = 1e9  # of a run: at a millisecond each they take eleven days
WORK_PER_PARTICLE = 1000  # operations in a DEM step, measured


def count_windows(t_end, dt, substeps=1, start=0.0):
    """Number of windows from ``start`` [s] on; ValueError unless dt > 0 divides the time and substeps is at least 1."""
    check.count("substeps", substeps)
    check.check_work(f"{substeps:g} DEM steps per window (substeps)", substeps * WORK_PER_PARTICLE, "take fewer")
    check.positive("dt", dt, "s", "the window must be positive")
    if not check.finite("t_end", t_end, "s", "it must be finite and lie after the start") > start:
        raise ValueError(f"t_end is {t_end} s: it must lie after the start at {start} s")
    if (t_end - start) / dt > MOST_WINDOWS:
        raise ValueError(f"dt is {dt} s: that makes {(t_end - start) / dt:.3g} windows until {t_end} s, more than "
                         f"{MOST_WINDOWS:g}, take a longer one or a smaller t_end")
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
    (ArithmeticError), down to one DEM step, and grows back; above, up to 1, the change of the force in a window against
    its extrapolation, relative to the largest so far, stays near it, and ``dt`` is the longest.

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
    _check(dt, grains.dt, substeps, iterate, tol, relax, len(grains.particles()))
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


def _check(dt, inner, substeps, iterate, tol, relax, particles):
    """ValueError for keywords that make no sense, and for more work in a window than anybody waits for."""
    if abs(substeps * inner - dt) > 1e-9 * dt:
        raise ValueError(f"{substeps} substeps of the DEM's {inner} s do not make a window of {dt} s: let them fit")
    check.count("iterate", iterate, 0, MOST_REPETITIONS,
                "give the most repetitions of a window, or 0 for weak coupling")
    check.between("tol", tol, 0, 1, rule="give a part of the force between 0 and 1, such as 1e-4", ends="()")
    check.choice("relax", relax, tuple(RELAXATIONS))
    work = substeps * max(particles, 1) * WORK_PER_PARTICLE
    check.check_work(f"{substeps} DEM steps per window (substeps) of {particles} particles", work,
                     "take fewer of both, or a shorter window")
