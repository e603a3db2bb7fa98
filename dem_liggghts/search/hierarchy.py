"""Which candidates are contacts of a sphere with a wall: the double hierarchy, one-sided walls; how contacts
share a force.

Geometry only, no contact law. The candidates are rows of `Query.found`.
"""
import numpy as np

from ..compiled import compiled
from ..scene.tables import JOINT, RIM
from .elements import (
    COLUMNS,
    DISTANCE,
    FEATURE,
    NEAREST,
    PAIR,
    POINT,
    SHARE,
    SIDE,
    WEIGHT,
    normal_and_angle,
)

COPLANAR = np.cos(np.radians(1.0))  # two contacts whose normals differ by less than this are one contact
TINY = 1e-8  # distance, as a fraction of the radius, below which the element's own normal tells the direction
JOINED = 0.01  # distance, as a fraction of the overlap, over which surfaces that meet still hang together
DROPPED = -1.0  # feature of a candidate that is none


@compiled
def drop_shared(query, first, end, radius):
    """Of the candidates ``first``..``end`` drop those whose closest point lies on an element that comes
    nearer elsewhere: the surface goes on towards the sphere there. Returns the end of those kept.

    Without this a large overlap with a surface that is bent inwards ever so little, as below a sphere that
    presses on it, would make a contact of every vertex in reach.
    """
    found, partner = query.found, query.near.partner
    for q in range(first, end):
        for g in range(first, end):
            if found[g, DISTANCE] < found[q, DISTANCE] - 1e-12 * radius and found[q, FEATURE] != 0.0:
                other, e = partner[int(found[g, PAIR])], partner[int(found[q, PAIR])]
                if _contains(query, other, e, found[q], radius):
                    found[q, FEATURE] = DROPPED
    return without_dropped(found, first, end)


@compiled
def without_dropped(found, first, end):
    """Close the gaps that the dropped ones of the rows ``first``..``end`` leave; returns the new end."""
    kept = first
    for q in range(first, end):
        if found[q, FEATURE] != DROPPED:
            if kept < q:
                _copy(found, q, kept)
            kept += 1
    return kept


@compiled
def _contains(query, other, e, row, radius):
    """Whether the element ``other`` contains the closest point ``row`` of the element e."""
    wall, tolerance = query.wall, JOINED * (radius - row[DISTANCE])
    for a in range(wall.elements.shape[1]):
        if row[WEIGHT + a] != 0.0:
            shared = False
            for b in range(wall.elements.shape[1]):
                shared = shared or _one_place(wall, query.t, other, b, e, a, tolerance)
            if not shared:
                return False
    return True


@compiled
def _one_place(wall, t, e, a, f, b, tolerance):
    """Whether the node a of the element e and b of f are the same, or were at the start and are still no
    farther apart than ``tolerance`` [m]."""
    i, j, distance2 = wall.elements[e, a], wall.elements[f, b], 0.0
    if i == j or wall.traits[e, JOINT + a] != wall.traits[f, JOINT + b]:
        return i == j
    for k in range(3):
        distance2 += (wall.x[i, k] - wall.x[j, k] + (wall.v[i, k] - wall.v[j, k]) * t) ** 2
    return distance2 <= tolerance * tolerance


@compiled
def outside(row, traits, corner, nodes, radius):
    """How far the centre is outside of the plane of an element, times the angle the element fills at the
    closest point [m rad]; infinite at a free end or edge. A centre on the element is put a little outside."""
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
    """Of the candidates ``first``..``end`` keep what a wall that pushes outwards only makes of them; returns
    the end of those kept.

    The centre is outside when the elements that contain the closest point say so together (as in
    `elements.distance_and_side`). Then those behind which it lies, on the far side of a finger, are dropped.
    Inside, the closest point alone pushes, from the centre towards itself, down to ``depth`` [m]; on the
    surface too, where the others have no direction.
    """
    if first == end:
        return first
    best, side = first, 0.0
    for q in range(first + 1, end):
        if before(found, q, best, radius):
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
    """Of the candidates ``first``..``end`` keep the nearest, drop what it makes redundant, go on with the
    rest; returns the end of those kept.

    A candidate is redundant when its point lies on or beyond the tangent plane of a nearer contact (a shared
    edge or vertex, the far side of a ridge). One in nearly the same direction (`COPLANAR`) is the same
    contact: it follows the nearer one, with which `share_force` lets it share. After the double hierarchy of
    Santasusana et al., Comput. Part. Mech. 3 (2016) 407-428.
    """
    kept = first
    while True:
        best = -1
        for q in range(kept, end):
            if found[q, FEATURE] != DROPPED and found[q, SHARE] > 0.0 and (
                    best < 0 or before(found, q, best, radius)):
                best = q
        if best < 0:
            return without_dropped(found, first, end)
        for k in range(COLUMNS):
            found[kept, k], found[best, k] = found[best, k], found[kept, k]
        g, kept = kept, kept + 1
        for q in range(kept, end):
            if found[q, FEATURE] == DROPPED or found[q, SHARE] <= 0.0:
                continue
            if same_direction(found, g, q):
                follow(found, g, q, first, end, radius)
            elif _dot(found, g, q) >= found[g, DISTANCE] ** 2 * (1.0 - 1e-9):
                found[q, FEATURE] = DROPPED


@compiled
def same_direction(found, g, q):
    """Whether two contacts lie in the same direction, as seen from the centre."""
    return _dot(found, g, q) >= found[g, DISTANCE] * found[q, DISTANCE] * COPLANAR


@compiled
def _dot(found, g, q):
    return found[q, 0] * found[g, 0] + found[q, 1] * found[g, 1] + found[q, 2] * found[g, 2]


@compiled
def follow(found, g, q, first, end, radius):
    """Let the candidate q follow the contact g in the same direction, or drop it when its point is not above
    the tangent plane of g or of another one of the rows ``first``..``end`` that follows g; or drop that one,
    when its point is not above the plane of q."""
    mark, flat = -1.0 - found[g, PAIR], 1e-12 * radius
    if not height(found, q, g) > flat:
        found[q, FEATURE] = DROPPED
    for o in range(first, end):
        if o != q and found[o, SHARE] == mark and found[o, FEATURE] != DROPPED and \
                found[q, FEATURE] != DROPPED:
            if not height(found, q, o) > flat:
                found[q, FEATURE] = DROPPED
            elif not height(found, o, q) > flat:
                found[o, FEATURE] = DROPPED
    found[q, SHARE] = mark


@compiled
def height(found, q, g):
    """How far the point of q lies above the tangent plane of g, towards the centre [m]."""
    return (found[g, 0] * (found[g, 0] - found[q, 0]) + found[g, 1] * (found[g, 1] - found[q, 1]) +
            found[g, 2] * (found[g, 2] - found[q, 2])) / abs(found[g, DISTANCE])


@compiled
def share_force(found, end):
    """Contacts that follow another one share its force with it.

    In a valley as flat as `COPLANAR` each side bears in proportion to the height of its point above the
    planes of the others: half at the bottom, and nothing where the point reaches the bottom, so that the
    force does not jump from side to side when a sphere goes across. The overlap is that of the nearest.
    """
    alone = True
    for q in range(end):
        found[q, NEAREST] = found[q, DISTANCE]
        alone = alone and found[q, SHARE] == 1.0
    if alone:
        return
    for g in range(end):
        if found[g, SHARE] != 1.0:
            continue
        mark, total = -1.0 - found[g, PAIR], 0.0
        for q in range(end):
            if q == g or found[q, SHARE] == mark:
                found[q, SIDE] = np.inf
                for o in range(end):
                    if o != q and (o == g or found[o, SHARE] == mark):
                        found[q, SIDE] = min(found[q, SIDE], max(height(found, q, o), 0.0))
                total += found[q, SIDE]
        for q in range(end):
            if total < np.inf and (q == g or found[q, SHARE] == mark):  # infinite: nothing follows g
                found[q, SHARE] = found[q, SIDE] / total if total > 0.0 else 1.0 * (q == g)
                found[q, NEAREST] = found[g, DISTANCE]


@compiled
def before(found, a, b, radius):
    """Order of the hierarchy: nearer first; at equal distance the face before the edge before the vertex,
    then the first: never by round-off, or two sides of a seam would take turns at random."""
    equal = abs(found[a, DISTANCE] - found[b, DISTANCE]) < 1e-12 * radius
    if equal and found[a, FEATURE] != found[b, FEATURE]:
        return found[a, FEATURE] < found[b, FEATURE]
    if equal:
        return found[a, PAIR] < found[b, PAIR]
    return found[a, DISTANCE] < found[b, DISTANCE]
