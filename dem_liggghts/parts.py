"""A scene as arrays: all its spheres in a row with the bodies they belong to, all its walls as one surface."""
from collections import namedtuple
from itertools import combinations

import numpy as np

from . import quaternion
from .arrays import in_space
from .wall import DEPTH, GROUP, JOINT, KIND, RADIUS, RIM, TRAITS

# All spheres, single ones first: x, v, omega (n, 3), radius, mass (n,) as in `protocol.PARTICLE`; partner: the mass
# that counts in a contact [kg]; kind: number of the material; body: number of the cluster, -1 for a single sphere;
# arm: from the body's centre of mass along its principal axes [m], (n, 3). SI units.
Grains = namedtuple("Grains", "x v omega radius mass partner kind body arm")

# Rigid bodies: x, v, omega (n, 3); q: quaternion of the principal axes (n, 4), turn: from these axes to the body's
# own frame (n, 4); mass (n,), inertia: principal moments (n, 3); free (n, 6), bool: motion along, rotation about the
# axes of space; first: numbers of their first spheres (n + 1,). SI units.
Rigid = namedtuple("Rigid", "x v omega q turn mass inertia free first")

# Walls as one surface: nodes x [m] (n, 3), elements and traits as in `wall.MovingWall`; own: first node and first
# element of the wall that moves.
Surface = namedtuple("Surface", "x elements traits own")

IMMOVABLE = 1e12  # mass in a contact, as a multiple of its own, of a body that does not give way


def grains(scene):
    """The spheres of ``scene`` at the start."""
    balls, number = scene.spheres, {name: k for k, name in enumerate(scene.names)}
    n = len(balls.x)
    parts = [Grains(in_space(balls.x), in_space(balls.v), balls.omega, balls.radius, balls.mass, balls.mass,
                    np.full(n, number.get(balls.material, 0)), np.full(n, -1), np.zeros((n, 3)))]
    for b, (c, v, omega) in enumerate((c, np.pad(c.v, (0, 3 - c.dim)), c.omega) for c in scene.clusters):
        n, x, turn = len(c.radii), c.places, c.principal()[1]
        arms = c.arms(quaternion.matrix(c.quaternion))
        volume = c.radii**3
        partner = c.mass * (1.0 if c.flags[:c.dim].any() else IMMOVABLE)
        parts.append(Grains(x, v + np.cross(omega, arms), np.tile(omega, (n, 1)), c.radii,
                            c.mass * volume / volume.sum(), np.full(n, partner), np.full(n, number[c.material]),
                            np.full(n, b), c.arms(quaternion.matrix(quaternion.inverse(turn)))))
    return Grains(*(np.ascontiguousarray(np.concatenate(column)) for column in zip(*parts)))


def rigid(scene):
    """The clusters of ``scene`` at the start."""
    clusters = scene.clusters
    inertia, turn = zip(*(c.principal() for c in clusters)) if clusters else (np.zeros((0, 3)), np.zeros((0, 4)))
    q = [quaternion.product(c.quaternion, t) for c, t in zip(clusters, turn)]
    first = len(scene.spheres.x) + np.cumsum([0] + [len(c.radii) for c in clusters])
    rows = lambda values, width: np.array(values, float).reshape(len(clusters), width)  # noqa: E731
    return Rigid(in_space(rows([c.x for c in clusters], scene.dim)), in_space(rows([c.v for c in clusters], scene.dim)),
                 rows([c.omega for c in clusters], 3), rows(q, 4), rows(turn, 4), np.array([c.mass for c in clusters]),
                 rows(inertia, 3), np.array([c.flags for c in clusters]).reshape(len(clusters), 6), first)


def surface(scene):
    """All walls of ``scene``: those at rest first, then the one that moves."""
    number = {name: k for k, name in enumerate(scene.names)}
    walls = [*scene.walls, scene.wall]
    nodes = np.cumsum([0] + [len(w.nodes) for w in walls])
    elements = np.concatenate([np.repeat(w.elements, scene.dim // w.elements.shape[1], axis=1) + start
                               for w, start in zip(walls, nodes)]).astype(np.int32)  # a disc names its node dim times
    traits = np.zeros((len(elements), TRAITS))
    depth = [-1.0 if w.depth is None else w.depth for w in walls]
    kind, radius = [number.get(w.material, 0) for w in walls], [w.radius or 0.0 for w in walls]
    per_wall = np.column_stack([kind, range(len(walls)), depth, radius])
    traits[:, [KIND, GROUP, DEPTH, RADIUS]] = np.repeat(per_wall, [len(w.elements) for w in walls], axis=0)
    joint = [w.elements if w.radius else _same_place(w.nodes)[w.elements] for w in walls]
    traits[:, RIM:RIM + scene.dim] = np.concatenate([_rim(e, scene.dim) for e in joint])
    traits[:, JOINT:JOINT + scene.dim] = np.concatenate([np.repeat(e, scene.dim // e.shape[1], axis=1) + start
                                                         for e, start in zip(joint, nodes)])
    return Surface(in_space(np.concatenate([w.nodes for w in walls])), elements, traits,
                   (int(nodes[-2]), len(elements) - len(scene.wall.elements)))


def _same_place(nodes):
    """For each of the ``nodes`` [m] of a wall the first one that lies in the same place, up to 1e-9 of the wall's size:
    elements are neighbours where they meet, whether or not they name the same nodes there (as those of an STL file)."""
    if not len(nodes):
        return np.zeros(0, np.int64)
    cell = 1.2345e-9 * max(np.ptp(nodes, axis=0).max(), np.finfo(float).tiny)  # places are seldom multiples of it
    _, first, number = np.unique(np.rint((nodes - nodes.min(axis=0)) / cell), axis=0, return_index=True,
                                 return_inverse=True)
    return first[number.ravel()]


def _rim(elements, dim):
    """Which node is a free end, in a wall of segments; opposite to which node the edge is free, of triangles. Beyond
    them an open wall has no inside. Discs have none of both."""
    if elements.shape[1] == 1:
        return np.zeros((len(elements), dim), np.bool_)
    facets = lambda element: combinations(sorted(element), len(element) - 1)  # noqa: E731
    times = {}
    for element in elements.tolist():
        for facet in facets(element):
            times[facet] = times.get(facet, 0) + 1
    free = np.zeros(elements.shape, np.bool_)
    for e, element in enumerate(elements.tolist()):
        for k, node in enumerate(element):
            rest = tuple(sorted(element[:k] + element[k + 1:]))
            free[e, k] = times[(node,) if len(element) == 2 else rest] == 1
    return free
