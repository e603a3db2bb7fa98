"""The columns of history.csv, and their numbers after each window."""
from typing import Any, Dict, Tuple

import numpy as np

from ..ledger import exchange
from ..ledger.books import Books
from ..ledger.departures import Departures
from ..ledger.dissipation import Dissipation
from ..ledger.on_bodies import OnBodies

WINDOW = {  # name → (unit, meaning)
    "newton": ("1", "Newton iterations of the MPM, in the last computation of the window"),
    "window": ("s", "length of the window"),
    "iterations": ("1", "computations of the window by both partitions until they agreed; 1 when weakly "
                   "coupled"),
    "retries": ("1", "attempts at the window that were given up"),
}


class RecordedColumns:
    """Of the case, name → (unit, meaning, function of the ``Window``); of the loop, the ledger and what has
    left, and of the solid. closed: nothing but the two partitions exchanges energy. ``meanings``: name →
    (unit, meaning). Collective.
    """

    def __init__(self, of_case: Dict[str, tuple], solid: Any, grains: Any, closed: bool = False) -> None:
        self._of_case, self._solid, self._closed = of_case, solid, closed
        gravity = 0.0 if grains is None else getattr(grains.scene, "gravity", 0.0)
        self.ledger = None if grains is None else exchange.Ledger(solid, grains, gravity)
        self._departures = Departures(solid, grains)
        self._books = Books(solid, grains, self.ledger.of_grains if self.ledger else None)
        self._dissipation = Dissipation(solid, grains)
        self._on_bodies = OnBodies(solid, self._books.columns)
        self._of_solid: Dict[str, tuple] = getattr(solid, "columns", dict)()
        self.meanings = {"time": ("s", "end of the window"), **_meanings(of_case), **WINDOW,
                         **(self.ledger.columns if self.ledger else {}), **self._departures.columns,
                         **self._dissipation.columns, **self._books.columns, **self._on_bodies.columns,
                         **_meanings(self._of_solid)}
        # sums of iterations; computations, failed and refused attempts
        self.newton, self.counts = 0, np.zeros(3, int)
        self._last: Dict[str, float] = {}

    def __call__(self, window: Any) -> Dict[str, float]:
        """The row of a window, name → number."""
        self._last = self.ledger(window) if self.ledger else {}
        self.newton += self._solid.iterations
        self.counts += window.iterations, window.failed, window.refused
        return {"time": window.time, **{name: of(window) for name, (_, _, of) in self._of_case.items()},
                "newton": self._solid.iterations, "window": window.dt, "iterations": window.iterations,
                "retries": window.failed + window.refused, **self._last, **self._departures.entries(),
                **self._dissipation(self.ledger), **self._books(window), **self._on_bodies(window),
                **{name: value() for name, (_, _, value) in self._of_solid.items()}}

    def get_state(self) -> Dict[str, Any]:
        """Sums since the start, as name → numbers."""
        return {"newton": self.newton, "counts": self.counts.copy(),
                "ledger": self.ledger and self.ledger.get_state(), "books": self._books.get_state()}

    def set_state(self, state: Dict[str, Any], last: Any) -> None:
        """Go on from there, after the ``last`` window."""
        self.newton, self.counts = state["newton"], state["counts"].copy()
        if self.ledger:
            self.ledger.set_state(state["ledger"], last)
        self._books.set_state(state["books"])
        self._on_bodies.look()

    def check(self, time: float) -> None:
        """``exchange.UnstableError`` when a closed system has gained energy until ``time`` [s]."""
        if self._closed and self.ledger:
            exchange.check_closed(self._last, time, self.ledger.share)

    def means(self, windows: int) -> Dict[str, float]:
        """Entries of report.json, over so many windows."""
        computed, failed, refused = self.counts.tolist()
        return {"newton_mean": self.newton / max(windows, 1), "coupling_mean": computed / max(windows, 1),
                "retries": failed + refused, "failed": failed}


def _meanings(columns: Dict[str, tuple]) -> Dict[str, Tuple[str, str]]:
    return {name: (unit, meaning) for name, (unit, meaning, _) in columns.items()}
