"""A sphere against a wall of segments, triangles or discs: closest points, the double hierarchy, one-sided walls.

Geometry only, no contact law. All points have three components; a plane scene lies in z = 0.
"""
from collections import namedtuple

import numpy as np
from numba import njit

# A division by zero gives NaN, which `advance` reports with its place. numba's cache does not see that a function
# called from another file has changed: after editing this file, near.py, contact.py or rigid.py, touch verlet.py.
compiled = njit(cache=True, error_model="numpy")

COPLANAR = np.cos(np.radians(1.0))  # two contacts whose normals differ by less than this are one contact
TINY = 1e-8  # distance, as a fraction of the radius, below which the element's own normal tells the direction

# nodes x [m] and v [m/s], shape (n, 3), at the start of the window; elements, shape (m, 2) or (m, 3), a disc names its
# node that often; traits of each element, shape (m, 7): number of its material, of its wall, depth [m] as in
# `scene.Wall` or -1, radius of a disc [m] or 0, and three truth values: in a plane which node is a free end, in space
# opposite to which node the edge is free
MovingWall = namedtuple("MovingWall", "x v elements traits")
KIND, GROUP, DEPTH, RADIUS, RIM = 0, 1, 2, 3, 4

# Columns of a row of `found`: from the centre to the closest point [m], its weights on the nodes, distance [m]
# (negative behind a one-sided wall or in a disc), feature (0 inside, 1 on an edge, 2 at a vertex), position in the
# list `near.Near`, of one-sided walls how far the centre is outside of the element's plane [m rad].
POINT, WEIGHT, DISTANCE, FEATURE, PAIR, SIDE, COLUMNS = 0, 3, 6, 7, 8, 9, 10


def at_rest(surface, nodes):
    """The walls ``surface`` (`parts.Surface`) with their nodes here [m], not moving."""
    return MovingWall(nodes, np.zeros_like(nodes), surface.elements, surface.traits)


@compiled
def place(wall, e, t, corner):
    """Corners of element ``e`` at time t [s] of the window, into corner [m], shape (3, 3)."""
    for a in range(wall.elements.shape[1]):
        node = wall.elements[e, a]
        for k in range(3):
            corner[a, k] = wall.x[node, k] + wall.v[node, k] * t


@compiled
def closest_on_segment(corner, p, weight):
    """Weights of the point of a segment closest to p; returns the feature (an end counts as an edge: the segment is
    the cut through a strip)."""
    along, length2 = 0.0, 0.0
    for k in range(3):
        ab = corner[1, k] - corner[0, k]
        along += (p[k] - corner[0, k]) * ab
        length2 += ab * ab
    s = min(max(along / length2, 0.0), 1.0) if length2 > 0.0 else 0.0
    weight[0], weight[1], weight[2] = 1.0 - s, s, 0.0
    return 0 if 0.0 < s < 1.0 else 1


@compiled
def _set(weight, a, b, c, feature):
    weight[0], weight[1], weight[2] = a, b, c
    return feature


@compiled
def closest_on_triangle(corner, p, weight):
    """Weights of the point of a triangle closest to p; returns the feature. Ericson, Real-Time Collision Detection
    (2005), section 5.1.5."""
    d1 = d2 = d3 = d4 = d5 = d6 = 0.0
    for k in range(3):
        ab, ac = corner[1, k] - corner[0, k], corner[2, k] - corner[0, k]
        d1 += ab * (p[k] - corner[0, k])
        d2 += ac * (p[k] - corner[0, k])
        d3 += ab * (p[k] - corner[1, k])
        d4 += ac * (p[k] - corner[1, k])
        d5 += ab * (p[k] - corner[2, k])
        d6 += ac * (p[k] - corner[2, k])
    if d1 <= 0.0 and d2 <= 0.0:
        return _set(weight, 1.0, 0.0, 0.0, 2)
    if d3 >= 0.0 and d4 <= d3:
        return _set(weight, 0.0, 1.0, 0.0, 2)
    vc = d1 * d4 - d3 * d2
    if vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        s = d1 / (d1 - d3)
        return _set(weight, 1.0 - s, s, 0.0, 1)
    if d6 >= 0.0 and d5 <= d6:
        return _set(weight, 0.0, 0.0, 1.0, 2)
    vb = d5 * d2 - d1 * d6
    if vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        s = d2 / (d2 - d6)
        return _set(weight, 1.0 - s, 0.0, s, 1)
    va = d3 * d6 - d5 * d4
    if va <= 0.0 and d4 >= d3 and d5 >= d6:
        s = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        return _set(weight, 0.0, 1.0 - s, s, 1)
    v, w = vb / (va + vb + vc), vc / (va + vb + vc)
    return _set(weight, 1.0 - v - w, v, w, 0)


@compiled
def closest(corner, nodes, p, weight, point):
    """Closest point of an element with 2 or 3 nodes, as a vector from p [m]; returns (distance [m], feature)."""
    if nodes == 2:
        feature = closest_on_segment(corner, p, weight)
    else:
        feature = closest_on_triangle(corner, p, weight)
    r2 = 0.0
    for k in range(3):
        point[k] = -p[k]
        for a in range(nodes):
            point[k] += weight[a] * corner[a, k]
        r2 += point[k] * point[k]
    return np.sqrt(r2), feature


@compiled
def find_contacts(p, radius, near, i, wall, t, corner, found):
    """Contacts of the sphere i at p [m] with the walls at time t [s], in the first rows of ``found`` (see the columns
    above), wall by wall and nearest first; returns their number."""
    total, q, last, nodes = 0, near.start[i], near.start[i + 1], wall.elements.shape[1]
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
        if depth >= 0.0:
            total = one_sided(found, total, n, radius, depth)
        elif disc == 0.0 and n > total + 1:
            total = double_hierarchy(found, total, n, radius)
        else:
            total = n
    return total


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
def normal_and_angle(corner, nodes, weight):
    """Unit normal of an element to the outside and the angle the element fills at the point with these weights
    [rad]."""
    ax, ay, az = corner[1, 0] - corner[0, 0], corner[1, 1] - corner[0, 1], corner[1, 2] - corner[0, 2]
    if nodes == 2:
        length = np.sqrt(ax * ax + ay * ay)
        return -ay / length, ax / length, 0.0, np.pi
    bx, by, bz = corner[2, 0] - corner[0, 0], corner[2, 1] - corner[0, 1], corner[2, 2] - corner[0, 2]
    x, y, z = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    area = np.sqrt(x * x + y * y + z * z)
    angle = np.pi
    for a in range(3):
        if weight[a] == 1.0:
            angle = _angle(corner, a)
    return x / area, y / area, z / area, angle


@compiled
def _angle(corner, a):
    """Angle of a triangle at its corner a [rad]."""
    uu = vv = uv = 0.0
    for k in range(3):
        u, v = corner[(a + 1) % 3, k] - corner[a, k], corner[(a + 2) % 3, k] - corner[a, k]
        uu, vv, uv = uu + u * u, vv + v * v, uv + u * v
    return np.arccos(uv / np.sqrt(uu * vv))


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
