"""Boundary conditions of a scene besides grid nodes: frozen data in SI units, checked when made.

Boundary particles carry them. They come as an ``Interface``: positions and the elements from which their
areas follow.
"""
from dataclasses import dataclass
from typing import Any, Callable, List, Optional, Tuple, Union

import numpy as np

import mpm_dem_checks as check

from .bodies import AXES
from .interface import Interface

CONTACTS = "nodes", "surface"


def _check_rubbing(wall: Union["Penalty", "GridWall"]) -> None:
    """Friction, separation and stiffness of a wall: a ``Penalty`` or ``GridWall``."""
    if not (isinstance(wall.friction, (int, float)) and wall.friction >= 0):
        check.refuse(f"the friction of {wall.name}", wall.friction, "it must be 0 or more (inf sticks)")
    check.truth(f"separates of {wall.name}", wall.separates)
    check.choice(f"contact of {wall.name}", wall.contact, CONTACTS)
    if wall.contact == "surface" and not wall.separates:
        raise ValueError(f'{wall.name} has contact="surface" but does not separate: a wall meets the surface '
                         "of a body only to push it away, give separates=True")
    if wall.stiffness is not None:
        check.positive(f"the stiffness of {wall.name}", wall.stiffness, "Pa/m", "it must be positive")


@dataclass(frozen=True)
class Penalty:
    """Boundary particles at which springs hold the body (Chandra et al. 2021, doi
    10.1007/s11440-020-01123-3).

    surface: the particles; one that belongs to no element, as a hinge, has the area of a cell's side.
    follows: they move with the body (a hinge, a sole), else they stay where they are or go where ``motion``
    takes them (a plane that cuts the grid anywhere, a moving wall). normal: of any length, shape (dim,) or
    (n, dim), from the wall into the body; with it only the motion along it is held (slip), without it the
    motion in all directions (stick). friction: Coulomb's coefficient against slip, at the normal force of the
    last step; inf sticks as long as there is one, so with separates=True the wall catches what it touches.
    separates: the wall pushes but does not pull. motion: displacement of what holds [m] as a function of time
    [s], shape (dim,) or (n, dim), zero at the start. at: a point of the plane [m], shape (dim,), to which
    particles that follow a body may have some distance at the start; None: every particle is on its plane.
    stiffness: of the springs per area [Pa/m]; None: the nearest body's stiffness (against stretch in one
    direction) over the cell size, and 100 times that for supports, which neither rub nor separate. It gives
    by pressure / stiffness. contact: of a wall in space that separates, "nodes": the springs hold the body
    where it shares cells with the particles; "surface": they hold its material points, where their share of
    the body meets the segments or triangles between the particles, see docs/walls.md.

    >>> slope = Interface.line((2.0, 0.0), (0.0, 1.0), segments=4)
    >>> Penalty(slope, normal=(1.0, 2.0), friction=0.4, name="slope").normal[0]
    array([0.4472136 , 0.89442719])
    """

    surface: Interface
    normal: Any = None
    friction: float = 0.0
    separates: bool = False
    follows: bool = False
    motion: Optional[Callable] = None
    at: Any = None
    stiffness: Optional[float] = None
    contact: str = "nodes"
    name: str = "penalty"

    def __post_init__(self) -> None:
        check.record(f"the surface of {self.name}", self.surface, Interface)
        _check_rubbing(self)
        check.truth(f"follows of {self.name}", self.follows)
        if self.motion is not None:
            check.function(f"the motion of {self.name}", self.motion)
        self._check_contact()
        if self.normal is None and (self.friction or self.separates or self.at is not None):
            raise ValueError(f"{self.name} sticks, as it has no normal: give one for friction, separates or "
                             "at")
        if self.at is not None and not self.follows:
            raise ValueError(f"{self.name} has a plane at {self.at} but stays in space: only particles that "
                             "follow the body (follows=True) can have a distance to it")
        if self.normal is not None:
            object.__setattr__(self, "normal", self._unit_normals())

    def _check_contact(self) -> None:
        D = np.shape(self.surface.x)[1]
        if self.contact == "surface" and self.follows:
            raise ValueError(f'{self.name} follows the body, contact="surface" is for a wall in space: '
                             "particles that follow are on the surface of the body already")
        if self.contact == "surface" and (not len(self.surface.elements)
                                          or np.shape(self.surface.elements)[1] != D):
            raise ValueError(f'{self.name} has contact="surface" but its surface has no segments or '
                             "triangles: give one of Interface.line or Interface.patch")

    def _unit_normals(self) -> np.ndarray:
        shape = np.shape(self.surface.x)
        given = check.array(f"the normal of {self.name}", self.normal, shape[1:], shape)
        normal = np.broadcast_to(given, shape)
        length = np.linalg.norm(normal, axis=1)
        bad = ~(np.isfinite(length) & (length > 0))
        if bad.any():
            raise ValueError(f"the normal of {self.name} is {normal[bad][0].tolist()}: it must be finite and "
                             "not zero")
        return normal / length[:, None]


@dataclass(frozen=True)
class GridWall:
    """A wall along grid nodes, with Coulomb friction or separation or both; without either a ``Support``
    does.

    where: function from node positions [m], shape (n, dim), to a mask, shape (n,). normal: a direction such
    as "+y" or "-x", from the wall into the body. friction, separates, stiffness and contact: see ``Penalty``,
    whose springs hold the nodes, or with contact="surface" the body where it meets the sides of cells between
    them.

    >>> floor = GridWall(lambda x: x[:, 1] < 1e-6, "+y", friction=0.5, name="floor")
    >>> floor.penalty(np.array([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)])).normal
    array([[0., 1.],
           [0., 1.]])
    """

    where: Callable
    normal: str
    friction: float = 0.0
    separates: bool = False
    stiffness: Optional[float] = None
    contact: str = "nodes"
    name: str = "grid wall"

    def __post_init__(self) -> None:
        if self.normal not in [sign + axis for sign in "+-" for axis in AXES]:
            raise ValueError(f"the normal of {self.name} is {check.shown(self.normal)}: give a sign and an "
                             "axis, as " "\"+y\"")
        check.function(f"where of {self.name}", self.where)
        _check_rubbing(self)

    def holds(self, vertices: np.ndarray) -> np.ndarray:
        """Mask, shape (n,), of the vertices [m], shape (n, dim), of the grid that the wall is made of."""
        return check.mask(f"where of {self.name}", self.where, vertices)

    def penalty(self, vertices: np.ndarray) -> Penalty:
        """The same as a ``Penalty`` on the vertices [m], shape (n, dim), of the grid."""
        axis = AXES.index(self.normal[1])
        if axis >= vertices.shape[1]:
            raise ValueError(f"the normal of {self.name} is {self.normal!r}, the scene has "
                             f"{vertices.shape[1]} dimensions: give one of its axes")
        x = vertices[self.holds(vertices)]
        if not len(x):
            raise ValueError(f"{self.name} holds no node of the grid: look at where")
        normal = np.zeros(vertices.shape[1])
        normal[axis] = float(self.normal[0] + "1")
        nodes = Interface(x, np.zeros((0, vertices.shape[1]), int))
        return Penalty(nodes, normal, self.friction, self.separates, stiffness=self.stiffness, name=self.name)


@dataclass(frozen=True)
class Load:
    """A load on boundary particles that follow the body.

    surface: the particles and their elements. Exactly one of: force: on each particle [N]; traction: [Pa],
    fixed in direction, on the area of the deformed surface; pressure: [Pa], positive against the outside of
    the deformed surface. Each is constant or a function of time [s]; force has shape (dim,) or (n, dim),
    traction (dim,), pressure is a number.

    >>> wind = Load(Interface.line((1.0, 1.0), (0.0, 1.0), 4), pressure=lambda t: 100.0 * t, name="wind")
    >>> wind.kind, float(wind.at(0.5))
    ('pressure', 50.0)
    """

    surface: Interface
    force: Any = None
    traction: Any = None
    pressure: Any = None
    name: str = "load"

    def __post_init__(self) -> None:
        check.record(f"the surface of {self.name}", self.surface, Interface)
        given = self._given()
        if len(given) != 1:
            raise ValueError(f"{self.name} has {' and '.join(given) or 'nothing'}: give one of force, "
                             "traction, pressure")
        if not callable(getattr(self, self.kind)):
            check.array(f"the {self.kind} of {self.name}", getattr(self, self.kind), *self.shapes)
        if self.kind != "force" and not len(self.surface.elements):
            raise ValueError(f"{self.name} has a {self.kind}, but its surface has no elements to take the "
                             "area from: give a force, or a surface of segments or triangles")

    def _given(self) -> List[str]:
        return [kind for kind in ("force", "traction", "pressure") if getattr(self, kind) is not None]

    @property
    def kind(self) -> str:
        """Which of the three it is."""
        return self._given()[0]

    @property
    def shapes(self) -> Tuple[Tuple[int, ...], ...]:
        """Shapes that its value may have."""
        D = self.surface.x.shape[1]
        return {"force": ((D,), self.surface.x.shape), "traction": ((D,),), "pressure": ((),)}[self.kind]

    def at(self, time: float) -> np.ndarray:
        """The force [N], traction or pressure [Pa] at ``time`` [s]."""
        value = getattr(self, self.kind)
        if not callable(value):
            return np.asarray(value, float)
        return check.values(f"the {self.kind} of {self.name} at t = {time:.6g} s", value, (time,),
                            *self.shapes)
