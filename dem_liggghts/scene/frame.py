"""The frame in which a back end computes: coordinates as in maps keep few digits, so its origin lies near the
scene.

At 5e6 m two doubles are 1e-9 m apart, as much as an overlap, and a sphere that creeps less than that in a
step stands still. The scene is translated when it is taken over and what is given out is translated back.
Only a state stays in the frame, whose ``origin`` is in it: else it would lose the digits it is there to keep.
"""
import copy
from typing import Any, List, Tuple

import numpy as np

from .arrays import Array
from .scene import SceneData
from .walls import Wall

FAR = 1024.0  # distance from zero over the size of the scene, from which on the frame is moved: ten bits


def find_origin(scene: SceneData) -> np.ndarray:
    """Origin [m], shape (3,), of the frame for ``scene``: zero along axes on which the scene is near zero.

    Elsewhere the multiple of a power of ten, larger than the scene, that is next to its lowest corner:
    users move a scene to a map by such numbers, and in the frame it is then where it was. Differences to
    anything so near are exact.
    """
    low, high = _box(scene)
    size = (high - low).max()
    if not size > 0.0:
        return np.zeros(3)
    near = np.where(low > 0.0, low, np.where(high < 0.0, high, 0.0))
    step = 10.0 ** np.ceil(np.log10(size))
    return np.where(np.abs(near) >= FAR * size, np.floor(low / step + 0.5) * step, 0.0)


def _box(scene: SceneData) -> Tuple[np.ndarray, np.ndarray]:
    """Lowest and highest corner of all spheres and wall nodes [m], shape (3,) each."""
    points: List[Tuple[Array, Any]] = [(scene.spheres.x, scene.spheres.radius[:, None])]
    points += [(cluster.places[:, :scene.dim], cluster.radii[:, None]) for cluster in scene.clusters]
    points += [(wall.nodes, wall.radius or 0.0) for wall in (*scene.fixed, scene.wall)]
    low, high = np.zeros(3), np.zeros(3)
    some = [(x, r) for x, r in points if len(x)]
    if some:
        low[:scene.dim] = np.min([(x - r).min(axis=0) for x, r in some], axis=0)
        high[:scene.dim] = np.max([(x + r).max(axis=0) for x, r in some], axis=0)
    return low, high


def translated(scene: SceneData, by: np.ndarray) -> SceneData:
    """``scene`` moved by ``by`` [m], shape (3,); itself when that is nothing."""
    if not np.any(by):
        return scene
    by = by[:scene.dim]
    return _with(scene, spheres=_with(scene.spheres, x=scene.spheres.x + by),
                 wall=_translated_wall(scene.wall, by),
                 clusters=tuple(_with(cluster, x=cluster.x + by) for cluster in scene.clusters),
                 walls=tuple(_translated_wall(wall, by) for wall in scene.walls),
                 surfaces=tuple(_translated_wall(wall, by) for wall in scene.surfaces))


def with_wall_inside(inside: SceneData, wall: Wall, by: np.ndarray) -> SceneData:
    """A translated scene with another moving ``wall``, moved ``by`` [m], shape (3,), as the rest has been."""
    return _with(inside, wall=_translated_wall(wall, by[:inside.dim]) if np.any(by) else wall)


def _translated_wall(wall: Wall, by: np.ndarray) -> Wall:
    return _with(wall, nodes=wall.nodes + by)


def _with(frozen: Any, **fields: Any) -> Any:
    """A frozen member of a scene with other arrays; not made anew, since nothing that was checked has
    changed."""
    other = copy.copy(frozen)
    for name, value in fields.items():
        if isinstance(value, np.ndarray):
            value.flags.writeable = False
        object.__setattr__(other, name, value)
    return other


def translated_points(x: Array, by: np.ndarray) -> Array:
    """Positions x [m], shape (n, dim), moved by ``by`` [m], shape (3,); themselves when that is nothing."""
    return np.asarray(x) + by[:np.shape(x)[1]] if by.any() else x


def to_true_positions(table: np.ndarray, origin: np.ndarray) -> np.ndarray:
    """Rows of `protocol.PARTICLE` or `protocol.BODY` from the frame with this ``origin`` [m], in place."""
    if origin.any():
        table["x"] += origin
    return table
