"""Signals that end a run, all of them like an interrupt: what it had is written before it ends.

They come from a user (SIGINT, SIGQUIT), from a queue whose time is over (SIGTERM, SIGUSR1, SIGUSR2, SIGXCPU),
from a terminal that is closed (SIGHUP), and from a pipe that nobody reads any more (SIGPIPE).
"""
import signal
import threading
import time
from contextlib import contextmanager
from typing import Any, ClassVar, Iterator, Optional

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT, signal.SIGPIPE, signal.SIGUSR1,
           signal.SIGUSR2, signal.SIGXCPU)
QUIET = 5.0  # [s] after a signal, in which others must not cut the end short: they often come in pairs


class Ending:
    """The handler: raises KeyboardInterrupt with the signal's name."""

    received: ClassVar[Optional[str]] = None  # name of the last signal of this run

    def __init__(self) -> None:
        self._last, Ending.received = -QUIET, None

    def __call__(self, number: int, frame: Any) -> None:
        """A signal has come."""
        now = time.monotonic()
        if now - self._last >= QUIET:
            self._last, Ending.received = now, signal.Signals(number).name
            raise KeyboardInterrupt(Ending.received)


def raise_again() -> None:
    """KeyboardInterrupt where a signal has been received after all: within a call back from C, as compiling
    makes them, the first one goes nowhere. Called after every window."""
    if Ending.received is not None:
        raise KeyboardInterrupt(Ending.received)


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
    try:
        yield
    finally:
        Ending.received = None
        for number, handler in before.items():
            signal.signal(number, handler)


def ignore() -> None:
    """From now on until the end of ``like_interrupts``."""
    if threading.current_thread() is threading.main_thread():
        for number in SIGNALS:
            signal.signal(number, signal.SIG_IGN)
