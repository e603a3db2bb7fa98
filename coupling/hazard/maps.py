"""What a user states of the maps of a run: terrain, cells, times, gauges and lines; frozen data."""
import re
from dataclasses import dataclass
from typing import Any, Optional, Sequence, Tuple, Union

import numpy as np

import mpm_dem_checks as check

NAME = re.compile(r"\w+", re.ASCII)


@dataclass(frozen=True)
class Gauge:
    """Depth and speed of the flow at a place: means over a square of width ``width`` [m] around ``at`` (x, y)
    [m], in the plane (x,). width: None for that of the cells of the map. ``name``: ends the names of its
    columns in history.csv, ``depth_NAME`` and ``speed_NAME``.

    >>> Gauge("road", at=(120.0, 35.0)).name
    'road'
    """

    name: str
    at: Sequence[float]
    width: Optional[float] = None

    def __post_init__(self) -> None:
        _check_name("gauge", self.name)
        place = _place(f"at of the gauge {self.name}", self.at)
        object.__setattr__(self, "at", place)
        if self.width is not None:
            check.positive(f"width of the gauge {self.name}", self.width, "m")


@dataclass(frozen=True)
class Line:
    """What flows through the vertical plane over a line from ``a`` to ``b`` (x, y) [m], in the plane through
    ``a`` (x,) alone: ``discharge_NAME`` [m^3/s] and ``passed_NAME`` [m^3] in history.csv, of material volume,
    positive to the right of a→b, in the plane along x. width [m]: of the band along the line over which it is
    averaged, None for that of the cells of the map.

    >>> Line("bridge", a=(50.0, 0.0), b=(50.0, 20.0)).normal
    (1.0, 0.0)
    """

    name: str
    a: Sequence[float]
    b: Optional[Sequence[float]] = None
    width: Optional[float] = None

    def __post_init__(self) -> None:
        _check_name("line", self.name)
        a = _place(f"a of the line {self.name}", self.a)
        object.__setattr__(self, "a", a)
        if (self.b is None) != (len(a) == 1):
            raise ValueError(f"the line {self.name} has {'no end b' if self.b is None else 'an end b'}: give "
                             "a and b in space, in the plane a alone")
        if self.b is not None:
            object.__setattr__(self, "b", check.numbers(f"b of the line {self.name}", self.b, 2, "m"))
            if self.b == a:
                raise ValueError(f"a and b of the line {self.name} are both {a}: give two different places")
        if self.width is not None:
            check.positive(f"width of the line {self.name}", self.width, "m")

    @property
    def length(self) -> float:
        """[m], 1 in the plane."""
        return 1.0 if self.b is None else float(np.hypot(*np.subtract(self.b, self.a)))

    @property
    def normal(self) -> Tuple[float, float]:
        """To the right of a→b, in the plane along x."""
        if self.b is None:
            return 1.0, 0.0
        along = np.subtract(self.b, self.a) / self.length
        return float(along[1]), float(0.0 - along[0])


@dataclass(frozen=True)
class Maps:
    """Rasters, gauges and a figure of a flow over a ``terrain``, for ``Run(maps=…)``: depth on the way;
    largest depth, speed, pressure and energy of rocks, time of arrival and deposit at the end.

    terrain: has ``lower`` and ``upper``, its horizontal extent [m], and ``height(xy)`` [m], (n, D - 1) →
    (n,), along the last axis, which points upward; with ``x`` [m], (n, D), and ``elements``, (m, D), it is
    shown in ParaView. cell: width of the cells [m]; every: from one map to the next, a float in seconds, an
    int in windows, None for start and end alone; gauges, lines: places that are watched in each window; dry:
    depth [m] below which a cell is not reached and its speed does not count, None for a tenth of the largest
    width of a point at the start; spread: width over which a point is spread, in cube roots of its volume, in
    the plane square roots, with edges blurred over one; with 2 a layer of two points per cell and direction
    is even; bodies: numbers of those that flow, None for all; release: outline of the release area in the
    figure [m], shape (n, 2), None for that of the flow at the start.

    >>> from types import SimpleNamespace as Toy
    >>> plane = Toy(lower=(0.0, 0.0), upper=(10.0, 5.0), height=lambda xy: -0.5 * xy[:, 0])
    >>> Maps(plane, cell=0.5, every=1.0, gauges=[Gauge("road", at=(8.0, 2.5))]).gauges[0].at
    (8.0, 2.5)
    """

    terrain: Any
    cell: float
    every: Union[None, int, float] = None
    gauges: Sequence[Gauge] = ()
    lines: Sequence[Line] = ()
    dry: Optional[float] = None
    spread: float = 2.0
    bodies: Optional[Sequence[int]] = None
    release: Any = None

    def __post_init__(self) -> None:
        lower, upper = (np.atleast_1d(np.asarray(getattr(self.terrain, side), float))
                        for side in ("lower", "upper"))
        if len(lower) not in (1, 2) or lower.shape != upper.shape or not (lower < upper).all():
            raise ValueError(f"the terrain extends from {lower.tolist()} to {upper.tolist()}: let it have a "
                             "horizontal extent, in space along x and y")
        check.positive("cell", self.cell, "m")
        if isinstance(self.every, float):
            check.positive("every", self.every, "s")
        elif self.every is not None:
            check.count("every", self.every)
        if self.dry is not None:
            check.not_negative("dry", self.dry, "m")
        check.positive("spread", self.spread)
        if self.release is not None:
            check.array("release", self.release, ("n", 2), unit="m")
        object.__setattr__(self, "gauges", check.records("gauges", self.gauges, Gauge))
        object.__setattr__(self, "lines", check.records("lines", self.lines, Line))
        for kind in ("gauges", "lines"):
            self._check_places(kind, lower, upper)

    def _check_places(self, kind: str, lower: np.ndarray, upper: np.ndarray) -> None:
        """ValueError for two of the same name, and for one that is not on the terrain."""
        names = [one.name for one in getattr(self, kind)]
        if len(set(names)) < len(names):
            raise ValueError(f"the {kind} are called {', '.join(names)}: give each a name of its own")
        for one in getattr(self, kind):
            for place in filter(None, (getattr(one, field, None) for field in ("at", "a", "b"))):
                if len(place) != len(lower) or not ((lower <= place) & (place <= upper)).all():
                    raise ValueError(f"{one.name} of the {kind} is at {place}: give a place on the terrain, "
                                     f"from {tuple(lower.tolist())} to {tuple(upper.tolist())}")


def _check_name(kind: str, name: Any) -> None:
    if not isinstance(name, str) or not NAME.fullmatch(name):
        check.refuse(f"name of a {kind}", name, "give a word of letters, digits and underscores")


def _place(name: str, value: Any) -> Tuple[float, ...]:
    """One or two coordinates [m], one may stand alone."""
    given = (value,) if np.ndim(value) == 0 else value
    return check.numbers(name, given, 1 if len(given) == 1 else 2, "m")
