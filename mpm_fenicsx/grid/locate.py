"""Kernels of the search for cells, see ``search``: rounding on a lattice, a walk over neighbours on any mesh.
``specialise`` fixes D, and K of the walk's."""
import math
from typing import NamedTuple

import numpy as np

from ..basis.shape import CellMaps, ReferencePoint
from ..compiled import compiled, put
from ..scene.lattice import cell_count

D, K = 2, 4  # fixed by specialise
to_reference = None
NOWHERE = -1


class Lattice(NamedTuple):
    """Regular cells of a box: its ``lower`` corner [m], shape (D,), size ``h`` of a cell [m], shape (D,),
    ``counts`` of cells, shape (D,), ``simplices`` per cell (1 or D!, numbered by the permutation that sorts
    the local coordinates downwards), and ``margin`` beyond the edges that counts as inside [cells], shape (D,
    2)."""

    lower: np.ndarray
    h: np.ndarray
    counts: np.ndarray
    simplices: int
    margin: np.ndarray


def lattice_of(grid, margin):
    """``Lattice`` of a ``Grid``."""
    return Lattice(np.asarray(grid.box.lower, float), grid.cell_size,
                   np.asarray(grid.cells, np.int64), cell_count((1,) * grid.dim, grid.cell), margin)


class Neighbours(NamedTuple):
    """``behind`` (cells, facets): the cell behind each facet, -1 where this rank sees none; ``lower``,
    ``upper`` (D + 1,): the facet that bounds each reference coordinate from below and above (of a simplex the
    last entry of ``upper`` is the facet sum(xi) = 1)."""

    behind: np.ndarray
    lower: np.ndarray
    upper: np.ndarray


def lattice_numbers(x, lower, h, counts, simplices, margin, number):
    """Number of the cell of a ``Lattice`` (its fields) of each point into ``number``, NOWHERE outside."""
    for p in range(len(x)):
        c, stride, f = 0, 1, (0.0, 0.0, 0.0)
        for d in range(D):
            s, count = (x[p, d] - lower[d]) / h[d], counts[d]
            i = int(math.floor(s))
            if i == count and s <= count + margin[d, 1]:
                i -= 1  # the far edge belongs to the last cell
            elif i == -1 and s >= -margin[d, 0]:
                i = 0
            if not 0 <= i < count:  # also catches NaN
                c = NOWHERE
                break
            c += stride * i
            stride *= count
            f = put(f, d, s - i)
        if c >= 0 and simplices > 1:
            first = 1 if f[1] > f[0] else 0
            if D == 3:
                if f[2] > f[first]:
                    first = 2
                a, b = (1 if first == 0 else 0), (1 if first == 2 else 2)
                first = 2 * first + (1 if f[b] > f[a] else 0)
            c = simplices * c + first
        number[p] = c


@compiled
def locate_lattice(number, owner, local, row, rank, cell):
    """Local cell of each point from its number; whether any point is not of this rank, and whether any lies
    in a cell without a ``row``, see ``active_cells``."""
    leaving = 0
    inactive = 0
    for p in range(len(number)):
        c = number[p]
        if c == NOWHERE or owner[c] != rank:
            leaving = 1
            continue
        cell[p] = local[c]
        if row[cell[p]] < 0:
            inactive = 1
    return leaving, inactive


def walk(x, cell, maps: CellMaps, neighbours: Neighbours, most, tolerance, found):
    """Cell of each point by walking from ``cell`` over the facet that the point violates most.

    most: steps before giving up; tolerance: of a cell's size, by which it may lie outside. Fills ``found``
    with the cell, or -1 when not reached.
    """
    corner, inverse = maps
    neighbour, facet_of_lower, facet_of_upper = neighbours
    place = ReferencePoint(np.empty(D), np.empty((D, D)), np.empty(K), np.empty((K, D)), np.empty((D, D)))
    xi = place.xi
    for p in range(len(x)):
        c = cell[p]
        reached = False
        for _ in range(most):
            if c < 0:
                break
            to_reference(p, c, x, maps, place)
            far = xi[0] != xi[0]
            # Newton's method fails far away: the linear map tells the direction
            for i in range(D if far else 0):
                xi[i] = 0.5
                for j in range(D):
                    for a in range(K):
                        xi[i] += inverse[c, i, j] * (x[p, j] - corner[c, a, j]) / K
            total, worst = 0.0, -tolerance
            facet = -1
            for i in range(D):
                total += xi[i]
                if xi[i] < worst:
                    worst, facet = xi[i], facet_of_lower[i]
                if K != D + 1 and 1.0 - xi[i] < worst:
                    worst, facet = 1.0 - xi[i], facet_of_upper[i]
            if K == D + 1 and 1.0 - total < worst:
                facet = facet_of_upper[D]
            if total != total:
                break  # not a number: no place at all
            if facet < 0:
                reached = not far
                break
            c = neighbour[c, facet]
        found[p] = c if reached else -1


def holds(x, cell, maps: CellMaps, tolerance, answer):
    """Fill ``answer``: whether each point lies in its cell, or beside it by less than ``tolerance`` sizes."""
    place = ReferencePoint(np.empty(D), np.empty((D, D)), np.empty(K), np.empty((K, D)), np.empty((D, D)))
    xi = place.xi
    for p in range(len(x)):
        to_reference(p, cell[p], x, maps, place)
        total = 0.0
        inside = True
        for i in range(D):
            total += xi[i]
            inside = inside and xi[i] >= -tolerance and (K == D + 1 or xi[i] <= 1.0 + tolerance)
        answer[p] = inside and (K != D + 1 or total <= 1.0 + tolerance)
