"""Lengths of time as a user types them, and how often a checkpoint is asked for."""
import re
from typing import Any, NamedTuple, Optional

import mpm_dem_checks as check

from . import words

UNITS = {"d": 86400, "h": 3600, "min": 60, "s": 1}  # [s], from the longest down
# each unit at most once, in this order
TYPED = re.compile("".join(rf"(?:(\d+\.?\d*|\.\d+){unit})?" for unit in UNITS), re.ASCII)
SLURM = re.compile(r"(?:(\d+)-)?(\d+):([0-5]\d):([0-5]\d)", re.ASCII)  # days-hours:minutes:seconds
BARE = re.compile(r"\d+\.?\d*|\.\d+", re.ASCII)
WAYS = "a length of time above zero such as 90s, 10min, 23h50min, 1d12h or 23:50:00"


def seconds(key: str, text: Any) -> float:
    """The length of time [s] that ``text`` says: numbers with the units d, h, min and s, from the longest
    down, or as Slurm writes it, hours:minutes:seconds with days and a dash before. ValueError, which names
    the ``key``, for anything else, also for zero.

    >>> seconds("walltime", "23h50min"), seconds("walltime", "1-12:00:00")
    (85800.0, 129600.0)
    >>> seconds("walltime", "100")
    Traceback (most recent call last):
    ValueError: walltime is '100': give it with a unit, such as 100s
    """
    if not isinstance(text, str) or not text:
        check.refuse(key, text, f"give {WAYS}")
    if BARE.fullmatch(text) and float(text) > 0.0:
        check.refuse(key, text, f"give it with a unit, such as {text}s")
    found = TYPED.fullmatch(text) or SLURM.fullmatch(text)
    length = sum(float(number or 0) * unit for number, unit in zip(found.groups(), UNITS.values())
                 ) if found else 0.0
    if not 0.0 < length < check.MOST:
        check.refuse(key, text, f"give {WAYS}")
    return length


def shown(length: float) -> str:
    """A length of time [s] as ``seconds`` reads it, to a thousandth of a second.

    >>> shown(85800), shown(90.5), shown(129600)
    ('23h50min', '1min30.5s', '1d12h')
    """
    left, parts = round(length * 1000), []  # [ms]
    for unit, size in UNITS.items():
        number, left = divmod(left, size * 1000)
        if unit == "s" and left:
            parts.append(f"{number + left / 1000:.15g}s")
        elif number:
            parts.append(f"{number}{unit}")
    return "".join(parts) or "0s"


class Every(NamedTuple):
    """How often a checkpoint is written: after so many ``windows`` or so many ``seconds`` of run time; where
    both are None, only at the end of the run, also of one that is told to stop."""

    windows: Optional[int] = None
    seconds: Optional[float] = None


def read_every(value: Any, key: str = "checkpoint") -> Optional[Every]:
    """``Every`` from "10min", "500" or 500 windows, or "end"; None for None. ValueError for anything else.

    >>> read_every("10min"), read_every("500"), read_every("end")
    (Every(windows=None, seconds=600.0), Every(windows=500, seconds=None), Every(windows=None, seconds=None))
    """
    if value is None or value == "end":
        return None if value is None else Every()
    way = "give a number of windows such as 500, a run time such as 10min, or end"
    if not isinstance(value, str):
        return Every(windows=check.count(key, value, rule=way))
    try:
        if words.NUMBERS[int].fullmatch(value):
            return Every(windows=check.count(key, words.convert(key, value, int)))
        return Every(seconds=seconds(key, value))
    except ValueError:
        check.refuse(key, value, way)
