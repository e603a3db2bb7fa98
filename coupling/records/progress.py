"""What a run shows while it goes on: a bar on a terminal, elsewhere a line every minute."""
import sys
import time

from tqdm import tqdm

from .writing import tell

EVERY = 60.0  # [s] between two lines


class Progress:
    """Of ``total`` windows of full length, of which so many are ``done`` already, as window ``number``; call
    it after each window, ``close`` it at the end. For rank 0."""

    def __init__(self, total: float, done: float = 0.0, number: int = 0) -> None:
        self._total, self._done, self._number, self._newton, self._bar = total, done, number, 0, None
        self._before, self._shown = done, number  # at the start; windows that the lines so far have told of
        self._begin = self._last = time.monotonic()
        if sys.stderr.isatty():
            self._bar = tqdm(total=total, initial=done, leave=False,
                             bar_format="{desc} {percentage:3.0f}%|{bar}| {elapsed} gone, {remaining} to go")

    def __call__(self, now: float, length: float, newton: int) -> None:
        """now: end of the window [s]; length: over that of a full window; newton: iterations in it."""
        self._number, self._done, self._newton = self._number + 1, self._done + length, self._newton + newton
        if self._bar is not None:
            self._bar.set_description_str(f"t = {now:.3e} s", refresh=False)
            self._bar.update(length)
        elif time.monotonic() - self._last >= EVERY:
            tell(self._line(now))
            self._last, self._newton, self._shown = time.monotonic(), 0, self._number

    def _line(self, now: float) -> str:
        gone, part = time.monotonic() - self._begin, self._done / self._total
        left = gone * (self._total - self._done) / (self._done - self._before)
        return (f"step {self._number}, t = {now:.4g} s ({part:.1%}): "
                f"{self._newton / (self._number - self._shown):.2f} Newton iterations per step, "
                f"{tqdm.format_interval(gone)} gone, {tqdm.format_interval(left)} to go")

    def close(self) -> None:
        """The run is over."""
        try:
            if self._bar is not None:
                self._bar.close()
        except OSError:
            pass  # the terminal is gone
        self._bar = None
