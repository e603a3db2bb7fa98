"""The partitioned loop: weak coupling, algorithm 1 of the paper, with substeps of the DEM."""
from time import perf_counter
from typing import NamedTuple

import numpy as np


class Window(NamedTuple):
    """What happened in one coupling window. Wall nodes moved from ``wall_x`` with ``wall_v``, shape (m, dim); the mean
    force on them was ``wall_force`` [N]; the interface got ``force`` [N] and moved by ``moved`` [m], shape (n, dim).
    ``seconds``: run time of the DEM, the mapping and the MPM."""

    number: int
    time: float
    dt: float
    wall_x: np.ndarray
    wall_v: np.ndarray
    wall_force: np.ndarray
    force: np.ndarray
    moved: np.ndarray
    seconds: dict


def count_windows(t_end, dt, substeps=1):
    """Number of windows; ValueError unless dt > 0 divides t_end and substeps is at least 1."""
    if substeps < 1:
        raise ValueError(f"substeps is {substeps}: give a whole number of at least 1")
    if not (dt > 0 and np.isfinite(dt)):
        raise ValueError(f"dt is {dt} s: it must be positive")
    count = round(t_end / dt) if np.isfinite(t_end) else 0
    if count < 1 or abs(count * dt - t_end) > 1e-9 * t_end:
        raise ValueError(f"t_end is {t_end} s, which is not a multiple of dt = {dt} s: take t_end = "
                         f"{max(count, 1) * dt:.6g}")
    return count


def couple(solid, grains, mapping, *, dt, t_end, substeps=1, on_window=()):
    """Advance both partitions to ``t_end`` [s] in windows of ``dt`` [s] of one MPM step and ``substeps`` DEM steps.

    In each window the DEM goes first, with the wall carried on at the interface's velocity; its mean force then drives
    the MPM (momentum is exact: force times window is the impulse). ``on_window`` are called with each ``Window``.
    """
    count = count_windows(t_end, dt, substeps)
    if abs(substeps * grains.dt - dt) > 1e-9 * dt:
        raise ValueError(f"{substeps} substeps of the DEM's {grains.dt} s do not make a window of {dt} s: make them fit")
    x, v = solid.surface()
    v_old = v
    for number in range(1, count + 1):
        start = perf_counter()
        wall_x, wall_v = mapping.motion(x, v + 0.5 * (v - v_old))  # the mean velocity to come, extrapolated
        mapped = perf_counter()
        wall_force = grains.advance(substeps, wall_x, wall_v)
        solved = perf_counter()
        force = mapping.force(wall_force)
        back = perf_counter()
        x_old, v_old, (x, v) = x, v, solid.advance(dt, force)
        seconds = {"DEM": solved - mapped, "mapping": mapped - start + back - solved, "MPM": perf_counter() - back}
        window = Window(number, number * dt, dt, wall_x, wall_v, wall_force, force, x - x_old, seconds)
        for report in on_window:
            report(window)
