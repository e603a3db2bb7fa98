"""Spheres and rigid clusters of spheres against a deforming wall: one protocol, two back ends (built-in and
LIGGGHTS)."""
from typing import Any

import mpm_dem_cache  # noqa: F401 - before anything is compiled
import mpm_dem_checks as check
import mpm_dem_loading  # noqa: F401 - the same

from . import quaternion
from .common.checks import check_start
from .common.energy import contact_energy, kinetic_energy, potential_energy
from .contact.critical_step import critical_step
from .contact.window import longest_window, warn_if_window_too_long
from .opening import Scene, open_scene
from .protocol import BODY, DEM, PARTICLE
from .scene.clusters import Cluster
from .scene.materials import Interaction, Material
from .scene.scene import SceneData
from .scene.sizes import check_size
from .scene.spheres import Spheres
from .scene.walls import Wall

__all__ = ["BODY", "Cluster", "DEM", "Interaction", "Material", "PARTICLE", "Scene", "Spheres", "Wall",
           "check_size", "check_start", "contact_energy", "critical_step", "kinetic_energy", "longest_window",
           "open_dem", "potential_energy", "quaternion", "warn_if_window_too_long"]


def open_dem(backend: str, scene: SceneData, dt: float, comm: Any = None) -> DEM:
    """The partition for ``scene`` with the time step ``dt`` [s], as `Scene.open` makes it.

    >>> import numpy as np
    >>> steel, wall = Material(1e7, 0.3), Wall([[-1.0, 0.0], [1.0, 0.0]], [[0, 1]])
    >>> sphere = Spheres(x=[[0.0, 0.0100001]], v=[[0.0, -0.1]], radius=0.01, rho=7800.0)
    >>> dem = open_dem("reference", Scene(sphere, wall, material=steel, wall_material=steel), dt=1e-5)
    >>> force = dem.advance(20, wall.nodes, np.zeros((2, 2)))  # 20 steps; the wall is at rest
    >>> force.shape, bool((force[:, 1] < 0.0).all())  # the sphere pushes both nodes of the wall down
    ((2, 2), True)
    >>> dem.close()
    """
    return open_scene(check.record("scene", scene, SceneData), backend, dt, comm)
