"""The partitioned loop: weak coupling, algorithm 1 of the paper, with substeps of the DEM."""
from time import perf_counter
from typing import NamedTuple

import numpy as np

from .resampling import resample


class Window(NamedTuple):
    """What happened in one coupling window. ``number`` counts from 1, ``time`` [s] is its end, ``dt`` [s] its length.

    Wall nodes moved from ``wall_x`` with ``wall_v``, the mean force on them was ``wall_force`` [N], shape (m, dim); the
    interface got ``force`` [N], moved by ``moved`` [m], is now at ``x`` with ``v``, and had ``v_start`` before, shape
    (n, dim); ``particles``: the grains at its end; ``seconds``: run time of the DEM, the mapping and the MPM;
    ``resampled``: how the interface's points before the window became those in it, see ``resample``, or None.
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


def couple(solid, grains, mapping, *, dt, t_end, substeps=1, on_window=(), last=None):
    """Advance both partitions to ``t_end`` [s] in windows of ``dt`` [s] of one MPM step and ``substeps`` DEM steps.

    In each window the DEM goes first, with the wall carried on at the interface's mean velocity of the window before
    plus its change since; its mean force then drives the MPM (momentum is exact: force times window is the impulse).
    The mean is that of the displacement: velocity and motion of boundary particles differ by what the grid smooths
    away, and a wall that follows the velocity jumps back in every window. Before each window the solid may renew its
    interface, see ``resampling``.

    ``on_window`` are called with each ``Window``. A run that stopped goes on bit for bit from the states of both
    partitions and its ``last`` window. FloatingPointError when a number is no longer finite.
    """
    start = solid.time
    count = count_windows(t_end, dt, substeps, start)
    if abs(substeps * grains.dt - dt) > 1e-9 * dt:
        raise ValueError(f"{substeps} substeps of the DEM's {grains.dt} s do not make a window of {dt} s: let them fit")
    x, v = solid.surface()
    coming = v if last is None else last.moved / dt + (v - last.v_start)
    for number in range(1, count + 1):
        begin = perf_counter()
        change = resample(solid, grains, mapping)
        if change is not None:
            (x, v), coming = solid.surface(), change.carry(coming)
        wall_x, wall_v = mapping.motion(x, coming)
        mapped = perf_counter()
        wall_force, particles = grains.advance(substeps, wall_x, wall_v), grains.particles()
        time = start + number * dt
        _check(number, time, force_on_the_wall=wall_force, position_of_a_particle=particles["x"],
               velocity_of_a_particle=particles["v"])
        solved = perf_counter()
        force = mapping.force(wall_force)
        back = perf_counter()
        x_start, v_start, (x, v) = x, v, solid.advance(dt, force)
        _check(number, time, position_of_the_interface=x, velocity_of_the_interface=v)
        moved = x - x_start
        coming = moved / dt + (v - v_start)
        seconds = {"DEM": solved - mapped, "mapping": mapped - begin + back - solved, "MPM": perf_counter() - back}
        window = Window(number, time, dt, wall_x, wall_v, wall_force, force, moved, x, v, v_start, particles, seconds,
                        change)
        for report in on_window:
            report(window)


def _check(number, time, **quantities):
    """FloatingPointError naming the first array that holds NaN or infinity."""
    with np.errstate(all="ignore"):
        if np.isfinite(sum(values.sum() for values in quantities.values())):
            return
    lost = next((name for name, values in quantities.items() if not np.isfinite(values).all()), None)
    if lost:
        raise FloatingPointError(f"the {lost.replace('_', ' ')} is not a finite number in window {number}, which ends "
                                 f"at t = {time:.6g} s: take a smaller dt or more substeps")
