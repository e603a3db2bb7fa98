"""How long a coupling window may be for the contact of the particles with the moving wall."""
import warnings
from typing import Optional

import numpy as np

import mpm_dem_checks as check

from ..scene.scene import SceneData
from ..scene.tables import sphere_table
from .law import constant, law_table


def contact_at_wall(scene: SceneData, force: float) -> np.ndarray:
    """Tangent stiffness [N/m], damping [kg/s] and mass [kg] in the contact of each sphere of ``scene`` with
    the moving wall under ``force`` [N]; shape (n,) each.

    Hertz: S = (6 E*^2 R force)^(1/3) = 2 E* sqrt(R d) at the overlap d, which is at most the radius, when the
    centre is on the surface: there the stiffness under an infinite force ends. Damping 2 sqrt(5/6) |beta|
    sqrt(S m), see `law.normal_force`.
    """
    spheres, number = sphere_table(scene), {name: k for k, name in enumerate(scene.names)}
    if not len(spheres.x) or not scene.wall.may_touch:
        return np.zeros((3, 0))
    table, wall = law_table(scene, scene.wall_pairs()), number[scene.wall.material]
    E, beta = (constant(table, name)[spheres.material, wall] for name in ("E", "beta"))
    disc = scene.wall.radius
    R = spheres.radius if disc is None else spheres.radius * disc / (spheres.radius + disc)
    overlap = np.minimum((0.75 * force / (E * np.sqrt(R))) ** (2.0 / 3.0), R)
    stiffness = 2.0 * E * np.sqrt(R * overlap)
    damping = 2.0 * np.sqrt(5.0 / 6.0) * abs(beta) * np.sqrt(stiffness * spheres.contact_mass)
    return np.array([stiffness, damping, spheres.contact_mass])


def longest_window(scene: SceneData, mass: float, force: Optional[float] = np.inf) -> float:
    """Longest sensible coupling window of ``scene`` [s] when the moving wall is carried by grid nodes of
    ``mass`` [kg], weakly coupled.

    For each sphere the root of 3/4 S dt^2/m + sqrt(3)/2 gamma dt/m = 1, with the stiffness S and the damping
    gamma of its contact under ``force`` [N], by default as deep as its radius: the stability limit of a mass
    on a spring and a damper that follows with the motion extrapolated from the windows before. 1.15 sqrt(m/S)
    without damping, 1.15 m/gamma where it rules. Infinite when nothing can meet the wall. Several spheres at
    one node, and nodes that carry less mass, shorten it; the stiffness of the grid, which this leaves out,
    lengthens it.

    >>> from dem_liggghts import Material, Scene, Spheres, Wall
    >>> steel, wall = Material(2.1e11, 0.3), Wall([[-1.0, 0.0], [1.0, 0.0]], [[0, 1]])
    >>> sphere = Spheres(x=[[0.0, 0.01]], v=[[0.0, -0.01]], radius=0.01, rho=7800.0)
    >>> scene = Scene(sphere, wall, material=steel, wall_material=steel)
    >>> f"{longest_window(scene, mass=0.01):.3g} s, {longest_window(scene, mass=0.01, force=20.0):.3g} s"
    '2.4e-06 s, 2.3e-05 s'
    """
    check.positive("mass", mass, "kg")
    force = np.inf if force is None or force == np.inf else check.positive("force", force, "N")
    stiffness, damping, _ = contact_at_wall(scene, force)
    k, c = 0.75 * stiffness, 0.5 * np.sqrt(3.0) * damping
    return float((2.0 * mass / (c + np.sqrt(c**2 + 4.0 * k * mass))).min(initial=np.inf))


def warn_if_window_too_long(scene: SceneData, dt: float, mass: float, force: Optional[float] = None) -> None:
    """One warning when the coupling window ``dt`` [s] exceeds what the contact of the moving wall under
    ``force`` [N] allows, carried by nodes of ``mass`` [kg], see `longest_window`.

    >>> from dem_liggghts import Material, Scene, Spheres, Wall
    >>> steel, wall = Material(2.1e11, 0.3), Wall([[-1.0, 0.0], [1.0, 0.0]], [[0, 1]])
    >>> sphere = Spheres(x=[[0.0, 0.01]], v=[[0.0, -0.01]], radius=0.01, rho=7800.0)
    >>> scene = Scene(sphere, wall, material=steel, wall_material=steel)
    >>> with warnings.catch_warnings(record=True) as caught:
    ...     warn_if_window_too_long(scene, dt=1e-4, mass=0.01)
    >>> str(caught[0].message)[:30]
    'the window of 0.0001 s exceeds'
    """
    limit = longest_window(scene, mass, force)
    if dt > limit:
        modulus = scene.materials[scene.wall.material].E
        warnings.warn(f"the window of {dt:.3g} s exceeds {limit:.3g} s, the limit of the contact with the "
                      f"moving wall, whose modulus is {modulus:.3g} Pa, on nodes of m = {mass:.3g} kg: the "
                      "force rings and may blow up; use shorter windows, a softer or less damped contact, or "
                      "iterate=10", stacklevel=3)
