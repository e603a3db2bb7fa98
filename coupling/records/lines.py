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
        self.path, self._waiting = path, bytearray()
        self._file = os.open(path, os.O_RDWR | os.O_CREAT | (0 if keep else os.O_TRUNC), 0o666)
        os.truncate(self._file, keep)
        os.lseek(self._file, keep, os.SEEK_SET)

    def add(self, text: str) -> None:
        """Append ``text``, which waits in memory until there is enough of it."""
        self._waiting += text.encode()
        if len(self._waiting) > MOST:
            self.flush()

    def flush(self) -> None:
        """Write what waits in memory."""
        while self._waiting:
            written = os.write(self._file, self._waiting)
            del self._waiting[:written]

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
        size, old = os.fstat(self._file).st_size, self._file
        self._waiting = bytearray(os.pread(old, size, 0)) + self._waiting
        self._file = os.open(self.path, os.O_RDWR | os.O_CREAT | os.O_TRUNC, 0o666)
        os.close(old)

    def close(self) -> None:
        """Write what is left. What then still cannot be written is lost."""
        try:
            self.flush()
        finally:
            os.close(self._file)
