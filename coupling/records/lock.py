"""The lock of a folder, held as long as the process lives that took it."""
import errno
import fcntl
import os
import socket
import warnings
from contextlib import suppress
from pathlib import Path
from typing import TextIO

from .writing import OutputError

UNKNOWN = errno.ENOLCK, errno.EOPNOTSUPP, errno.ENOSYS  # file systems without locks


class Lock:
    """Holds ``folder``, which is there, by a lock on the file ``path`` in it. The system gives it up when the
    process ends, however that happens. OutputError when another run holds it."""

    def __init__(self, folder: Path, path: Path) -> None:
        self._path = Path(path)
        self._file = self._open(folder)
        while not self._is_in_folder():  # its holder has removed it meanwhile, as it does at its end
            self._file.close()
            self._file = self._open(folder)
        with suppress(OSError):  # a full disk: the lock holds without
            self._file.truncate(0)
            self._file.write(f"process {os.getpid()} on {socket.gethostname()}")
            self._file.flush()

    def _open(self, folder: Path) -> TextIO:
        file = self._create()
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            if error.errno in UNKNOWN:
                warnings.warn(f"out={folder} is on a file system without locks: "
                              "let no other run write there meanwhile", stacklevel=2)
                return file
            file.seek(0)
            holder = file.read() or "a process that has just begun"
            file.close()
            if error.errno not in (errno.EWOULDBLOCK, errno.EACCES):
                raise
            raise OutputError(f"out={folder} belongs to a run that has not ended ({holder}): wait for its "
                              "end, or choose another folder") from None
        return file

    def _create(self) -> TextIO:
        while True:
            self._path.parent.mkdir(exist_ok=True)
            try:
                return open(self._path, "a+", encoding="utf-8")
            except FileNotFoundError:
                pass  # its holder has just removed the folder, too

    def _is_in_folder(self) -> bool:
        try:
            return os.path.samestat(os.stat(self._path), os.fstat(self._file.fileno()))
        except FileNotFoundError:
            return False

    def held(self) -> bool:
        """Is the lock's file still in the folder?"""
        return not self._file.closed and self._is_in_folder()

    def release(self) -> None:
        """Give the folder to others."""
        if self.held():
            self._path.unlink()
        with suppress(OSError):
            self._file.close()
