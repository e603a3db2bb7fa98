"""What an MPM scene consists of: frozen data in SI units, checked when made. No numerics, MPI or PETSc in here."""
from dataclasses import dataclass
from typing import Callable, Optional, Tuple

import numpy as np

from .laws import Law
from .mesh import Box, Mesh, cell_of

AXES = "xyz"
TENSOR_POINTS = range(1, 7)  # per direction
SIMPLEX_POINTS = {2: (1, 3, 6, 7, 12), 3: (1, 4, 14, 15, 24)}  # basix's rules with positive weights


def whole_numbers(value, dim, name):
    counts = tuple(int(n) for n in value)
    if len(counts) != dim or any(n != v for n, v in zip(counts, value)) or min(counts) < 1:
        shown, wanted = (value[0], "a whole number of") if dim == len(value) == 1 else (
            tuple(value), f"{dim} whole numbers, each" if dim > 1 else "one whole number of")
        raise ValueError(f"{name} is {shown}: give {wanted} at least 1")
    return counts


@dataclass(frozen=True)
class Grid:
    """Regular background grid: ``box`` divided into ``cells`` per direction; cell: kind of cell, None for
    quadrilaterals and hexahedra."""

    box: Box
    cells: Tuple[int, ...]
    cell: Optional[str] = None

    def __post_init__(self):
        object.__setattr__(self, "cells", whole_numbers(self.cells, self.box.dim, "cells of the grid"))
        object.__setattr__(self, "cell", cell_of(self.box.dim, self.cell, "grid"))

    @property
    def dim(self):
        return self.box.dim

    @staticmethod
    def counts(size, h):
        """Cells per direction of size about ``h`` [m] for a box of ``size`` [m]."""
        if not (np.isfinite(h) and 0 < h <= min(size)):
            raise ValueError(f"h is {h} m: the cell size must lie between 0 and {min(size):.3g} m")
        return tuple(max(1, round(length / h)) for length in size)


@dataclass(frozen=True)
class Cloud:
    """Material points given one by one: positions x [m], shape (n, dim), and volumes [m^3], shape (n,)."""

    x: np.ndarray
    volume: np.ndarray

    def __post_init__(self):
        x, volume = np.array(self.x, float), np.array(self.volume, float)
        if x.ndim != 2 or x.shape[1] not in (2, 3) or volume.shape != (len(x),):
            raise ValueError(f"a cloud of points has positions of shape (n, 2) or (n, 3) and as many volumes, not "
                             f"{x.shape} and {volume.shape}")
        if not len(x):
            raise ValueError("the cloud has no points: give at least one")
        for what, bad, values, rule in (("position", ~np.isfinite(x).all(axis=1), x, "finite"),
                                        ("volume", ~(np.isfinite(volume) & (volume > 0)), volume, "positive")):
            if bad.any():
                raise ValueError(f"the {what} of point {np.argmax(bad)} of the cloud is {values[bad][0]}: it must be "
                                 f"{rule}")
        object.__setattr__(self, "x", x)
        object.__setattr__(self, "volume", volume)

    @property
    def box(self):
        return Box(tuple(self.x.min(axis=0)), tuple(self.x.max(axis=0)))


@dataclass(frozen=True)
class Body:
    """A body and its material points.

    shape: a ``Box`` divided into ``cells`` body cells of kind ``cell``; a ``Mesh``, whose cells are the body cells
    (``cells`` is None); or a ``Cloud`` (``cells`` and ``points`` are None). points: per body cell, for quadrilaterals
    and hexahedra per direction (tensor Gauss rule, 1 to 6), for simplices in all (triangles 1, 3, 6, 7 or 12,
    tetrahedra 1, 4, 14, 15 or 24). stress_state: ``plane_stress`` or ``plane_strain`` (default) in the plane,
    ``three_dimensional``. thickness: of a plane body [m]. velocity: initial velocity [m/s], shape (dim,), or a function
    from positions (n, dim) to velocities (n, dim). f_bar: average the volume change over each cell of the background
    grid, or over patches of its triangles and tetrahedra, against locking of bodies that keep their volume. stress:
    normal stresses along x, y and z at the start [Pa], shape (n, 3), as a function of positions (n, dim), see
    ``geostatic``; the body is then at rest, not in free fall.
    """

    shape: object
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

    def __post_init__(self):
        put = lambda name, value: object.__setattr__(self, name, value)  # noqa: E731 - the class is frozen
        if isinstance(self.shape, Box):
            put("cells", whole_numbers(self.cells, self.dim, "body (its cells)"))
            put("cell", cell_of(self.dim, self.cell, "body"))
        elif isinstance(self.shape, Mesh):
            put("cell", self.shape.cell)
        elif not isinstance(self.shape, Cloud):
            raise ValueError(f"the shape of a body is a Box, a Mesh or a Cloud, not {type(self.shape).__name__}")
        if not (np.isfinite(self.rho) and self.rho > 0):
            raise ValueError(f"rho is {self.rho} kg/m^3: the density must be positive")
        if not (np.isfinite(self.thickness) and self.thickness > 0):
            raise ValueError(f"thickness is {self.thickness} m: it must be positive")
        states = ("plane_stress", "plane_strain") if self.dim == 2 else ("three_dimensional",)
        put("stress_state", self.stress_state or states[-1])
        if self.stress_state not in states:
            raise ValueError(f"stress_state is {self.stress_state!r}: choose one of {', '.join(states)}")
        tensor = self.cell in ("quadrilateral", "hexahedron")
        allowed = TENSOR_POINTS if tensor else SIMPLEX_POINTS[self.dim]
        if not isinstance(self.shape, Cloud) and self.points not in allowed:
            raise ValueError(f"points is {self.points}: choose one of {', '.join(map(str, allowed))} "
                             f"({'per direction' if tensor else 'per ' + self.cell})")

    @property
    def box(self):
        """The body, or the smallest box around it."""
        return self.shape if isinstance(self.shape, Box) else self.shape.box

    @property
    def dim(self):
        return self.box.dim


@dataclass(frozen=True)
class Support:
    """Grid nodes whose motion is given.

    where: function from node positions [m], shape (n, dim), to a mask, shape (n,). fix: the directions held, such as
    "y" or "xy". motion: displacement from the start [m] as a function of time [s], one number or one per direction of
    ``fix``; None holds still.
    """

    where: Callable
    fix: str
    motion: Optional[Callable] = None
    name: str = "support"

    def __post_init__(self):
        if not self.fix or set(self.fix) - set(AXES):
            raise ValueError(f"{self.name} fixes {self.fix!r}: give one or more of the letters x, y, z")

    @staticmethod
    def column(axis: str, at: float, grid: Grid, fix: str, motion=None, name="support"):
        """Support on the grid nodes of the column (in space: plane) across ``axis`` that is nearest to ``at`` [m]."""
        d = AXES.index(axis)
        h = grid.box.size[d] / grid.cells[d]
        nearest = grid.box.lower[d] + h * np.rint((at - grid.box.lower[d]) / h)
        return Support(lambda x: np.abs(x[:, d] - nearest) < 0.25 * h, fix, motion, name)
