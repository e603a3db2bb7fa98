"""What stays when the moving wall is replaced by another one; for both back ends."""
import copy
from dataclasses import replace
from typing import Any

import numpy as np

import mpm_dem_checks as check

from ..compiled import compiled
from ..scene.arrays import in_space
from ..scene.scene import SceneData
from ..scene.walls import Wall
from ..search.elements import MovingWall, closest, corners_of


def with_wall(scene: SceneData, wall: Wall) -> SceneData:
    """``scene`` with ``wall`` as the moving one. Raises ValueError when they do not fit."""
    if wall.dim != scene.dim:
        raise ValueError(f"the new wall is {wall.dim}D, the scene {scene.dim}D: use one dimension")
    if len(wall.elements) and wall.material not in scene.materials:
        raise ValueError(f"there is no material {wall.material!r} in the scene: it has "
                         f"{sorted(scene.materials)}")
    old = scene.wall
    if (wall.material, wall.may_touch) != (old.material, old.may_touch):
        return replace(scene, wall=wall)
    other = copy.copy(scene)  # not made anew: nothing that was checked has changed
    object.__setattr__(other, "wall", wall)
    return other


def check_was(was: Any, wall: Wall, count: int) -> np.ndarray:
    """``was`` as numbers, shape (n,): which of ``count`` discs each of the ``wall`` has been, -1 for none.
    ValueError when it says something else."""
    was = check.indices("was (numbers that the discs had)", np.asarray(was)[:, None] + 1, count + 1, (1,),
                        "discs, from -1 on")[:, 0] - 1
    if wall.radius is None or not len(was) == len(wall.nodes) == len(wall.elements):
        raise ValueError(f"was has {len(was)} numbers for {len(wall.elements)} elements on {len(wall.nodes)} "
                         "nodes: give it for discs, one around each node")
    return was


def new_numbers(was: np.ndarray, count: int) -> np.ndarray:
    """The number that each of ``count`` discs has after the change that ``was`` says, -1 where it is
    gone."""
    new = np.full(count, -1)
    new[was[was >= 0]] = np.flatnonzero(was >= 0)
    return new


def carried(was: np.ndarray, old: np.ndarray, force: np.ndarray, x: np.ndarray) -> np.ndarray:
    """``force`` [N] on the ``old`` discs [m], shape (m, dim), on those that there are now at x [m], (n, dim);
    that of one which is gone acts on the nearest."""
    out, new = np.zeros(x.shape), new_numbers(was, len(old))
    out[was >= 0] = force[was[was >= 0]]
    for i in np.flatnonzero((new < 0) & force.any(axis=1)):
        if len(x):
            out[np.argmin(((x - old[i])**2).sum(axis=1))] += force[i]
    return out


def redistribute(old: np.ndarray, force: np.ndarray, wall: MovingWall) -> np.ndarray:
    """Nodal ``force`` [N] at the ``old`` nodes [m], (m, dim), as one on the nodes of ``wall``, (n, dim): each
    goes to the closest place of it, so that the sum stays and so does what acts on a node that is still
    there."""
    out = np.zeros((len(wall.x), 3))
    if force.any() and len(wall.elements):
        _add_to_closest(in_space(old), in_space(force), wall, out)
    return out[:, :force.shape[1]].copy()


@compiled
def _add_to_closest(old, force, wall, out):
    corner, weight, point, best = np.empty((3, 3)), np.empty(3), np.empty(3), np.empty(3)
    for i in range(len(old)):
        if not force[i].any():
            continue
        nearest, shortest = 0, np.inf
        for e in range(len(wall.elements)):
            corners_of(wall, e, 0.0, corner)
            r = closest(corner, wall.elements.shape[1], old[i], weight, point)[0]
            if r < shortest:
                nearest, shortest = e, r
                best[:] = weight
        for a in range(wall.elements.shape[1]):
            out[wall.elements[nearest, a]] += best[a] * force[i]
