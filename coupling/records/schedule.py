"""When a checkpoint is due, and when the run must stop so that it ends in order."""
import signal
from collections import deque
from time import perf_counter
from typing import Callable, Deque, NamedTuple, Optional

import numpy as np
from mpi4py import MPI

from .. import signals
from ..durations import Every, shown
from ..started import IMPORTED

RECENT = 50  # windows of which the longest says how long the next one may take
SAFETY = 2.0  # times as long as the longest of them, and as the last checkpoint, the next one may take
LEAST = 1.0  # [s] for a checkpoint
ENDING = 5.0, 0.01  # [s], part of the walltime, the larger one: for report and pictures at the end


class Due(NamedTuple):
    """What is to be done after a window: write a ``checkpoint``; ``stop``, for the reason that is given."""

    checkpoint: bool = False
    stop: Optional[str] = None


class Schedule:
    """Says after each window what is due: ``due = schedule(window.number)``, the same on all ranks. Call
    ``begin()`` before the first window, ``wrote(seconds)`` after each checkpoint.

    every: how often a checkpoint is asked for, or None; walltime: run time [s] after which this process is
    ended from outside, counted from the moment ``began`` of ``clock``, or None; comm: the ranks. The clock
    is that of rank 0; a signal counts on whichever rank it was noted, see ``signals.deferred``. Without
    ``every`` and ``walltime`` nothing is ever due, and nothing is sent.

    A run must stop when the walltime that is left would not hold one more window, twice the longest of the
    last 50, a checkpoint, twice the time of the last one and at least 1 s, and the end of the run, 5 s or 1 %
    of the walltime. As long as none has been written, a checkpoint gets as much as the end.

    >>> moments = iter([0.0, 4.0, 11.0, 11.5])
    >>> schedule = Schedule(Every(seconds=10.0), None, clock=lambda: next(moments))
    >>> schedule(1), schedule(2)
    (Due(checkpoint=False, stop=None), Due(checkpoint=True, stop=None))
    >>> schedule.wrote(0.5)
    """

    def __init__(self, every: Optional[Every], walltime: Optional[float], began: float = IMPORTED,
                 comm: MPI.Comm = MPI.COMM_WORLD, clock: Callable[[], float] = perf_counter) -> None:
        self._every, self._walltime, self._began, self._comm, self._clock = (every, walltime, began, comm,
                                                                             clock)
        self._lengths: Deque[float] = deque(maxlen=RECENT)  # run time of the last windows [s]
        self._took: Optional[float] = None  # by the last checkpoint [s]
        self.begin()

    def begin(self) -> None:
        """The first window is about to begin."""
        self._window_began = self._last = self._clock()  # moments of this window, of the last checkpoint

    def wrote(self, seconds: float) -> None:
        """A checkpoint has been written, which took so long [s]: it is no part of the next window, and the
        time to the next one counts from here."""
        self._took = seconds
        self._window_began = self._last = self._clock()

    def __call__(self, number: int) -> Due:
        """What is due now that the window of this number is done. Where the run must stop, a checkpoint is
        due too. Collective."""
        if self._every is None and self._walltime is None:
            return Due()
        now = self._clock()
        self._lengths.append(now - self._window_began)
        self._window_began = now
        name = signals.noted()
        own = [self._checkpoint(number, now), self._over(now), signal.Signals[name].value if name else 0]
        if self._comm.size > 1:
            own = self._agreed(own)
        stop = None
        if own[2]:
            stop = f"signal {signal.Signals(own[2]).name}"
        elif own[1]:
            stop = f"walltime of {shown(self._walltime or 0.0)}"
        return Due(bool(own[0]) or stop is not None, stop)

    def _agreed(self, own: list) -> list:
        """The same numbers on all ranks: the clock's are those of rank 0, the signal that of any rank."""
        mine = np.array(own if self._comm.rank == 0 else [0, 0, own[2]], dtype=np.int32)
        all_ranks = np.empty_like(mine)
        self._comm.Allreduce(mine, all_ranks, MPI.MAX)
        return all_ranks.tolist()

    def _checkpoint(self, number: int, now: float) -> bool:
        """Whether the next one is due by number of windows or run time."""
        windows, seconds = self._every or Every()
        return bool(windows and number % windows == 0) or (seconds is not None
                                                           and now - self._last >= seconds)

    def _over(self, now: float) -> bool:
        """Whether the walltime would not hold another window and the end."""
        if self._walltime is None:
            return False
        ending = max(ENDING[0], ENDING[1] * self._walltime)
        writing = ending if self._took is None else max(SAFETY * self._took, LEAST)
        return self._began + self._walltime - now < SAFETY * max(self._lengths) + writing + ending
