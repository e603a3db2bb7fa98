"""The loop of a solid alone, with the observers of the coupled one."""
from time import perf_counter
from typing import NamedTuple

import numpy as np

from .couple import begin, count_windows


class Step(NamedTuple):
    """What happened in one step. ``number`` counts from 1, ``time`` [s] is its end, ``dt`` [s] its length; ``x``,
    ``v``: interface of the solid, shape (n, dim); ``seconds``: run time of the solid. The rest is as of a coupled
    window."""

    number: int
    time: float
    dt: float
    x: np.ndarray
    v: np.ndarray
    seconds: dict
    substeps: int = 1
    iterations: int = 1
    failed: int = 0
    refused: int = 0


def march(solid, *, dt, t_end, on_window=()):
    """Advance a solid that nothing touches to ``t_end`` [s] in steps of ``dt`` [s]; ``on_window`` are called with each
    ``Step``, see ``couple``. ValueError unless dt divides the time, Unstable when the solid gains energy."""
    start = solid.time
    count = count_windows(t_end, dt, start=start)
    on_window = begin(solid, on_window)
    for number in range(1, count + 1):
        before = perf_counter()
        x, v = solid.advance(dt)
        step = Step(number, start + number * dt, dt, x, v, {"MPM": perf_counter() - before})
        for report in on_window:
            report(step)
