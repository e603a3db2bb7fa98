"""What can be wrong with a scene before the first step, and with its numbers after one; for both back ends."""
import warnings

import numpy as np

import mpm_dem_checks as check

from . import parts
from .compiled import compiled
from .contact import critical_step
from .frame import find_origin, moved
from .near import near_spheres, nothing
from .outflow import check_inside
from .sizes import HOPELESS
from .wall import JOINT, RIM, at_rest, closest, normal_and_angle, place
from .window import longest_window

TOUCHING = 1e-9  # overlap at the start, as a fraction of the radius, that still counts as touching
GONE = ("is going through the wall: Hertz's law does not stop it before its centre is there; take a stiffer contact "
        "(E), a smaller speed, more substeps, or a wall with a depth, which pushes outwards on both sides")  # also wall.h
CONNECTED = 1e-6  # gap, as a fraction of the radius, over which the spheres of a cluster still hang together


def check_start(scene):
    """Raise ValueError unless every sphere starts outside the body and free of overlap, touching is fine, and every
    cluster is in one piece."""
    origin = find_origin(scene)
    scene = moved(scene, -origin)
    balls, slack = parts.grains(scene), 4.0 * np.spacing(np.abs(origin).max())  # what was lost in far coordinates
    if scene.dim == 2 and balls.omega[:, :2].any():
        bad = int(np.flatnonzero(balls.omega[:, :2].any(axis=1))[0])
        raise ValueError(f"sphere {bad + 1} of a plane scene has spin {balls.omega[bad]} rad/s: only the third "
                         "component may differ from zero")
    check_inside(scene, [(f"{what} {k + 1}", (x + origin[:scene.dim])) for what, places in (
        ("sphere", scene.spheres.x), ("cluster", [c.x for c in scene.clusters])) for k, x in enumerate(places)])
    for number, cluster in enumerate(scene.clusters):
        _check_one_piece(cluster, number)
    _check_apart(balls, slack)
    for number, wall in enumerate((*scene.walls, scene.wall)):
        if len(wall.elements):
            _check_adhesion(scene, balls, wall)
            _check_outside(scene, balls, wall, "the wall" if wall is scene.wall else f"fixed wall {number + 1}", slack,
                           origin)


def _name(balls, i):
    """A sphere as its user knows it."""
    body = int(balls.body[i])
    if body < 0:
        return f"sphere {i + 1}"
    return f"cluster {body + 1} (its sphere {i - int(np.argmax(balls.body == body)) + 1})"


def _check_one_piece(cluster, number):
    x, n = cluster.arms(), len(cluster.radii)
    near = near_spheres(x, np.array(cluster.radii), np.full(n, -1), CONNECTED * cluster.radii.min(), nothing(n), False)
    reached, follow = {0}, [0]
    neighbours = {i: [] for i in range(n)}
    for i in range(n):
        for j in near.partner[near.start[i]:near.start[i + 1]].tolist():
            neighbours[i].append(j), neighbours[j].append(i)
    while follow:
        for j in neighbours[follow.pop()]:
            if j not in reached:
                reached.add(j), follow.append(j)
    if len(reached) < n:
        apart = min(set(range(n)) - reached)
        raise ValueError(f"cluster {number + 1} is in two pieces: its sphere {apart + 1} at {cluster.centres[apart]} m "
                         "does not hang together with its sphere 1 over touching spheres: use larger or more spheres")


def _check_apart(balls, slack):
    near = near_spheres(balls.x, balls.radius, balls.body, 0.0, nothing(len(balls.x)), False)
    for i in range(len(balls.x)):
        for j in near.partner[near.start[i]:near.start[i + 1]]:
            overlap = balls.radius[i] + balls.radius[j] - np.sqrt(((balls.x[j] - balls.x[i]) ** 2).sum())
            if overlap > TOUCHING * balls.radius[i] + slack:
                both = f"spheres {i + 1} and {j + 1}" if max(balls.body[i], balls.body[j]) < 0 else \
                    f"{_name(balls, i)} and {_name(balls, j)}"
                raise ValueError(f"{both} overlap by {overlap:.3g} m at the start: "
                                 "move them apart by at least that much")


def _check_adhesion(scene, balls, wall):
    smallest = balls.radius.min(initial=np.inf)
    sticky = [a for a, b in scene.wall_pairs() if b == wall.material and scene.interaction(a, b).adhesion > 0]
    if wall.depth is not None and wall.depth > smallest and sticky:
        raise ValueError(f"the wall of material {wall.material!r} has adhesion and a depth of {wall.depth} m: with "
                         f"adhesion give at most the smallest radius, {smallest:.3g} m, where the area of contact ends")


def _check_outside(scene, balls, wall, what, slack, origin):
    surface = at_rest(*_alone(scene, wall))
    for i, radius in enumerate(balls.radius):
        distance, outside, e, weight = side(balls.x[i], surface, 1e-9 * radius + slack)
        distance -= wall.radius or 0.0
        at_rim = surface.traits[e, RIM:JOINT] * (weight == (1.0 if scene.dim == 2 else 0.0))
        if outside < -slack and not at_rim.any():
            place = (balls.x[i] + origin)[:scene.dim]
            raise ValueError(f"{_name(balls, i)} at {place} m lies inside the body, {distance:.3g} m "
                             "below its surface: move it out, or reverse the wall elements (outside is left of a "
                             "segment)")
        if radius - distance > TOUCHING * radius + slack:
            raise ValueError(f"{_name(balls, i)} overlaps {what} by {radius - distance:.3g} m at the start: "
                             "move it away from the wall by at least that much")


def _alone(scene, wall):
    """The surface of one wall of the scene, and its nodes."""
    surface = parts.surface(type(scene)(wall=wall, materials=scene.materials))
    return surface, surface.x


@compiled
def side(p, wall, tolerance):
    """Distance [m] of p from the wall (of a disc: from its centre), its side (positive outside, negative inside, NaN of
    discs), the closest element and the weights of the closest point on its nodes.

    The side is taken from the sum of the normals of all elements that hold the closest point (within ``tolerance``
    [m]), in space weighted with their angles there, which makes it right at edges and vertices too (Baerentzen and
    Aanaes, IEEE TVCG 11 (2005) 243-253).
    """
    corner, weight, point = np.zeros((3, 3)), np.zeros(3), np.empty(3)
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
            a, b, c, share = normal_and_angle(corner, nodes, weight)
            outside -= share * (a * point[0] + b * point[1] + c * point[2])
    place(wall, nearest, 0.0, corner)
    closest(corner, nodes, p, weight, point)
    return shortest, outside, nearest, weight


def warn_if_too_long(scene, dt):
    """One warning when the time step ``dt`` [s] exceeds the critical one; ValueError unless it is positive."""
    check.positive("dt", dt, "s", "the DEM time step must be positive")
    limit = critical_step(scene)
    if dt > HOPELESS * min(limit):
        raise ValueError(f"DEM time step is {dt:.3g} s, {dt / min(limit):.3g} times the limit of {min(limit):.3g} s, beyond "
                         "which contacts make energy: use more substeps per window or a smaller window (dt)")
    if dt > min(limit):
        warnings.warn(f"DEM time step {dt:.3g} s exceeds the limit {min(limit):.3g} s (Rayleigh {limit.rayleigh:.3g} "
                      f"s, Hertz {limit.hertz:.3g} s): use more substeps per window or a smaller window", stacklevel=4)


def warn_if_window_too_long(scene, dt, mass, force=None):
    """One warning when the coupling window ``dt`` [s] exceeds what the contact of the moving wall under ``force`` [N]
    allows, carried by nodes of ``mass`` [kg], see `longest_window`."""
    limit = longest_window(scene, mass, force)
    if dt > limit:
        modulus = scene.materials[scene.wall.material].E
        warnings.warn(f"the window of {dt:.3g} s exceeds {limit:.3g} s, the limit of the contact with the moving wall, "
                      f"whose modulus is {modulus:.3g} Pa, on nodes of m = {mass:.3g} kg: the force rings and may blow "
                      "up; use shorter windows, a softer or less damped contact, or iterate=10", stacklevel=3)


def check_window(steps, x, v, scene):
    """``steps`` as int; ValueError unless the arguments of `protocol.DEM.advance` make sense."""
    shape = scene.wall.nodes.shape
    if not all(isinstance(a, np.ndarray) and a.shape == shape for a in (x, v)):
        x, v = (check.shaped(f"{name} of the wall nodes", value, shape) for name, value in (("x", x), ("v", v)))
    return check.count("steps", steps, rule="a window has at least one DEM step, give a whole number of them")


def check_finite(x, time, origin=0.0):
    """Raise FloatingPointError, naming the particle and the time [s], unless all positions x [m] from ``origin`` [m]
    are finite."""
    if not np.isfinite(x.sum()):
        bad = int(np.flatnonzero(~np.isfinite(x).all(axis=1))[0])
        raise FloatingPointError(f"particle {bad + 1} is at {x[bad] + origin} m at t = {time:.6g} s: its contact is too "
                                 "stiff for the DEM time step, or the wall passed through it; use more substeps per "
                                 "window")


class PerforatedError(RuntimeError):
    """A sphere goes through the wall."""


def through_the_wall(name, time):
    """What is said of the sphere ``name`` in the window that starts at ``time`` [s]."""
    return f"{name} {GONE} (in the window from t = {time:.6g} s)"
