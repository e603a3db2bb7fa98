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


class Searches:
    """Of the ``snes``. kinks: the residual is piecewise linear, as of springs that open, stick and slide.
    They have a potential: line search cp finds its minimum along a line, where bt gets stuck on the
    residual's norm. What the user's options decide is left to them."""

    def __init__(self, snes: PETSc.SNES, kinks: bool) -> None:
        self._snes = snes
        self.by_user = PETSc.Options(PREFIX).hasName("snes_linesearch_type")
        self._first: Tuple = ("cp", 2, 0.1) if kinks else ("bt",)
        self._other: Tuple = ("basic",)
        self._wanted, self._now = self._first, ()
        self._least: List[float] = []
        self._use(self._first)

    @property
    def full_steps_first(self) -> bool:
        """Whether attempts begin with full steps."""
        return self._first == ("basic",)

    def exchange(self) -> None:
        """Full Newton steps from the first attempt on, and a line search where that had them."""
        self._first, self._other = self._other, self._first
        self.want(False)

    def want(self, other: bool) -> None:
        """Coming attempts begin with the ``other`` one, or with the first."""
        self._wanted = self._other if other else self._first

    def begin(self) -> None:
        """An attempt begins."""
        self._least = []
        self._use(self._wanted)

    def follow(self, iteration: int) -> None:
        """At the start of an iteration, where the residual has kinks: the search of those to come."""
        norm = self._snes.getFunctionNorm()
        self._least.append(min([norm, *self._least[-1:]]))
        if len(self._least) > STALLED and self._least[-1] > LEFT * self._least[-1 - STALLED]:
            self._least = [norm]
            self._use(self._other if self._now == self._first else self._first)

    def _use(self, search: Tuple) -> None:
        if not self.by_user and search != self._now:
            compat.set_line_search(self._snes, *search)
            if self._now:  # the first one gets the options with the rest of the SNES
                compat.read_line_search_options(self._snes)
        self._now = search
