"""What is tried where a window fails, one thing after the other; for coupled windows and those of a solid
alone.

    1. ``solid.fall_back()``, such as the ghost penalty on inertia, and the same step again, while it helps
    2. a window of half the length, from the states at its start, as often as the step control allows; where
       it allows none, what the solid does by itself, such as shorter steps within the window
    3. the error says what was tried and what remains to try

A failure is an ArithmeticError, on all ranks alike: of the solid's step, which leaves the solid as it was, of
the grains, or of the iteration of a window. Other errors are of the scene and end the run, as do mistakes in
code (``MISTAKES``): they may be one rank's, for which the others wait.
"""
from typing import Any, Callable, List, NamedTuple, Optional, Tuple

import numpy as np

from ..protocols import Grains, Solid
from .control import StepControl

MISTAKES = ZeroDivisionError, OverflowError


class Attempt(NamedTuple):
    """How a window came about: ``steps`` in it, as counted by ``StepControl``; attempts at it that
    ``failed``, and those ``refused`` as too long for the accuracy asked for."""

    steps: int
    failed: int
    refused: int


class Ladder:
    """The rungs of one run. dt: of the longest window [s]; keep_solid: whether a window may be given up after
    the solid has done its step, as where windows are repeated, so that its state is needed, too.
    Collective."""

    def __init__(self, solid: Solid, grains: Optional[Grains], control: StepControl, dt: float,
                 keep_solid: bool) -> None:
        self._solid, self._grains, self._control, self._dt = solid, grains, control, dt
        self._keeps_solid = keep_solid
        self._keeps_grains = control.active or keep_solid
        self._fallen_back: List[str] = []
        self._failed, self._start = 0, solid.time
        self._set_back: List[Callable[[], None]] = []

    def climb(self, attempt: Callable, error: Callable, number: int, done: int, total: int) -> Tuple:
        """The ``Window`` of the first of ever shorter attempts that neither fails nor is refused, and its
        ``Attempt``. attempt(number, done, steps): makes a ``Window``; error(window): of its length; number:
        of the window; done: steps before it, of a ``total`` in the run."""
        self._failed, refused = 0, 0
        self._keep()
        while True:
            steps = self._control.next(total - done)
            try:
                window = attempt(number, done, steps)
            except MISTAKES:
                raise
            except ArithmeticError as failure:
                stays = self._solid.time == self._start or self._keeps_solid
                if not (stays and self._control.shorten(steps)):
                    self._explain(failure, steps)
                    raise
                self._failed += 1
            else:
                if not self._control.refuses(error(window), steps):
                    return window, Attempt(steps, self._failed, refused)
                refused += 1
            self.rewind()

    def advance(self, dt: float, *force: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
        """A step of the solid, again as long as it finds something to change where that fails."""
        attempt = getattr(self._solid, "attempt", self._solid.advance)
        while True:
            try:
                return attempt(dt, *force)
            except MISTAKES:
                raise
            except ArithmeticError:
                changed = self._solid.fall_back() if hasattr(self._solid, "fall_back") else ""
                if not changed:
                    if attempt == self._solid.advance or self._control.can_shorten:
                        raise
                    attempt = self._solid.advance
                    continue
            self._fallen_back.append(changed)
            self._failed += 1
            if self._keeps_solid:  # it is where the window began
                self._set_back[0] = _to_state(self._solid)

    def rewind(self) -> None:
        """Set the partitions back to where the window began."""
        for set_back in self._set_back:
            set_back()

    def _keep(self) -> None:
        """A window begins here."""
        self._start = self._solid.time
        self._set_back = [_to_state(self._solid)] if self._keeps_solid else []
        if self._grains is not None and self._keeps_grains:
            if hasattr(self._grains, "remember") and not self._keeps_solid:
                self._set_back.append(self._grains.remember())
            else:
                self._set_back.append(_to_state(self._grains))

    def _explain(self, failure: ArithmeticError, steps: int) -> None:
        """Add to the message what was tried, and what remains to try, after a window of so many ``steps``."""
        most, kind = self._control.most, "steps" if self._grains is None else "windows"
        tried, remain = [*self._fallen_back], ""
        if not self._control.active:
            remain = f"shorter {kind} where one fails (adapt=0)"
        elif steps < most:
            tried.append(f"{kind} down to {self._dt * (steps / most):.3g} s")
        if self._control.active and self._grains is not None and steps < 2:
            remain = f"more DEM steps per window (substeps={2 * most}), so that it can be shorter"
        more = [f"tried before: {', '.join(tried)}"] * bool(tried) + [f"left to try: {remain}"] * bool(remain)
        if more:
            failure.args = "; ".join([str(failure), *more]),


def _to_state(partition: Any) -> Callable[[], None]:
    """A function that sets a ``partition`` back to its state now."""
    state = partition.get_state()
    return lambda: partition.set_state(state)
