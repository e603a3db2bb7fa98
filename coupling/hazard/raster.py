"""Rasters of equal cells over the horizontal extent of a terrain, and the files that hold them."""
import math
from pathlib import Path
from typing import Any, Callable, Dict, NamedTuple, Optional, Tuple

import numpy as np

import mpm_dem_checks as check

NODATA = -9999.0


class Raster(NamedTuple):
    """Squares, in the plane intervals, of width ``cell`` [m] from the corner ``lower`` [m], shape (2,) or
    (1,), on; ``shape``: rows along y, one in the plane, and columns along x."""

    lower: np.ndarray
    cell: float
    shape: Tuple[int, int]

    @property
    def area(self) -> float:
        """Of a cell [m^2], in the plane [m]."""
        return float(self.cell ** len(self.lower))

    @property
    def upper(self) -> np.ndarray:
        """The other corner [m], as long as ``lower``."""
        return self.lower + self.cell * np.array(self.shape[::-1][:len(self.lower)])

    def axis(self, number: int) -> np.ndarray:
        """Middles of the columns (0) or the rows (1) [m]."""
        return self.lower[number] + self.cell * (np.arange(self.shape[1 - number]) + 0.5)

    def middles(self) -> np.ndarray:
        """Of the cells [m], shape (rows columns, 2 or 1)."""
        if len(self.lower) == 1:
            return self.axis(0)[:, None]
        y, x = np.meshgrid(self.axis(1), self.axis(0), indexing="ij")
        return np.column_stack([x.ravel(), y.ravel()])


class Ground:
    """A ``terrain``, see ``protocols.Terrain``, also where something is beyond its edge: ``lower`` and
    ``upper`` corner [m], shape (2,) or (1,). motion: how it has moved as a whole since the start [m], (2,) or
    (3,), as a function of time; of one whose vertices move each for themselves heights stay those of the
    start."""

    def __init__(self, terrain: Any, motion: Optional[Callable] = None) -> None:
        self._terrain, self._motion, self._shift = terrain, motion, np.zeros(1 + np.size(terrain.lower))
        self.lower, self.upper = (np.atleast_1d(np.asarray(side, float)) for side in (terrain.lower,
                                                                                      terrain.upper))

    def go(self, time: float) -> None:
        """Where it is at ``time`` [s]."""
        shift = np.zeros(1) if self._motion is None else np.asarray(self._motion(time), float)
        if shift.shape == self._shift.shape:
            self._shift = shift

    def height(self, xy: np.ndarray) -> np.ndarray:
        """At horizontal places [m], shape (n, 2 or 1), of the nearest place for those beyond: [m], (n,)."""
        inside = np.minimum(np.maximum(xy - self._shift[:-1], self.lower), self.upper)
        return np.asarray(self._terrain.height(inside), float) + self._shift[-1]


def raster_over(ground: Ground, cell: float) -> Raster:
    """The fewest cells of width ``cell`` [m] that cover the extent of the ``ground``.

    >>> from types import SimpleNamespace as Toy
    >>> raster_over(Ground(Toy(lower=(10.0, 0.0), upper=(11.0, 0.5))), 0.2).shape
    (3, 5)
    """
    columns, *rows = (max(1, math.ceil(n - 1e-9)) for n in (ground.upper - ground.lower) / cell)
    raster = Raster(ground.lower, cell, (rows[0] if rows else 1, columns))
    check.check_memory(f"a map of {raster.shape[0]} x {columns} cells", 200 * raster.shape[0] * columns,
                       "make cell larger")
    return raster


def write_grid(path: Path, raster: Raster, values: np.ndarray) -> None:
    """An ESRI ASCII grid of ``values``, shape (rows, columns): the northernmost row, of the largest y, comes
    first; NaN: no data."""
    (x, y), (rows, columns) = raster.lower.tolist(), raster.shape
    head = (f"ncols {columns}\nnrows {rows}\nxllcorner {x!r}\nyllcorner {y!r}\ncellsize {raster.cell!r}\n"
            f"NODATA_value {NODATA:g}\n")
    with open(path, "w", encoding="ascii") as file:
        file.write(head)
        np.savetxt(file, np.where(np.isnan(values), NODATA, values)[::-1], "%.15g")


def write_table(path: Path, columns: Dict[str, Tuple[str, str]], values: np.ndarray) -> None:
    """A CSV file of ``values``, shape (lines, columns), with ``columns``, name → (unit, meaning), explained
    in its head."""
    notes = "".join(f"# {name} [{unit}]: {meaning}\n" for name, (unit, meaning) in columns.items())
    with open(path, "w", encoding="utf-8") as file:
        file.write(notes + ",".join(columns) + "\n")
        np.savetxt(file, values, "%.15g", delimiter=",")
