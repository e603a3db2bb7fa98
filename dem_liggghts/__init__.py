"""Spheres and rigid clusters of spheres against a deforming wall: one protocol, two back ends (built-in and
LIGGGHTS)."""
import mpm_dem_cache  # noqa: F401 - before anything is compiled
import mpm_dem_checks as check

from .checks import check_start, warn_if_window_too_long
from .clusters import Cluster
from .contact import critical_step
from .energy import contact_energy, kinetic_energy, potential_energy
from .opening import open_scene
from .protocol import BODY, DEM, PARTICLE
from .scene import Interaction, Material, Scene, Spheres, Wall
from .sizes import check_size
from .window import longest_window

__all__ = ["BODY", "Cluster", "DEM", "Interaction", "Material", "PARTICLE", "Scene", "Spheres", "Wall", "check_size",
           "check_start", "contact_energy", "critical_step", "kinetic_energy", "longest_window", "open_dem", "potential_energy",
           "warn_if_window_too_long"]


def open_dem(backend, scene, dt, comm=None):
    """The partition for ``scene`` with the time step ``dt`` [s], as `Scene.open` makes it."""
    return open_scene(backend, check.record("scene", scene, Scene), dt, comm)
