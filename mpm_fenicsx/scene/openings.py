"""Where material comes into a scene and leaves it: frozen data in SI units, checked when made."""
from dataclasses import dataclass
from typing import Any, Callable, Optional

import numpy as np

import mpm_dem_checks as check
from mpm_dem_series import is_table, read_table

from .bodies import AXES
from .hydrograph import EVER, SAMPLES, Hydrograph, Series, sample
from .mesh import Box

STEEP = 1e-9  # sine of the angle between two directions that are taken for one
RATES = {"depth": "m", "speed": "m/s", "discharge": "m^3/s"}


def direction(name: str, given: Any, dim: int, remedy: str) -> np.ndarray:
    """The unit vector of what is ``given``, such as "+x" or a vector of any length, shape (dim,)."""
    if isinstance(given, str):
        ways = tuple(sign + axis for axis in AXES[:dim] for sign in "+-")
        check.choice(name, given, ways)
        return np.eye(dim)[AXES.index(given[1])] * (1.0 if given[0] == "+" else -1.0)
    vector: np.ndarray = check.array(name, given, (dim,))
    size = np.linalg.norm(vector)
    if size == 0.0:
        raise ValueError(f"{name} is {given}: {remedy}, such as \"+x\"")
    return vector / size


def axes_of(name: str, along: np.ndarray, up: Any) -> np.ndarray:
    """Axes of an opening, unit vectors in rows, shape (dim, dim): along the flow, up, and in space across.
    up: its part across the flow counts; None: y, of a flow along y x. ValueError where it is along the
    flow."""
    dim = len(along)
    ways = [direction(f"up of {name}", up, dim, "give the way up")] if up is not None else [
        np.eye(dim)[1], np.eye(dim)[0]]
    for way in ways:
        rest = way - (way @ along) * along
        if np.linalg.norm(rest) > STEEP:
            axes = [along, rest / np.linalg.norm(rest)]
            if dim == 3:
                across = np.cross(*axes)
                axes.append(across * np.sign(across[np.argmax(abs(across))]) + 0.0)
            return np.array(axes)
    raise ValueError(f"up of {name} is {up}, along its normal: give a direction across it")


@dataclass(frozen=True)
class Inflow:
    """Material of one of the bodies that enters through a plane in the grid during the run.

    at: middle of the lower edge of the inlet [m], shape (dim,), in the plane its lower end, best on nodes of
    the grid; normal: the way the flow goes, such as "+x", or a vector of any length, shape (dim,). Two of
    depth [m], speed [m/s] and discharge [m^3/s], each a number, a function of time [s], or a table, times and
    values, linear between them. The depth is measured across the flow from ``at`` toward ``up``, a direction
    like the normal, "+z" over a terrain; None: y, or x of a flow along y. width: across both [m], in the
    plane it is the thickness of the body. until: end of the inflow [s]; None: that of the table that ends
    first, never with numbers alone; with functions it is needed. body: number of the body whose law, density
    and spacing of points the material has.

    ratio: of the stress along the bed to that across it in what comes in, whose stress is ``at_rest`` under
    its surface; None: nu / (1 - nu), or the nearest that a soil without cohesion bears. stress: in its place,
    see ``Body``; elastic laws have none. length: of the column upstream of the inlet from which it is fed
    [m]; None: two cells.

    The column moves with ``speed`` as one piece: the nodes of the grid from the inlet upstream are held to
    it, as by a ``Support`` with this ``name``. See docs/scenes.md.

    >>> depth = [0.0, 1.0, 5.0], [0.1, 0.3, 0.0]
    >>> flood = Inflow("flood", at=(0.0, 0.0), normal="+x", depth=depth, speed=2.0)
    >>> round(flood.hydrograph(1.0).discharged(1.0), 6)  # of one metre width, until t = 1 s [m^3]
    0.4
    """

    name: str
    at: Any
    normal: Any
    depth: Optional[Series] = None
    speed: Optional[Series] = None
    discharge: Optional[Series] = None
    width: Optional[float] = None
    until: Optional[float] = None
    body: int = 0
    ratio: Optional[float] = None
    stress: Optional[Callable] = None
    length: Optional[float] = None
    up: Any = None

    def __post_init__(self) -> None:
        at = check.array(f"at of {self.name}", self.at, (2,), (3,), unit="m")
        object.__setattr__(self, "at", at)
        along = direction(f"normal of {self.name}", self.normal, len(at), "give the way in")
        object.__setattr__(self, "axes", axes_of(self.name, along, self.up))
        if (self.width is None) == (len(at) == 3):
            raise ValueError(f"the width of {self.name} is {self.width}: give one in space, and none in the "
                             "plane, where it is the thickness of the body")
        for what in ("width", "until", "length"):
            if getattr(self, what) is not None:
                check.positive(f"{what} of {self.name}", getattr(self, what), "s" if what == "until" else "m")
        if self.ratio is not None:
            check.not_negative(f"ratio of {self.name}", self.ratio)
        if self.stress is not None:
            check.function(f"stress of {self.name}", self.stress)
        object.__setattr__(self, "body", check.count(f"body of {self.name}", self.body, 0))
        self.hydrograph(self.width or 1.0)

    def hydrograph(self, width: float) -> Hydrograph:
        """Speed and discharge of an inlet of this ``width`` [m]. ValueError for what is no flow."""
        given = {rate: getattr(self, rate) for rate in RATES if getattr(self, rate) is not None}
        if len(given) != 2:
            raise ValueError(f"{self.name} has {' and '.join(given) or 'no rate'}: give two of depth, speed "
                             "and discharge")
        times = self._times(given)
        found = {rate: sample(f"the {rate} of {self.name}", value, times, RATES[rate])
                 for rate, value in given.items()}
        if "speed" not in found:
            found["speed"] = self._over(found["discharge"], found["depth"] * width, times, "depth")
        elif "depth" not in found:
            self._over(found["discharge"], found["speed"], times, "speed")
        return Hydrograph(times, found["speed"],
                          found.get("discharge", found["speed"] * found.get("depth", 0.0) * width))

    def _times(self, given: dict) -> np.ndarray:
        """At which the rates are looked at [s]."""
        tables = [read_table(f"the {rate} of {self.name}", one, RATES[rate], ("n",))[0]
                  for rate, one in given.items() if is_table(one)]
        functions = any(map(callable, given.values()))
        if self.until is None and functions:
            raise ValueError(f"{self.name} has a function of time and no end: give until")
        end = min((times[-1] for times in tables), default=EVER) if self.until is None else self.until
        if not tables and not functions:
            return np.array([0.0, end])
        times = np.unique(np.concatenate([np.linspace(0.0, end, SAMPLES + 1), *tables]))
        return times[(times >= 0.0) & (times <= end)]

    def _over(self, discharge: np.ndarray, by: np.ndarray, times: np.ndarray, what: str) -> np.ndarray:
        """Discharge over the area or speed ``by``."""
        dry = (by == 0.0) & (discharge > 0.0)
        if dry.any():
            raise ValueError(f"the discharge of {self.name} is {discharge[dry][0]:.6g} m^3/s at t = "
                             f"{times[dry][0]:.6g} s, where its {what} is 0: give both, or neither")
        return np.divide(discharge, by, out=np.zeros_like(by), where=by > 0.0)


@dataclass(frozen=True)
class Outflow:
    """A plane in the grid, or a part of one, at which material leaves: points beyond it are removed.

    at: a point of the plane [m], shape (dim,); normal: the way out, such as "+x", or a vector of any length,
    shape (dim,). box: only what is in it leaves, such as in a gap of a barrier; width: only what is within
    half of it [m] from ``at`` along the plane, in space across ``up``, see ``Inflow``; None: all that is
    beyond the plane. Volume and discharge are columns of the history with the ``name``; mass, momentum and
    energy are booked with what else leaves, see ``MPM.removed``.

    >>> gap = Outflow("gap", at=(2.0, 0.0), normal="+x", box=Box((2.0, 0.0), (2.5, 0.3)))
    >>> gap.passed(np.array([(1.9, 0.1), (2.1, 0.1), (2.1, 0.4)]))
    array([False,  True, False])
    """

    name: str
    at: Any
    normal: Any
    box: Optional[Box] = None
    width: Optional[float] = None
    up: Any = None

    def __post_init__(self) -> None:
        at = check.array(f"at of {self.name}", self.at, (2,), (3,), unit="m")
        object.__setattr__(self, "at", at)
        normal = direction(f"normal of {self.name}", self.normal, len(at), "give the way out")
        object.__setattr__(self, "normal", normal)
        object.__setattr__(self, "axes", axes_of(self.name, normal, self.up))
        if self.width is not None:
            check.positive(f"width of {self.name}", self.width, "m")
        if self.box is not None and check.record(f"box of {self.name}", self.box, Box).dim != len(at):
            raise ValueError(f"box of {self.name} has {self.box.dim} dimensions, at has {len(at)}: give both "
                             "the same")

    def passed(self, x: np.ndarray) -> np.ndarray:
        """Which of the positions x [m], shape (n, dim), are beyond it, shape (n,)."""
        beyond: np.ndarray = (x - self.at) @ self.normal > 0.0
        if self.width is not None:
            along = (x - self.at) @ self.axes[-1]  # type: ignore[attr-defined] # set above
            beyond &= abs(along) <= 0.5 * self.width
        if self.box is not None:
            beyond &= ((x >= self.box.lower) & (x <= self.box.upper)).all(axis=1)
        return beyond
