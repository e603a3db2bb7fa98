"""A sphere against a wall of segments or triangles: closest points, the double hierarchy, lists of near elements.

Geometry only, no contact law. All points have three components; a plane scene lies in z = 0.
"""
from collections import namedtuple

import numpy as np
from numba import njit

# A division by zero gives NaN, which `advance` reports with its place. numba's cache does not see that a function called
# from another file has changed: after editing this file or contact.py, touch verlet.py.
compiled = njit(cache=True, error_model="numpy")

COPLANAR = np.cos(np.radians(1.0))  # two contacts whose normals differ by less than this are one contact

# nodes x [m] and v [m/s], shape (n, 3), at the start of the window; elements, shape (m, 2) or (m, 3)
MovingWall = namedtuple("MovingWall", "x v elements")

# Per sphere i the partners start[i]..start[i+1]: partner (p,), whether they touched in the last step (p,), and the
# tangential displacement shear [m], shape (p, 3), or (0, 3) when there is no friction and so nothing to remember.
Near = namedtuple("Near", "start partner active shear")

# Columns of a row of `found`: from the centre to the closest point [m], its weights on the nodes, distance [m],
# feature (0 inside, 1 on an edge, 2 at a vertex), position in the list `Near`.
POINT, WEIGHT, DISTANCE, FEATURE, PAIR, COLUMNS = 0, 3, 6, 7, 8, 9


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
    s = min(max(along / length2, 0.0), 1.0)
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
    """Contacts of the sphere i at p [m] with the wall at time t [s], nearest first, in the first rows of ``found``
    (see the columns above); returns their number."""
    n, nodes = 0, wall.elements.shape[1]
    for q in range(near.start[i], near.start[i + 1]):
        place(wall, near.partner[q], t, corner)
        row = found[n]
        r, feature = closest(corner, nodes, p, row[WEIGHT:WEIGHT + 3], row[POINT:POINT + 3])
        if r <= radius:
            row[DISTANCE], row[FEATURE], row[PAIR] = r, feature, q
            n += 1
    return double_hierarchy(found, n, radius)


@compiled
def double_hierarchy(found, n, radius):
    """Keep the nearest candidate, drop what it makes redundant, go on with the rest; returns the number kept.

    A candidate is redundant when its point lies on or beyond the tangent plane of a nearer contact (a shared edge or
    vertex, the far side of a ridge), or in nearly the same direction (`COPLANAR`). After the double hierarchy of
    Santasusana et al., Comput. Part. Mech. 3 (2016) 407-428.
    """
    kept = 0
    while kept < n:
        best = kept
        for q in range(kept + 1, n):
            if _before(found[q], found[best], radius):
                best = q
        for k in range(COLUMNS):
            found[kept, k], found[best, k] = found[best, k], found[kept, k]
        g, r = found[kept], found[kept, DISTANCE]
        kept += 1
        left = kept
        for q in range(kept, n):
            c = found[q]
            cosine = c[0] * g[0] + c[1] * g[1] + c[2] * g[2]
            if cosine < r * r * (1.0 - 1e-9) and cosine < c[DISTANCE] * r * COPLANAR:
                found[left] = c
                left += 1
        n = left
    return kept


@compiled
def _before(a, b, radius):
    """Order of the hierarchy: nearer first; at equal distance the face before the edge before the vertex."""
    if abs(a[DISTANCE] - b[DISTANCE]) < 1e-12 * radius and a[FEATURE] != b[FEATURE]:
        return a[FEATURE] < b[FEATURE]
    if a[DISTANCE] != b[DISTANCE]:
        return a[DISTANCE] < b[DISTANCE]
    return a[PAIR] < b[PAIR]


@compiled
def near_elements(x, radius, skin, wall, t, old, history):
    """List of the elements closer to each sphere (centres x [m], shape (n, 3)) than its radius plus ``skin`` [m]."""
    nodes = wall.elements.shape[1]
    low, high = boxes(wall, t)
    start, partner, count = np.zeros(len(x) + 1, np.int64), np.empty(64, np.int64), 0
    corner, weight, point = np.empty((3, 3)), np.empty(3), np.empty(3)
    for i in range(len(x)):
        reach = radius[i] + skin
        for e in range(len(wall.elements)):
            if low[e, 0] > x[i, 0] + reach or high[e, 0] < x[i, 0] - reach or low[e, 1] > x[i, 1] + reach or \
                    high[e, 1] < x[i, 1] - reach or low[e, 2] > x[i, 2] + reach or high[e, 2] < x[i, 2] - reach:
                continue
            place(wall, e, t, corner)
            if closest(corner, nodes, x[i], weight, point)[0] <= reach:
                if count == len(partner):
                    partner = np.append(partner, partner)  # room for twice as many
                partner[count] = e
                count += 1
        start[i + 1] = count
    return with_history(start, partner[:count], old, history)


@compiled
def boxes(wall, t):
    """Lowest and highest corner of the box around each element at time t [s], both [m], shape (m, 3)."""
    corner, nodes = np.empty((3, 3)), wall.elements.shape[1]
    low, high = np.empty((len(wall.elements), 3)), np.empty((len(wall.elements), 3))
    for e in range(len(wall.elements)):
        place(wall, e, t, corner)
        for k in range(3):
            low[e, k], high[e, k] = corner[0, k], corner[0, k]
            for a in range(1, nodes):
                low[e, k], high[e, k] = min(low[e, k], corner[a, k]), max(high[e, k], corner[a, k])
    return low, high


@compiled
def with_history(start, partner, old, history):
    """A new list that remembers what the ``old`` one knew of the pairs in both."""
    size = len(partner) if history else 0
    near = Near(start, partner, np.zeros(size, np.bool_), np.zeros((size, 3)))
    if history:
        for i in range(len(old.start) - 1):
            for o in range(old.start[i], old.start[i + 1]):
                for q in range(start[i], start[i + 1]):
                    if partner[q] == old.partner[o]:
                        near.active[q] = old.active[o]
                        near.shear[q] = old.shear[o]
    return near


@compiled
def hand_over(near, i, elements, found, kept):
    """Bring the tangential history of sphere i up to date with its ``kept`` contacts.

    A contact that is new takes the history of one that has just ended on an element with a common node: the sphere
    rolled or slid across the border. LIGGGHTS does this between coplanar neighbours
    (FixContactHistoryMesh::handleContact); here it holds for ridges too, where the normal turns without a jump.
    """
    first, last = near.start[i], near.start[i + 1]
    for k in range(kept):
        q = int(found[k, PAIR])
        if near.active[q]:
            continue
        for o in range(first, last):
            if near.active[o] and not _holds(found, kept, o) and \
                    _share_a_node(elements, near.partner[o], near.partner[q]):
                near.shear[q] = near.shear[o]
    for o in range(first, last):
        near.active[o] = _holds(found, kept, o)
        if not near.active[o]:
            near.shear[o] = 0.0


@compiled
def _holds(found, kept, q):
    for k in range(kept):
        if found[k, PAIR] == q:
            return True
    return False


@compiled
def _share_a_node(elements, e, f):
    for a in range(elements.shape[1]):
        for b in range(elements.shape[1]):
            if elements[e, a] == elements[f, b]:
                return True
    return False
