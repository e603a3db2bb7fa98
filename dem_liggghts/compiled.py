"""How the kernels of the built-in DEM are compiled."""
import hashlib
from pathlib import Path

from numba import njit

# Numba's cache does not notice that a function called from another file has changed: the package's sources go into the
# names by which it keeps the kernels.
FILES = sorted(Path(__file__).parent.glob("*.py"))
SOURCES = hashlib.sha1(b"".join(path.read_bytes() for path in FILES)).hexdigest()[:12]


def compiled(function):
    """``function`` compiled, and kept on disk. A division by zero gives NaN, which `advance` reports with its place."""
    function.__qualname__ += "_" + SOURCES
    return njit(cache=True, error_model="numpy")(function)
