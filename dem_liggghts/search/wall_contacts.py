"""Where a sphere touches the walls: candidates wall by wall, one contact where walls meet.

Geometry only, no contact law. All points have three components; a plane scene lies in z = 0.
"""
import numpy as np

from ..compiled import compiled
from ..scene.tables import DEPTH, GROUP, RADIUS
from .elements import (
    DISTANCE,
    FEATURE,
    PAIR,
    POINT,
    SHARE,
    SIDE,
    WEIGHT,
    closest,
    corners_of,
    normal_and_angle,
)
from .hierarchy import (
    COPLANAR,
    DROPPED,
    JOINED,
    before,
    double_hierarchy,
    drop_shared,
    follow,
    one_sided,
    outside,
    same_direction,
    share_force,
    without_dropped,
)


@compiled
def find_contacts(query, i, p, radius):
    """Contacts of the sphere i at p [m] with the walls, in the first rows of ``query.found``, wall by wall
    and nearest first; returns their number."""
    near, wall, found, corner = query.near, query.wall, query.found, query.corner
    # np.int64: for a plain 0 numba would compile what takes it once more.
    total, q, last, nodes = np.int64(0), near.start[i], near.start[i + 1], wall.elements.shape[1]
    touched = 0  # walls that are no discs
    while q < last:
        e, first, n = near.partner[q], total, total
        group, depth, disc = wall.traits[e, GROUP], wall.traits[e, DEPTH], wall.traits[e, RADIUS]
        while q < last and wall.traits[near.partner[q], GROUP] == group:
            e, row = near.partner[q], found[n]
            corners_of(wall, e, query.t, corner)
            r, feature = closest(corner, nodes, p, row[WEIGHT:WEIGHT + 3], row[POINT:POINT + 3])
            for k in range(3 if disc > 0.0 else 0):  # to the rim of the disc
                row[POINT + k] *= (r - disc) / r
            r -= disc
            if r <= max(radius, depth):
                row[DISTANCE], row[FEATURE], row[PAIR], row[SHARE] = r, feature, q, 1.0
                if depth >= 0.0:
                    row[SIDE] = outside(row, wall.traits[e], corner, nodes, radius)
                n += 1
            q += 1
        if disc == 0.0 and n > first + 1:
            n = drop_shared(query, first, n, radius)
        if depth >= 0.0:
            n = one_sided(found, first, n, radius, depth)
        elif disc == 0.0 and n > first + 1:
            n = double_hierarchy(found, first, n, radius)
        touched += disc == 0.0 and n > first
        total = n
    if touched > 1:
        total = across_walls(query, i, p, radius, total)
    share_force(found, total)
    return total


@compiled
def across_walls(query, i, p, radius, end):
    """Of the contacts of the sphere i with several walls, the first ``end`` rows, keep one where these walls
    meet; returns the end of those kept.

    A contact is dropped when its point lies on an element of another wall that comes nearer, or as near and
    comes before it, as inside one wall. It follows one of another wall in the same direction that is no
    farther apart than the two sides of a valley as flat as `COPLANAR`. Walls one behind the other are two
    obstacles.
    """
    found = query.found
    for q in range(end):
        if _continues(query, i, p, radius, q, end):
            found[q, FEATURE] = DROPPED
    for g in range(end):
        for q in range(end):
            if found[g, FEATURE] == DROPPED and found[q, SHARE] == -1.0 - found[g, PAIR]:
                found[q, SHARE] = 1.0  # it has lost the one that it followed
    for g in range(end):
        for q in range(end):
            if _one_seam(query, g, q, radius):
                for o in range(end):
                    if found[o, SHARE] == -1.0 - found[q, PAIR]:
                        found[o, SHARE] = -1.0 - found[g, PAIR]
                follow(found, g, q, 0, end, radius)
    return without_dropped(found, 0, end)


@compiled
def _continues(query, i, p, radius, q, free):
    """Whether the point of contact q lies on an element of another wall that comes nearer. free: a row not in
    use."""
    near, wall, found, corner = query.near, query.wall, query.found, query.corner
    traits, r = wall.traits[near.partner[int(found[q, PAIR])]], abs(found[q, DISTANCE])
    nodes = wall.elements.shape[1]
    weight, point = found[free, WEIGHT:WEIGHT + 3], found[free, POINT:POINT + 3]
    for o in range(near.start[i], near.start[i + 1]):
        other = wall.traits[near.partner[o]]
        if other[GROUP] == traits[GROUP] or other[RADIUS] > 0.0 or traits[RADIUS] > 0.0:
            continue
        corners_of(wall, near.partner[o], query.t, corner)
        nearest, feature = closest(corner, nodes, p, weight, point)
        level = abs(nearest - r) <= 1e-12 * radius
        first = feature < found[q, FEATURE] or (feature == found[q, FEATURE] and other[GROUP] < traits[GROUP])
        if nearest > r + 1e-12 * radius or (level and not first):
            continue
        if other[DEPTH] >= 0.0:
            x, y, z, _ = normal_and_angle(corner, nodes, weight)
            if x * point[0] + y * point[1] + z * point[2] > 0.0:  # it faces the other way
                continue
        for k in range(3):
            found[free, SIDE - 2 + k] = p[k] + found[q, POINT + k]
        if closest(corner, nodes, found[free, SIDE - 2:SIDE + 1], weight, point)[0] <= \
                JOINED * (radius - r) + 1e-12 * radius:
            return True
    return False


@compiled
def _one_seam(query, g, q, radius):
    """Whether the contacts g and q with two walls, g first in the hierarchy, are one."""
    found, traits, partner = query.found, query.wall.traits, query.near.partner
    if found[g, FEATURE] == DROPPED or found[q, FEATURE] == DROPPED or found[g, SHARE] != 1.0 or \
            found[q, SHARE] != 1.0:
        return False
    a, b = traits[partner[int(found[g, PAIR])]], traits[partner[int(found[q, PAIR])]]
    if a[GROUP] == b[GROUP] or a[RADIUS] > 0.0 or b[RADIUS] > 0.0 or not before(found, g, q, radius):
        return False
    return found[g, DISTANCE] > 0.0 and same_direction(found, g, q) and \
        found[q, DISTANCE] - found[g, DISTANCE] <= (1.0 - COPLANAR) * radius
