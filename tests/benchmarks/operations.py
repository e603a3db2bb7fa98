"""What a compiled kernel does: its operations on floats, and the bytes of the arrays that it touches.

The kernel and all it calls run as plain Python, on numbers that count what is done to them and arrays that
know whether they were read and written. A sum, a product, a quotient, a power, a root, a logarithm are one
operation each, a product that is added two; comparisons, absolute values and copies are none. Operations on
constants of the call, such as a law's parameters, do not count: they belong in front of the loop.
"""
import math
import operator
import types
from typing import NamedTuple

import numpy as np

from mpm_fenicsx import compiled


class Work(NamedTuple):
    """Per point: ``operations``, and the bytes of what was ``read`` and ``written``."""

    operations: float
    read: float
    written: float


class Number:
    """A float that counts."""

    __slots__ = ("value",)
    operations = 0

    def __init__(self, value):
        self.value = float(value)

    def __float__(self):
        return self.value

    def __int__(self):
        return int(self.value)

    def __bool__(self):
        return bool(self.value)

    def __abs__(self):
        return Number(abs(self.value))

    def __neg__(self):
        return Number(-self.value)


def _counted(function):
    def call(*given):
        Number.operations += 1
        with np.errstate(all="ignore"):  # as in the kernels, where 1 / 0 is infinite
            return Number(function(*(np.float64(float(value)) for value in given)))

    return call


for _name in ("add", "sub", "mul", "truediv", "pow"):
    _call = _counted(getattr(operator, _name))
    setattr(Number, f"__{_name}__", _call)
    setattr(Number, f"__r{_name}__", lambda self, other, call=_call: call(other, self))
for _name in ("lt", "le", "gt", "ge", "eq", "ne"):
    setattr(Number, f"__{_name}__", lambda self, other, same=getattr(operator, _name): same(
        self.value, float(other)))


def _numbers(values):
    return np.frompyfunc(Number, 1, 1)(np.asarray(values, float)).astype(object)


class Watched(np.ndarray):
    """An array, with its parts, that notes under its ``name`` in ``touched`` that it was read or written."""

    def __array_finalize__(self, other):
        self.name, self.touched = getattr(other, "name", None), getattr(other, "touched", None)

    def __getitem__(self, index):
        found = super().__getitem__(index)
        if not isinstance(found, Watched) and self.touched is not None:
            self.touched["read"].add(self.name)
        return found

    def __setitem__(self, index, value):
        if self.touched is not None:
            self.touched["written"].add(self.name)
        super().__setitem__(index, value)


class Records:
    """An array of records: each is one of ``Record``."""

    def __init__(self, fields):
        self.fields = fields

    def __getitem__(self, q):
        return Record(self.fields, q)


class Record:
    """Record q of arrays by field."""

    def __init__(self, fields, q):
        self.__dict__.update(_fields=fields, _q=q)

    def __getattr__(self, name):
        return self._fields[name][self._q]

    def __setattr__(self, name, value):
        self._fields[name][self._q] = value


class _Space:
    """A module whose functions count; ``others``: what is not as there."""

    def __init__(self, module, **others):
        self._module, self._others = module, others

    def __getattr__(self, name):
        found = self._others.get(name, getattr(self._module, name))
        return found if name in self._others or not callable(found) else _counted(found)


def _made(shape, *kind):
    return _numbers(np.zeros(shape))


def _multiply(shape, keep, out, left, right):
    """See ``compiled.multiply``."""
    (rows, terms, columns), (to, at, down) = shape, out
    (f, first, next_row, then), (x, start, step) = left, right
    to, f, x = to.reshape(-1), f.reshape(-1), x.reshape(-1)
    for i in range(rows):
        for j in range(columns):
            total = to[at + i * down + j] if keep else 0.0
            for n in range(terms):
                total = total + f[first + i * next_row + n * then] * x[start + n * step + j]
            to[at + i * down + j] = total


def _where(condition, one, other):
    return one if condition else other


def _put(numbers, place, value):
    return *numbers[:place], value, *numbers[place + 1:]


SPACES = {id(math): _Space(math), id(np): _Space(np, empty=_made, zeros=_made)}


def plain(function, known):
    """A compiled function, or what stands in its place, as plain Python that counts; ``known``: by id."""
    instead = {id(compiled.multiply): _multiply, id(compiled.where): _where, id(compiled.put): _put}
    if id(function) in instead:
        return instead[id(function)]
    if id(function) in SPACES or not hasattr(function, "py_func"):
        return SPACES.get(id(function), function)
    if id(function) not in known:
        source, names = function.py_func, {}
        known[id(function)] = types.FunctionType(source.__code__, names, source.__name__,
                                                  source.__defaults__, source.__closure__)
        names.update({name: plain(source.__globals__[name], known) for name in source.__code__.co_names
                      if name in source.__globals__})
    return known[id(function)]


def work(kernel, arguments, n, chosen):
    """``Work`` of a call with those arguments, in which arrays of ``n`` rows belong to the points: done for
    the points ``chosen``, a slice, alone. The arguments stay as they are."""
    touched, sizes, taken = {"read": set(), "written": set()}, {}, len(range(n)[chosen])

    def watched(array):
        name = len(sizes)
        sizes[name] = array.nbytes
        part = array[chosen] if len(array) == n else array
        copy = (_numbers(part) if array.dtype.kind == "f" else part.copy()).view(Watched)
        copy.name, copy.touched = name, touched
        return copy

    def counting(value):
        if isinstance(value, tuple):
            given = (counting(part) for part in value)
            return type(value)(*given) if hasattr(value, "_fields") else tuple(given)
        if not isinstance(value, np.ndarray):
            return value
        if value.dtype.names:
            return Records({name: watched(value[name]) for name in value.dtype.names})
        return watched(value)

    given = [counting(argument) for argument in arguments]
    Number.operations = 0
    plain(kernel, {})(*given)
    used = {way: sum(sizes[name] for name in names) / n for way, names in touched.items()}
    return Work(Number.operations / taken, used["read"], used["written"])
