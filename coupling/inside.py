"""Whether the grains of a run start where its solid can come."""
from typing import Any, Iterator, Tuple

import numpy as np


def check_inside(scene: Any, solid: Any) -> None:
    """ValueError for a particle of the ``scene`` that lies outside the grid of the ``solid``, whose material
    points it is to meet: none can ever come there."""
    box = solid.grid.box
    lower, upper = np.asarray(box.lower, float), np.asarray(box.upper, float)
    for name, x, radius in _particles(scene):
        outside = ((x + radius < lower) | (x - radius > upper)).any(axis=1)
        if outside.all():
            raise ValueError(f"{name} at {x[0].tolist()} m lies outside the grid of the soil, {box.lower} to "
                             f"{box.upper} m, where no soil can come: move it, or enlarge the grid")


def _particles(scene: Any) -> Iterator[Tuple[str, np.ndarray, Any]]:
    """Name of each single sphere and cluster, centres [m], shape (n, dim), and radii of its spheres."""
    dim = scene.wall.nodes.shape[1]
    for k, (x, radius) in enumerate(zip(scene.spheres.x, scene.spheres.radius)):
        yield f"sphere {k + 1}", x[None], radius
    for k, cluster in enumerate(scene.clusters):
        yield f"cluster {k + 1}", cluster.places[:, :dim], np.asarray(cluster.radii)[:, None]
