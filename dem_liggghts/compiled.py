"""The one way in which functions of this package are compiled: ``@compiled``.

They get all they work on as arguments: arrays and numbers, grouped in typed NamedTuples, which numba unpacks
at no cost (a call from Python takes some 10 microseconds longer for it, once per window). Two groups of one
type compile to one kernel, so that a group is made in few places and always with the same types.

The kernels of `mpm_fenicsx.specialise` are bound to constants (dimension, cell, law) besides and so are made
by a call per set of constants. Here nothing varies but the types, so a decorator is enough.
"""
import hashlib
from pathlib import Path
from typing import Any, Callable

from numba import njit

# Numba's cache does not notice that a function called from another file has changed: the package's sources go
# into the names by which it keeps the kernels.
FILES = sorted(Path(__file__).parent.rglob("*.py"))
SOURCES = hashlib.sha1(b"".join(path.read_bytes() for path in FILES)).hexdigest()[:12]


def compiled(function: Callable[..., Any]) -> Any:
    """``function`` compiled, and kept on disk. A division by zero gives NaN, which `advance` reports with its
    place."""
    function.__qualname__ += "_" + SOURCES
    return njit(cache=True, error_model="numpy")(function)
