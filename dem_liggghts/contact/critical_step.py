"""The longest DEM time step that the contacts of a scene allow."""
import warnings
from typing import NamedTuple

import numpy as np

import mpm_dem_checks as check

from ..scene.scene import SceneData
from ..scene.tables import sphere_table
from .law import constant, laws_of

HOPELESS = 10.0  # steps beyond the critical one by that factor make energy out of any contact


class CriticalStep(NamedTuple):
    """Longest sensible time steps [s]."""

    rayleigh: float
    hertz: float


def critical_step(scene: SceneData) -> CriticalStep:
    """Longest sensible time steps of ``scene`` [s].

    ``rayleigh``: 0.2 of the time a surface wave needs around the smallest sphere, pi R sqrt(rho/G) / (0.163
    nu + 0.8766) (Thornton and Randall 1988; Li, Xu and Thornton 2005). ``hertz``: 1/20 of the shortest
    elastic contact, 2.87 (m*^2 / (R* E*^2 v))^(1/5) at the largest speed at the start (Johnson 1985), or a
    twentieth of the smallest radius at that speed, so that no sphere jumps over a wall; infinite at rest.
    With a damping ratio z beyond 2.7 it is 1/(7.4 z), mass over damping m* / gamma_n at the largest overlap.
    A sphere of a cluster counts with its share of the mass.

    >>> from dem_liggghts import Material, Scene, Spheres
    >>> sphere = Spheres(x=[[0.0, 0.0]], v=[[0.0, 0.0]], radius=0.01, rho=7800.0)
    >>> limit = critical_step(Scene(sphere, material=Material(2.1e11, 0.3)))
    >>> f"{limit.rayleigh:.3g} s", limit.hertz
    ('2.11e-06 s', inf)
    """
    spheres = sphere_table(scene)
    if not len(spheres.x):
        return CriticalStep(np.inf, np.inf)
    elastic = np.array([(scene.materials[name].E, scene.materials[name].nu) for name in scene.names])
    E, nu = elastic[spheres.material].T
    rho = spheres.mass / (4.0 / 3.0 * np.pi * spheres.radius**3)
    rayleigh = np.pi * spheres.radius * np.sqrt(rho / (E / (2.0 * (1.0 + nu)))) / (0.163 * nu + 0.8766)
    speed = np.sqrt((spheres.v**2).sum(axis=1).max())
    shortest, damped = np.inf, 0.0
    if speed > 0.0:
        tables = laws_of(scene)
        between, at_wall = (constant(table, "E") for table in tables)
        damped = max(np.nan_to_num(-constant(table, "beta")).max() for table in tables)
        largest = lambda E: np.nanmax(np.where(np.isnan(E), 0.0, E), axis=1)[spheres.material]  # noqa: E731
        hertz = lambda m, R, E, v: m**2 / (R * E**2 * v)  # noqa: E731
        m, R = spheres.mass, spheres.radius
        with np.errstate(divide="ignore"):
            shortest = 2.87 * min(hertz(m, R, largest(at_wall), speed).min(),
                                  hertz(m / 2, R / 2, largest(between), 2 * speed).min()) ** 0.2
        shortest = min(shortest, spheres.radius.min() / speed)
    return CriticalStep(0.2 * rayleigh.min(), shortest / max(20.0, 7.4 * damped))


def warn_if_too_long(scene: SceneData, dt: float) -> None:
    """One warning when the time step ``dt`` [s] exceeds the critical one; ValueError unless it is
    positive."""
    check.positive("dt", dt, "s", "the DEM time step must be positive")
    limit = critical_step(scene)
    if dt > HOPELESS * min(limit):
        raise ValueError(f"DEM time step is {dt:.3g} s, {dt / min(limit):.3g} times the limit of "
                         f"{min(limit):.3g} s, beyond which contacts make energy: use more substeps per "
                         "window or a smaller window (dt)")
    if dt > min(limit):
        warnings.warn(f"DEM time step {dt:.3g} s exceeds the limit {min(limit):.3g} s (Rayleigh "
                      f"{limit.rayleigh:.3g} s, Hertz {limit.hertz:.3g} s): use more substeps per window or "
                      "a smaller window",
                      stacklevel=4)
