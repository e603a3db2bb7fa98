"""A kernel that is loaded from numba's cache leaves what is only for other kernels until one is compiled."""
import importlib
import os
import subprocess
import sys
from pathlib import Path

import numba
import pytest

import mpm_dem_loading

ROOT = Path(__file__).parents[1]
INNER = """
from numba import njit

@njit(cache=True)
def inner(x):
    return 3.0 * x
"""
OUTER = """
import ctypes, mpm_dem_loading, numba
from inner_kernel import inner

assert inner(2.0) == 6.0 and sum(inner.stats.cache_hits.values()) == 1
(result,) = inner.overloads.values()
waits = result.library.waiting is not None
entry = result.library.get_pointer_to_function(result.fndesc.llvm_cfunc_wrapper_name)
of_c = ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_double)(entry)
assert of_c(3.0) == 9.0 and result.library.get_pointer_to_function("nowhere") == 0

@numba.njit
def outer(x):
    return inner(x) + 1.0

print(waits, outer(2.0), result.library.waiting is None)
"""


@pytest.mark.skipif(numba.__version__.rpartition(".")[0] not in mpm_dem_loading.VERSIONS,
                    reason="this numba loads as it does by itself")
def test_bitcode_waits_for_a_kernel_that_needs_it(tmp_path, monkeypatch):
    (tmp_path / "inner_kernel.py").write_text(INNER)
    monkeypatch.syspath_prepend(tmp_path)
    assert importlib.import_module("inner_kernel").inner(1.0) == 3.0  # compiled and kept
    path = os.pathsep.join(map(str, (ROOT, tmp_path)))
    done = subprocess.run([sys.executable, "-c", OUTER], env={**os.environ, "PYTHONPATH": path},
                          capture_output=True, text=True)
    assert done.stdout.split() == ["True", "7.0", "True"], done.stderr
