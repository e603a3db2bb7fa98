"""Kernels come from numba's cache without what only other kernels want of them.

Beside the machine code of a kernel numba keeps its bitcode, of which kernels that call it are made. It parses
that, and collects the names in it, whenever it loads a kernel. In a run that compiles nothing this is half of
what loading takes, 5 of 10 ms per kernel, and a sixth of its memory, 47 of 295 MB (measured on
``cases/beam_impact.py``, 37 kernels, numba 0.56). Here the bitcode waits, as it is, until a kernel that calls
this one is compiled. ``mpm_fenicsx`` and ``dem_liggghts`` import this before they compile anything.
"""
import gc
from typing import Any

COLLECTS = gc.isenabled()
gc.disable()  # what libraries are made of stays: to look it through for what does not takes 0.1 s

import numba  # noqa: E402
from llvmlite import binding  # noqa: E402
from numba.core import codegen  # noqa: E402

if COLLECTS:
    gc.enable()

VERSIONS = ("0.56", "0.68")  # of numba, whose inside is known; another one loads as it does by itself


class Library(codegen.JITCodeLibrary):
    """Machine code, and perhaps bitcode that nobody has asked for."""

    waiting = None

    @classmethod
    def _unserialize(cls, maker: Any, state: Any) -> Any:
        """A library from what the cache has kept of it."""
        name, kind, data = state
        if kind != "object":
            return super()._unserialize(maker, state)
        library = maker.create_library(name)
        machine_code, library.waiting = data
        library.enable_object_caching()
        library._set_compiled_object(machine_code)
        library._finalize_final_module()
        return library

    def _get_module_for_linking(self) -> Any:
        """The bitcode, for a kernel that is being compiled."""
        if self.waiting is not None:
            self._shared_module, self.waiting = binding.parse_bitcode(self.waiting), None
            self._codegen._engine._load_defined_symbols(self._shared_module)
        return super()._get_module_for_linking()

    def get_pointer_to_function(self, name: str) -> int:
        """Its address. Numba asks its list of names, in which those of the bitcode are missing, to be told
        of one that is nowhere: LLVM would end the process."""
        if self.waiting is not None and name.encode() in self.waiting:
            return self._codegen._engine.get_function_address(name)
        return super().get_pointer_to_function(name)


if numba.__version__.rpartition(".")[0] in VERSIONS:
    codegen.JITCPUCodegen._library_class = Library
