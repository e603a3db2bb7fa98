"""A text file that grows by lines, of which none is lost while the disk is full or the file is gone."""
import os
from pathlib import Path
from typing import Union

MOST = 1 << 13  # bytes that wait in memory


class Lines:
    """Write to ``path``, anew, or after the first ``keep`` bytes of what is there. What cannot be written
    stays in memory, and is written by the next ``flush`` that can. Who renames the file tells its new
    ``path``."""

    def __init__(self, path: Union[str, Path], keep: int = 0) -> None:
        # Where in the file that begins which waits, and that: one thing, so that an interrupt between a write
        # and what is known of it has the same bytes written to the same place again, not behind themselves.
        self.path, self._rest = path, (keep, b"")
        self._file = os.open(path, os.O_RDWR | os.O_CREAT | (0 if keep else os.O_TRUNC), 0o666)
        os.truncate(self._file, keep)

    def add(self, text: str) -> None:
        """Append ``text``, which waits in memory until there is enough of it."""
        place, waiting = self._rest
        self._rest = place, waiting + text.encode()
        if len(self._rest[1]) > MOST:
            self.flush()

    def flush(self) -> None:
        """Write what waits in memory."""
        while self._rest[1]:
            place, waiting = self._rest
            written = os.pwrite(self._file, waiting, place)
            self._rest = place + written, waiting[written:]

    def sync(self) -> int:
        """Write all to the disk itself, so that it outlives the machine. Returns the size of the file
        [bytes]."""
        self.flush()
        os.fsync(self._file)
        return os.fstat(self._file).st_size

    def missing(self) -> bool:
        """Has somebody removed the file?"""
        try:
            return not os.path.samestat(os.stat(self.path), os.fstat(self._file))
        except FileNotFoundError:
            return True

    def restore(self) -> None:
        """Put the file back at ``path`` after somebody has removed it: as long as it is open, it can be
        read."""
        old, (place, waiting) = self._file, self._rest
        self._rest = 0, os.pread(old, place, 0) + waiting
        self._file = os.open(self.path, os.O_RDWR | os.O_CREAT | os.O_TRUNC, 0o666)
        os.close(old)

    def close(self) -> None:
        """Write what is left. What then still cannot be written is lost."""
        try:
            self.flush()
        finally:
            os.close(self._file)
