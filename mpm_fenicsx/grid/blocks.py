"""The blocks of a large regular grid that are near material points: only their cells are made. Those of
columns on a terrain are in ``column_blocks``.

A ``large`` grid is cut into blocks of ``SIDE`` cells per direction. Those within ``AHEAD``
cells of a point form the mesh, so that memory and time follow the points and not the box; the blocks are
chosen anew when a point has come within ``NEEDED`` cells of one that is missing.
"""
from typing import NamedTuple

import numpy as np

from ..compiled import compiled
from ..scene.lattice import SIDE, axes_of, block_counts, cell_count, check_size, lattice_cells

AHEAD = {2: 32, 3: 8}  # cells around points that are made, at most SIDE
NEEDED = 3  # cells around points that a step may ask for
FULL = 0.1  # of all cells: with more a grid is judged as a whole
MISSING = -1


class Division(NamedTuple):
    """Of a regular grid: its ``lower`` corner [m], size ``h`` of a cell [m], ``counts`` of cells, ``side`` of
    a block [cells] and number of ``blocks`` along each direction, shape (D,) each; ``simplices`` per cell of
    the lattice."""

    lower: np.ndarray
    h: np.ndarray
    counts: np.ndarray
    side: np.ndarray
    blocks: np.ndarray
    simplices: int


class Present(NamedTuple):
    """The b blocks that are there: ``place`` (all blocks,) of each among them, or MISSING; ``start`` (b,),
    number of the first cell of each; ``within`` (b, D), cells of each along each direction."""

    place: np.ndarray
    start: np.ndarray
    within: np.ndarray


def divide(grid):
    """``Division`` of a ``Grid``."""
    D, counts = grid.dim, np.asarray(grid.cells, np.int64)
    return Division(np.asarray(grid.box.lower, float), grid.box.size / counts, counts,
                    np.full(D, SIDE[D], np.int64), np.array(block_counts(grid.cells), np.int64),
                    cell_count((1,) * D, grid.cell))


@compiled
def mark(x, division: Division, reach, marked):
    """Mark the blocks within ``reach`` cells, at most the side of a block, of points x [m], shape (n, D), in
    ``marked``, (blocks,). Points beyond the edge of the grid count as at it. Returns whether all were marked
    before."""
    lower, h, counts, side, blocks, _ = division
    D, before = x.shape[1], True
    first, last = np.zeros(3, np.int64), np.zeros(3, np.int64)
    for p in range(len(x)):
        for d in range(D):
            s = (x[p, d] - lower[d]) / h[d]
            i = 0
            if s > 0.0:  # not so for what is not a number, which the search will find
                i = int(min(s, counts[d] - 1.0))
            first[d] = max(i - reach, 0) // side[d]
            last[d] = min(i + reach, counts[d] - 1) // side[d]
        for k in range(first[2], last[2] + 1):
            for j in range(first[1], last[1] + 1):
                for i in range(first[0], last[0] + 1):
                    b = i + blocks[0] * (j + blocks[1] * k)
                    if not marked[b]:
                        marked[b] = True
                        before = False
    return before


@compiled
def renumber(number, division: Division, present: Present):
    """Numbers of cells of the whole grid, (n,), become those among the cells of the blocks that are there,
    MISSING where none is; what is below 0 stays."""
    _, _, counts, side, blocks, simplices = division
    place, start, within = present
    D = len(counts)
    for p in range(len(number)):
        if number[p] < 0:
            continue
        box = number[p] // simplices
        kind = number[p] - simplices * box
        block, stride, rest = 0, 1, box
        for d in range(D):
            block += stride * ((rest % counts[d]) // side[d])
            stride *= blocks[d]
            rest //= counts[d]
        b = place[block]
        if b < 0:
            number[p] = MISSING
            continue
        cell, stride, rest = 0, 1, box
        for d in range(D):
            cell += stride * ((rest % counts[d]) % side[d])
            stride *= within[b, d]
            rest //= counts[d]
        number[p] = start[b] + simplices * cell + kind


class Blocks:
    """Those of a ``Grid`` that are there: ``numbers``, sorted, shape (b,), with ``count`` cells, the same on
    every rank. ValueError where these need more memory or time than there is, or all cells if these are more
    than ``FULL`` of them."""

    divide = staticmethod(divide)

    def __init__(self, grid, numbers):
        self.grid, self.numbers, self.division = grid, np.asarray(numbers, np.int64), self.divide(grid)
        self._find_cells()
        self._there = np.zeros(int(np.prod(self.division.blocks)), np.bool_)
        self._there[self.numbers] = True

    @staticmethod
    def straight(grid, division, x):
        """Places x [m], shape (n, D), in the coordinates of the ``division``."""
        return x

    def _find_cells(self):
        """Those of the blocks; the last of its tasks is to count them."""
        grid, blocks = self.grid, self.division.blocks
        self._at = np.stack(np.unravel_index(self.numbers, blocks, order="F"), axis=1)  # (b, D)
        within = np.minimum(self.division.counts - self.division.side * self._at, self.division.side)
        place = np.full(int(np.prod(blocks)), MISSING, np.int32)
        place[self.numbers] = np.arange(len(self.numbers))
        sizes = self.division.simplices * np.prod(within, axis=1)
        self.count = int(sizes.sum())
        whole = self.count > FULL * cell_count(grid.cells, grid.cell)
        check_size(grid.cells, grid.cell, None if whole else self.count)
        self._present = Present(place, np.cumsum(sizes) - sizes, within)

    @classmethod
    def around(cls, grid, places, comm):
        """Around points at the ``places`` [m], (n, D) each, of which each rank gives some. Collective."""
        division = cls.divide(grid)
        marked = np.zeros(int(np.prod(division.blocks)), np.bool_)
        for x in places:
            mark(cls.straight(grid, division, x), division, AHEAD[grid.dim], marked)
        numbers = comm.allgather(np.flatnonzero(marked)) if comm.size > 1 else [np.flatnonzero(marked)]
        return cls(grid, np.unique(np.concatenate(numbers)))

    def hold(self, x):
        """Whether all cells are there that a step may ask for with points x [m], shape (n, D)."""
        return bool(mark(self.straight(self.grid, self.division, x), self.division, NEEDED,
                         self._there.copy()))

    def renumber(self, number):
        """See the kernel of that name."""
        renumber(number, self.division, self._present)

    def mesh(self):
        """Vertices, shape (n, D), and cells, shape (m, K), block by block, of the lattice within."""
        counts = self.division.counts
        count = np.prod(self._present.within, axis=1)
        block = np.repeat(np.arange(len(count)), count)
        rest = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
        places = []
        for d in range(self.grid.dim):
            size = self._present.within[block, d]
            places.append(self.division.side[d] * self._at[block, d] + rest % size)
            rest //= size
        cells = lattice_cells(places, [int(n) for n in counts], self.grid.cell)
        used, corners = np.unique(cells, return_inverse=True)
        at = np.unravel_index(used, counts + 1, order="F")
        axes = axes_of(self.grid.box, self.grid.cells)
        return np.stack([axis[i] for axis, i in zip(axes, at)], axis=1), corners.reshape(cells.shape)
