"""The line search of Newton's method where the residual has kinks.

Springs close and soil that has come apart meets again on the way of a step. A line search goes little farther
than the first of these places, so that where many points close one after the other each iteration goes a
shorter way than the one before (measured: a residual that falls as one over the number of iterations). Full
steps close all of them at once, and the next tangent knows it; they may go to and fro in turn, where a line
search does not. So an attempt that stalls goes on with the other of the two.
"""
from typing import List, Tuple

from petsc4py import PETSc

from ..grid import compat
from .options import PREFIX

# An attempt stalls where so many iterations leave more than this of the least residual before them: the
# search goes a tenth of the way each time, or full steps go to and fro.
STALLED, LEFT = 4, 0.5
CRITICAL, BACKTRACKING, FULL = ("cp", 2, 0.1), ("bt",), ("basic",)
STIFF = 0.5  # stiffness over inertia from which soil has the first of these, see docs/tangents.md


class Searches:
    """Of the ``snes``. kinks: the residual is piecewise linear, as of springs that open, stick and slide.
    They have a potential: line search cp finds its minimum along a line, where bt gets stuck on the
    residual's norm. flows: it is that of soil which moves and keeps its strength; where a step makes that
    stiff, cp is better, too. What the user's options decide is left to them."""

    def __init__(self, snes: PETSc.SNES, kinks: bool, flows: bool) -> None:
        self._snes, self._kinks, self._flows = snes, kinks, flows
        self.by_user = PETSc.Options(PREFIX).hasName("snes_linesearch_type")
        self.full_steps_first = self._other = False  # whether attempts begin with full steps, or not as usual
        self._search: Tuple = CRITICAL if kinks else BACKTRACKING
        self._now: Tuple = ()
        self._least: List[float] = []
        self._use(self._search)

    @property
    def follows(self) -> bool:
        """Whether ``follow`` is of use."""
        return self._kinks or self._flows

    def exchange(self) -> None:
        """Full Newton steps from the first attempt on, and a line search where that had them."""
        self.full_steps_first = not self.full_steps_first

    def want(self, other: bool) -> None:
        """Coming attempts begin with the ``other`` one, or with the first."""
        self._other = other

    def begin(self, stiffness_over_inertia: float) -> None:
        """An attempt begins."""
        stiff = self._flows and stiffness_over_inertia > STIFF
        self._search, self._least = CRITICAL if self._kinks or stiff else BACKTRACKING, []
        self._use(FULL if self._other != self.full_steps_first else self._search)

    def follow(self, iteration: int) -> None:
        """At the start of an iteration, where it ``follows``: the search of those to come."""
        norm = self._snes.getFunctionNorm()
        self._least.append(min([norm, *self._least[-1:]]))
        if len(self._least) > STALLED and self._least[-1] > LEFT * self._least[-1 - STALLED]:
            self._least = [norm]
            self._use(self._search if self._now == FULL else FULL)

    def _use(self, search: Tuple) -> None:
        if not self.by_user and search != self._now:
            compat.set_line_search(self._snes, *search)
            if self._now:  # the first one gets the options with the rest of the SNES
                compat.read_line_search_options(self._snes)
        self._now = search
