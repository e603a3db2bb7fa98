"""One instance of LIGGGHTS in this process: its life, and calls of the shim's functions."""
import ctypes
from typing import Any

import numpy as np
from mpi4py import MPI

from .library import ARGUMENTS, LiggghtsError, check_sizes, quiet


def pointer(array: np.ndarray) -> int:
    """Address of the first number of ``array``, as the shim's functions take it."""
    return array.ctypes.data


class Instance:
    """LIGGGHTS on the ranks of ``comm``, through the shim ``library``. One that raised LiggghtsError is
    lost."""

    def __init__(self, library: ctypes.CDLL, comm: MPI.Comm):
        self._library = library
        arguments = (ctypes.c_char_p * (len(ARGUMENTS) + 1))(*(a.encode() for a in ARGUMENTS), None)
        handle = ctypes.c_void_p()
        with quiet():
            own = MPI._addressof(comm) if library.shares_mpi else None
            self._check(library.dem_open(len(ARGUMENTS), arguments, own, ctypes.byref(handle)))
        if not library.dem_same_layout(handle):
            raise LiggghtsError("the shim was compiled for another version of LIGGGHTS than the one "
                                "installed: reinstall this package, or use dem=reference")
        self._handle: Any = handle

    @property
    def alive(self) -> bool:
        """Neither closed nor lost in an error."""
        return self._handle is not None

    def _check(self, code: int) -> int:
        if code == 1:
            self._handle = None  # not closed: after some errors that would free memory twice
            raise LiggghtsError("LIGGGHTS: " + self._library.dem_last_error().decode(errors="replace"))
        return code

    def call(self, name: str, *arguments: Any) -> int:
        """What the shim's function ``name`` returns. Raises LiggghtsError with LIGGGHTS' own text."""
        if not self.alive:
            raise LiggghtsError("this LIGGGHTS instance is closed, or was lost in an error before: make a "
                                "new one")
        check_sizes(name, arguments)
        return self._check(getattr(self._library, name)(self._handle, *arguments))

    def command(self, line: str) -> None:
        """Run one line of LIGGGHTS' language."""
        self.call("dem_command", line.encode())

    def count(self, name: str) -> int:
        """A number of things on this rank, as the shim's function ``name`` counts them."""
        return getattr(self._library, name)(self._handle) if self.alive else 0

    def close(self) -> None:
        """Free it; a second call does nothing."""
        if self.alive:
            handle, self._handle = self._handle, None
            self._check(self._library.dem_close(handle))
