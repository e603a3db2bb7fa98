"""What stays when the moving wall is replaced by another one; for both back ends."""
from dataclasses import replace

import numpy as np

from ..compiled import compiled
from ..scene.arrays import in_space
from ..scene.scene import SceneData
from ..scene.tables import wall_table
from ..scene.walls import Wall
from ..search.elements import at_rest, closest, corners_of


def with_wall(scene: SceneData, wall: Wall) -> SceneData:
    """``scene`` with ``wall`` as the moving one. Raises ValueError when they do not fit."""
    if wall.dim != scene.dim:
        raise ValueError(f"the new wall is {wall.dim}D, the scene {scene.dim}D: use one dimension")
    if len(wall.elements) and wall.material not in scene.materials:
        raise ValueError(f"there is no material {wall.material!r} in the scene: it has "
                         f"{sorted(scene.materials)}")
    return replace(scene, wall=wall)


def redistribute(old: np.ndarray, force: np.ndarray, scene: SceneData) -> np.ndarray:
    """Nodal ``force`` [N] at the ``old`` nodes [m] as one on the nodes of the moving wall of ``scene``, all
    (n, dim): each goes to the closest place of the wall, so that the sum stays and so does what acts on a
    node that is still there."""
    out = np.zeros((len(scene.wall.nodes), 3))
    table = wall_table(scene)
    nodes, elements = table.moving
    if force.any() and len(scene.wall.elements):
        all_nodes = np.zeros((len(table.x), 3))
        _add_to_closest(in_space(old), in_space(force), at_rest(table, table.x), elements, all_nodes)
        out = all_nodes[nodes:]
    return out[:, :scene.dim].copy()


@compiled
def _add_to_closest(old, force, wall, first, out):
    corner, weight, point, best = np.empty((3, 3)), np.empty(3), np.empty(3), np.empty(3)
    for i in range(len(old)):
        if not force[i].any():
            continue
        nearest, shortest = first, np.inf
        for e in range(first, len(wall.elements)):
            corners_of(wall, e, 0.0, corner)
            r = closest(corner, wall.elements.shape[1], old[i], weight, point)[0]
            if r < shortest:
                nearest, shortest = e, r
                best[:] = weight
        for a in range(wall.elements.shape[1]):
            out[wall.elements[nearest, a]] += best[a] * force[i]
