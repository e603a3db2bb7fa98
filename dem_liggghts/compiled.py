"""The one way in which functions of this package are compiled: ``@compiled``.

They get all they work on as arguments: arrays and numbers, grouped in typed NamedTuples, which cost nothing
inside compiled code. Only a call from Python has a price: numba takes 180 microseconds to recognise the
groups of a window. What Python calls in every window is therefore called by `mpm_dem_direct`.

`mpm_fenicsx.compiled` has besides `specialise`, which binds a kernel to constants (dimension, cell, law) and
compiles it per set of them. Here nothing varies but the types of arguments, so a decorator is all there is.
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
