"""Rows of numbers on disk, so that the memory of a run does not grow with its length."""
import tempfile
from pathlib import Path
from typing import Any, Iterator, Optional, Sequence

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

    def parts(self) -> Iterator[np.ndarray]:
        """All rows in pieces, shape (some, width) each."""
        done, width, on_disk = 0, self._block.shape[1], self._count - self._count % BLOCK
        some = max(1, PART // (8 * max(width, 1)))
        while done < on_disk:
            self._file.seek(8 * width * done)
            count = min(some, on_disk - done)
            yield np.frombuffer(self._file.read(8 * width * count)).reshape(-1, width)
            done += count
        yield self._block[:self._count - done]

    def column(self, number: int) -> np.ndarray:
        """Shape (rows,)."""
        return np.concatenate([part[:, number].copy() for part in self.parts()])

    def __len__(self) -> int:
        return self._count
