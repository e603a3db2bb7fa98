"""The partitioned loop: windows of an MPM step and several DEM steps, weakly coupled or iterated; or of MPM
steps alone."""
from typing import Any, Iterable, NamedTuple, Optional, Tuple, Union

import numpy as np

import mpm_dem_checks as check

from ..ledger.energy_watch import EnergyWatch
from ..maps.mapping import Mapping
from ..protocols import Grains, Observer, Solid
from ..scheme import WORK_PER_PARTICLE, Scheme, Steps, count_windows
from .control import StepControl, limit_speed
from .iterate import MOST_REPETITIONS, Iterated, NotConvergedError
from .ladder import Ladder
from .relaxation import RELAXATIONS
from .resampling import resample_interface
from .trend import Trend
from .window import Alone, Sides, Weak, Window

__all__ = ["NotConvergedError", "Window", "couple", "march"]

SHORTEST = 32  # the shortest step of a solid alone is this part of dt


class Position(NamedTuple):
    """How far a run has come: ``done`` of its shortest steps of ``dt`` / ``most`` since its ``start`` [s]; dt
    [s]: the longest window."""

    start: float
    dt: float
    most: int
    done: int


class LoopState(NamedTuple):
    """What goes over to the next window besides the states of the partitions: the trend of the force, what
    the scheme knows, the state of the step control, where the run is, and what has been seen of the solid's
    energy *before* the window."""

    trend: Optional[Trend]
    scheme: Any
    control: Tuple[int, int]
    position: Position
    energy: Any


def march(solid: Solid, steps: Steps, on_window: Iterable[Observer] = (),
          last: Optional[Window] = None) -> None:
    """Advance a solid that nothing touches, see ``couple``; steps that fail are shortened, to a 32nd at most.

    >>> import mpm_fenicsx as mpm
    >>> body = mpm.Body(mpm.Box((0.0, 0.0), (1.0, 1.0)), (2, 2), 2, mpm.linear(E=1e6, nu=0.3), rho=1000.0)
    >>> solid = mpm.MPM(mpm.Grid(mpm.Box((-1.0, -1.0), (2.0, 2.0)), (6, 6)), body, gravity=(0.0, -10.0))
    >>> march(solid, Steps(dt=1e-2, t_end=0.1))
    >>> abs(solid.points.v - [0.0, -1.0]).max() < 1e-9
    True
    """
    couple(solid, None, None, steps, on_window, last)


def couple(solid: Solid, grains: Optional[Grains], mapping: Optional[Mapping], scheme: Union[Scheme, Steps],
           on_window: Iterable[Observer] = (), last: Optional[Window] = None) -> None:
    """Advance both partitions to ``t_end`` [s] in windows of ``dt`` [s] of one MPM step and ``substeps`` DEM
    steps; without ``grains`` and ``mapping``, the solid alone. Before each window the solid may renew its
    interface, see ``resampling``.

    The ``scheme`` says how often a window may be repeated until both sides agree (``iterate``; 0: weak
    coupling, see ``Weak`` and ``Iterated``) and when windows become shorter (``adapt``): None never; 0 halves
    those that fail (ArithmeticError), see ``ladder``, down to one DEM step, and grows back; above, up to 1,
    the change of the force in a window against its extrapolation, relative to the largest so far, stays near
    it, and ``dt`` is the longest.

    ``on_window`` are called with each ``Window``; those with a method ``begin`` are told before the first
    one, when the scheme has been checked. A run that stopped goes on bit for bit, and counts on, from the
    states of both partitions and its ``last`` window. FloatingPointError when a number is no longer finite,
    NotConvergedError when a window needs more repetitions, UnstableError when the solid gains energy, see
    ``energy_watch``. Here a ball bounces off a block:

    >>> import dem_liggghts as dem, mpm_fenicsx as mpm
    >>> box, rubber = mpm.Box((0.0, 0.0), (0.1, 0.1)), dem.Material(E=1e7, nu=0.3)
    >>> block = mpm.Body(box, (4, 4), 2, mpm.linear(E=1e7, nu=0.3), rho=1000.0)
    >>> top, bottom = mpm.Interface.top(box, (4,)), mpm.Support(lambda x: x[:, 1] < 1e-9, "xy")
    >>> solid = mpm.MPM(mpm.Grid(mpm.Box((-0.05, 0.0), (0.15, 0.2)), (8, 8)), block, [bottom], top)
    >>> ball = dem.Spheres([[0.05, 0.111]], [[0.0, -1.0]], 0.01, 2500.0)
    >>> scene = dem.Scene(ball, dem.Wall(top.x, top.elements), rubber, rubber)
    >>> grains = dem.open_dem("reference", scene, 1e-5)
    >>> couple(solid, grains, copy(top.x), Scheme(dt=1e-4, t_end=5e-3, substeps=10))
    >>> bool(grains.particles()["v"][0, 1] > 0.5)
    True
    """
    control = StepControl(SHORTEST if grains is None else scheme.substeps, scheme.adapt)
    most, (at, total) = control.most, _positions(scheme, control, solid.time, last)
    method, ladder = _method(solid, grains, mapping, scheme, control, last)
    on_window, watch = _begin(solid, on_window, last)

    def attempt(number: int, done: int, steps: int) -> Window:
        return method(number, at.start + (done + steps) / most * at.dt, at.dt * (steps / most), steps)

    number, done = 0 if last is None else last.number, at.done
    particles = np.zeros(0) if grains is None else grains.particles()
    while done < total:
        number += 1
        if grains is not None and mapping is not None:
            change = resample_interface(solid, grains, mapping, (particles, scheme.window))
            if change is not None:
                method.transfer(change)
        limit_speed(control, solid, scheme)
        window, how = ladder.climb(attempt, method.error, number, done, total)
        done, particles = done + how.steps, window.particles
        method.accept(window)
        window = window._replace(fraction=how.steps / most, failed=how.failed, refused=how.refused,
                                 state=LoopState(method.trend, method.get_state(), control.get_state(),
                                                 at._replace(done=done), watch.get_state()))
        for report in on_window:
            report(window)


def check_end(scheme: Steps, now: float, last: Window) -> None:
    """ValueError unless a run that is at ``now`` [s] after its ``last`` window can go on by the
    ``scheme``."""
    most = scheme.substeps if isinstance(scheme, Scheme) else SHORTEST
    _positions(scheme, StepControl(most, scheme.adapt), now, last)


def _positions(scheme: Steps, control: StepControl, now: float,
               last: Optional[Window]) -> Tuple[Position, int]:
    """Where a run from ``now`` [s] on, or after its ``last`` window, begins, and the number of its shortest
    steps at the end."""
    at, most = Position(now, scheme.window, control.most, 0), control.most
    if last is not None and scheme.t_end < now * (1.0 - 1e-9):
        raise ValueError(f"t_end is {scheme.t_end} s, and the run has already come to {now:.10g} s: give a "
                         "later end")
    if last is not None and last.state is not None:
        before = last.state.position
        if (before.dt, before.most) == (scheme.window, most):
            at = before
            if before.done and abs(now - scheme.t_end) <= 1e-9 * scheme.t_end:
                return at, at.done  # nothing is left to do
    if control.active and last is not None:  # shorter windows may have left any number of them
        return at, count_windows(scheme.t_end, scheme.window / most, 1, at.start)
    return at, count_windows(scheme.t_end, scheme.window, scheme.substeps, at.start) * most


def _method(solid: Solid, grains: Optional[Grains], mapping: Optional[Mapping], scheme: Union[Scheme, Steps],
            control: StepControl, last: Optional[Window]) -> Tuple[Any, Ladder]:
    """How a window is computed, and its ``Ladder``, going on from the ``last`` window. The trend of the force
    is kept only where it is needed."""
    state = None if last is None else last.state
    if state is not None and (state.position.dt, state.position.most) == (scheme.window, control.most):
        control.set_state(state.control)
    if grains is None:
        ladder = Ladder(solid, None, control, scheme.window, keep_solid=False)
        return Alone(solid, ladder), ladder
    if mapping is None or not isinstance(scheme, Scheme):
        raise ValueError("mapping and scheme do not say how to couple grains: give a Mapping and a Scheme")
    _check(scheme, grains.dt, len(grains.particles()))
    needs_trend = scheme.iterate > 0 or bool(control.tolerance)
    ladder = Ladder(solid, grains, control, scheme.window, keep_solid=needs_trend)
    trend = ((state and state.trend) or Trend()) if needs_trend else None
    sides = Sides(solid, grains, mapping, ladder)
    if scheme.iterate and trend is not None:
        return Iterated(sides, trend, scheme, state and state.scheme), ladder
    return Weak(sides, trend, last, state and state.scheme), ladder


def _begin(solid: Solid, on_window: Iterable[Any],
           last: Optional[Window]) -> Tuple[Tuple[Any, ...], EnergyWatch]:
    """Tell the observers that want to know it that the first window is about to begin; returns them with the
    one that watches the energy of the solid, and that one, which goes on after the ``last`` window."""
    watch = EnergyWatch(solid)
    if last is not None and last.state is not None:
        watch.set_state(last.state.energy)
        watch(last)
    for report in on_window:
        if hasattr(report, "begin"):
            report.begin()
    return (*on_window, watch), watch


def _check(scheme: Scheme, inner: float, particles: int) -> None:
    """ValueError for a scheme that makes no sense, and for more work in a window than anybody waits for."""
    dt, substeps = scheme.window, scheme.substeps
    if abs(substeps * inner - dt) > 1e-9 * dt:
        raise ValueError(f"{substeps} substeps of the DEM's {inner} s do not make a window of {dt} s: let "
                         "them fit")
    check.count("iterate", scheme.iterate, 0, MOST_REPETITIONS,
                "give the most repetitions of a window, or 0 for weak coupling")
    check.between("tol", scheme.tol, 0, 1, rule="give a part of the force between 0 and 1, such as 1e-4",
                  ends="()")
    check.choice("relax", scheme.relax, tuple(RELAXATIONS))
    work = substeps * max(particles, 1) * WORK_PER_PARTICLE
    check.check_work(f"{substeps} DEM steps per window (substeps) of {particles} particles", work,
                     "take fewer of both, or a shorter window")
