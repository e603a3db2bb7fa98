"""All that ``MPM`` is given: frozen data in SI units, checked when made."""
from dataclasses import dataclass, field
from typing import Any, Callable, Dict, List, Optional, Sequence, Tuple, Union

import numpy as np

import mpm_dem_checks as check
from mpm_dem_series import over_time

from .balls import Balls
from .bodies import Body, Grid
from .cell_sizes import on_grid
from .conditions import GridWall, Load, Penalty
from .interface import Interface
from .mesh import BYTES_PER_CELL, Mesh
from .numerics import Numerics
from .openings import Inflow, Outflow
from .structures import Structure
from .supports import Support

INERTIA = "consistent", "lumped", "ghost"  # the kinds there are
# what else gives momentum, see ``Impulses``
BOOKED = "gravity", "base", "interface", "inflow", "outflow", "numerical"


def find_fields(bonded: Union[bool, Sequence[Sequence[int]]], count: int) -> Tuple[int, ...]:
    """Number of the field of the grid in which each of ``count`` bodies moves: its own, or that of those to
    which it is ``bonded``: True, to all, or groups of the numbers of bodies. Raises ValueError for others.

    >>> find_fields(False, 3), find_fields(True, 3), find_fields([(0, 2)], 3)
    ((0, 1, 2), (0, 0, 0), (0, 1, 0))
    """
    if isinstance(bonded, (bool, np.bool_)):
        return (0,) * count if bonded else tuple(range(count))
    first = list(range(count))  # of the bodies in its group
    taken: list = []
    try:
        groups = [[int(check.count("number of a body in bonded", n, 0)) for n in group] for group in bonded]
    except TypeError:
        raise ValueError(f"bonded is {check.shown(bonded)}: give True or False, or groups of the numbers of "
                         "bodies, such as [(0, 1)]") from None
    for group in groups:
        for n in group:
            if not 0 <= n < count or n in taken:
                raise ValueError(f"bonded is {check.shown(bonded)}: give each of the bodies 0 to {count - 1} "
                                 "at most once")
            taken.append(n)
            first[n] = min(group)
    return tuple(sorted(set(first)).index(n) for n in first)


@dataclass(frozen=True)
class SolidScene:
    """The arguments of ``MPM``, see there. ``body``: a body or several, afterwards a tuple.

    Raises ValueError for the first one that is none.
    """

    grid: Union[Grid, Mesh]
    body: Union[Body, Sequence[Body]]
    supports: Sequence[Support] = ()
    interface: Union[Interface, Balls, None] = None
    gravity: Optional[Sequence[float]] = None
    inertia: str = "consistent"
    loads: Sequence[Load] = ()
    penalties: Sequence[Union[Penalty, GridWall]] = ()
    body_force: Optional[Callable] = None
    outflow: Union[str, Dict[str, str]] = "stop"
    bonded: Union[bool, Sequence[Sequence[int]]] = False
    numerics: Numerics = field(default_factory=Numerics)
    structures: Sequence[Structure] = ()
    openings: Sequence[Union[Inflow, Outflow]] = ()
    base: Any = None

    def __post_init__(self) -> None:
        def put(name: str, value: Any) -> None:
            object.__setattr__(self, name, value)

        check.record("grid", self.grid, Grid, Mesh)
        put("body", tuple(on_grid(body, self.grid, number) for number, body
                          in enumerate(check.records("bodies", self.bodies, Body))))
        put("supports", check.records("supports", self.supports, Support))
        put("loads", check.records("loads", self.loads, Load))
        put("penalties", check.records("penalties", self.penalties, Penalty, GridWall))
        put("structures", check.records("structures", self.structures, Structure))
        put("openings", check.records("openings", self.openings, Inflow, Outflow))
        self._check_structures()
        self._check_openings()
        check.choice("inertia", self.inertia, INERTIA)
        check.record("numerics", self.numerics, Numerics)
        if self.interface is not None:
            check.record("interface", self.interface, Interface, Balls)
        if isinstance(self.interface, Balls):
            self.interface.check_bodies(len(self.bodies))
        if self.gravity is not None:
            check.numbers("gravity", self.gravity, self.grid.box.dim, "m/s^2")
        if self.body_force is not None:
            check.function("body_force", self.body_force)
        if self.base is not None:
            put("base", over_time("base", self.base, self.grid.box.dim, "m/s^2"))
        self._check_fields()

    def _check_structures(self) -> None:
        """ValueError for one of another dimension, outside the grid, or of a name that is taken."""
        taken, box = self._stated_names, self.grid.box
        for one in self.structures:
            if one.name in BOOKED:
                raise ValueError(f"{one.name!r} is the name of a structure, and that of another cause in the "
                                 "books: give the structure another one")
            if one.dim != box.dim:
                raise ValueError(f"{one.name} has {one.dim} dimensions, the grid {box.dim}: give both the "
                                 "same")
            if (one.x.max(axis=0) < box.lower).any() or (one.x.min(axis=0) > box.upper).any():
                raise ValueError(f"{one.name} lies outside the grid, from {one.x.min(axis=0).tolist()} to "
                                 f"{one.x.max(axis=0).tolist()} m, where no soil can come: the grid covers "
                                 f"{box.lower} to {box.upper} m, move it or enlarge the grid")
            for name in {one.name, *one.cells} & set(taken):
                raise ValueError(f"{name!r} is the name of two structures, supports, penalties or loads: "
                                 "give each its own, as forces are told by name")
            taken += {one.name, *one.cells}

    def _check_openings(self) -> None:
        """ValueError for one of another dimension, into no body, or of a name that is taken."""
        stated = *self.supports, *self.penalties, *self.loads, *self.structures
        taken = [*BOOKED, *(one.name for one in stated)]  # type: ignore[union-attr]
        for one in self.openings:
            if len(one.at) != self.grid.box.dim:
                raise ValueError(f"{one.name} has {len(one.at)} dimensions, the grid {self.grid.box.dim}: "
                                 "give both the same")
            if isinstance(one, Outflow):
                self._check_plane(one)
            elif one.body >= len(self.bodies):
                raise ValueError(f"body of {one.name} is {one.body}: give a number from 0 to "
                                 f"{len(self.bodies) - 1}")
            if one.name in taken:
                raise ValueError(f"{one.name!r} is the name of an opening, and of something else in the "
                                 "books: give it another one")
            taken.append(one.name)

    def _check_plane(self, plane: Outflow) -> None:
        """ValueError where nothing of the grid, or of its box, is on either side of it."""
        box = plane.box or self.grid.box
        corners = np.stack(np.meshgrid(*zip(box.lower, box.upper), indexing="ij"), axis=-1)
        ends = (corners.reshape(-1, len(plane.at)) - plane.at) @ plane.normal
        meets = (np.less(box.lower, self.grid.box.upper) & np.greater(box.upper, self.grid.box.lower)).all()
        if not meets or ends.max() <= 0.0 or (ends.min() >= 0.0 and plane.box is None):
            raise ValueError(f"{plane.name} lies outside the grid, at {plane.at.tolist()} m with the normal "
                             f"{plane.normal.tolist()}: the grid covers {self.grid.box.lower} to "
                             f"{self.grid.box.upper} m, move the plane into it")

    @property
    def inflows(self) -> Tuple[Inflow, ...]:
        """Those among the ``openings``."""
        return tuple(one for one in self.openings if isinstance(one, Inflow))

    @property
    def outflows(self) -> Tuple[Outflow, ...]:
        """Those among the ``openings``."""
        return tuple(one for one in self.openings if isinstance(one, Outflow))

    @property
    def _stated_names(self) -> List[str]:
        return [str(one.name) for one in (*self.supports, *self.penalties, *self.loads)]  # type: ignore

    @property
    def names(self) -> List[str]:
        """Of all by whose names forces are told, but bodies."""
        return [*BOOKED, *self._stated_names,
                *(name for one in self.structures for name in (one.name, *one.cells))]

    @property
    def walls(self) -> Tuple[Union[Penalty, GridWall, Structure], ...]:
        """Penalties and structures."""
        return (*self.penalties, *self.structures)

    @property
    def bodies(self) -> Tuple[Body, ...]:
        """The bodies as a tuple."""
        return tuple(self.body) if isinstance(self.body, (list, tuple)) else (self.body,)  # type: ignore

    def _check_fields(self) -> None:
        count = max(self.fields, default=0) + 1
        cells = self.grid.count
        if count > 1 and not getattr(self.grid, "large", False):
            what = f"{count} copies of the grid with {cells:.3g} cells, for bodies that do not stick together"
            check.check_memory(what, count * cells * BYTES_PER_CELL[self.grid.box.dim],
                               "take larger and fewer cells (h), or bodies that are bonded")

    @property
    def fields(self) -> Tuple[int, ...]:
        """Number of the field of the grid of each body, see ``find_fields``."""
        return find_fields(self.bonded, len(self.bodies))

    @property
    def acceleration(self) -> np.ndarray:
        """Of gravity [m/s^2], shape (dim,)."""
        return np.zeros(self.grid.box.dim) if self.gravity is None else np.array(self.gravity, float)

    def frame_pull(self, time: float) -> np.ndarray:
        """Acceleration of what is free in the frame of the ``base``, without gravity, at ``time`` [s]
        [m/s^2], shape (dim,)."""
        return np.zeros(self.grid.box.dim) if self.base is None else -self.base(time)
