"""The steps of the built-in DEM: velocity Verlet, and when neighbour lists are due."""
from typing import NamedTuple

import numpy as np

from ..compiled import compiled
from ..search.elements import MovingWall
from ..search.neighbours import NeighbourLists, near_elements, near_spheres
from .forces import Moment, SphereState, forces
from .rigid import drift_clusters, kick_clusters, move_spheres, speed_bound

LARGE = 2000  # elements of a wall


class Span(NamedTuple):
    """Steps of a window to be done: from ``begin`` to ``end`` of ``steps``, with lists in use since
    ``first``."""

    first: int
    begin: int
    end: int
    steps: int
    dt: float  # [s]
    fresh: bool  # whether the lists have just been built


@compiled
def kick(b, half):
    """Half a step of velocity and angular velocity [s] of the single spheres, I = 2/5 m R^2."""
    for i in range(b.single):
        for k in range(3):
            b.v[i, k] += half / b.mass[i] * b.force[i, k]
            b.omega[i, k] += half / (0.4 * b.mass[i] * b.radius[i] ** 2) * b.torque[i, k]


@compiled
def kick_and_drift(b, clusters, dt, room):
    """Half a kick and the way of a step dt [s]. room: (3,)."""
    kick(b, 0.5 * dt)
    for i in range(b.single):
        for k in range(3):
            b.x[i, k] += dt * b.v[i, k]
    if clusters is not None:
        drift_clusters(clusters, dt, room)
        move_spheres(clusters, b.x, b.v, b.omega, True)


@compiled
def last_kick(b, clusters, half):
    """The second half kick of a step [s]."""
    kick(b, half)
    if clusters is not None:
        kick_clusters(clusters, half)
        move_spheres(clusters, b.x, b.v, b.omega, False)


@compiled
def wall_travel(wall, built, t):
    """Largest distance of a wall node that may move, at time t [s], from where it was when the lists were
    built, ``built`` [m], and largest speed of one [m/s]; NaN when a node is."""
    distance2, speed2, total = 0.0, 0.0, 0.0
    for m in range(len(wall.moving)):
        i, a2, s2 = wall.moving[m], 0.0, 0.0
        for k in range(3):
            a2 += (wall.x[i, k] + wall.v[i, k] * t - built[m, k]) ** 2
            s2 += wall.v[i, k] ** 2
        distance2, speed2, total = max(distance2, a2), max(speed2, s2), total + a2
    return (np.sqrt(distance2) if np.isfinite(total) else np.nan), np.sqrt(speed2)


@compiled
def sphere_travel(b, clusters, built, dt):
    """Largest distance of a centre from ``built`` [m] at the end of the coming step."""
    largest = 0.0
    for i in range(b.single):
        step2 = 0.0
        for k in range(3):
            step2 += (b.v[i, k] + 0.5 * dt / b.mass[i] * b.force[i, k]) ** 2
        largest = max(largest, _distance(b.x, built, i) + dt * np.sqrt(step2))
    if clusters is not None:
        for c in range(len(clusters.x)):
            distance = 0.0
            for i in range(clusters.first[c], clusters.first[c + 1]):
                distance = max(distance, _distance(b.x, built, i))
            largest = max(largest, distance + dt * speed_bound(clusters, c, dt))
    return largest


@compiled
def _distance(x, built, i):
    return np.sqrt((x[i, 0] - built[i, 0]) ** 2 + (x[i, 1] - built[i, 1]) ** 2 + (x[i, 2] - built[i, 2]) ** 2)


@compiled
def run(span, spheres, clusters, wall, lists, laws, on_wall, scratch):
    """Velocity Verlet over the steps of ``span``, in the order of LIGGGHTS: half kick, drift, forces with the
    velocities of the half step, half kick.

    ``clusters`` is None in a scene without them, which compiles to a loop without them. Returns the number of
    steps done: fewer when the lists became too old (at least one when they are fresh), -1 when the wall holds
    NaN, -1 - i when sphere i is about to go through a wall.
    """
    first, dt = span.first, span.dt
    node, node_speed = wall_travel(wall, lists.wall, first * dt)
    if not np.isfinite(node + node_speed):
        return -1
    for step in range(span.begin, span.end):
        way = sphere_travel(spheres, clusters, lists.x, dt)
        closed_in = max(2.0 * way, way + node + node_speed * (step + 1 - first) * dt)
        if closed_in > lists.skin and not (span.fresh and step == first):
            return step
        kick_and_drift(spheres, clusters, dt, scratch.vectors.vt)
        last = step + 1 == span.steps
        moment = Moment((step + 1) * dt, dt, 0.5 * dt if last else dt, last)
        through = forces(spheres, clusters, wall, lists, laws, moment, on_wall, scratch)
        if through:
            return -1 - through
        last_kick(spheres, clusters, 0.5 * dt)
    return span.end


def choose_skin(spheres: SphereState, wall: MovingWall, dt: float) -> float:
    """Skin of new neighbour lists [m]: a tenth of the smallest radius, or what lasts some ten steps of dt [s]
    at the speeds of now, some fifty where the wall is large and new lists are dear."""
    speed = sum(np.sqrt((v**2).sum(axis=1).max(initial=0.0)) for v in (spheres.v, wall.v[wall.moving]))
    steps = 20.0 if len(wall.elements) < LARGE else 100.0
    return float(max(0.1 * spheres.radius.min(initial=np.inf), steps * dt * speed))


@compiled
def build_lists(spheres, cluster, wall, t, skin, old, springs):
    """Neighbour lists for spheres of different ``cluster`` and walls as they are at time t [s] of the window.
    springs: how many of each contact of spheres, at walls those of the ``old`` lists hand on."""
    x, radius, nodes = spheres.x, spheres.radius, np.empty((len(wall.moving), 3))
    for m in range(len(nodes)):
        i = wall.moving[m]
        for k in range(3):
            nodes[m, k] = wall.x[i, k] + wall.v[i, k] * t
    among_spheres = near_spheres(x, radius, cluster, skin, old.spheres, springs[0])
    elements = near_elements(x, radius, skin, wall, t, old.elements, springs[1])
    return NeighbourLists(among_spheres, elements, x.copy(), nodes, skin)
