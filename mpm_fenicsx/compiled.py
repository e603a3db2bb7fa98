"""How kernels are compiled: the only module that calls numba.

    specialise  a kernel for one dimension, kind of cell or law: a plain function whose globals become
                constants
    compiled    a kernel as it stands
    inlined     a small function that kernels call with their sizes as arguments, always made part of them
    called      a function that kernels call, made part of them where LLVM finds that good
    multiply    products of small matrices, with packed arithmetic

Numba treats global names as constants, so a loop over ``range(D)`` with a global ``D`` is unrolled: measured
on the residual of 15 360 points in the plane, 0.64 ms against 2.3 ms with the dimension read from the arrays
at run time. A law passed as an argument would be compiled anew in every process; bound as a global it comes
from numba's cache.

Kernels take arrays in groups, NamedTuples, which they unpack at their head: numba passes their fields on as
if each was an argument of its own. In a call from Python numba looks at groups with more than three arrays
slowly, at those of the residual for 0.2 ms (measured, numba 0.56): kernels of every iteration are called by
``mpm_dem_direct``.
"""
import functools
import hashlib
import inspect
import sys
import types
from pathlib import Path
from typing import Any, Callable

from llvmlite import ir
from numba import njit, void
from numba.core import cgutils
from numba.extending import intrinsic

OPTIONS = dict(error_model="numpy", fastmath={"contract"})
compiled = njit(cache=True, error_model="numpy")
# LLVM inlines these and unrolls their loops. Numba's own inlining does as well at run time, but doubles or
# triples the time that a kernel takes to compile.
inlined = njit(forceinline=True, **OPTIONS)
called = njit(error_model="numpy")


@intrinsic(prefer_literal=True)
def multiply(typing, shape, keep, out, left, right):
    """The product of small matrices, out = left right, or with ``keep`` out += left right. shape: (rows,
    terms, columns) of ``left``, rows x terms, and ``right``, terms x columns; it and keep are constants. out,
    right: (array of floats, place of the first number, step from row to row), rows without gaps; left the
    same with a step from column to column, too. Places count numbers as they lie in memory.

    A row is one packed number for LLVM, which does not find any in loops of so few rounds: these are unrolled
    before it looks."""
    (rows, terms, columns), added = (kind.literal_value for kind in shape), keep.literal_value
    signature = void(shape, keep, out, left, right)

    def generate(context, b, signature, arguments):
        vector, lane = ir.VectorType(ir.DoubleType(), columns), ir.IntType(32)
        multiply_add = cgutils.get_or_insert_function(
            b.module, ir.FunctionType(vector, [vector] * 3), f"llvm.fmuladd.v{columns}f64")
        (to, at, down), (f, first, next_row, then), (x, start, step) = (
            (context.make_array(kind[0])(context, b, value[0]).data, *value[1:])
            for kind, value in zip(signature.args[2:], (cgutils.unpack_tuple(b, group)
                                                        for group in arguments[2:])))

        def place(array, index, n, step):
            return b.gep(array, [b.add(index, b.mul(step, index.type(n)))])

        packed = lambda *of: b.bitcast(place(*of), vector.as_pointer())  # noqa: E731
        of_right = [b.load(packed(x, start, n, step), align=8) for n in range(terms)]
        for row in range(rows):
            total = b.load(packed(to, at, row, down), align=8) if added else ir.Constant(
                vector, [0.0] * columns)
            of_row = b.add(first, b.mul(next_row, first.type(row)))
            for n in range(terms):
                factor = b.load(place(f, of_row, n, then))
                factor = b.insert_element(ir.Constant(vector, ir.Undefined), factor, lane(0))
                factor = b.shuffle_vector(factor, ir.Constant(vector, ir.Undefined),
                                          ir.Constant(ir.VectorType(lane, columns), [0] * columns))
                total = b.call(multiply_add, [factor, of_right[n], total])
            b.store(total, packed(to, at, row, down), align=8)
        return context.get_dummy_value()

    return signature, generate


def _module(value):
    """Where a compiled function or a group of arrays is defined; None for anything else."""
    function = value.__wrapped__ if value is multiply else getattr(value, "py_func", None)
    if function is not None:
        return inspect.getmodule(function)
    return inspect.getmodule(value) if isinstance(value, type) and hasattr(value, "_fields") else None


def _home(template):
    """Name of the module of a template. That of a script that is run, ``__main__``, is another one in each
    run: with its classes, such as the parameters of a law, what is kept on disk could not be read again. It
    gets a name of its own, which they are told to come from."""
    if template.__module__ != "__main__":
        return template.__module__
    main = sys.modules["__main__"]
    if not getattr(main, "__file__", None):
        raise ValueError(f"{template.__name__} is defined in an interactive session, where its source cannot "
                         "be found again: put it in a file and import that")
    name = f"script_{Path(main.__file__).stem}"
    sys.modules[name] = main
    for value in vars(main).values():
        if isinstance(value, type) and hasattr(value, "_fields") and value.__module__ == "__main__":
            value.__module__ = name
    return name


@functools.lru_cache(maxsize=None)
def _source(module):
    """Source of a module and of those whose compiled functions and groups of arrays it has imported."""
    others = {_module(value) for value in vars(module).values()} - {module, None}
    return inspect.getsource(module) + "".join(sorted(_source(other) for other in others))


@functools.lru_cache(maxsize=None)
def _bind(template, names):
    constants, home = dict(names), _home(template)
    # Numba tells cache entries apart by the qualified name and does not notice edits of what a kernel calls:
    # constants and sources therefore go into the name. A bound kernel has a name of that sort already. So
    # does the module: numba finds the class of a law's parameters by its name.
    text = repr([home, *((name, getattr(value, "__name__", value)) for name, value in names)])
    tag = hashlib.sha1((text + _source(sys.modules[home])).encode()).hexdigest()[:12]
    kernel = types.FunctionType(template.__code__, {**template.__globals__, **constants},
                                f"{template.__name__}_{tag}", template.__defaults__)
    kernel.__qualname__ = kernel.__name__
    kernel.__module__ = home
    kernel.__doc__ = template.__doc__
    return njit(cache=True, **OPTIONS)(kernel)


def specialise(template: Callable, **constants: Any) -> Callable:
    """Compile the plain function ``template`` with its global names in ``constants`` (numbers, or compiled
    functions such as a law's stress) fixed. The result is kept per set of constants, in the process and on
    disk."""
    return _bind(template, tuple(sorted(constants.items())))
