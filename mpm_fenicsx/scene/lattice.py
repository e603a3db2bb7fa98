"""Regular meshes of a box, and how large they may be."""
import math
from itertools import permutations
from typing import List, Optional, Sequence, Tuple

import numpy as np

import mpm_dem_checks as check

from .mesh import BYTES_PER_CELL, CELLS, Box

START_PER_CELL = 2.5e4  # operations to set up a grid, measured
SIDE = {2: 32, 3: 8}  # cells of a block of a large grid along each direction
BYTES_PER_BLOCK = 5  # of a large grid, of those without cells as well
REMEDY = "take larger and fewer cells (h), or a smaller box"
LARGE = 1_000_000  # cells; a smaller grid is made as a whole: that costs less than blocks that change


def cell_count(counts: Sequence[int], cell: Optional[str]) -> int:
    """Number of cells of that kind in a regular mesh, see ``lattice``."""
    return math.prod(counts) * {"triangle": 2, "tetrahedron": 6}.get(cell or "", 1)


def block_counts(counts: Sequence[int]) -> Tuple[int, ...]:
    """Blocks of ``SIDE`` cells along each direction."""
    return tuple(-(-int(n) // SIDE[len(counts)]) for n in counts)


def check_size(counts: Sequence[int], cell: Optional[str], made: Optional[int] = None) -> None:
    """ValueError where the cells of a regular grid need more memory or time than there is. made: so many of
    them, None: all."""
    n = cell_count(counts, cell)
    what = f"{n:.3g} cells of the grid (cells={','.join(map(str, counts))})"
    if made is not None:
        what = f"{made:.3g} of {what}, those near the material,"
    _check(what, n if made is None else made, len(counts))


def check_blocks(counts: Sequence[int]) -> None:
    """ValueError where a regular grid has too many blocks."""
    n = float(math.prod(block_counts(counts)))
    what = f"{n:.3g} blocks of the grid (cells={','.join(map(str, counts))})"
    check.check_memory(what, BYTES_PER_BLOCK * n, REMEDY)


def _check(what: str, n: int, D: int) -> None:
    check.check_memory(what, n * BYTES_PER_CELL[D], REMEDY)
    check.check_work(f"{what} at the start", n * START_PER_CELL, REMEDY)


def lattice(box: Box, counts: Sequence[int], cell: Optional[str]) -> Tuple[np.ndarray, np.ndarray]:
    """Vertices, shape (n, D), and cells, shape (m, K), of a regular mesh; direction 0 runs fastest in both.

    Simplices: each box cell is cut into D! of them along its main diagonal (Kuhn), numbered by the
    permutation that sorts the local coordinates downwards.
    """
    axes = axes_of(box, counts)
    vertices = np.stack([a.ravel(order="F") for a in np.meshgrid(*axes, indexing="ij")], axis=1)
    places = np.meshgrid(*map(np.arange, counts), indexing="ij")
    return vertices, lattice_cells([place.ravel(order="F") for place in places], counts, cell)


def lattice_corners(box: Box, counts: Sequence[int], cell: Optional[str], boxes: slice) -> np.ndarray:
    """Corners [m], shape (m, K, D), of those cells of a ``lattice`` that are in its ``boxes``, from one
    number to another."""
    places = np.unravel_index(np.arange(boxes.start, boxes.stop), counts, order="F")
    vertices = np.unravel_index(lattice_cells(places, counts, cell), [n + 1 for n in counts], order="F")
    return np.stack([axis[i] for axis, i in zip(axes_of(box, counts), vertices)], axis=-1)


def axes_of(box: Box, counts: Sequence[int]) -> List[np.ndarray]:
    """Coordinates [m] of the vertices of a regular mesh along each direction."""
    return [np.linspace(lo, hi, n + 1) for lo, hi, n in zip(box.lower, box.upper, counts)]


def lattice_cells(places: Sequence[np.ndarray], counts: Sequence[int], cell: Optional[str]) -> np.ndarray:
    """Vertices of the cells of a ``lattice`` in the boxes of the numbers ``places`` along each direction,
    (n,) each: (n, K), of simplices (n D!, K)."""
    D = len(counts)
    strides = np.cumprod([1, *(n + 1 for n in counts[:-1])])
    corner = sum(s * i for s, i in zip(strides, places))
    if cell == CELLS[D][0]:
        offsets = [sum(strides[d] for d in range(D) if (a >> d) & 1) for a in range(2**D)]
        return corner[:, None] + np.array(offsets)
    paths = [np.cumsum([0, *(strides[d] for d in order)]) for order in permutations(range(D))]
    return (corner[:, None, None] + np.array(paths)).reshape(-1, D + 1)
