"""What can be wrong with a scene before the first step, and with its numbers after one; for both back ends."""
import warnings
from itertools import combinations

import numpy as np

from .contact import critical_step, in_space
from .wall import MovingWall, closest, compiled, place

TOUCHING = 1e-9  # overlap at the start, as a fraction of the radius, that still counts as touching


def check_start(scene):
    """Raise ValueError unless every sphere starts outside the body and free of overlap; touching is fine."""
    balls, x = scene.spheres, in_space(scene.spheres.x)
    if scene.dim == 2 and balls.omega[:, :2].any():
        bad = int(np.flatnonzero(balls.omega[:, :2].any(axis=1))[0])
        raise ValueError(f"sphere {bad + 1} of a plane scene has spin {balls.omega[bad]} rad/s: only the third "
                         "component may differ from zero")
    for i in range(len(x) - 1):
        overlap = balls.radius[i] + balls.radius[i + 1:] - np.sqrt(((x[i + 1:] - x[i]) ** 2).sum(axis=1))
        j = int(overlap.argmax())
        if overlap[j] > TOUCHING * balls.radius[i]:
            raise ValueError(f"spheres {i + 1} and {i + j + 2} overlap by {overlap[j]:.3g} m at the start: "
                             "move them apart by at least that much")
    nodes = in_space(scene.wall.nodes)
    wall = MovingWall(nodes, np.zeros_like(nodes), np.array(scene.wall.elements))
    rim = _rim(wall.elements)
    for i, radius in enumerate(balls.radius):
        distance, outside, e, weight = side(x[i], wall, 1e-9 * radius)
        feature = {int(n) for n, w in zip(wall.elements[e], weight) if w > 0.0}
        if outside < 0.0 and not any(feature <= facet for facet in rim):
            raise ValueError(f"sphere {i + 1} at {balls.x[i]} m lies inside the body, {distance:.3g} m below its "
                             "surface: move it out, or reverse the wall elements (outside is left of a segment)")
        if radius - distance > TOUCHING * radius:
            raise ValueError(f"sphere {i + 1} overlaps the wall by {radius - distance:.3g} m at the start: "
                             "move it away from the wall by at least that much")


def _rim(elements):
    """Free ends of a wall of segments, free edges of a wall of triangles, as sets of nodes. Beyond them an open wall
    has no inside."""
    facets = {}
    for element in elements.tolist():
        for facet in combinations(sorted(element), len(element) - 1):
            facets[facet] = facets.get(facet, 0) + 1
    return [set(facet) for facet, times in facets.items() if times == 1]


@compiled
def side(p, wall, tolerance):
    """Distance [m] of p from the wall, its side (positive outside, negative inside), the closest element and the
    weights of the closest point on its nodes.

    The side is taken from the sum of the normals of all elements that hold the closest point (within ``tolerance``
    [m]), in space weighted with their angles there, which makes it right at edges and vertices too (Baerentzen and
    Aanaes, IEEE TVCG 11 (2005) 243-253).
    """
    corner, weight, point, normal = np.zeros((3, 3)), np.zeros(3), np.empty(3), np.zeros(3)
    nodes, nearest, shortest = wall.elements.shape[1], 0, np.inf
    for e in range(len(wall.elements)):
        place(wall, e, 0.0, corner)
        r = closest(corner, nodes, p, weight, point)[0]
        if r < shortest:
            nearest, shortest = e, r
    outside = 0.0
    for e in range(len(wall.elements)):
        place(wall, e, 0.0, corner)
        if closest(corner, nodes, p, weight, point)[0] <= shortest + tolerance:
            share = _normal(corner, nodes, weight, normal)
            outside -= share * (normal[0] * point[0] + normal[1] * point[1] + normal[2] * point[2])
    place(wall, nearest, 0.0, corner)
    closest(corner, nodes, p, weight, point)
    return shortest, outside, nearest, weight


@compiled
def _normal(corner, nodes, weight, normal):
    """Unit normal of an element to the outside; returns the angle it fills at the point with these weights [rad]."""
    if nodes == 2:
        d = corner[1] - corner[0]
        normal[0], normal[1] = -d[1] / np.sqrt(d[0] ** 2 + d[1] ** 2), d[0] / np.sqrt(d[0] ** 2 + d[1] ** 2)
        return np.pi
    normal[:] = np.cross(corner[1] - corner[0], corner[2] - corner[0])
    normal /= np.sqrt(np.sum(normal**2))
    a = np.argmax(weight)
    if weight[a] < 1.0:
        return np.pi
    u, v = corner[(a + 1) % 3] - corner[a], corner[(a + 2) % 3] - corner[a]
    return np.arccos(np.sum(u * v) / np.sqrt(np.sum(u * u) * np.sum(v * v)))


def warn_if_too_long(scene, dt):
    """One warning when the time step ``dt`` [s] exceeds the critical one; ValueError unless it is positive."""
    if not 0.0 < dt < np.inf:
        raise ValueError(f"dt is {dt} s: the DEM time step must be positive")
    limit = critical_step(scene)
    if dt > min(limit):
        warnings.warn(f"DEM time step {dt:.3g} s exceeds the limit {min(limit):.3g} s (Rayleigh {limit.rayleigh:.3g} "
                      f"s, Hertz {limit.hertz:.3g} s): use more substeps per window or a smaller window", stacklevel=3)


def check_finite(x, time):
    """Raise FloatingPointError, naming the particle and the time [s], unless all positions x [m] are finite."""
    if not np.isfinite(x.sum()):
        bad = int(np.flatnonzero(~np.isfinite(x).all(axis=1))[0])
        raise FloatingPointError(f"particle {bad + 1} is at {x[bad]} m at t = {time:.6g} s: its contact is too stiff "
                                 "for the DEM time step, or the wall passed through it; use more substeps per window")
