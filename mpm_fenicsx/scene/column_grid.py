"""Background grid of columns of cells whose layers follow a surface."""
from functools import cached_property
from typing import Dict, Optional, Sequence, Tuple

import numpy as np

import mpm_dem_checks as check

from .facets import alike
from .mesh import BYTES_PER_CELL, CELLS, FACETS, FLAT, Box, Mesh

LARGE_COLUMNS = 100_000  # cells; a smaller grid is made as a whole
REMEDY = "take larger cells (h), or fewer (where, above)"
Cells = Tuple[np.ndarray, np.ndarray]


class Columns(Mesh):
    """A ``Mesh`` of columns of cells of ``h`` [m] that is told by its columns: vertices, cells and surfaces
    are made when somebody asks for them, and of a ``large`` one the scene has only parts.

    lines: between the columns along each axis of the plan [m], (n + 1,) each, in equal distances; z: heights
    of the surface where they cross [m]; down, up: cells below and above it, of each column, both 0 where
    there is none. Levels count layers of cells from the lowest one below the surface, ``lowest`` of them.
    """

    def __init__(self, lines: Sequence[np.ndarray], z: np.ndarray, h: float, down: np.ndarray,
                 up: np.ndarray) -> None:
        put = self.__dict__.update  # the class is frozen
        put(lines=tuple(lines), z=z, h=h, down=down, up=up, groups={}, cell=CELLS[z.ndim + 1][0])
        put(lowest=int(down.max()), levels=int(down.max()) + int(up.max()))
        if not self.large:
            self.check_whole()

    lines: Tuple[np.ndarray, ...]
    z: np.ndarray
    h: float
    down: np.ndarray
    up: np.ndarray
    lowest: int
    levels: int

    @property
    def dim(self) -> int:
        """Number of dimensions."""
        return self.z.ndim + 1

    @cached_property
    def count(self) -> int:  # type: ignore[override]
        """Number of cells."""
        return int((self.down + self.up).sum())

    @property
    def large(self) -> bool:
        """Whether only blocks of it near the material are made, where the scene permits."""
        return self.count > LARGE_COLUMNS

    def check_whole(self, made: Optional[int] = None) -> None:
        """ValueError where its cells need more memory than there is. made: so many of them, None: all."""
        what = f"{self.count:.3g} cells of the columns on the terrain"
        if made is not None:
            what = f"{made:.3g} of {what}, those near the material,"
        check.check_memory(what, (self.count if made is None else made) * BYTES_PER_CELL[self.dim], REMEDY)

    # ---------------------------------------------------------------- what is told of all cells

    def _corners(self) -> Tuple[np.ndarray, np.ndarray]:
        """Lowest and highest of the heights at the corners of each column [m]."""
        return around(self.z, least=True), around(self.z)

    @cached_property
    def box(self) -> Box:
        """Smallest box around all cells."""
        there, (low, high) = self.down + self.up > 0, self._corners()
        ends = [(line[i.min()], line[i.max() + 1]) for line, i in zip(self.lines, np.nonzero(there))]
        ends.append(((low - self.h * self.down)[there].min(), (high + self.h * self.up)[there].max()))
        return Box(*zip(*ends))

    @property
    def cell_size(self) -> np.ndarray:
        """Of all cells along the axes [m], shape (dim,): the sides of a column, and h. On a slope a cell
        extends over more height than h, and has no more volume."""
        return np.array([*(line[1] - line[0] for line in self.lines), self.h])

    @cached_property
    def affine(self) -> bool:
        """Whether all cells are parallelepipeds: no column's surface is twisted."""
        twist, steep = self.z, [self.h]
        for axis in range(self.z.ndim):
            steep.append(np.abs(np.diff(self.z, axis=axis)).max())
            twist = np.diff(twist, axis=axis)
        if self.z.ndim == 1:
            return True
        size = np.abs([self.box.lower, self.box.upper]).max()
        twist = np.abs(twist[self.down + self.up > 0]).max()
        return bool(0.5 * twist < FLAT * max(steep) + 4 * np.finfo(float).eps * size)

    # ---------------------------------------------------------------- its cells

    def cells_between(self, column: np.ndarray, first: np.ndarray, count: np.ndarray) -> Cells:
        """Vertices [m], shape (n, dim), and cells, shape (m, K), of those ``columns``, numbers (k,), from the
        level ``first`` on so many each, column by column."""
        which = np.repeat(np.arange(len(column)), count)
        level = np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count) + first[which]
        place = np.unravel_index(column[which], self.down.shape)
        levels, D, corners = self.levels + 1, self.dim, []
        for a in range(2**D):
            node = np.ravel_multi_index([p + ((a >> d) & 1) for d, p in enumerate(place)], self.z.shape)
            corners.append(node * levels + level + (a >> (D - 1)))
        used, cells = np.unique(np.stack(corners, axis=1), return_inverse=True)
        node, layer = np.divmod(used, levels)
        at = np.unravel_index(node, self.z.shape)
        x = np.column_stack([*(line[i] for line, i in zip(self.lines, at)),
                             self.z.ravel()[node] + self.h * (layer - self.lowest)])
        return x, cells.reshape(-1, 2**D)

    @cached_property
    def _whole(self) -> Cells:
        self.check_whole()
        down = self.down.ravel()
        return self.cells_between(np.arange(down.size), self.lowest - down, down + self.up.ravel())

    @cached_property
    def vertices(self) -> np.ndarray:  # type: ignore[override]
        """Of all cells [m], shape (n, dim)."""
        return self._whole[0]

    @cached_property
    def cells(self) -> np.ndarray:  # type: ignore[override]
        """All of them, shape (m, nodes per cell)."""
        return self._whole[1]

    @cached_property
    def surfaces(self) -> Dict[str, np.ndarray]:  # type: ignore[override]
        """"side", "top" and "bottom" of all cells, see ``Mesh``."""
        return outside(self.cells, self.cell)


def around(values: np.ndarray, least: bool = False) -> np.ndarray:
    """Of values at the corners of squares those at the corners of each: the greatest, or the least."""
    for axis in range(values.ndim):
        low, high = (np.take(values, range(k, values.shape[axis] - 1 + k), axis) for k in (0, 1))
        values = np.minimum(low, high) if least else np.maximum(low, high)
    return values


def outside(cells: np.ndarray, kind: str) -> Dict[str, np.ndarray]:
    """Facets of one cell alone by name: those under a cell, those on one, and those beside."""
    local = np.array(FACETS[kind])
    name = np.array(["bottom" if max(facet) < len(cells[0]) // 2 else
                     "top" if min(facet) >= len(cells[0]) // 2 else "side" for facet in local.tolist()])
    facets = cells[:, local].reshape(-1, local.shape[1])
    order, first, count = alike(facets)
    alone = np.sort(order[first[count == 1]])
    of = name[alone % len(local)]
    return {each: facets[alone[of == each]] for each in ("side", "top", "bottom")}
