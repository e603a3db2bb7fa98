"""Signals that end a run, all of them like an interrupt: what it had is written before it ends. A run that
writes checkpoints notes them instead, see ``deferred``.

They come from a user (SIGINT, SIGQUIT), from a queue whose time is over (SIGTERM, SIGUSR1, SIGUSR2, SIGXCPU),
from a terminal that is closed (SIGHUP), and from a pipe that nobody reads any more (SIGPIPE).
"""
import os
import signal
import threading
import time
from contextlib import contextmanager, nullcontext, suppress
from typing import Any, ClassVar, Iterator, Optional

from mpi4py import MPI

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT, signal.SIGPIPE, signal.SIGUSR1,
           signal.SIGUSR2, signal.SIGXCPU)
QUIET = 5.0  # [s] after a signal, in which others must not cut the end short: they often come in pairs


class Ending:
    """The handler: raises KeyboardInterrupt with the signal's name, or notes the first one, see
    ``deferred``."""

    received: ClassVar[Optional[str]] = None  # name of the last signal of this run that was raised
    noted: ClassVar[Optional[str]] = None  # of the one that was not
    active: ClassVar[bool] = False  # within like_interrupts
    deferring: ClassVar[bool] = False  # within deferred

    def __init__(self) -> None:
        self._last, Ending.received, Ending.noted = -QUIET, None, None

    def __call__(self, number: int, frame: Any) -> None:
        """A signal has come."""
        now, name = time.monotonic(), signal.Signals(number).name
        if now - self._last < QUIET:
            return
        self._last = now
        if not Ending.deferring or Ending.noted is not None:
            Ending.received = name
            raise KeyboardInterrupt(name)
        Ending.noted = name
        if MPI.COMM_WORLD.rank == 0:
            with suppress(OSError):  # nobody reads it
                # print may be what the signal has come into, and cannot be called a second time
                os.write(2, f"warning: {name}: a checkpoint is written when this window is done; another "
                         f"signal, {QUIET:g} s from now or later, ends the run at once\n".encode())


def raise_again() -> None:
    """KeyboardInterrupt where a signal has been raised before: within a call back from C, as compiling makes
    them, the first one goes nowhere. Called after every window. What is only noted is not raised."""
    if Ending.received is not None:
        raise KeyboardInterrupt(Ending.received)


def noted() -> Optional[str]:
    """Name of the signal that has been noted on this rank in the place of being raised, until the end of
    ``like_interrupts``."""
    return Ending.noted


@contextmanager
def like_interrupts() -> Iterator[None]:
    """Inside, each of SIGNALS raises KeyboardInterrupt, but those that were ignored when the program was
    started, as by nohup: they still are. (SIGPIPE is always ignored by Python itself.) Outside the main
    thread nothing changes."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before, ending = {number: signal.getsignal(number) or signal.SIG_DFL for number in SIGNALS}, Ending()
    for number, handler in before.items():
        ignored = handler == signal.SIG_IGN and number != signal.SIGPIPE
        signal.signal(number, signal.SIG_IGN if ignored else ending)  # PETSc has put in handlers of its own
    Ending.active = True
    try:
        yield
    finally:
        Ending.received, Ending.noted, Ending.active = None, None, False
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def deferred() -> Iterator[None]:
    """Inside, the first of SIGNALS is noted, so that the window in progress can be finished and a checkpoint
    written; whoever runs the windows asks ``noted()`` after each. One that comes ``QUIET`` seconds later
    raises KeyboardInterrupt. Includes ``like_interrupts`` where that has not been entered."""
    with nullcontext() if Ending.active else like_interrupts():
        Ending.deferring = True
        try:
            yield
        finally:
            Ending.deferring = False


def ignore() -> None:
    """From now on until the end of ``like_interrupts``."""
    if threading.current_thread() is threading.main_thread():
        for number in SIGNALS:
            signal.signal(number, signal.SIG_IGN)
