"""What a user gives as a function of time: a function, or a table of times and values. All packages may use
it."""
from typing import Any, Callable, Tuple

import numpy as np

import mpm_dem_checks as check


def read_table(name: str, given: Any, unit: str, *shapes: tuple) -> Tuple[np.ndarray, np.ndarray]:
    """Times [s], shape (n,), and values of one of the ``shapes`` from a pair of both. ValueError for times
    that do not increase.

    >>> read_table("the speed", ([0.0, 2.0], [1.0, 3.0]), "m/s", ("n",))
    (array([0., 2.]), array([1., 3.]))
    """
    try:
        times, values = given
    except (TypeError, ValueError):
        return check.refuse(name, given, "give a number, a function of time, or a table: times and values",
                            unit)
    times = check.array(f"the times of {name}", times, ("n",), unit="s")
    values = check.array(f"the values of {name}", values, *shapes, unit=unit)
    if len(times) < 2 or len(values) != len(times):
        raise ValueError(f"{name} has {len(times)} times and {len(values)} values: give as many of both, at "
                         "least two")
    wrong = np.flatnonzero(np.diff(times) <= 0.0)
    if len(wrong):
        first = int(wrong[0])
        raise ValueError(f"the times of {name} do not increase: {times[first + 1]:g} s comes after "
                         f"{times[first]:g} s, sort them and give each once")
    return times, values


def is_table(given: Any) -> bool:
    """Whether it has several entries, as times and values."""
    return isinstance(given, (tuple, list, np.ndarray))


def over_time(name: str, given: Any, size: int, unit: str) -> Callable[[float], np.ndarray]:
    """A function of time [s] with ``size`` values from a function, or from a table: times and values, shape
    (n,) and (n, ``size``), linear between them and constant before and after. ValueError for what is none.

    >>> over_time("base", ([0.0, 1.0], [(0.0, 0.0), (2.0, 4.0)]), 2, "m/s^2")(0.5)
    array([1., 2.])
    """
    if is_table(given):
        times, values = read_table(name, given, unit, ("n", size))
        return lambda time: np.array([np.interp(time, times, column) for column in values.T])
    check.function(name, given)

    def at(time: float) -> np.ndarray:
        found: np.ndarray = check.values(name, given, (time,), (size,), unit=unit)
        return found

    at(0.0)
    return at
