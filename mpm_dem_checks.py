"""Checks of what a user gives: one function per kind of value, the same for keys, fields of scenes and files.

Each returns the value as the program uses it, or raises ValueError with one sentence: name of the key or
field, value, and what is allowed, in the words of ``rule`` where that is given. All packages may use it.
"""
import math
import os
from contextlib import suppress
from pathlib import Path
from typing import NoReturn

import numpy as np

MOST, LEAST = 1e30, 1e-30  # SI units: beyond them products of a few quantities leave the range of a double
COUNT = 2**31 - 1  # most of anything that is counted: numbers have 32 bits in PETSc and LIGGGHTS
WORK = 1e12  # operations of a window or of the start, some twenty minutes: for more nobody waits
SHOWN = 80  # characters of a value


def refuse(name: str, value: object, rule: str, unit: str = "") -> NoReturn:
    """Raise the ValueError of all that follows."""
    raise ValueError(f"{name} is {shown(value)}{unit and ' ' + unit}: {rule}")


def shown(value, plain=False):
    """A value in one line and not too long; plain: a text without quotes."""
    quoted = isinstance(value, (str, bytes)) and not plain
    text = getattr(value, "__name__", None) or (repr(value) if quoted else str(value))
    text = " ".join(text.encode(errors="backslashreplace").decode().split())
    return text if len(text) <= SHOWN or isinstance(value, Path) else text[:SHOWN] + " …"


def finite(name, value, unit="", rule="give a finite number"):
    """A number that is neither NaN nor infinite, as float."""
    number = _real(value)
    if not math.isfinite(number):
        refuse(name, value, rule, unit)
    if abs(number) > MOST:
        refuse(name, value, f"give a number of at most {MOST:g} in size", unit)
    return number


def positive(name, value, unit="", rule="give a positive number"):
    """A finite number above zero, as float."""
    number = finite(name, value, unit, rule)
    if not number > 0.0:
        refuse(name, value, rule, unit)
    if number < LEAST:
        refuse(name, value, f"give a positive number of at least {LEAST:g}", unit)
    return number


def not_negative(name, value, unit="", rule="give 0 or a positive number"):
    """A finite number from zero on, as float."""
    return positive(name, value, unit, rule) if finite(name, value, unit, rule) else 0.0


def between(name, value, low, high, unit="", rule=None, ends="[]"):
    """A number from ``low`` to ``high`` as float; ends: "(]" is without ``low``, "[)" ``high``, "()" both."""
    out = " and ".join(str(end) for end, left in ((low, ends[0] == "("), (high, ends[1] == ")")) if left)
    rule = rule or f"give a number from {low} to {high}" + (f" without {out}" if out else "")
    number = finite(name, value, unit, rule)
    if not low <= number <= high or (number == low and ends[0] == "(") or (number == high and ends[1] == ")"):
        refuse(name, value, rule, unit)
    return number


def count(name, value, least=1, most=COUNT, rule=None):
    """A whole number, as int."""
    number, general = _real(value), f"give a whole number of at least {least}"
    if not (number >= least and number % 1.0 == 0.0):  # infinity leaves NaN
        refuse(name, value, rule or general)
    if number > most:
        refuse(name, value, f"{general} and at most {most}")
    return int(number)


def _real(value):
    """As float; NaN when it is no number. Truth values and texts are none."""
    if type(value) is float:
        return value
    try:
        text = isinstance(value, (bool, np.bool_, str, bytes)) or np.ndim(value)
        return math.nan if text else float(value)
    except (TypeError, ValueError, OverflowError):
        return math.nan


def counts(name, value, length, least=1):
    """``length`` whole numbers, as tuple of int; one may stand alone."""
    given = (value,) if length == 1 and not math.isnan(_real(value)) else _listed(value)
    if len(given) != length or not all(v >= least and v % 1.0 == 0.0 for v in map(_real, given)):
        if length > 1:
            refuse(name, value, f"give {length} whole numbers, each at least {least}")
        refuse(name, given[0] if len(given) == 1 else value,
               f"give {'a' if len(given) == 1 else 'one'} whole number of at least {least}")
    return tuple(count(name, v, least, math.inf) for v in given)


def numbers(name, value, length, unit="", kind=finite):
    """``length`` numbers, each as ``kind`` allows (``finite``, ``positive``, …), as tuple of float."""
    values = _listed(value)
    if len(values) != length:
        refuse(name, value, f"give {length} numbers" if length > 1 else "give one number", unit)
    return tuple(kind(f"{name} (number {i} of {length})", v, unit) for i, v in enumerate(values, 1))


def _listed(value):
    """The entries of a tuple, list or array with one dimension; of anything else none."""
    try:
        return () if isinstance(value, (str, bytes)) or np.ndim(value) != 1 else tuple(value)
    except (TypeError, ValueError):
        return ()


def array(name, value, *shapes, unit=""):
    """Finite numbers of one of the ``shapes``, tuples in which a text as "n" is any length, as floats."""
    result = shaped(name, value, *shapes)
    bad = ~(np.abs(result) <= MOST)
    if bad.any():
        place = np.argwhere(bad)[0].tolist()
        where = f"{name} (entry {', '.join(map(str, place))})" if place else name
        refuse(where, result[tuple(place)], f"give finite numbers of at most {MOST:g} in size", unit)
    return result


def indices(name, value, end, columns, of):
    """Numbers of ``of`` from 0 to ``end`` - 1, shape (n, k) with k among ``columns``, as array of int64."""
    result = shaped(name, value, *(("n", k) for k in columns))
    if result.size and not (result % 1.0 == 0.0).all():
        refuse(name, value, f"give whole numbers, those of {of}")
    if result.size and not 0 <= result.min() <= result.max() < end:
        raise ValueError(f"{name} name {of} {result.min():.0f}..{result.max():.0f}, there are {end}: "
                         f"give numbers from 0 to {end - 1}")
    return result.astype(np.int64)


def shaped(name, value, *shapes):
    """Numbers of one of the ``shapes``, also NaN and infinity, as array of float."""
    try:
        result = np.array(value)
    except ValueError:  # lists of different lengths
        result = None
    if result is None or result.dtype.kind not in "iuf":  # texts, truth values and objects are no numbers
        refuse(name, value, f"give numbers of shape {_shapes(shapes)}")
    if not any(len(shape) == result.ndim and all(
            isinstance(n, str) or n == m for n, m in zip(shape, result.shape)) for shape in shapes):
        given = f"is {shown(value)}" if result.size < 7 else f"has shape {result.shape}"
        raise ValueError(f"{name} {given}: give numbers of shape {_shapes(shapes)}")
    return result.astype(float)


def _shapes(shapes):
    return " or ".join(str(shape).replace("'", "") + ("" if shape else " (one number)") for shape in shapes)


def choice(name, value, choices):
    """One of the ``choices``."""
    found = [known for known in choices if type(value) is type(known) and value == known]
    return found[0] if found else refuse(name, value, f"choose one of {', '.join(map(str, choices))}")


def truth(name, value):
    """True or False."""
    if not isinstance(value, (bool, np.bool_)):
        refuse(name, value, "give True or False")
    return bool(value)


def mask(name, function, x):
    """Which of the positions x [m], shape (n, dim), ``function`` chooses, as array of bool, shape (n,)."""
    result = np.asarray(_called(name, function, x))
    if result.dtype != bool or result.shape != (len(x),):
        raise ValueError(f"{name} gives {result.dtype} of shape {result.shape} for positions of shape "
                         f"{np.shape(x)}: let it say True or False of each, shape ({len(x)},)")
    return result


def values(name, function, arguments, *shapes, unit=""):
    """What ``function`` gives for the ``arguments``, finite numbers of one of the ``shapes``."""
    return array(f"the value of {name}", _called(name, function, *arguments), *shapes, unit=unit)


def function(name, value):
    """Something that can be called."""
    return value if callable(value) else refuse(name, value, "give a function")


def _called(name, given, *arguments):
    function(name, given)
    try:
        return given(*arguments)
    except Exception as error:
        of = ", ".join(f"shape {np.shape(a)}" if np.ndim(a) else str(a) for a in arguments)
        said = f"{name} fails for {of} ({type(error).__name__}: {error}): look at this function"
        raise ValueError(said) from error


def record(name, value, *kinds):
    """An object of one of the classes ``kinds``."""
    if not isinstance(value, kinds):
        refuse(name, value, f"give a {_either(kinds)}")
    return value


def records(name, value, *kinds):
    """Any number of such objects, as tuple."""
    try:
        return tuple(record(f"one of the {name}", one, *kinds) for one in value)
    except TypeError:
        return refuse(name, value, f"give a list of {_either(kinds)}")


def _either(kinds):
    return " or ".join("None" if kind is type(None) else kind.__name__ for kind in kinds)


def path(name, value):
    """A path, ~ as the home folder."""
    text = value if isinstance(value, (str, Path)) else ""
    if not str(text) or "\0" in str(text):
        refuse(name, value, "give the name of a file or folder")
    try:
        str(text).encode()
        return Path(text).expanduser()
    except (UnicodeEncodeError, RuntimeError):  # of bytes that are no UTF-8; of ~ followed by nobody's name
        return refuse(name, value, "give a name in UTF-8, where ~ is your home folder")


def file(name, value):
    """Path of a file that can be read; not of a folder, pipe or device, which could be read for ever."""
    found = path(name, value)
    if not found.exists():
        refuse(name, found, "this file does not exist, look at its name")
    if not found.is_file():
        refuse(name, found, "this is a folder, pipe or device, give a file")
    readable = os.access(found, os.R_OK)
    return found if readable else refuse(name, found, "this file cannot be read, look at its owner")


def memory():
    """What each process on this machine may have if all of one run have the same [bytes]."""
    whole = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    with suppress(OSError, ValueError):  # no limit
        whole = min(whole, int(Path("/sys/fs/cgroup/memory.max").read_text()))
    return whole / int(os.environ.get("OMPI_COMM_WORLD_LOCAL_SIZE", 1))


def check_memory(what, need, remedy, shared=False):
    """ValueError when ``what``, as "9e9 cells", shared by all ranks or not, needs too much memory [bytes]."""
    need = need / int(os.environ.get("OMPI_COMM_WORLD_SIZE", 1)) if shared else need
    if need > memory():
        raise ValueError(f"{what} need about {need / 1e9:.3g} GB of memory, and there are "
                         f"{memory() / 1e9:.3g} GB for each process: {remedy}")


def check_work(what, operations, remedy):
    """ValueError when ``what``, such as "1e9 DEM steps of a window", takes ``WORK`` operations or more."""
    if operations >= WORK:
        raise ValueError(f"{what} take about {operations:.2g} operations, more than {WORK:g}: {remedy}")
