"""Which of the closest points of a wall's elements are contacts of a sphere: the double hierarchy, one-sided walls.

Geometry only, no contact law. All points have three components; a plane scene lies in z = 0.
"""
import numpy as np

from .compiled import compiled
from .wall import (COLUMNS, DEPTH, DISTANCE, FEATURE, GROUP, PAIR, POINT, RADIUS, RIM, SIDE, WEIGHT, closest,
                   normal_and_angle, place)

COPLANAR = np.cos(np.radians(1.0))  # two contacts whose normals differ by less than this are one contact
TINY = 1e-8  # distance, as a fraction of the radius, below which the element's own normal tells the direction
DROPPED = -1.0  # feature of a candidate that is none


@compiled
def find_contacts(p, radius, near, i, wall, t, corner, found):
    """Contacts of the sphere i at p [m] with the walls at time t [s], in the first rows of ``found`` (see their
    columns in wall.py), wall by wall and nearest first; returns their number."""
    # np.int64: for a plain 0 numba would compile what takes it once more.
    total, q, last, nodes = np.int64(0), near.start[i], near.start[i + 1], wall.elements.shape[1]
    while q < last:
        e, n = near.partner[q], total
        group, depth, disc = wall.traits[e, GROUP], wall.traits[e, DEPTH], wall.traits[e, RADIUS]
        while q < last and wall.traits[near.partner[q], GROUP] == group:
            e, row = near.partner[q], found[n]
            place(wall, e, t, corner)
            r, feature = closest(corner, nodes, p, row[WEIGHT:WEIGHT + 3], row[POINT:POINT + 3])
            for k in range(3 if disc > 0.0 else 0):  # to the rim of the disc
                row[POINT + k] *= (r - disc) / r
            r -= disc
            if r <= max(radius, depth):
                row[DISTANCE], row[FEATURE], row[PAIR] = r, feature, q
                if depth >= 0.0:
                    row[SIDE] = _outside(row, wall.traits[e], corner, nodes, radius)
                n += 1
            q += 1
        if disc == 0.0 and n > total + 1:
            n = drop_shared(found, total, n, radius, near.partner, wall.elements)
        if depth >= 0.0:
            total = one_sided(found, total, n, radius, depth)
        elif disc == 0.0 and n > total + 1:
            total = double_hierarchy(found, total, n, radius)
        else:
            total = n
    return total


@compiled
def drop_shared(found, first, end, radius, partner, elements):
    """Of the candidates ``first``..``end`` drop those whose closest point lies on an element that comes nearer
    elsewhere: the surface goes on towards the sphere there. Returns the end of those kept.

    Without this a large overlap with a surface that is bent inwards ever so little, as below a sphere that presses on
    it, would make a contact of every vertex in reach. partner: elements of the list, by ``PAIR``; elements: their
    nodes.
    """
    for q in range(first, end):
        for g in range(first, end):
            if found[g, DISTANCE] < found[q, DISTANCE] - 1e-12 * radius and found[q, FEATURE] != 0.0 and _holds(
                    elements[partner[int(found[g, PAIR])]], elements[partner[int(found[q, PAIR])]], found[q]):
                found[q, FEATURE] = DROPPED
    kept = first
    for q in range(first, end):
        if found[q, FEATURE] != DROPPED:
            if kept < q:
                _copy(found, q, kept)
            kept += 1
    return kept


@compiled
def _holds(other, nodes, row):
    """Whether an element with the nodes ``other`` holds the closest point ``row`` of the one with ``nodes``."""
    for a in range(len(nodes)):
        if row[WEIGHT + a] != 0.0:
            held = False
            for b in range(len(other)):
                held = held or other[b] == nodes[a]
            if not held:
                return False
    return True


@compiled
def _outside(row, traits, corner, nodes, radius):
    """How far the centre is outside of the plane of an element, times the angle the element fills at the closest point
    [m rad]; infinite at a free end or edge. A centre on the element is put a little outside."""
    for k in range(nodes):
        if traits[RIM + k] > 0.0 and row[WEIGHT + k] == (1.0 if nodes == 2 else 0.0):
            return np.inf
    x, y, z, angle = normal_and_angle(corner, nodes, row[WEIGHT:WEIGHT + 3])
    if row[DISTANCE] < TINY * radius:
        tiny = TINY * radius
        row[DISTANCE], row[POINT], row[POINT + 1], row[POINT + 2] = tiny, -tiny * x, -tiny * y, -tiny * z
    return -angle * (x * row[POINT] + y * row[POINT + 1] + z * row[POINT + 2])


@compiled
def one_sided(found, first, end, radius, depth):
    """Of the candidates ``first``..``end`` keep what a wall that pushes outwards only makes of them; returns the end of
    those kept.

    The centre is outside when the elements that hold the closest point say so together (as in `checks.side`). Then
    those behind which it lies, on the far side of a finger, are dropped. Inside, the closest point alone pushes, from
    the centre towards itself, down to ``depth`` [m]; on the surface too, where the others have no direction.
    """
    if first == end:
        return first
    best, side = first, 0.0
    for q in range(first + 1, end):
        if _before(found, q, best, radius):
            best = q
    r = found[best, DISTANCE]
    for q in range(first, end):
        if found[q, DISTANCE] <= r + 1e-9 * radius:
            side += found[q, SIDE]
    if side < 0.0 or r <= TINY * radius:
        _copy(found, best, first)
        found[first, DISTANCE] = -r if side < 0.0 else r
        return first + 1 if r <= depth or side >= 0.0 else first
    kept = first
    for q in range(first, end):
        if found[q, DISTANCE] <= radius and (q == best or found[q, SIDE] >= 0.0):
            _copy(found, q, kept)
            kept += 1
    return double_hierarchy(found, first, kept, radius)


@compiled
def _copy(found, source, target):
    for k in range(COLUMNS):
        found[target, k] = found[source, k]


@compiled
def double_hierarchy(found, first, end, radius):
    """Of the candidates ``first``..``end`` keep the nearest, drop what it makes redundant, go on with the rest; returns
    the end of those kept.

    A candidate is redundant when its point lies on or beyond the tangent plane of a nearer contact (a shared edge or
    vertex, the far side of a ridge), or in nearly the same direction (`COPLANAR`). After the double hierarchy of
    Santasusana et al., Comput. Part. Mech. 3 (2016) 407-428.
    """
    kept = first
    while kept < end:
        best = kept
        for q in range(kept + 1, end):
            if _before(found, q, best, radius):
                best = q
        for k in range(COLUMNS):
            found[kept, k], found[best, k] = found[best, k], found[kept, k]
        g, r = kept, found[kept, DISTANCE]
        kept += 1
        left = kept
        for q in range(kept, end):
            cosine = found[q, 0] * found[g, 0] + found[q, 1] * found[g, 1] + found[q, 2] * found[g, 2]
            if cosine < r * r * (1.0 - 1e-9) and cosine < found[q, DISTANCE] * r * COPLANAR:
                _copy(found, q, left)
                left += 1
        end = left
    return kept


@compiled
def _before(found, a, b, radius):
    """Order of the hierarchy: nearer first; at equal distance the face before the edge before the vertex."""
    if abs(found[a, DISTANCE] - found[b, DISTANCE]) < 1e-12 * radius and found[a, FEATURE] != found[b, FEATURE]:
        return found[a, FEATURE] < found[b, FEATURE]
    if found[a, DISTANCE] != found[b, DISTANCE]:
        return found[a, DISTANCE] < found[b, DISTANCE]
    return found[a, PAIR] < found[b, PAIR]
