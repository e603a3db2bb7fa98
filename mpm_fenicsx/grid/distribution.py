"""Distribution of the background grid: which rank has which cell, by recursive bisection.

Along the axis on which the cells with points spread farthest, they are cut in two so that the weights on both
sides go with the numbers of ranks, and so on. Weights are whole numbers: their sums are exact, and the cuts
do not depend on how many ranks look for them.
"""
from typing import NamedTuple

import numpy as np
from mpi4py import MPI

from ..compiled import compiled

EMPTY_CELL, POINT = 1, 50  # weight of a cell without points, and of a point in one
DIGITS = 12  # of a coordinate [m]: what is nearer lies level
LAST = np.iinfo(np.int64).max


def bisect(centres, weights, ranks, patch=None):
    """Recursive coordinate bisection: the rank of each cell, shape (n,), so that every rank gets about the
    same sum of ``weights``. Ties are broken by the cell's number, so the answer does not depend on who asks.
    patch: (n,) numbers of groups of cells that must not be cut, or None."""
    if patch is not None:
        size = np.bincount(patch)
        middle = np.stack([np.bincount(patch, x) / size for x in centres.T], axis=1)
        return bisect(middle, np.bincount(patch, weights), ranks)[patch]
    owner = np.zeros(len(centres), np.int32)

    def split(members, first, count):
        if count == 1:
            owner[members] = first
            return
        heavy = members[weights[members] > weights.min()]
        spread = np.ptp(centres[heavy if len(heavy) else members], axis=0) if len(members) else np.zeros(1)
        axis = int(np.argmax(spread))
        order = members[np.lexsort((members, np.round(centres[members, axis], DIGITS)))]
        filling = np.cumsum(weights[order])
        half = count // 2
        cut = np.searchsorted(filling, filling[-1] * half / count) + 1 if len(order) else 0
        split(order[:cut], first, half)
        split(order[cut:], first + half, count - half)

    split(np.arange(len(centres)), 0, ranks)
    return owner


class Cells(NamedTuple):
    """The cells of this rank: one of several slices of all, in their order."""

    centres: np.ndarray  # [m], (n, D)
    weights: np.ndarray  # whole numbers, (n,)
    first: int  # number of the first one


def bisect_together(comm, cells):
    """The same of ``Cells`` of which each rank has its own, for as many ranks as there are: the rank of each
    of this rank's cells, (n,). None looks at more than its own. Collective."""
    n = len(cells.weights)
    part, number = np.zeros(n, np.int64), cells.first + np.arange(n)
    first, count = np.zeros(1, np.int64), np.full(1, comm.size)  # of each part: its ranks
    heavy = cells.weights > comm.allreduce(int(cells.weights.min(initial=LAST)), MPI.MIN)
    while count.max() > 1:
        axis = _axes(comm, cells.centres, heavy, part, len(count))
        key = _sortable(np.round(cells.centres[np.arange(n), axis[part]], DIGITS))
        half = count // 2
        last_key, last_number = _cuts(comm, (part, key, number, cells.weights), half, count)
        after = (key > last_key[part]) | ((key == last_key[part]) & (number > last_number[part]))
        part = 2 * part + (after & (count > 1)[part])
        whole = count == 1
        first = np.stack([first, first + half], axis=1).ravel()
        count = np.stack([np.where(whole, 1, half), np.where(whole, 0, count - half)], axis=1).ravel()
    return first[part].astype(np.int32)


def _axes(comm, centres, heavy, part, parts):
    """Along which the heavy cells of each part, or all if there are none, spread farthest, (parts,)."""
    D = centres.shape[1]
    high = np.full((2, 2, parts, D), -np.inf)  # heavy or all, their largest and largest negative coordinates
    _extremes(centres, heavy, part, high)
    comm.Allreduce(MPI.IN_PLACE, high, MPI.MAX)
    spread = high.sum(axis=1)
    return np.argmax(np.where(np.isfinite(spread[0]), spread[0], spread[1]), axis=1)


def _sortable(x):
    """Whole numbers in the order of the numbers ``x``."""
    bits = np.ascontiguousarray(x + 0.0).view(np.int64)  # + 0.0: no zero with a sign
    return np.where(bits < 0, bits ^ LAST, bits)


def _cuts(comm, table, half, count):
    """Key and number of the last cell before the cut of each part: up to it, in the order of keys and
    numbers, ``half`` of ``count`` of the weight. table: part, key, number and weight of each cell."""
    part, key, number, weight = table
    order = np.lexsort((number, key, part))
    ends = np.searchsorted(part[order], np.arange(len(count) + 1))
    sums = np.concatenate([[0], np.cumsum(weight[order], dtype=np.int64)])
    base = sums[ends[:-1]]
    target = _total(comm, sums[ends[1:]] - base) * half

    def find(values, begin, end):
        """The least value with which enough is reached, among those from ``begin`` to ``end``."""
        bounds = np.full((2, len(count)), -LAST)
        inside = begin < end
        bounds[0, inside], bounds[1, inside] = -values[begin[inside]], values[end[inside] - 1]
        comm.Allreduce(MPI.IN_PLACE, bounds, MPI.MAX)
        low, high = -bounds[0] - 1, bounds[1]  # beyond the least one, and surely enough
        high = np.maximum(high, low + 1)
        while (low + 1 < high).any():
            middle = (low >> 1) + (high >> 1) + (low & high & 1)
            mass = np.empty(len(count), np.int64)
            _reached(values, sums, begin, end, middle, mass)
            enough = _total(comm, mass - base) * count >= target
            high, low = np.where(enough, middle, high), np.where(enough, low, middle)
        return high

    keys, numbers = key[order], number[order]
    last = find(keys, ends[:-1], ends[1:])
    level = np.empty((2, len(count)), np.int64)
    _level(keys, ends, last, level)
    return last, find(numbers, *level)


def _total(comm, values):
    values = np.array(values, np.int64)
    comm.Allreduce(MPI.IN_PLACE, values, MPI.SUM)
    return values


@compiled
def _extremes(centres, heavy, part, high):
    """Raise ``high``, see ``_axes``, to that of the cells."""
    for i in range(len(part)):
        for d in range(centres.shape[1]):
            x = centres[i, d]
            for kind in range(0 if heavy[i] else 1, 2):
                high[kind, 0, part[i], d] = max(high[kind, 0, part[i], d], x)
                high[kind, 1, part[i], d] = max(high[kind, 1, part[i], d], -x)


@compiled
def _reached(values, sums, begin, end, middle, mass):
    """Of each part the sum up to the last of its values, rising from ``begin`` to ``end``, that is not larger
    than its ``middle``."""
    for p in range(len(begin)):
        mass[p] = sums[begin[p] + np.searchsorted(values[begin[p]:end[p]], middle[p], side="right")]


@compiled
def _level(keys, ends, last, level):
    """Where in each part the keys that are its ``last`` one begin and end."""
    for p in range(len(last)):
        own = keys[ends[p]:ends[p + 1]]
        level[0, p] = ends[p] + np.searchsorted(own, last[p], side="left")
        level[1, p] = ends[p] + np.searchsorted(own, last[p], side="right")


def ghosts(cells, vertex_count, owner, ranks, mine):
    """For each cell of the slice ``mine``: its owner, then all other ranks with a cell at its vertices."""
    at_vertex = np.zeros((vertex_count, ranks), bool)
    at_vertex[cells.ravel(), np.repeat(owner, cells.shape[1])] = True
    sharing = at_vertex[cells[mine]].any(axis=1)
    single = sharing.sum(axis=1) == 1
    return [[o] if alone else [o, *(r for r in np.flatnonzero(row) if r != o)]
            for o, alone, row in zip(owner[mine].tolist(), single, sharing)]
