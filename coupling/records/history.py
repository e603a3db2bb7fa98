"""history.csv: one row per coupling window."""
import time
from pathlib import Path
from typing import Dict, Iterable, List, Optional, Tuple, Union

import numpy as np

from .lines import Lines
from .rows import Rows

Columns = Dict[str, Tuple[str, str]]


class History:
    """Rows of named numbers, written as they come, so that a run that fails leaves what it had. Memory does
    not grow with them: columns are read back from ``rows.Rows``, which has the numbers as they were, when
    they are asked for.

    path: the CSV file, or None for none; columns: name → (unit, meaning), in their order; notes:
    lines for the head of the file. Give a path on rank 0 only.

    >>> history = History(None, {"time": ("s", "end of the window"), "force": ("N", "on the wall")})
    >>> history.add({"time": 0.5, "force": 2.0})
    >>> history["force"], len(history)
    (array([2.]), 1)
    """

    def __init__(self, path: Optional[Union[str, Path]], columns: Columns,
                 notes: Iterable[str] = ()) -> None:
        self.columns, self.file = dict(columns), None if path is None else Lines(path)
        self.rows = Rows(len(self.columns), None if path is None else Path(path).parent)
        self._flushed = time.monotonic()
        if self.file:
            notes = [*notes,
                     *(f"{name} [{unit}]: {meaning}" for name, (unit, meaning) in self.columns.items())]
            for note in notes:
                self.file.add(f"# {' '.join(note.split())}\n")
            self.file.add(",".join(self.columns) + "\n")
            self.file.flush()

    def add(self, row: Dict[str, float]) -> None:
        """Append one row, name → number; the names are those of the columns."""
        values = [row[name] for name in self.columns]
        self.rows.add(values)
        if self.file:
            self.file.add(",".join(f"{value:.15g}" for value in values) + "\n")
            if time.monotonic() - self._flushed > 0.5:
                self.file.flush()
                self._flushed = time.monotonic()

    def __getitem__(self, name: str) -> np.ndarray:
        """Column as an array, shape (rows,)."""
        return self.rows.column(list(self.columns).index(name))

    def __len__(self) -> int:
        return len(self.rows)

    def close(self) -> None:
        """Write what is left; columns can still be read."""
        if self.file:
            file, self.file = self.file, None
            file.close()


def read(path: Union[str, Path]) -> Dict[str, np.ndarray]:
    """Columns of a history.csv as name → array, shape (rows,). A last line that was not written to its end is
    left out. ValueError when the file has no header yet."""
    names: List[str] = []
    rows = Rows(0)
    with open(path, encoding="utf-8") as file:
        for line in file:
            if line.startswith("#") or not line.endswith("\n"):
                continue
            if not names:
                names = line.strip().split(",")
                rows = Rows(len(names))
            elif line != "\n":
                rows.add([float(number) for number in line.split(",")])
    if not names:
        raise ValueError(f"{path} has no line with the names of its columns: it is not a history, or the run "
                         "ended before its first window")
    return {name: rows.column(k) for k, name in enumerate(names)}
