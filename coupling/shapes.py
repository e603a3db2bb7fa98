"""Surfaces of what a scene holds besides its points: rocks, structures and fixed walls, known by their
fields."""
from typing import Any, List, NamedTuple, Sequence, Tuple

import numpy as np

from .ledger.momentum import rotation


class Faces(NamedTuple):
    """Several surfaces in one: places ``x`` [m], shape (n, dim), and ``elements``, shape (m, dim), segments
    or triangles; from which surface vertices (n,) and elements (m,) come, numbered from 0."""

    x: np.ndarray
    elements: np.ndarray
    of_vertex: np.ndarray
    of_element: np.ndarray


def joined(parts: Sequence[Tuple[Any, Any]], dim: int) -> Faces:
    """The surfaces ``parts``, (places, elements) each, as one.

    >>> side = [[0, 0], [1, 0]], [[0, 1]]
    >>> faces = joined([side, side], 2)
    >>> faces.elements.tolist(), faces.of_vertex.tolist()
    ([[0, 1], [2, 3]], [0, 0, 1, 1])
    """
    places = [np.reshape(np.asarray(x, float), (-1, dim)) for x, _ in parts]
    elements = [np.reshape(np.asarray(e, np.int64), (-1, dim)) for _, e in parts]
    first = np.cumsum([0, *map(len, places)])[:-1].astype(np.int64)
    numbers = np.arange(len(parts))
    return Faces(np.concatenate([np.zeros((0, dim)), *places]),
                 np.concatenate([np.zeros((0, dim), np.int64), *(e + f for e, f in zip(elements, first))]),
                 np.repeat(numbers, [len(x) for x in places]),
                 np.repeat(numbers, [len(e) for e in elements]))


def has_surface(cluster: Any) -> bool:
    """Whether a cluster is a rock that has been made from a surface."""
    return getattr(cluster, "surface", None) is not None


def rocks(grains: Any) -> Tuple[Faces, np.ndarray]:
    """The surfaces, where they are now, of the clusters that have one and have not been removed, and their
    rows of ``bodies()``. Collective."""
    clusters = getattr(getattr(grains, "scene", None), "clusters", ())
    surfaces = {n: cluster for n, cluster in enumerate(clusters) if has_surface(cluster)}
    if not surfaces:
        return joined([], 3), np.zeros(0)
    bodies, particles = grains.bodies(), grains.particles()
    there = set(particles["body"][particles["radius"] > 0.0].tolist())
    shown = [n for n in surfaces if int(bodies["id"][n]) in there]
    parts = []
    for n in shown:
        x, triangles = surfaces[n].surface
        turn = rotation(bodies["quaternion"][n])
        parts.append((bodies["x"][n] + (x - surfaces[n].centre) @ turn.T, triangles))
    return joined(parts, 3), bodies[shown]


def bare_spheres(grains: Any) -> np.ndarray:
    """The particles that are not seen as the surface of a rock: mask of ``particles()``, shape (p,).
    Collective."""
    clusters = getattr(grains.scene, "clusters", ())
    seen = [n + 1 for n, cluster in enumerate(clusters) if has_surface(cluster)]
    particles = grains.particles()
    return ~np.isin(particles["body"], seen) if seen else np.ones(len(particles), bool)


def structures(solid: Any, grains: Any) -> List[Any]:
    """The structures of both sides, one of each name, those of the solid first."""
    owners = solid, getattr(solid, "scene", None), getattr(grains, "scene", None)
    both: List[Any] = []
    for owner in owners:
        both += getattr(owner, "structures", None) or ()
    return list({structure.name: structure for structure in reversed(both)}.values())[::-1]


def motion_of(ground: Any, solid: Any, grains: Any) -> Any:
    """That of the structure which is the surface of a terrain, ``ground``; None where none moves."""
    x = np.asarray(getattr(ground, "x", ()))
    return next((one.motion for one in structures(solid, grains) if one.motion is not None and np.array_equal(
        one.x, x)), None)


def placed(structure: Any, time: float) -> np.ndarray:
    """Vertices of a structure at a ``time`` [s]: places [m], shape (n, dim)."""
    x = np.asarray(structure.x, float)
    return x if structure.motion is None else x + np.asarray(structure.motion(time), float)


def sizes(x: np.ndarray, elements: np.ndarray) -> np.ndarray:
    """Lengths [m] of segments, areas [m^2] of triangles, shape (m,)."""
    corner = x[elements]
    if elements.shape[1] == 2:
        return np.linalg.norm(corner[:, 1] - corner[:, 0], axis=1)
    return 0.5 * np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1)


def fixed_walls(solid: Any, grains: Any) -> List[Any]:
    """The walls at rest of segments or triangles that are no structures, nor in the same place as one."""
    known = [np.asarray(one.x) for one in structures(solid, grains)]
    return [wall for wall in getattr(getattr(grains, "scene", None), "walls", ())
            if wall.radius is None and not any(np.array_equal(wall.nodes, x) for x in known)]
