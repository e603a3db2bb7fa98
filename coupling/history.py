"""history.csv: one row per coupling window."""
import time
from pathlib import Path

import numpy as np


class History:
    """Rows of named numbers, written as they come, so that a run that fails leaves what it had.

    path: the CSV file, or None to keep rows in memory only; units: name → unit, in the order of the columns; notes:
    lines for the head of the file. Give a path on rank 0 only.
    """

    def __init__(self, path, units, notes=()):
        self.units, self.rows = dict(units), []
        self._file = None if path is None else open(path, "w", encoding="utf-8")
        self._flushed = time.monotonic()
        if self._file:
            for note in notes:
                self._file.write(f"# {note}\n")
            self._file.write("# units: " + ", ".join(f"{n} [{u}]" for n, u in self.units.items()) + "\n")
            self._file.write(",".join(self.units) + "\n")
            self._file.flush()

    def add(self, row):
        """Append one row, name → number; the names are those of the columns."""
        values = [row[name] for name in self.units]
        self.rows.append(values)
        if self._file:
            self._file.write(",".join(f"{value:.12g}" for value in values) + "\n")
            if time.monotonic() - self._flushed > 0.5:
                self._file.flush()
                self._flushed = time.monotonic()

    def __getitem__(self, name):
        """Column as an array, shape (rows,)."""
        return np.array(self.rows, float).reshape(-1, len(self.units))[:, list(self.units).index(name)]

    def __len__(self):
        return len(self.rows)

    def close(self):
        if self._file:
            self._file.close()
            self._file = None


def read(path):
    """Columns of a history.csv as name → array, shape (rows,)."""
    lines = [line for line in Path(path).read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    names, rows = lines[0].split(","), [line.split(",") for line in lines[1:]]
    values = np.array([row for row in rows if len(row) == len(names)], float).reshape(-1, len(names))
    return dict(zip(names, values.T))
