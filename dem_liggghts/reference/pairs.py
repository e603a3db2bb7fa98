"""Pairs of a neighbour list, numbered as all spheres are, that go from rank to rank.

The list of a rank has its own spheres in front, rising, and those of others behind them: there the second
one of a pair may have the lower number. Springs are those of the first one, so that they change their sign
where both change places; forces and springs of a pair are the same, bit for bit, on both ranks.
"""
from typing import Any, NamedTuple, Optional

import numpy as np

from ..compiled import compiled
from ..search.neighbours import NeighbourList
from .gathering import rows_of_all


class Pairs(NamedTuple):
    """Pairs of two spheres, the lower number first, or of a sphere and an element of a wall."""

    first: np.ndarray  # (p,)
    second: np.ndarray  # (p,)
    active: np.ndarray  # as in `NeighbourList`
    shear: np.ndarray

    def some(self, which: np.ndarray) -> "Pairs":
        """Those that ``which`` names, (p,) bool or numbers."""
        springs = which if len(self.active) else slice(0, 0)
        return Pairs(self.first[which], self.second[which], self.active[springs], self.shear[springs])


def pairs_of(near: NeighbourList, number: np.ndarray, among_spheres: bool) -> Pairs:
    """Of the list of one rank, whose spheres have this ``number``, (n,). A pair of two ranks is named by the
    one that has the lower sphere."""
    first = number[np.repeat(np.arange(len(near.start) - 1), np.diff(near.start))]
    second = number[near.partner] if among_spheres else near.partner
    pairs = Pairs(first, second, near.active, near.shear)
    return pairs.some(first < second) if among_spheres else pairs


def list_of(pairs: Pairs, index: np.ndarray, rows: int, among_spheres: bool) -> NeighbourList:
    """The list of the ``rows`` first ones of spheres that have an ``index`` here, (n,), -1 for none, with
    those of the ``pairs`` whose spheres have one."""
    first, second = index[pairs.first], index[pairs.second] if among_spheres else pairs.second
    kept = (first >= 0) & (second >= 0)
    first, second, pairs = first[kept], second[kept], pairs.some(kept)
    shear = pairs.shear
    if among_spheres:
        turned = first > second
        first, second = np.where(turned, second, first), np.where(turned, first, second)
        if len(shear):
            shear = np.where(turned[:, None], -shear, shear)
    start, order = _sorted(first, second, rows)
    kept = order if len(shear) else slice(0, 0)
    return NeighbourList(start, second[order], pairs.active[kept], np.ascontiguousarray(shear[kept]))


@compiled
def _sorted(first, second, rows):
    """Where the pairs of each of the ``rows`` begin, (rows + 1,), and the order in which they come."""
    start, order = np.zeros(rows + 1, np.int64), np.empty(len(first), np.int64)
    for p in range(len(first)):
        start[first[p] + 1] += 1
    for row in range(rows):
        start[row + 1] += start[row]
    end = start[:-1].copy()
    for p in range(len(first)):
        row, o = first[p], end[first[p]]
        while o > start[row] and second[order[o - 1]] > second[p]:
            order[o] = order[o - 1]
            o -= 1
        order[o] = p
        end[row] += 1
    return start, order


def gathered(pairs: Pairs, springs: int, comm: Any) -> Pairs:
    """The pairs of all ranks, on every rank; springs: of each contact."""
    return _pairs(rows_of_all(_block(pairs, springs), comm), springs)


def routed(pairs: Pairs, springs: int, to: np.ndarray, also: Optional[np.ndarray], comm: Any) -> Pairs:
    """What all ranks have for this one: each sends its pairs to the ranks ``to``, (p,), and those of
    ``also`` where these are others."""
    rows = np.arange(len(to))
    if also is not None:
        more = np.flatnonzero(also != to)
        rows, to = np.append(rows, more), np.append(to, also[more])
    away = np.flatnonzero(to != comm.rank)  # what stays needs no message
    order = away[np.argsort(to[away], kind="stable")]
    block = _block(pairs.some(rows[order]), springs)
    sent, width = np.bincount(to[order], minlength=comm.size), block.shape[1]
    received = np.empty_like(sent)
    comm.Alltoall(sent, received)
    others = np.empty((received.sum(), width))
    comm.Alltoallv([block, sent * width], [others, received * width])
    stay, come = pairs.some(rows[to == comm.rank]), _pairs(others, springs)
    return Pairs(*(np.concatenate(both) for both in zip(stay, come)))


def _block(pairs: Pairs, springs: int) -> np.ndarray:
    """Rows of numbers; those of spheres and elements are exact in them."""
    columns = [pairs.first, pairs.second]
    return np.column_stack(columns + ([pairs.active, pairs.shear] if springs else [])).astype(float)


def _pairs(block: np.ndarray, springs: int) -> Pairs:
    first, second = block[:, :2].astype(np.int64).T
    if not springs:
        return Pairs(first, second, np.zeros(0, np.bool_), np.zeros((0, 3)))
    return Pairs(first, second, block[:, 2] > 0.0, block[:, 3:])
