"""Chains of particles in the plane, linked by segments a→b: what is removed from them, where they cross.

``following`` and ``before``, shape (n,), link each particle with its neighbours in its chain: NONE beyond an
end; both are NONE for a particle that is gone. A chain may be open or closed; the outside is on its left.
"""
from typing import NamedTuple

import numpy as np

from ..compiled import compiled

NONE = -1
FOLD = np.cos(np.radians(15.0))  # two segments that leave a particle at a smaller angle are a fold


@compiled
def links(elements, n):
    """``following`` and ``before`` of the n particles of segments a→b, shape (m, 2)."""
    following, before = np.full(n, NONE), np.full(n, NONE)
    for e in range(len(elements)):
        following[elements[e, 0]], before[elements[e, 1]] = elements[e, 1], elements[e, 0]
    return following, before


@compiled
def remove(i, following, before):
    """Take particle i out of its chain."""
    a, c = before[i], following[i]
    if a != NONE:
        following[a] = c
    if c != NONE:
        before[c] = a
    following[i] = before[i] = NONE


def end_of(following, before, last):
    """The last or the first particle of the open chain; NONE when there is no such chain."""
    ends = np.flatnonzero((following == NONE) & (before != NONE) if last
                          else (before == NONE) & (following != NONE))
    return ends[0] if len(ends) else NONE


@compiled
def deviation(x, a, i, c):
    """Twice the area [m^2] that the outline loses or gains when it goes from a to c without i."""
    return abs((x[i, 0] - x[a, 0]) * (x[c, 1] - x[a, 1]) - (x[i, 1] - x[a, 1]) * (x[c, 0] - x[a, 0]))


@compiled
def folded(x, a, i, c):
    """Whether the outline turns back at i."""
    ux, uy, vx, vy = x[a, 0] - x[i, 0], x[a, 1] - x[i, 1], x[c, 0] - x[i, 0], x[c, 1] - x[i, 1]
    along = ux * vx + uy * vy
    return along > 0.0 and along * along > FOLD * FOLD * (ux * ux + uy * uy) * (vx * vx + vy * vy)


@compiled
def thin_out(x, following, before, stays, shortest):
    """Remove particles that do not ``stay``, that are folds, or that bound segments below ``shortest`` [m]:
    of these the one that changes the shape less. Ends of open chains remain. Returns whether any is gone."""
    changed = False
    for i in range(len(x)):
        if not stays[i] and following[i] != NONE and before[i] != NONE:
            remove(i, following, before)
            changed = True
    for start in range(len(x)):
        i = start
        while i != NONE:
            a, c, back = before[i], following[i], i
            i = NONE
            if c == NONE or a == c:
                continue
            inner, d = a != NONE, following[c]
            if inner and folded(x, a, back, c):
                remove(back, following, before)
                i = a
            elif np.hypot(x[c, 0] - x[back, 0], x[c, 1] - x[back, 1]) < shortest:
                if inner and (d == NONE or deviation(x, a, back, c) < deviation(x, back, c, d)):
                    remove(back, following, before)
                    i = a
                elif d != NONE:
                    remove(c, following, before)
                    i = back
            changed = changed or i != NONE
    return changed


class Floor(NamedTuple):
    """Across which ``axis`` it lies, at which ``level`` [m], which way (1 or -1) is ``inward``, and how far
    above it a foot may ``reach`` [m]."""

    axis: int
    level: float
    inward: float
    reach: float


@compiled
def foremost(x, step, end, floor, out, loaded):
    """The particle farthest to the side ``out`` of those linked to ``end`` within reach of the ``floor``."""
    axis = floor.axis
    nose = i = end
    while i != NONE and not loaded[i] and floor.inward * (x[i, axis] - floor.level) <= floor.reach:
        if out * (x[i, 1 - axis] - x[nose, 1 - axis]) > 0.0:
            nose = i
        i = step[i]
    return nose


@compiled
def crossing(x, following):
    """First particles of two segments that cross, or (NONE, NONE)."""
    first = np.flatnonzero(following != NONE)
    low, high = x[first].copy(), x[first].copy()
    for s in range(len(first)):
        for k in range(2):
            other = x[following[first[s]], k]
            low[s, k], high[s, k] = min(low[s, k], other), max(high[s, k], other)
    order = np.argsort(low[:, 0])
    for o in range(len(order)):
        s = order[o]
        for q in range(o + 1, len(order)):
            r = order[q]
            if low[r, 0] > high[s, 0]:
                break
            if low[r, 1] <= high[s, 1] and high[r, 1] >= low[s, 1]:
                a, b, c, d = first[s], following[first[s]], first[r], following[first[r]]
                if b != c and a != d and _sides(x, a, b, c, d) and _sides(x, c, d, a, b):
                    return a, c
    return NONE, NONE


@compiled
def _sides(x, a, b, c, d):
    """Whether c and d lie on different sides of the line a b."""
    ux, uy = x[b, 0] - x[a, 0], x[b, 1] - x[a, 1]
    of_c = ux * (x[c, 1] - x[a, 1]) - uy * (x[c, 0] - x[a, 0])
    of_d = ux * (x[d, 1] - x[a, 1]) - uy * (x[d, 0] - x[a, 0])
    return of_c * of_d < 0.0


@compiled
def untie(x, following, before, touched):
    """Where two segments cross, each goes on as the other did: a chain is cut into two, or two chains become
    one, with the outside still on their left. Marks the particles ``touched``; returns the number of
    crossings."""
    count = 0
    while count < len(x):
        a, c = crossing(x, following)
        if a == NONE:
            break
        b, d = following[a], following[c]
        following[a], following[c], before[d], before[b] = d, b, a, c
        touched[a] = touched[b] = touched[c] = touched[d] = True
        count += 1
    return count


@compiled
def drop_loops(x, following, before, touched, smallest):
    """Remove closed chains with ``touched`` particles that are air (they run counter-clockwise), or body of
    less than ``smallest`` [m^2]."""
    seen = np.zeros(len(x), np.bool_)
    for start in range(len(x)):
        if not touched[start] or seen[start]:
            continue
        area, i = 0.0, start
        while i != NONE and not seen[i]:
            seen[i], c = True, following[i]
            if c != NONE:
                area += 0.5 * (x[i, 0] * x[c, 1] - x[i, 1] * x[c, 0])
            i = c
        if i == start and area > -smallest:
            while following[start] != NONE:
                remove(following[start], following, before)


@compiled
def in_order(following, before):
    """Particles chain by chain, open ones first, shape (k,), and the place of each follower in that order or
    NONE. Closed chains of less than three are left out."""
    n, count = len(following), 0
    order, after, seen = np.empty(n, np.int64), np.empty(n, np.int64), np.zeros(n, np.bool_)
    for closed in (False, True):
        for start in range(n):
            if seen[start] or following[start] == NONE or (not closed and before[start] != NONE):
                continue
            first, i = count, start
            while i != NONE and not seen[i]:
                order[count], after[count], seen[i] = i, count + 1, True
                count, i = count + 1, following[i]
            after[count - 1] = first if closed else NONE
            if closed and count - first < 3:
                count = first
    return order[:count], after[:count]
