"""A scene as arrays: tables of its spheres, single ones first, of its clusters, and of its walls as one
surface."""
from typing import NamedTuple, Tuple

import numpy as np

from .. import quaternion
from .arrays import in_space, same_place
from .scene import SceneData
from .walls import Wall

# Columns of WallTable.traits: number of the material, of the wall; depth as in `walls.Wall` or -1 [m]; radius
# of a disc or 0 [m]; three truth values: in a plane which node is a free end, in space opposite to which node
# the edge is free; for each of its nodes the first one of the wall in the same place
MATERIAL, GROUP, DEPTH, RADIUS, RIM, JOINT, TRAITS = 0, 1, 2, 3, 4, 7, 10

IMMOVABLE = 1e12  # mass in a contact, as a multiple of its own, of a cluster that does not give way


class SphereTable(NamedTuple):
    """All spheres of a scene, one row each; SI units."""

    x: np.ndarray  # centres [m], (n, 3)
    v: np.ndarray  # (n, 3)
    omega: np.ndarray  # (n, 3)
    radius: np.ndarray  # (n,)
    mass: np.ndarray  # of a sphere of a cluster: its share of the cluster's, by volume, (n,)
    contact_mass: np.ndarray  # the one that counts in a contact: of a cluster's sphere the cluster's, (n,)
    material: np.ndarray  # number in Scene.names, (n,)
    cluster: np.ndarray  # number of the cluster, -1 for a single sphere, (n,)
    arm: np.ndarray  # from the cluster's centre of mass, along its principal axes [m], (n, 3)


class ClusterTable(NamedTuple):
    """All clusters of a scene, one row each; SI units."""

    x: np.ndarray  # centres of mass [m], (n, 3)
    v: np.ndarray  # (n, 3)
    omega: np.ndarray  # (n, 3)
    q: np.ndarray  # quaternion of the principal axes, (n, 4)
    turn: np.ndarray  # quaternion from the principal axes to the cluster's own frame, (n, 4)
    mass: np.ndarray  # (n,)
    inertia: np.ndarray  # principal moments, (n, 3)
    free: np.ndarray  # motion along and rotation about the axes of space, (n, 6), bool
    first: np.ndarray  # number of the first sphere of each, and the end, (n + 1,)


class WallTable(NamedTuple):
    """All walls of a scene as one surface: those at rest first, then the one that moves."""

    x: np.ndarray  # nodes [m], (n, 3)
    elements: np.ndarray  # (m, dim); a disc names its node dim times
    traits: np.ndarray  # of each element, (m, TRAITS)
    moving: Tuple[int, int]  # first node and first element of the wall that moves


def sphere_table(scene: SceneData) -> SphereTable:
    """The spheres of ``scene`` at the start."""
    single, number = scene.spheres, {name: k for k, name in enumerate(scene.names)}
    n = len(single.x)
    tables = [SphereTable(in_space(single.x), in_space(single.v), single.omega, single.radius, single.mass,
                          single.mass, np.full(n, number.get(single.material, 0)), np.full(n, -1),
                          np.zeros((n, 3)))]
    for b, (c, v, omega) in enumerate((c, np.pad(c.v, (0, 3 - c.dim)), c.omega) for c in scene.clusters):
        n, x, turn = len(c.radii), c.places, c.principal()[1]
        arms = c.arms(quaternion.matrix(c.quaternion))
        volume = c.radii**3
        contact_mass = c.mass * (1.0 if c.flags[:c.dim].any() else IMMOVABLE)
        tables.append(SphereTable(x, v + np.cross(omega, arms), np.tile(omega, (n, 1)), c.radii,
                                  c.mass * volume / volume.sum(), np.full(n, contact_mass),
                                  np.full(n, number[c.material]), np.full(n, b),
                                  c.arms(quaternion.matrix(quaternion.inverse(turn)))))
    return SphereTable(*(np.ascontiguousarray(np.concatenate(column)) for column in zip(*tables)))


def cluster_table(scene: SceneData) -> ClusterTable:
    """The clusters of ``scene`` at the start."""
    clusters, dim = scene.clusters, scene.dim
    principal = [c.principal() for c in clusters]
    q = [quaternion.product(c.quaternion, turn) for c, (_, turn) in zip(clusters, principal)]
    first = len(scene.spheres.x) + np.cumsum([0] + [len(c.radii) for c in clusters])
    rows = lambda values, width: np.array(values, float).reshape(len(clusters), width)  # noqa: E731
    x, v = (in_space(rows([getattr(c, name) for c in clusters], dim)) for name in ("x", "v"))
    return ClusterTable(x, v, rows([c.omega for c in clusters], 3), rows(q, 4),
                        rows([turn for _, turn in principal], 4),
                        np.array([c.mass for c in clusters]), rows([moments for moments, _ in principal], 3),
                        np.array([c.flags for c in clusters]).reshape(len(clusters), 6), first)


def wall_table(scene: SceneData) -> WallTable:
    """The walls of ``scene`` where they are."""
    nodes = np.cumsum([0] + [len(w.nodes) for w in scene.fixed])
    fixed = [_part(scene, w, group, start) for group, (w, start) in enumerate(zip(scene.fixed, nodes))]
    x, elements, traits = (np.concatenate(parts) for parts in zip(*fixed, own_part(scene, nodes[-1])))
    own = scene.wall
    return WallTable(x, elements, traits, (len(x) - len(own.nodes), len(elements) - len(own.elements)))


def own_part(scene: SceneData, start: int) -> Tuple[np.ndarray, ...]:
    """Nodes, elements and traits of the moving wall of ``scene``, whose nodes are numbered from ``start``
    on."""
    return _part(scene, scene.wall, len(scene.fixed), start)


def _part(scene: SceneData, wall: Wall, group: int, start: int) -> Tuple[np.ndarray, ...]:
    """Nodes, elements and traits of one ``wall``, whose nodes are numbered from ``start`` on."""
    def corners(elements: np.ndarray) -> np.ndarray:
        width = elements.shape[1] or scene.dim
        return np.repeat(elements, scene.dim // width, axis=1).reshape(-1, scene.dim) + start

    joint = wall.elements if wall.radius else same_place(wall.nodes)[wall.elements]
    traits = np.zeros((len(wall.elements), TRAITS))
    number = scene.names.index(wall.material) if wall.material in scene.materials else 0
    depth = -1.0 if wall.depth is None else wall.depth
    traits[:, [MATERIAL, GROUP, DEPTH, RADIUS]] = number, group, depth, wall.radius or 0.0
    traits[:, RIM:RIM + scene.dim] = _rim(joint, scene.dim)
    traits[:, JOINT:JOINT + scene.dim] = corners(joint)
    return in_space(wall.nodes), corners(wall.elements).astype(np.int32), traits


def _rim(elements: np.ndarray, dim: int) -> np.ndarray:
    """Which node is a free end, in a wall of segments; opposite to which node the edge is free, of triangles.
    Beyond them an open wall has no inside. Discs have none of both."""
    if elements.shape[1] == 1:
        return np.zeros((len(elements), dim), np.bool_)
    rest = elements
    if dim == 3:  # the nodes of the edge opposite to each node, in either direction one number
        ends = np.stack([elements[:, [1, 0, 0]], elements[:, [2, 2, 1]]]).astype(np.int64)
        rest = ends.min(axis=0) * (1 + int(elements.max(initial=0))) + ends.max(axis=0)
    _, number, times = np.unique(rest, return_inverse=True, return_counts=True)
    return times[number.ravel()].reshape(elements.shape) == 1
