"""Rows of numbers on disk, so that the memory of a run does not grow with its length."""
import tempfile
from pathlib import Path
from typing import Any, Optional, Sequence

import numpy as np

BLOCK = 256  # rows that are gathered before they go to disk
PART = 1 << 20  # bytes that are read at once


class Rows:
    """Rows of ``width`` numbers, read by column. They lie in a file without a name in ``folder``, None for
    that of temporary files (TMPDIR); there is none before the first ``BLOCK`` rows. OSError when it cannot be
    written."""

    def __init__(self, width: int, folder: Optional[Path] = None) -> None:
        self._block, self._folder, self._count = np.empty((BLOCK, width)), folder, 0
        self._file: Any = None

    def add(self, values: Sequence[float]) -> None:
        """Append one row, shape (width,)."""
        self._block[self._count % BLOCK] = values
        if self._count % BLOCK == BLOCK - 1:
            if self._file is None:
                self._file = tempfile.TemporaryFile(dir=self._folder, buffering=0)  # noqa: SIM115 - as long as this lives
            self._write(self._block.tobytes())
        self._count += 1

    def _write(self, data: bytes) -> None:
        """All of the bytes, or none."""
        end = self._file.seek(0, 2)
        try:
            while data:  # unbuffered, a write may take a part only
                data = data[self._file.write(data):]
        except OSError:
            self._file.truncate(end)
            raise

    def column(self, number: int) -> np.ndarray:
        """Shape (rows,)."""
        out, done, width = np.empty(self._count), 0, self._block.shape[1]
        some = max(1, PART // (8 * width))
        while done < self._count - self._count % BLOCK:
            self._file.seek(8 * width * done)
            count = min(some, self._count - self._count % BLOCK - done)
            part = np.frombuffer(self._file.read(8 * width * count)).reshape(-1, width)
            out[done:done + len(part)] = part[:, number]
            done += len(part)
        out[done:] = self._block[:self._count - done, number]
        return out

    def __len__(self) -> int:
        return self._count
