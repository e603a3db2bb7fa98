"""How kernels are compiled: the only module that calls numba.

    specialise  a kernel for one dimension, kind of cell or law: a plain function whose globals become
                constants
    compiled    a kernel as it stands
    inlined     a small function that kernels call with their sizes as arguments, always made part of them
    called      a function that kernels call, made part of them where LLVM finds that good
    within      a template, see ``specialise``, that is always made part of what calls it
    merged      a long function that is made part of a loop over points with packed arithmetic
    multiply    products of small matrices, with packed arithmetic
    prefetch    a line of the cache that will be wanted
    call_energy a C function that was given a name by ``link``
    where       one of two numbers, without a branch
    put         a tuple with another number at one place

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

from llvmlite import binding, ir
from numba import boolean, float64, intp, njit, void
from numba.core import cgutils
from numba.cpython.unsafe.tuple import tuple_setitem as put  # noqa: F401 - by this name
from numba.extending import intrinsic

OPTIONS = dict(error_model="numpy", fastmath={"contract"})
compiled = njit(cache=True, error_model="numpy")
# LLVM inlines these and unrolls their loops. Numba's own inlining does as well at run time, but doubles or
# triples the time that a kernel takes to compile.
inlined = njit(forceinline=True, **OPTIONS)
called = njit(error_model="numpy")
# Numba's own inlining, for long functions in loops over many points: compiled by itself first, such a one has
# packed pairs of numbers already, which keep LLVM from packing points.
merged = njit(inline="always", **OPTIONS)
WITHIN = "always_within"


def within(template: Callable) -> Callable:
    """Decorator of a template: what ``specialise`` makes of it becomes part of the kernels that call it. For
    one in a loop over points that returns several numbers: a call has them written to memory and read."""
    setattr(template, WITHIN, True)
    return template


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


@intrinsic
def where(typing, condition, one, other):
    """``one`` where the ``condition`` holds, else ``other``, both floats, without a branch: LLVM does not
    turn a loop into packed arithmetic in which it finds one."""
    def generate(context, b, signature, arguments):
        return b.select(*arguments)

    return float64(boolean, float64, float64), generate


@intrinsic
def prefetch(typing, array, place):
    """Have the cache line with one entry of an array come from memory; place: its number as they lie there.
    Nothing waits for it, and a place beyond the end of the array is no error."""
    def generate(context, b, signature, arguments):
        byte, number = ir.IntType(8).as_pointer(), ir.IntType(32)
        data = context.make_array(signature.args[0])(context, b, arguments[0]).data
        function = cgutils.get_or_insert_function(
            b.module, ir.FunctionType(ir.VoidType(), [byte] + 3 * [number]), "llvm.prefetch.p0i8")
        to_read, second_cache, of_data = number(0), number(2), number(1)
        b.call(function, [b.bitcast(b.gep(data, [arguments[1]]), byte), to_read, second_cache, of_data])
        return context.get_dummy_value()

    return void(array, place), generate


def link(key: str, kind: str, D: int, address: int) -> None:
    """Let kernels find a C function by its name, also those that were compiled by another process: the name
    stands in what numba keeps on disk, the address would be another one in each process."""
    binding.add_symbol(f"energy_{key}_{kind}_{D}", address)


def _into(context, b, kind, array, place, value):
    """Write one number of an array."""
    at = [context.get_constant(intp, index) for index in place]
    into = context.make_array(kind)(context, b, array)
    b.store(value, cgutils.get_item_pointer(context, b, kind, into, at))


@intrinsic(prefer_literal=True)
def call_energy(typing, key, D, p, F, F33, out):
    """Call the C functions of the energy ``key``, see ``link``, in ``D`` dimensions; both are constants. p:
    parameters; F, shape (D, D), and F33. It fills ``out``: P, shape (D*D + 1,), or A, shape (D*D + 1, D*D +
    1), of which C has the upper triangle; for None it returns the energy.

    They have the signature of FFCx, tabulate_tensor(out, w, given, coordinates, …), add to their output, and
    read nothing but ``given``, the entries of F and the parameters."""
    kind, dim = ("energy", "stress", "tangent")[getattr(out, "ndim", 0)], D.literal_value
    n, last = 5 if dim == 2 else 9, dim * dim + 1
    size = {"energy": 1, "stress": n, "tangent": n * (n + 1) // 2}[kind]
    name = f"energy_{key.literal_value}_{kind}_{dim}"

    def generate(context, b, signature, arguments):
        _, _, p, F, F33, out = arguments
        kinds, double, byte = signature.args, ir.DoubleType(), ir.IntType(8).as_pointer()
        of_F = context.make_array(kinds[3])(context, b, F)
        at = [[context.get_constant(intp, i) for i in (k // dim, k % dim)] for k in range(dim * dim)]
        given = [b.load(cgutils.get_item_pointer(context, b, kinds[3], of_F, place)) for place in at]
        given += [F33] if dim == 2 else []
        given += cgutils.unpack_tuple(b, p, len(kinds[2]))
        inputs, outputs = (cgutils.alloca_once(b, ir.ArrayType(double, length))
                           for length in (len(given), size))
        places = [cgutils.gep_inbounds(b, outputs, 0, i) for i in range(size)]
        for i, value in enumerate(given):
            b.store(value, cgutils.gep_inbounds(b, inputs, 0, i))
        zero = ir.Constant(double, 0.0)
        for place in places:
            b.store(zero, place)
        function = cgutils.get_or_insert_function(b.module, ir.FunctionType(ir.VoidType(), [byte] * 7), name)
        nothing = ir.Constant(byte, None)
        b.call(function, [b.bitcast(outputs, byte), nothing, b.bitcast(inputs, byte), *[nothing] * 4])
        found = [b.load(place) for place in places]
        if kind == "energy":
            return found[0]
        if kind == "stress":
            for i in range(last):
                _into(context, b, kinds[5], out, (i,), found[i] if i < n else zero)
        else:
            rows = iter(found)
            half = {(i, j): next(rows) for i in range(n) for j in range(i, n)}
            for i in range(last):
                for j in range(last):
                    _into(context, b, kinds[5], out, (i, j), half.get((min(i, j), max(i, j)), zero))
        return context.get_dummy_value()

    return (float64 if kind == "energy" else void)(key, D, p, F, F33, out), generate


def _module(value):
    """Where a compiled function or a group of arrays is defined; None for anything else."""
    own = any(value is one for one in (multiply, where, prefetch, call_energy))
    function = value.__wrapped__ if own else getattr(value, "py_func", None)
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
    return njit(cache=True, forceinline=hasattr(template, WITHIN), **OPTIONS)(kernel)


def specialise(template: Callable, **constants: Any) -> Callable:
    """Compile the plain function ``template`` with its global names in ``constants`` (numbers, or compiled
    functions such as a law's stress) fixed. The result is kept per set of constants, in the process and on
    disk."""
    return _bind(template, tuple(sorted(constants.items())))
