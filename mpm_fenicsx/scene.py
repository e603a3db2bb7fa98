"""What an MPM scene consists of: frozen data in SI units, checked when made. No numerics, MPI or PETSc in here."""
from dataclasses import dataclass
from typing import Callable, Optional, Tuple

import numpy as np

from .laws import Law

AXES = "xyz"
CELLS = ("quadrilateral", "triangle")


@dataclass(frozen=True)
class Box:
    """Axis-parallel box from ``lower`` to ``upper`` [m], tuples of 2 or 3 numbers."""

    lower: Tuple[float, ...]
    upper: Tuple[float, ...]

    def __post_init__(self):
        lower, upper = np.asarray(self.lower, float), np.asarray(self.upper, float)
        if lower.shape != upper.shape or lower.shape not in ((2,), (3,)):
            raise ValueError(f"box from {self.lower} to {self.upper}: give two corners with 2 or 3 coordinates each")
        if not (upper > lower).all():
            raise ValueError(f"box from {self.lower} to {self.upper}: every upper coordinate must exceed the lower one")

    @property
    def dim(self):
        return len(self.lower)

    @property
    def size(self):
        """Edge lengths [m], shape (dim,)."""
        return np.subtract(self.upper, self.lower)


def _counts(value, dim, name):
    counts = tuple(int(n) for n in value)
    if len(counts) != dim or any(n != v for n, v in zip(counts, value)) or min(counts) < 1:
        raise ValueError(f"{name} is {tuple(value)}: give {dim} whole numbers, each at least 1")
    return counts


@dataclass(frozen=True)
class Grid:
    """Background grid: ``box`` divided into ``cells`` per direction, of type ``cell``."""

    box: Box
    cells: Tuple[int, ...]
    cell: str = "quadrilateral"

    def __post_init__(self):
        object.__setattr__(self, "cells", _counts(self.cells, self.box.dim, "cells of the grid"))
        if self.cell not in CELLS:
            raise ValueError(f"cell is {self.cell!r}: choose one of {', '.join(CELLS)}")


    @staticmethod
    def counts(size, h):
        """Cells per direction of size about ``h`` [m] for a box of ``size`` [m]."""
        if not (np.isfinite(h) and 0 < h <= min(size)):
            raise ValueError(f"h is {h} m: the cell size must lie between 0 and {min(size):.3g} m")
        return tuple(max(1, round(length / h)) for length in size)


@dataclass(frozen=True)
class MeshGrid:
    """Background grid given as a mesh: vertices [m], shape (n, dim), cells, shape (m, nodes), in dolfinx's order of
    vertices; quadrilaterals must be parallelograms."""

    vertices: np.ndarray
    cells: np.ndarray
    cell: str = "triangle"

    def __post_init__(self):
        vertices, cells = np.array(self.vertices, float), np.array(self.cells, np.int64)
        if self.cell not in CELLS:
            raise ValueError(f"cell is {self.cell!r}: choose one of {', '.join(CELLS)}")
        wanted = {"triangle": 3, "quadrilateral": 4}[self.cell]
        if vertices.ndim != 2 or vertices.shape[1] != 2 or cells.ndim != 2 or cells.shape[1] != wanted:
            raise ValueError(f"a mesh of {self.cell} cells needs vertices of shape (n, 2) and cells of shape (m, "
                             f"{wanted}), not {vertices.shape} and {cells.shape}")
        if not 0 <= cells.min() <= cells.max() < len(vertices):
            raise ValueError(f"the cells name vertices {cells.min()}..{cells.max()}, there are {len(vertices)}")
        object.__setattr__(self, "vertices", vertices)
        object.__setattr__(self, "cells", cells)

    @property
    def box(self):
        """Smallest box around the mesh."""
        return Box(tuple(self.vertices.min(axis=0)), tuple(self.vertices.max(axis=0)))


@dataclass(frozen=True)
class Body:
    """A body: ``box`` divided into ``cells`` body cells with ``points`` material points each.

    points: for quadrilaterals the points per direction (tensor Gauss rule, 1 to 6), for triangles the points per
    triangle (1, 3, 6, 7 or 12). stress_state: ``plane_stress``, ``plane_strain`` or ``three_dimensional``. thickness:
    of a plane body [m]. velocity: initial velocity [m/s], shape (dim,), or a function from positions (n, dim) to
    velocities (n, dim).
    """

    box: Box
    cells: Tuple[int, ...]
    points: int
    law: Law
    rho: float
    stress_state: str = "plane_strain"
    thickness: float = 1.0
    cell: str = "quadrilateral"
    velocity: object = 0.0

    def __post_init__(self):
        object.__setattr__(self, "cells", _counts(self.cells, self.box.dim, "body (its cells)"))
        if not (np.isfinite(self.rho) and self.rho > 0):
            raise ValueError(f"rho is {self.rho} kg/m^3: the density must be positive")
        if not (np.isfinite(self.thickness) and self.thickness > 0):
            raise ValueError(f"thickness is {self.thickness} m: it must be positive")
        states = ("plane_stress", "plane_strain") if self.box.dim == 2 else ("three_dimensional",)
        if self.stress_state not in states:
            raise ValueError(f"stress_state is {self.stress_state!r}: choose one of {', '.join(states)}")
        if self.cell not in CELLS:
            raise ValueError(f"cell of the body is {self.cell!r}: choose one of {', '.join(CELLS)}")
        allowed = range(1, 7) if self.cell == "quadrilateral" else (1, 3, 6, 7, 12)
        if self.points not in allowed:
            raise ValueError(f"points is {self.points}: choose one of {', '.join(map(str, allowed))} "
                             f"({'per direction' if self.cell == 'quadrilateral' else 'per triangle'})")


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


@dataclass(frozen=True)
class Interface:
    """Boundary particles: positions x [m], shape (n, dim), and the elements they form, shape (m, dim): segments a→b
    with the outside on their left, or triangles that run counter-clockwise seen from outside."""

    x: np.ndarray
    elements: np.ndarray

    def at_x(self, x, values):
        """``values``, shape (n, m), interpolated linearly along the interface of a plane scene to the place x [m]."""
        order = np.argsort(self.x[:, 0])
        return np.array([np.interp(x, self.x[order, 0], column) for column in values[order].T])

    @staticmethod
    def top(box: Box, segments: int, shift: float = 0.0):
        """Upper edge of a plane box in equal segments, moved into the body by ``shift`` [m] (the paper's delta)."""
        if int(segments) != segments or segments < 1:
            raise ValueError(f"segments is {segments}: give a whole number of at least 1")
        if not 0.0 <= shift < box.size[1]:
            raise ValueError(f"shift is {shift} m: it must lie between 0 and the height of the body, {box.size[1]} m")
        x = np.linspace(box.lower[0], box.upper[0], segments + 1)  # rightwards: the outside is on the left hand
        i = np.arange(segments)
        return Interface(np.column_stack([x, np.full(segments + 1, box.upper[1] - shift)]),
                         np.column_stack([i, i + 1]))

    @staticmethod
    def line(a, b, segments: int):
        """Segments of equal length from a to b [m] in the plane; their outside is on the left of the way."""
        if int(segments) != segments or segments < 1:
            raise ValueError(f"segments is {segments}: give a whole number of at least 1")
        i = np.arange(segments)
        return Interface(np.linspace(a, b, segments + 1), np.column_stack([i, i + 1]))

    @staticmethod
    def patch(corner, first, second, counts):
        """Parallelogram in space from ``corner`` along the edges ``first`` and ``second`` [m], in counts[0] x counts[1]
        pieces of two triangles each; its outside is that of first x second."""
        n, m = _counts(counts, 2, "pieces of the patch")
        s, t = (a.ravel() for a in np.meshgrid(np.arange(n + 1), np.arange(m + 1), indexing="ij"))
        x = np.asarray(corner, float) + np.outer(s / n, first) + np.outer(t / m, second)
        corners = (np.arange(n)[:, None] * (m + 1) + np.arange(m)).ravel()
        along, across = corners + m + 1, corners + 1
        return Interface(x, np.concatenate([np.column_stack([corners, along, along + 1]),
                                            np.column_stack([corners, along + 1, across])]))
