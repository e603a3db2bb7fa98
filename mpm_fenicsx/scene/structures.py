"""Rigid surfaces that soil and rocks both meet: frozen data in SI units, checked when made."""
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Callable, ClassVar, Optional, Sequence, Tuple, Union

import numpy as np

import mpm_dem_checks as check

from .interface import Interface
from .mesh import Box
from .shapes import box_surface, circle_surface, cylinder_surface, outwards, plane_surface, width

MOST_CELLS = 10_000  # of a box: each has columns in the history


@dataclass(frozen=True)
class Structure:
    """A rigid surface in space, stated once: ``MPM(structures=…)`` and the DEM's ``Scene(structures=…)`` take
    the same one. It pushes and rubs, and never pulls.

    name: of its forces; x: vertices [m], shape (n, dim); elements, shape (m, dim): segments a→b with the
    outside on their left, or triangles that run counter-clockwise seen from outside; a closed surface that is
    inside out is turned. friction: Coulomb's coefficient with the soil [-], one, or one of each element,
    shape (m,). xi: Voellmy's coefficient of turbulent friction [m/s^2], likewise (inf: none), which resists
    slip with the velocity v by rho g v^2 / xi per area besides. motion: displacement of the vertices since
    the start [m] as a function of time [s], shape (dim,) or (n, dim), zero at the start, see ``moving`` and
    ``turning``. cell: number of the force cell of each element, shape (m,), from 0 on; None: the whole is
    one. stiffness: of its contact with the soil per area [Pa/m], see ``Penalty``. material: its name in the
    DEM; None: that of the structure. names: of the force cells, which go behind that of the structure
    ("bed_ice"); None: they are numbered from 1 on.

    >>> wall = Structure.box("wall", Box((1.0, 0.0, 0.0), (1.1, 0.4, 0.3)), cells=(1, 2, 1), friction=0.3)
    >>> wall.cells, wall.closed, len(wall.elements)
    (('wall_1', 'wall_2'), True, 20)
    """

    name: str
    x: np.ndarray
    elements: np.ndarray
    friction: Any = 0.0
    motion: Optional[Callable] = None
    cell: Optional[np.ndarray] = None
    stiffness: Optional[float] = None
    material: Optional[str] = None
    names: Optional[Sequence[str]] = None
    xi: Any = np.inf

    contact: ClassVar[str] = "surface"  # as of a ``Penalty``, see there
    separates: ClassVar[bool] = True
    follows: ClassVar[bool] = False

    def __post_init__(self) -> None:
        put = lambda name, value: object.__setattr__(self, name, value)  # noqa: E731 - the class is frozen
        if not isinstance(self.name, str) or not self.name.replace("_", "a").replace("-", "a").isalnum():
            check.refuse("the name of a structure", self.name, "give letters, digits, _ and -, as it names "
                         "columns of the history")
        x = check.array(f"vertices of {self.name}", self.x, ("n", 2), ("n", 3), unit="m")
        elements = check.indices(f"elements of {self.name}", self.elements, len(x), (x.shape[1],), "vertices")
        if not len(elements):
            raise ValueError(f"{self.name} has no elements: give segments in a plane, triangles in space")
        self._check_rubbing(len(elements))
        cell = np.zeros(len(elements), np.int64) if self.cell is None else check.shaped(
            f"force cells of {self.name}", self.cell, (len(elements),))
        if not np.array_equal(np.unique(cell), np.arange(len(np.unique(cell)))):
            raise ValueError(f"force cells of {self.name} are {np.unique(cell).tolist()}: number them from 0 "
                             "on, and leave none out")
        self._check_cell_names(int(cell.max()) + 1)
        elements, closed = outwards(x, elements, self.name)
        for name, value in (("x", x), ("elements", elements), ("cell", cell.astype(np.int64)),
                            ("closed", closed)):
            put(name, value)

    def _check_rubbing(self, n: int) -> None:
        for field, least, rule in (("friction", 0.0, "it must be 0 or more (inf sticks)"),
                                   ("xi", 5e-324, "it must be positive (inf: no turbulent friction)")):
            given, value = f"the {field} of {self.name}", getattr(self, field)
            if np.ndim(value):
                values = check.shaped(given, value, (n,))
                if not (values >= least).all():
                    check.refuse(given, float(values[~(values >= least)][0]), rule)
                object.__setattr__(self, field, values)
            elif isinstance(value, bool) or not (isinstance(value, (int, float)) and value >= least):
                check.refuse(given, value, rule)
        if self.motion is not None:
            check.function(f"the motion of {self.name}", self.motion)
        if self.stiffness is not None:
            check.positive(f"the stiffness of {self.name}", self.stiffness, "Pa/m", "it must be positive")
        check.record(f"the material of {self.name}", self.material, str, type(None))

    def _check_cell_names(self, n: int) -> None:
        if self.names is None:
            return
        names = tuple(self.names)
        if len(set(names)) != n or len(names) != n or not all(
                isinstance(one, str) and one.replace("_", "a").isalnum() for one in names):
            check.refuse(f"names of the force cells of {self.name}", names, f"give {n} different ones of "
                         "letters, digits and _")
        object.__setattr__(self, "names", names)

    # ---------------------------------------------------------------- shapes

    @classmethod
    def plane(cls, name: str, at: Sequence[float], normal: Union[str, Sequence[float]], box: Box,
              **more: Any) -> "Structure":
        """The part inside ``box`` of the plane through ``at`` [m], whose outside is where ``normal`` points:
        a direction such as "+y", or shape (dim,), of any length. more: further fields. ValueError when the
        plane misses the box.

        >>> Structure.plane("slope", (0.0, 0.0), (1.0, 2.0), Box((-2.0, -1.0), (2.0, 1.0))).x.tolist()
        [[-2.0, 1.0], [2.0, -1.0]]
        """
        return cls(name, *plane_surface(name, at, normal, check.record("box", box, Box)), **more)

    @classmethod
    def box(cls, name: str, box: Box, cells: Optional[Sequence[int]] = None, **more: Any) -> "Structure":
        """A ``Box``, in the plane a rectangle. cells: number of force cells along each axis, into which it is
        cut; they are numbered along x first. more: further fields.

        >>> Structure.box("post", Box((0.0, 0.0), (0.1, 0.5)), cells=(1, 2)).cells
        ('post_1', 'post_2')
        """
        box = check.record("box", box, Box)
        counts = check.counts(f"force cells of {name}", (1,) * box.dim if cells is None else cells, box.dim)
        if np.prod(counts, dtype=float) > MOST_CELLS:
            check.refuse(f"force cells of {name}", cells, f"give at most {MOST_CELLS} in all")
        x, elements, cell = box_surface(box, counts)
        return cls(name, x, elements, cell=cell, **more)

    @classmethod
    def cylinder(cls, name: str, start: Sequence[float], end: Sequence[float], radius: float,
                 sides: int = 24, **more: Any) -> "Structure":
        """A round column in space from ``start`` to ``end`` [m] on its axis, as a prism of so many sides with
        the volume of the cylinder. more: further fields.

        >>> Structure.cylinder("pile", (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), radius=0.2).closed
        True
        """
        surface = cylinder_surface(name, start, end, check.positive(f"radius of {name}", radius, "m"),
                                   check.count(f"sides of {name}", sides, 3))
        return cls(name, *surface, **more)

    @classmethod
    def circle(cls, name: str, centre: Sequence[float], radius: float, sides: int = 24,
               **more: Any) -> "Structure":
        """A column across a plane scene, as a polygon with the area of its circle. more: further fields.

        >>> Structure.circle("pile", (0.0, 0.0), radius=0.2).dim
        2
        """
        surface = circle_surface(name, centre, check.positive(f"radius of {name}", radius, "m"),
                                 check.count(f"sides of {name}", sides, 3))
        return cls(name, *surface, **more)

    @classmethod
    def read(cls, name: str, path: Union[str, Path], scale: float = 1.0, **more: Any) -> "Structure":
        """The triangles of a file that meshio reads, as STL, OBJ or PLY, times ``scale``. more: further
        fields. ValueError for a file without.

        >>> import meshio, tempfile
        >>> file = Path(tempfile.mkdtemp()) / "sheet.stl"
        >>> meshio.write_points_cells(file, [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)],
        ...                           [("triangle", [(0, 2, 1)])])
        >>> Structure.read("sheet", file).closed
        False
        """
        from .meshfile import read_triangles

        x, triangles = read_triangles(path)
        return cls(name, check.positive(f"scale of {name}", scale) * x, triangles, **more)

    # ---------------------------------------------------------------- motion

    def moving(self, velocity: Sequence[float]) -> "Structure":
        """The same with a constant ``velocity`` [m/s], shape (dim,).

        >>> Structure.circle("pile", (0.0, 0.0), radius=0.2).moving((1.0, 0.0)).motion(0.5).tolist()
        [0.5, 0.0]
        """
        v = np.array(check.numbers(f"velocity of {self.name}", velocity, self.dim, "m/s"))
        return replace(self, motion=lambda t: t * v)

    def turning(self, angle: Union[float, Callable], at: Sequence[float],
                axis: Optional[Sequence[float]] = None) -> "Structure":
        """The same, turning about ``axis``, shape (3,) (of any length, right-handed; in a plane scene none,
        counter-clockwise), through ``at`` [m]. angle: [rad] as a function of time [s], zero at the start, or
        a constant rate [rad/s].

        >>> paddle = Structure.box("paddle", Box((0.0, 0.0), (1.0, 0.1))).turning(np.pi, at=(0.0, 0.0))
        >>> (paddle.x + paddle.motion(0.5)).round(12)[0].tolist(), paddle.x[0].tolist()
        ([0.0, 0.0], [0.0, 0.0])
        """
        point = np.array(check.numbers(f"a point on the axis of {self.name}", at, self.dim, "m"))
        if self.dim == 3:
            n = np.array(check.numbers(f"axis of {self.name}", axis if axis is not None else (), 3))
            if not n.any():
                check.refuse(f"axis of {self.name}", axis, "give a direction that is not zero")
            n = n / np.linalg.norm(n)
        elif axis is not None:
            check.refuse(f"axis of {self.name}", axis, "give none in a plane scene, where it stands upright")
        rate = angle if callable(angle) else check.finite(f"rate of {self.name}", angle, "rad/s")
        arm = self.x - point

        def motion(time: float) -> np.ndarray:
            phi = rate(time) if callable(rate) else rate * time
            sine, versine = np.sin(phi), 2.0 * np.sin(0.5 * phi) ** 2  # exact for small angles
            if len(point) == 2:
                return sine * np.column_stack([-arm[:, 1], arm[:, 0]]) - versine * arm
            across = np.cross(n, arm)
            return sine * across + versine * np.cross(n, across)

        return replace(self, motion=motion)

    # ---------------------------------------------------------------- what is read off

    @property
    def dim(self) -> int:
        """Number of dimensions."""
        return int(self.x.shape[1])

    @property
    def cells(self) -> Tuple[str, ...]:
        """Names of its force cells, by number."""
        n = int(self.cell.max()) + 1  # type: ignore[union-attr] # set above
        if self.names is None and n == 1:
            return (self.name,)
        return tuple(f"{self.name}_{k}" for k in self.names or range(1, n + 1))

    @property
    def surface(self) -> Interface:
        """Its vertices and elements."""
        return Interface(self.x, self.elements)

    @property
    def width(self) -> float:
        """The least one across a face, of what it encloses [m]; 0 when it is open."""
        return width(self.x, self.elements) if self.closed else 0.0  # type: ignore[attr-defined]
