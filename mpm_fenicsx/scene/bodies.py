"""Bodies and grids of a scene: frozen data in SI units, checked when made."""
from dataclasses import dataclass, replace
from typing import Any, Callable, Optional, Sequence, Tuple, Union

import numpy as np

import mpm_dem_checks as check

from ..laws import Law, check_declared
from .force_cells import check_force_cells
from .from_checkpoint import FromCheckpoint
from .hollow import without_rocks
from .lattice import LARGE, cell_count, check_blocks, check_size
from .mesh import Box, Mesh, cell_of

AXES = "xyz"
TENSOR_POINTS = range(1, 7)  # per direction
SIMPLEX_POINTS = {2: (1, 3, 6, 7, 12), 3: (1, 4, 14, 15, 24)}  # basix's rules with positive weights
BYTES_PER_POINT = {2: 1000, 3: 3500}  # with its share of matrix and solver, measured


@dataclass(frozen=True)
class Grid:
    """Regular background grid: ``box`` divided into ``cells`` per direction; cell: kind of cell, None for
    quadrilaterals and hexahedra.

    >>> Grid(Box((0.0, 0.0), (2.0, 1.0)), (20, 10)).cell
    'quadrilateral'
    """

    box: Box
    cells: Tuple[int, ...]
    cell: Optional[str] = None

    def __post_init__(self) -> None:
        check.record("box of the grid", self.box, Box)
        object.__setattr__(self, "cells", check.counts("cells of the grid", self.cells, self.box.dim))
        object.__setattr__(self, "cell", cell_of(self.box.dim, self.cell, "grid"))
        if self.large:
            check_blocks(self.cells)
        else:
            self.check_whole()

    @property
    def count(self) -> int:
        """Number of cells."""
        return cell_count(self.cells, self.cell)

    @property
    def large(self) -> bool:
        """Whether only blocks of it near the material are made, where the scene permits."""
        return self.count > LARGE

    @property
    def cell_size(self) -> np.ndarray:
        """Along the axes [m], shape (dim,)."""
        return np.asarray(self.box.size / self.cells)

    def check_whole(self) -> None:
        """ValueError where its cells need more memory or time than there is."""
        check_size(self.cells, self.cell)

    @property
    def dim(self) -> int:
        """Number of dimensions."""
        return self.box.dim

    @staticmethod
    def counts(size: Sequence[float], h: float) -> Tuple[int, ...]:
        """Cells per direction of size about ``h`` [m] for a box of ``size`` [m].

        >>> Grid.counts((0.5, 0.2), h=0.1)
        (5, 2)
        """
        size = check.numbers("size of the box", size, len(np.atleast_1d(size)), "m", check.positive)
        check.positive("h", h, "m", f"the cell size must lie between 0 and {min(size):.3g} m")
        check.between("h", h, 0, min(size), "m", f"the cell size must lie between 0 and {min(size):.3g} m",
                      "(]")
        return tuple(max(1, round(length / h)) for length in size)


@dataclass(frozen=True)
class Cloud:
    """Material points given one by one: positions x [m], shape (n, dim), and volumes [m^3], in the plane
    areas [m^2], shape (n,). half: half widths [m], shape (n, dim), of the boxes that they stand for; None for
    squares and cubes.

    >>> Cloud([(0.0, 0.0), (0.1, 0.2)], volume=[0.01, 0.01]).box
    Box(lower=(0.0, 0.0), upper=(0.1, 0.2))
    """

    x: np.ndarray
    volume: np.ndarray
    half: Optional[np.ndarray] = None

    def __post_init__(self) -> None:
        x = check.array("positions of the cloud", self.x, ("n", 2), ("n", 3), unit="m")
        volume = check.array("volumes of the cloud", self.volume, (len(x),), unit="m^3")
        if not len(x):
            raise ValueError("the cloud has no points: give at least one")
        if not (volume > 0).all():
            bad = int(np.argmin(volume > 0))
            raise ValueError(f"the volume of point {bad} of the cloud is {volume[bad]}: it must be positive")
        object.__setattr__(self, "x", x)
        object.__setattr__(self, "volume", volume)
        if self.half is not None:
            half = check.array("half widths of the cloud", self.half, x.shape, unit="m")
            if not (half > 0).all():
                raise ValueError(f"the half widths of the cloud go down to {half.min()} m: they must be "
                                 "positive")
            object.__setattr__(self, "half", half)

    @property
    def box(self) -> Box:
        """Smallest box around the points."""
        return Box(tuple(self.x.min(axis=0)), tuple(self.x.max(axis=0)))


@dataclass(frozen=True)
class Body:
    """A body and its material points.

    shape: a ``Box`` divided into ``cells`` body cells of kind ``cell``; a ``Mesh``, whose cells are the body
    cells (``cells`` is None); or a ``Cloud`` (``cells`` and ``points`` are None). points: per body cell, for
    quadrilaterals and hexahedra per direction (tensor Gauss rule, 1 to 6), for simplices in all (triangles 1,
    3, 6, 7 or 12, tetrahedra 1, 4, 14, 15 or 24). stress_state: ``plane_stress`` or ``plane_strain``
    (default) in the plane, ``three_dimensional``. thickness: of a plane body [m]. velocity: initial velocity
    [m/s], shape (dim,), or a function from positions (n, dim) to velocities (n, dim). f_bar: average the
    volume change over each cell of the background grid, or over patches of its triangles and tetrahedra,
    against locking of bodies that keep their volume. stress: normal stresses along x, y and z at the start
    [Pa], shape (n, 3), or tensors, (n, 3, 3), as a function of positions (n, dim), see ``at_rest``; the body
    is then at rest, not in free fall. friction: coefficient of friction (Coulomb) with other bodies; of two
    that touch the larger one counts. name: of the forces of other bodies and of particles on it. force_cells:
    into which it is divided for that, numbers along the axes, counted along x first, or a function from
    places at the start (n, dim) to numbers from 0 on, (n,). start: the points start with the state that they
    have in a checkpoint, see ``FromCheckpoint``. Functions are asked for some of the points at a time.

    >>> from mpm_fenicsx import linear
    >>> steel = linear(E=210e9, nu=0.3)
    >>> beam = Body(Box((0.0, 0.0), (1.0, 0.1)), cells=(20, 2), points=2, law=steel, rho=7800.0)
    >>> beam.stress_state
    'plane_strain'
    """

    shape: Union[Box, Mesh, Cloud]
    cells: Optional[Tuple[int, ...]]
    points: Optional[int]
    law: Law
    rho: float
    stress_state: Optional[str] = None
    thickness: float = 1.0
    cell: Optional[str] = None
    velocity: object = 0.0
    f_bar: bool = False
    stress: Optional[Callable] = None
    friction: float = 0.0
    name: Optional[str] = None
    force_cells: Union[Sequence[int], Callable, None] = None
    start: Optional[FromCheckpoint] = None

    def __post_init__(self) -> None:
        put = lambda name, value: object.__setattr__(self, name, value)  # noqa: E731 - the class is frozen
        if isinstance(self.shape, Box):
            put("cells", check.counts("body (its cells)", self.cells, self.dim))
            put("cell", cell_of(self.dim, self.cell, "body"))
        elif isinstance(self.shape, Mesh):
            put("cell", self.shape.cell)
        elif not isinstance(self.shape, Cloud):
            raise ValueError("the shape of a body is a Box, a Mesh or a Cloud, not "
                             f"{check.shown(self.shape)}: give one; from_dolfinx makes a Mesh of dolfinx's")
        check_declared(self.law)
        put("rho", check.positive("rho", self.rho, "kg/m^3", "the density must be positive"))
        put("thickness", check.positive("thickness", self.thickness, "m", "it must be positive"))
        put("f_bar", check.truth("f_bar", self.f_bar))
        put("friction", check.not_negative("friction of the body", self.friction))
        put("force_cells", check_force_cells(self.name, self.force_cells, self.dim))
        states = ("plane_stress", "plane_strain") if self.dim == 2 else ("three_dimensional",)
        put("stress_state", states[-1] if self.stress_state is None else
            check.choice("stress_state", self.stress_state, states))
        if self.stress is not None:
            check.function("stress of the body", self.stress)
        if self.start is not None:
            check.record("start of the body", self.start, FromCheckpoint).check_alone(self.stress)
        if not callable(self.velocity):
            put("velocity", check.array("velocity of the body", self.velocity, (), (self.dim,), unit="m/s"))
        if not isinstance(self.shape, Cloud):
            self._check_points()

    def _check_points(self) -> None:
        tensor = self.cell in ("quadrilateral", "hexahedron")
        allowed = TENSOR_POINTS if tensor else SIMPLEX_POINTS[self.dim]
        if self.points not in list(allowed) or isinstance(self.points, bool):
            raise ValueError(f"points is {check.shown(self.points)}: choose one of "
                             f"{', '.join(map(str, allowed))} "
                             f"({'per direction' if tensor else f'per {self.cell}'})")
        if isinstance(self.shape, Mesh):
            cells = len(self.shape.cells)
        else:
            cells = cell_count(self.cells or (), self.cell)
        n = cells * (self.points**self.dim if tensor else self.points)
        check.check_memory(f"{n:.3g} material points of the body ({cells:.3g} cells, points={self.points})",
                           n * BYTES_PER_POINT[self.dim],
                           "take fewer body cells (body or refine, a larger h), or fewer points in each",
                           shared=True)

    def without(self, rocks: Any, gap: float = 0.0) -> "Body":
        """The body without the material points in ``rocks``: `Spheres` and `Cluster` of `dem_liggghts`, or
        lists of them, in a plane as discs. What is left is a ``Cloud``, whose volume and mass are those of
        the body less the rocks; gap: least distance of a material point from a rock [m], such as the radius
        of the balls that stand for the points in contacts. See ``hollow.around_rocks`` for the rule.

        A Box is filled evenly, as smooth bases do; a Mesh is refused. Raises ValueError, too, when nothing is
        left.

        >>> from types import SimpleNamespace
        >>> from mpm_fenicsx import linear
        >>> block = Body(Box((0.0, 0.0), (1.0, 1.0)), (10, 10), 2, linear(1e6, 0.3), 1000.0)
        >>> rock = SimpleNamespace(x=np.array([(0.5, 0.5)]), radius=0.2)  # as Spheres have them
        >>> soil = block.without(rock)
        >>> len(soil.shape.x), round(soil.shape.volume.sum(), 3), round(1 - np.pi * 0.2**2, 3)
        (348, 0.874, 0.874)
        """
        if isinstance(self.shape, Mesh):
            raise ValueError("the body is a Mesh: rocks can be cut out of a Box or a Cloud")
        left = without_rocks(self, rocks, check.not_negative("gap", gap, "m"))
        return replace(self, shape=Cloud(*left), cells=None, points=None, cell=None)

    @property
    def box(self) -> Box:
        """The body, or the smallest box around it."""
        return self.shape if isinstance(self.shape, Box) else self.shape.box

    @property
    def dim(self) -> int:
        """Number of dimensions."""
        return self.shape.x.shape[1] if isinstance(self.shape, Cloud) else self.shape.dim
