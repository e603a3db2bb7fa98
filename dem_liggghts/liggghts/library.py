"""The LIGGGHTS library in this process: the project's own shim (``shim/shim.cpp``), found, checked and
loaded."""
import ctypes
import os
import zlib
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path

from mpi4py import MPI  # before the library: it starts the MPI that LIGGGHTS may share

import mpm_dem_checks as check

SHIM = Path(__file__).with_name("libdemshim.so")
SOURCE = Path(__file__).with_name("shim")  # there when the package is used from its source tree
# with "-screen none" it may crash
ARGUMENTS = ("liggghts", "-screen", "/dev/null", "-log", "none", "-nocite")

# The library finds names in itself and in its own MPI first, not in another MPI of this process.
OWN_NAMES_FIRST = os.RTLD_NOW | os.RTLD_LOCAL | os.RTLD_DEEPBIND

_SIGNATURES = {
    "dem_open": (ctypes.c_int, ctypes.POINTER(ctypes.c_char_p), ctypes.c_void_p,
                 ctypes.POINTER(ctypes.c_void_p)),
    "dem_close": (ctypes.c_void_p,),
    "dem_command": (ctypes.c_void_p, ctypes.c_char_p),
    "dem_same_layout": (ctypes.c_void_p,),
    "dem_add_spheres": (ctypes.c_void_p, ctypes.c_int, ctypes.c_void_p),
    "dem_set_bodies": (ctypes.c_void_p, ctypes.c_int, ctypes.c_void_p),
    "dem_count_bodies": (ctypes.c_void_p,),
    "dem_bodies": (ctypes.c_void_p, ctypes.c_void_p),
    "dem_set_wall": (ctypes.c_void_p, *[ctypes.c_int] * 5, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int,
                     ctypes.c_void_p),
    "dem_set_moving": (ctypes.c_void_p, ctypes.c_int, ctypes.c_void_p, ctypes.c_int, ctypes.c_void_p),
    "dem_set_squares": (ctypes.c_void_p, ctypes.c_int, *[ctypes.c_void_p] * 4),
    "dem_wall_rows": (ctypes.c_void_p, *[ctypes.c_int] * 2, ctypes.POINTER(ctypes.c_void_p),
                      ctypes.POINTER(ctypes.c_int)),
    "dem_set_wall_force": (ctypes.c_void_p, *[ctypes.c_int] * 2, ctypes.c_void_p),
    "dem_advance": (ctypes.c_void_p, *[ctypes.c_int] * 4, *[ctypes.c_void_p] * 2),
    "dem_count": (ctypes.c_void_p,),
    "dem_particles": (ctypes.c_void_p, ctypes.c_void_p),
    "dem_get_state": (ctypes.c_void_p, ctypes.POINTER(ctypes.c_void_p), ctypes.POINTER(ctypes.c_int)),
    "dem_get_springs": (ctypes.c_void_p, ctypes.POINTER(ctypes.c_void_p), ctypes.POINTER(ctypes.c_int)),
    "dem_set_springs": (ctypes.c_void_p, ctypes.c_int, ctypes.c_void_p),
    "dem_halt": (ctypes.c_void_p,),
    "dem_set_state": (ctypes.c_void_p, ctypes.c_int, ctypes.c_int, ctypes.c_void_p, ctypes.c_int,
                      ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int, ctypes.c_void_p, ctypes.c_int),
}


INTEGERS = {name: [i for i, kind in enumerate(arguments[1:]) if kind is ctypes.c_int]  # after the handle
            for name, arguments in _SIGNATURES.items()}


class MissingLiggghts(ImportError):  # noqa: N818 - what is missing is its name
    """LIGGGHTS or the shim compiled against it is not there."""


class LiggghtsError(RuntimeError):
    """LIGGGHTS stopped with an error; its text is the message."""


def check_sizes(name, arguments):
    """ValueError unless the shim's function ``name`` gets whole numbers of 32 bits: ctypes cuts off what is
    beyond."""
    for i in INTEGERS[name]:
        if not -check.COUNT <= arguments[i] <= check.COUNT:
            raise ValueError(f"{arguments[i]} is too large for LIGGGHTS, which counts to {check.COUNT}: take "
                             "fewer steps per window, spheres or wall elements, or use dem=reference")


@lru_cache(maxsize=None)
def load(path):
    """The shim at ``path``. It must come into the process before libliggghts, whose error handling it
    replaces: it brings the library along. Raises MissingLiggghts."""
    try:
        library = ctypes.CDLL(str(path), mode=OWN_NAMES_FIRST)
    except OSError as error:
        raise MissingLiggghts(
            "LIGGGHTS is not available: install it with `apt install liggghts libliggghts-dev "
            "libopenmpi-dev` and reinstall this package to compile its shim, or use dem=reference, which "
            f"works without ({error})") from None
    library.dem_last_error.restype, library.dem_source.restype = ctypes.c_char_p, ctypes.c_uint
    source = [file.read_bytes() for file in sorted(SOURCE.glob("*")) if file.suffix in (".cpp", ".h")]
    if source and library.dem_source() != zlib.crc32(b"".join(source)):
        raise MissingLiggghts(f"the LIGGGHTS shim {path} is older than its source: reinstall this package to "
                              "compile it, or use dem=reference, which works without")
    for name, arguments in _SIGNATURES.items():
        getattr(library, name).argtypes = arguments
    library.shares_mpi = bool(library.dem_shares_mpi())  # asked before LIGGGHTS starts an MPI of its own
    return library


def ranks_of(library, comm=None):
    """Communicator of one instance of LIGGGHTS: ``comm`` (default: all ranks), or this rank alone where
    LIGGGHTS was built with another MPI than mpi4py. Then every rank runs the whole scene, and all do the same
    to the last bit."""
    return (comm or MPI.COMM_WORLD) if library.shares_mpi else MPI.COMM_SELF


@contextmanager
def quiet():
    """Nothing on stderr: from the second instance on, LIGGGHTS lists all its contact models there."""
    keep = os.dup(2)
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, 2)
    try:
        yield
    finally:
        os.dup2(keep, 2)
        os.close(keep)
        os.close(null)
