"""Forces and impulses on the force cells of a solid's named bodies: of the soil, and of the rocks."""
from typing import Any, Dict, Iterable, List, Tuple

import numpy as np

from .books import MATTER, key_of, means_of
from .momentum import AXES

ACTS = {"bodies": MATTER["solid"], "interface": MATTER["grains"]}  # who does, to a solid → the matter
Rows = Dict[Tuple[str, str], np.ndarray]


class OnBodies:
    """Of a ``solid`` with a method ``impulses_on_bodies()``, see ``protocols``; call it with each ``Window``.
    ``columns``: name → (unit, meaning), in the words of those of structures, none without named bodies.
    taken: names of other columns; ValueError for one that would have the same. Collective."""

    def __init__(self, solid: Any, taken: Iterable[str] = ()) -> None:
        self._read = getattr(solid, "impulses_on_bodies", dict)
        self._given = self._rows()
        self._means: Dict[str, Tuple[str, str]] = {}
        self._wholes: List[Tuple[str, str, int]] = []  # name, column, axis
        for (name, acts), row in self._given.items():
            self._means |= means_of(ACTS[acts], [key_of(name)], _dim(row))
        for name, row in {name: row for (name, _), row in self._given.items()}.items():
            self._wholes += [(name, f"impulse_{key_of(name)}_{axis}", k)
                             for k, axis in enumerate(AXES[:_dim(row)])]
        self.columns = {**self._means, **{column: ("N s", "impulse of soil and rock on it since the start")
                                          for _, column, _ in self._wholes}}
        for name in sorted(set(self.columns) & set(taken)):
            raise ValueError(f"{name} would be two columns of the history, of a body and of a wall or "
                             "another one with the same name: give each its own")

    def _rows(self) -> Rows:
        read: Dict[str, Dict[str, np.ndarray]] = self._read()
        return {(name, acts): row for name, sums in read.items() for acts, row in sums.items()}

    def __call__(self, window: Any) -> Dict[str, float]:
        """Entries after this window, name → number."""
        before, self._given = self._given, self._rows()
        means = [(row - before[key]) / window.dt for key, row in self._given.items()]
        found = dict(zip(self._means, np.concatenate([[], *means]).tolist()))
        for name, column, k in self._wholes:
            found[column] = float(sum(row[k] for (own, _), row in self._given.items() if own == name))
        return found

    def look(self) -> None:
        """Go on from what the solid has been given until now."""
        self._given = self._rows()


def _dim(row: np.ndarray) -> int:
    return 2 if len(row) == 3 else 3
