"""history.csv: one row per coupling window."""
import time
from pathlib import Path
from typing import Dict, Iterable, List, NamedTuple, Optional, Tuple, Union

import numpy as np

from .lines import Lines
from .rows import Rows
from .writing import OutputError

Columns = Dict[str, Tuple[str, str]]


class Kept(NamedTuple):
    """Of a history that goes on: how many ``rows`` stay, and the ``size`` of the file with them [bytes]."""

    rows: int
    size: int


class History:
    """Rows of named numbers, written as they come, so that a run that fails leaves what it had. Memory does
    not grow with them: columns are read back from ``rows.Rows``, which has the numbers as they were, when
    they are asked for.

    path: the CSV file, or None for none; columns: name → (unit, meaning), in their order; notes:
    lines for the head of the file; kept: of a history at ``path`` that goes on, else None: OutputError where
    the file does not have these rows and columns. Give a path on rank 0 only.

    >>> history = History(None, {"time": ("s", "end of the window"), "force": ("N", "on the wall")})
    >>> history.add({"time": 0.5, "force": 2.0})
    >>> history["force"], len(history)
    (array([2.]), 1)
    """

    def __init__(self, path: Optional[Union[str, Path]], columns: Columns, notes: Iterable[str] = (),
                 kept: Optional[Kept] = None) -> None:
        self.columns, self._flushed = dict(columns), time.monotonic()
        self.rows = Rows(len(self.columns), None if path is None else Path(path).parent)
        if path is not None and kept is not None:
            self._read(Path(path), kept)
        self.file = None if path is None else Lines(path, 0 if kept is None else kept.size)
        if self.file and kept is None:
            notes = [*notes,
                     *(f"{name} [{unit}]: {meaning}" for name, (unit, meaning) in self.columns.items())]
            for note in notes:
                self.file.add(f"# {' '.join(note.split())}\n")
            self.file.add(",".join(self.columns) + "\n")
            self.file.flush()

    def _read(self, path: Path, kept: Kept) -> None:
        """The rows that stay."""
        there = path.stat().st_size
        if there < kept.size:
            raise OutputError(f"{path} has {there} bytes, fewer than the {kept.size} bytes that it had when "
                              "the checkpoint was written: put back the history of that run")
        if _read_rows(path, self.rows, kept.size) != list(self.columns) or len(self.rows) != kept.rows:
            raise OutputError(f"{path} does not have the columns of this run and the {kept.rows} rows of the "
                              "checkpoint: put back the history of that run")

    def sync(self) -> Kept:
        """Write all rows to the disk itself, and say how much that is."""
        return Kept(len(self), self.file.sync() if self.file else 0)

    def add(self, row: Dict[str, float]) -> None:
        """Append one row, name → number; the names are those of the columns."""
        values = [row[name] for name in self.columns]
        self.rows.add(values)
        if self.file:
            self.file.add(",".join(map(_exactly, values)) + "\n")
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
    with open(path, encoding="utf-8") as file:
        names = next((line.strip().split(",") for line in file if line[0] != "#" and line[-1] == "\n"), [])
    rows = Rows(len(names))
    _read_rows(path, rows)
    if not names:
        raise ValueError(f"{path} has no line with the names of its columns: it is not a history, or the run "
                         "ended before its first window")
    return {name: rows.column(k) for k, name in enumerate(names)}


def _read_rows(path: Union[str, Path], rows: Rows, size: Optional[int] = None) -> List[str]:
    """Add the rows in the first ``size`` bytes of a history.csv (None: in all) to ``rows``; returns the names
    of its columns. ValueError for a row of another length."""
    names: List[str] = []
    with open(path, "rb") as file:
        for line in file:
            if line.startswith(b"#") or not line.endswith(b"\n") or (size is not None and file.tell() > size):
                continue
            if not names:
                names = line.decode().strip().split(",")
            elif line != b"\n":
                rows.add([float(number) for number in line.split(b",")])
    return names


def _exactly(value: float) -> str:
    """The shortest text that is this number to the last bit, without a point where it is a whole one.

    >>> _exactly(2.0), _exactly(0.1 + 0.2), _exactly(2e-6)
    ('2', '0.30000000000000004', '2e-06')
    """
    return repr(float(value)).removesuffix(".0")
