"""A simply supported beam: what is stated of it, and the grid, body, supports and interface that it takes."""
from dataclasses import dataclass
from typing import List, Literal, NamedTuple, Optional, Tuple, cast

import numpy as np

import mpm_dem_checks as check

from ..laws import Law
from .bodies import Body, Grid
from .interface import Interface
from .mesh import Box
from .supports import Support

BESIDE = 0.0026  # [m] of grid beside a beam on a grid that is given by its cells


class BeamScene(NamedTuple):
    """The first arguments of an ``MPM``."""

    grid: Grid
    body: Body
    supports: List[Support]
    interface: Interface


@dataclass(frozen=True)
class SimplySupportedBeam:
    """A beam along x whose ends are held up, on a grid of three beam heights. The origin is at midspan on
    top.

    >>> from mpm_fenicsx import SimplySupportedBeam, linear
    >>> beam = SimplySupportedBeam(length=0.1, h=2e-3, body=(50, 5), segments=(50,))
    >>> scene = beam.scene(linear(beam.E, beam.nu))
    >>> scene.grid.cells, len(scene.interface.x)
    ((52, 15), 51)
    """

    dim: Literal[2, 3] = 2  # in the plane or in space
    length: float = 0.1535  # of the beam [m]
    height: float = 0.01  # of the beam [m]
    width: float = 0.01  # of the beam, across the plane [m]
    E: float = 215.82e9  # Young's modulus [Pa]
    nu: float = 0.289  # Poisson's ratio [-]
    rho: float = 7960.0  # density [kg/m^3]
    h: float = 2e-3  # size of the background cells, of which columns stand at the beam's ends [m]
    cells: Optional[Tuple[int, ...]] = None  # of the grid along, up (3 beam heights), across [-]; replaces h
    cell: Optional[Literal["quadrilateral", "triangle", "hexahedron", "tetrahedron"]] = None  # grid and body
    body: Optional[Tuple[int, ...]] = None  # body cells along, up and across [-]; none: those of the case
    points: int = 2  # per body cell: in all (triangle, tetrahedron) or per direction (others) [-]
    segments: Optional[Tuple[int, ...]] = None  # of the interface along and across [-]; none: of the case

    counts = {"h": (lambda keys: keys["cells"] is None, "without cells=")}  # of a key: when it has an effect

    @property
    def box(self) -> Box:
        """The beam."""
        half, across = self.length / 2, self.width / 2
        return Box((-half, -self.height, -across)[:self.dim], (half, 0.0, across)[:self.dim])

    def scene(self, law: Law, plane: str = "stress", f_bar: bool = False, shift: float = 0.0) -> BeamScene:
        """Grid, beam, its supports and the interface on top, ``shift`` [m] inside it. plane: "stress" or
        "strain"."""
        box, grid = self.box, self.grid()
        state, thickness = (f"plane_{plane}", self.width) if self.dim == 2 else (None, 1.0)
        beam = Body(box, self.body, self.points, law, self.rho, state, thickness, self.cell, f_bar=f_bar)
        supports = [Support.column("x", x, grid, "y", name=f"support of the {side} end")
                    for x, side in zip((box.lower[0], box.upper[0]), ("left", "right"))]
        segments = cast(Tuple[int, ...], self.segments)  # none is refused there
        return BeamScene(grid, beam, supports, Interface.top(box, segments, shift))

    def grid(self) -> Grid:
        """Cells of size h, one column beside the beam on each side; or ``cells``, 2.6 mm beside it as in the
        paper."""
        box, size, beside = self.box, self.box.size, [d for d in range(self.dim) if d != 1]
        margin, cells = np.full(self.dim, BESIDE), self.cells
        if cells is None:
            check.between("h", self.h, 0, self.height, "m",
                          f"the cell size must lie between 0 and the beam's height of {self.height} m", "(]")
            check.positive("h", self.h, "m")
            columns = np.rint(size / self.h)  # floats: of tiny cells there are more than an integer counts
            margin, cells = size / columns, columns + 2
            cells[1] = round(3 * self.height / self.h)
        lower, upper = np.array(box.lower), np.array(box.upper)
        lower[beside], upper[beside] = lower[beside] - margin[beside], upper[beside] + margin[beside]
        lower[1], upper[1] = -2 * self.height, self.height
        return Grid(Box(tuple(lower), tuple(upper)), cells, self.cell)
