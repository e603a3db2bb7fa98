"""Neighbour lists: spheres near each other, wall elements near spheres."""
from typing import NamedTuple

import numpy as np

from ..compiled import compiled
from ..scene.tables import DEPTH, RADIUS
from .elements import MovingWall, closest, corners_of
from .squares import add_still, box_of, far, longest

FEW = 32  # up to so many spheres all pairs are looked at: sorting them into cells would cost more


class NeighbourList(NamedTuple):
    """Per sphere i the partners start[i]..start[i + 1], rising: other spheres, or elements of walls."""

    start: np.ndarray  # (n + 1,)
    partner: np.ndarray  # (p,)
    active: np.ndarray  # whether they touched in the last step, (p,); (0,) without friction
    shear: np.ndarray  # displacements of the springs [m], three of each, (p, 3), (p, 6); (0, 3) without


class NeighbourLists(NamedTuple):
    """Both lists, good until centres and wall nodes have moved by ``skin`` in all since they were built."""

    spheres: NeighbourList
    elements: NeighbourList
    x: np.ndarray  # centres when they were built [m], (n, 3)
    wall: np.ndarray  # nodes that may move, then [m], (m, 3)
    skin: float  # [m]


class Query(NamedTuple):
    """What a search for contacts of spheres with walls needs, the same for all spheres in one step."""

    near: NeighbourList  # of elements
    wall: MovingWall
    t: float  # time in the window [s]
    found: np.ndarray  # room for candidates, those of one sphere and one row more, (…, COLUMNS)
    corner: np.ndarray  # room for the corners of an element, (3, 3)


@compiled
def no_neighbours(spheres):
    """A list without partners."""
    return NeighbourList(np.zeros(spheres + 1, np.int64), np.zeros(0, np.int64), np.zeros(0, np.bool_),
                         np.zeros((0, 3)))


@compiled
def springs_in(near):
    """How many springs each contact of a list has, see `Interaction.springs`; 0 for an empty list."""
    return near.shear.shape[1] // 3 if len(near.shear) else 0


@compiled
def sort_into_cells(x, size):
    """Cells no smaller than ``size`` [m] and not many more than spheres: cell of each centre (n, 3), number
    of cells per axis (3,), first sphere of each cell, next sphere in the same cell (-1: none)."""
    n, shape, at = len(x), np.ones(3, np.int64), np.zeros((len(x), 3), np.int64)
    for k in range(3):
        low, high = x[:, k].min(), x[:, k].max()
        if n > FEW and np.isfinite(high - low):
            shape[k] = max(1, min(int((high - low) / size), 2 * n // (shape[0] * shape[1])))
            for i in range(n):
                if shape[k] > 1:
                    at[i, k] = max(0, min(int((x[i, k] - low) / (high - low) * shape[k]), shape[k] - 1))
    first, following = np.full(shape[0] * shape[1] * shape[2], -1, np.int64), np.empty(n, np.int64)
    for i in range(n):
        cell = (at[i, 0] * shape[1] + at[i, 1]) * shape[2] + at[i, 2]
        following[i], first[cell] = first[cell], i
    return at, shape, first, following


@compiled
def _sort(partner, first, end):
    """Put partner[first..end] in rising order; there are few."""
    for q in range(first + 1, end):
        o, value = q, partner[q]
        while o > first and partner[o - 1] > value:
            partner[o] = partner[o - 1]
            o -= 1
        partner[o] = value


@compiled
def near_spheres(x, radius, cluster, skin, old, springs):
    """List of the partners j > i of each of the spheres of the ``old`` list, the first ones of all, whose gap
    is less than ``skin`` [m], none of the same ``cluster``; springs: how many of each contact it keeps, see
    `with_history`."""
    n, count, rows = len(x), 0, len(old.start) - 1
    start, partner = np.zeros(rows + 1, np.int64), np.empty(64, np.int64)
    if n > 1:
        at, shape, first, following = sort_into_cells(x, 2.0 * radius.max() + skin)
    for i in range(rows if n > 1 else 0):
        for a in range(max(at[i, 0] - 1, 0), min(at[i, 0] + 2, shape[0])):
            for b in range(max(at[i, 1] - 1, 0), min(at[i, 1] + 2, shape[1])):
                for c in range(max(at[i, 2] - 1, 0), min(at[i, 2] + 2, shape[2])):
                    j = first[(a * shape[1] + b) * shape[2] + c]
                    while j > i:
                        dx, dy, dz = x[i, 0] - x[j, 0], x[i, 1] - x[j, 1], x[i, 2] - x[j, 2]
                        if dx * dx + dy * dy + dz * dz < (radius[i] + radius[j] + skin) ** 2 and \
                                (cluster[i] < 0 or cluster[i] != cluster[j]):
                            if count == len(partner):
                                partner = np.append(partner, partner)  # room for twice as many
                            partner[count] = j
                            count += 1
                        j = following[j]
        _sort(partner, start[i], count)
        start[i + 1] = count
    return with_history(start, partner[:count], old, springs)


@compiled
def near_elements(x, radius, skin, wall, t, old, springs):
    """List of the elements that each of the spheres of the ``old`` list, the first ones of all (centres x
    [m], shape (n, 3)), may touch after a way of ``skin`` [m]: those nearer than its radius, or than the depth
    of a one-sided wall."""
    x, radius = x[:len(old.start) - 1], radius[:len(old.start) - 1]
    loose, sorted_ones = wall.squares.loose, len(wall.squares.element) > 0
    low, high = boxes(wall, t, loose)
    start, partner, count = np.zeros(len(x) + 1, np.int64), np.empty(64, np.int64), 0
    deepest = disc = 0.0
    for e in loose:
        deepest, disc = max(deepest, wall.traits[e, DEPTH]), max(disc, wall.traits[e, RADIUS])
    some = _around(x, max(radius.max(), deepest) + disc + skin if len(x) else 0.0, low, high)
    axis, nodes = longest(low[some], high[some]), wall.elements.shape[1]
    order = some[np.argsort(low[some, axis])]
    lowest, widest = low[order, axis], (high[some, axis] - low[some, axis]).max() if len(some) else 0.0
    corner, weight, point, box = np.empty((3, 3)), np.empty(3), np.empty(3), np.empty((2, 3))
    for i in range(len(x)):
        most = max(radius[i], deepest) + disc + skin
        for o in range(np.searchsorted(lowest, x[i, axis] - most - widest), len(order)):
            e = loose[order[o]]
            reach = max(radius[i], wall.traits[e, DEPTH]) + wall.traits[e, RADIUS] + skin
            if lowest[o] > x[i, axis] + most:
                break
            box[0], box[1] = low[order[o]], high[order[o]]
            if far(box, x[i], reach):
                continue
            corners_of(wall, e, t, corner)
            if closest(corner, nodes, x[i], weight, point)[0] <= reach:
                if count == len(partner):
                    partner = np.append(partner, partner)  # room for twice as many
                partner[count] = e
                count += 1
        if sorted_ones:
            partner, count = add_still(wall, x[i], radius[i], skin, partner, count)
        _sort(partner, start[i], count)
        start[i + 1] = count
    return with_history(start, partner[:count], old, springs)


@compiled
def _around(x, reach, low, high):
    """Numbers of the boxes that come nearer than ``reach`` [m] to the box around all x: most elements of a
    large wall do not."""
    out, n = np.empty(len(low), np.int64), 0
    for e in range(len(low) if len(x) else 0):
        out[n] = e
        n += 1
    for k in range(3):
        kept = 0
        least, most = (x[:, k].min() - reach, x[:, k].max() + reach) if n else (0.0, 0.0)
        for q in range(n):
            if low[out[q], k] <= most and high[out[q], k] >= least:
                out[kept] = out[q]
                kept += 1
        n = kept
    return out[:n]


@compiled
def boxes(wall, t, which):
    """Lowest and highest corner of the box around each of the elements ``which`` at time t [s], both [m],
    shape (m, 3)."""
    corner, box = np.empty((3, 3)), np.empty((2, 3))
    low, high = np.empty((len(which), 3)), np.empty((len(which), 3))
    for i in range(len(which)):
        box_of(wall, which[i], t, corner, box)
        low[i], high[i] = box[0], box[1]
    return low, high


@compiled
def with_history(start, partner, old, springs):
    """A new list that remembers what the ``old`` one knew of the pairs in both: ``springs`` of each."""
    size = len(partner) if springs else 0
    near = NeighbourList(start, partner, np.zeros(size, np.bool_), np.zeros((size, 3 * max(springs, 1))))
    if springs:
        for i in range(len(old.start) - 1):
            for o in range(old.start[i], old.start[i + 1]):
                for q in range(start[i], start[i + 1]):
                    if partner[q] == old.partner[o]:
                        near.active[q] = old.active[o]
                        near.shear[q] = old.shear[o]
    return near
