"""Elements of a wall: segments, triangles or discs, and their points closest to a centre.

Geometry only, no contact law. All points have three components; a plane scene lies in z = 0.
"""
from typing import NamedTuple

import numpy as np

from ..compiled import compiled
from ..scene.tables import WallTable

# Columns of a row of `Query.found`: from the centre to the closest point [m], its weights on the nodes,
# distance [m] (negative behind a one-sided wall or in a disc), feature (0 inside, 1 on an edge, 2 at a
# vertex), position in the neighbour list, of one-sided walls how far the centre is outside of the element's
# plane [m rad]; share of the force that the nearest of the contacts that share it would have alone, and the
# distance of that one [m].
POINT, WEIGHT, DISTANCE, FEATURE, PAIR, SIDE, SHARE, NEAREST, COLUMNS = 0, 3, 6, 7, 8, 9, 10, 11, 12


class Squares(NamedTuple):
    """Elements that do not move, in squares of a plane along two axes, see `squares`."""

    start: np.ndarray  # where each square begins in ``element``, the second axis fastest, and the end
    element: np.ndarray  # those that reach into it
    axes: np.ndarray  # the two axes, how many squares along each, (4,)
    frame: np.ndarray  # lower corner, side, largest depth, largest disc of the elements in squares [m], (5,)
    loose: np.ndarray  # all other elements, in rising order


class MovingWall(NamedTuple):
    """The walls of a scene, whose nodes move along x + v t during a window."""

    x: np.ndarray  # nodes at the start of the window [m], (n, 3)
    v: np.ndarray  # [m/s], (n, 3)
    elements: np.ndarray  # as in `tables.WallTable`
    traits: np.ndarray
    moving: np.ndarray  # numbers of the nodes that may move
    squares: Squares


def at_rest(table: WallTable, x: np.ndarray) -> MovingWall:
    """The walls ``table`` with their nodes at x [m], not moving; none of their elements in squares."""
    loose = np.arange(len(table.elements))
    return MovingWall(x, np.zeros_like(x), table.elements, table.traits, loose[:0], no_squares(loose))


def no_squares(loose: np.ndarray) -> Squares:
    """No squares: the elements ``loose`` are all that there are."""
    return Squares(np.zeros(2, np.int64), np.zeros(0, np.int32), np.array([0, 1, 1, 1]), np.zeros(5), loose)


@compiled
def corners_of(wall, e, t, corner):
    """Corners of element ``e`` at time t [s] of the window, into corner [m], shape (3, 3)."""
    for a in range(wall.elements.shape[1]):
        node = wall.elements[e, a]
        for k in range(3):
            corner[a, k] = wall.x[node, k] + wall.v[node, k] * t


@compiled
def closest_on_segment(corner, p, weight):
    """Weights of the point of a segment closest to p; returns the feature (an end counts as an edge: the
    segment is the cut through a strip)."""
    along, length2 = 0.0, 0.0
    for k in range(3):
        ab = corner[1, k] - corner[0, k]
        along += (p[k] - corner[0, k]) * ab
        length2 += ab * ab
    s = min(max(along / length2, 0.0), 1.0) if length2 > 0.0 else 0.0
    weight[0], weight[1], weight[2] = 1.0 - s, s, 0.0
    return 0 if 0.0 < s < 1.0 else 1


@compiled
def _weights(weight, a, b, c, feature):
    weight[0], weight[1], weight[2] = a, b, c
    return feature


@compiled
def closest_on_triangle(corner, p, weight):
    """Weights of the point of a triangle closest to p; returns the feature. Ericson, Real-Time Collision
    Detection (2005), section 5.1.5."""
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
        return _weights(weight, 1.0, 0.0, 0.0, 2)
    if d3 >= 0.0 and d4 <= d3:
        return _weights(weight, 0.0, 1.0, 0.0, 2)
    vc = d1 * d4 - d3 * d2
    if vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        s = d1 / (d1 - d3)
        return _weights(weight, 1.0 - s, s, 0.0, 1)
    if d6 >= 0.0 and d5 <= d6:
        return _weights(weight, 0.0, 0.0, 1.0, 2)
    vb = d5 * d2 - d1 * d6
    if vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        s = d2 / (d2 - d6)
        return _weights(weight, 1.0 - s, 0.0, s, 1)
    va = d3 * d6 - d5 * d4
    if va <= 0.0 and d4 >= d3 and d5 >= d6:
        s = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        return _weights(weight, 0.0, 1.0 - s, s, 1)
    v, w = vb / (va + vb + vc), vc / (va + vb + vc)
    return _weights(weight, 1.0 - v - w, v, w, 0)


@compiled
def closest(corner, nodes, p, weight, point):
    """Closest point of an element with 2 or 3 nodes, as a vector from p [m]; returns (distance [m],
    feature)."""
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
def normal_and_angle(corner, nodes, weight):
    """Unit normal of an element to the outside and the angle the element fills at the point with these
    weights [rad]."""
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
def distance_and_side(p, wall, tolerance):
    """Distance [m] of p from the wall (of a disc: from its centre), its side (positive outside, negative
    inside, NaN of discs), the closest element and the weights of the closest point on its nodes.

    The side is taken from the sum of the normals of all elements that hold the closest point (within
    ``tolerance`` [m]), in space weighted with their angles there, which makes it right at edges and vertices
    too (Baerentzen and Aanaes, IEEE TVCG 11 (2005) 243-253).
    """
    corner, weight, point = np.zeros((3, 3)), np.zeros(3), np.empty(3)
    nodes, nearest, shortest = wall.elements.shape[1], 0, np.inf
    for e in range(len(wall.elements)):
        corners_of(wall, e, 0.0, corner)
        r = closest(corner, nodes, p, weight, point)[0]
        if r < shortest:
            nearest, shortest = e, r
    outside = 0.0
    for e in range(len(wall.elements)):
        corners_of(wall, e, 0.0, corner)
        if closest(corner, nodes, p, weight, point)[0] <= shortest + tolerance:
            a, b, c, share = normal_and_angle(corner, nodes, weight)
            outside -= share * (a * point[0] + b * point[1] + c * point[2])
    corners_of(wall, nearest, 0.0, corner)
    closest(corner, nodes, p, weight, point)
    return shortest, outside, nearest, weight
