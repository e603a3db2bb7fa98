"""Modulus of the balls that stand for material points, window and time step, from what meets what."""
from typing import Any, NamedTuple, Tuple

import numpy as np

import mpm_dem_checks as check

from ..scene.scene import SceneData
from ..scene.tables import IMMOVABLE, SphereTable, sphere_table
from .critical_step import critical_step
from .law import constant, law_table
from .window import longest_window

DEPTH = 0.1  # to which a point may be pressed into a rock, in spacings of the points
# mass that a pressed point moves, in masses of a point: at a flat free surface in the linear basis, two
# points per cell and direction, 1 / sum_i N_i^2 / M_i of one alone, and 1 / sum_i N_i 2^(D-1) N_i / M_i =
# 1.68 and more, whatever D, of one of many
ALONE, TOGETHER = {2: 5.4, 3: 17.2}, 1.6
GAP = 0.5  # between a rock and a point whose neighbours touch it, in spacings
SWING = 0.2  # DEM step in sqrt(m / k) of a rock that is held by all balls around it


class Scales(NamedTuple):
    """Of the material points, as `MPM.contact_scales` gives them."""

    spacing: float  # of the points [m]
    mass: float  # of one of them [kg]
    area: float  # that a point has on a surface [m^2]
    rho: float  # density of the soil [kg/m^3]
    wave: float  # speed of its compression waves [m/s], 0 when not known
    height: float  # of the soil along gravity [m]
    speed: float  # largest that is expected [m/s]


class ContactRule(NamedTuple):
    """What the contact of the balls with the rocks asks for; see `contact_rule`."""

    modulus: float  # of the balls to take, E [Pa]
    force: float  # largest expected on one point [N]
    depth: float  # to which it presses a point with the modulus of the scene [spacings]
    window: float  # longest that weak coupling bears with it [s]
    inner: float  # longest time step of the DEM with it [s]
    given: float  # modulus of the balls in the scene [Pa]

    def __str__(self) -> str:
        return (f"contact modulus {self.given:.3g} Pa, where {self.force:.3g} N, the most expected on a "
                f"material point, press it {self.depth:.2g} of its spacing into a rock "
                f"({self.modulus:.3g} Pa: {DEPTH})")


def contact_rule(scene: SceneData, scales: Any, speed: float) -> ContactRule:
    """Modulus, window and step for the balls of ``scene.wall`` that meet its rocks at ``speed`` [m/s], as
    they are now and as they should be. scales: see `Scales`.

    The largest force is that on a point which meets a rock alone, before its neighbours, and so moves ALONE
    masses of a point, as its nodes have those of neighbours, too. Within DEPTH s, s the spacing, Hertz's
    contact takes up the energy of the impact and, as a point may have to cross a gap before it touches, the
    work of the pressure p along gap and depth, while the wave in the soil presses with rho c v:

        F = 5/2 (m* v^2 / 2 + A p (GAP + DEPTH) s) / (DEPTH s) + A rho c v

    with m* the effective mass with the heaviest rock, A the area of a point, and p = rho g H of the soil's
    weight and a rock's weight over pi R^2 (in a plane 2 R times the thickness). The modulus is that with
    which F presses a ball DEPTH s into the rock of the smallest radius: E* = 3/4 F / sqrt(R* d^3). The window
    is the shorter one of `longest_window` with the mass of a lone point under F, and with TOGETHER masses of
    a point under the force on one of many, which have no gap. The step is the critical one, or SWING sqrt(M /
    k) of a rock of mass M that all balls that have room on half of its surface hold with the stiffness k.
    Raises ValueError for rocks that are too soft for any balls.
    """
    check.not_negative("speed", speed, "m/s", "the speed at which rocks meet the soil must be 0 or more")
    spheres = sphere_table(scene)
    g, s = float(np.linalg.norm(scene.gravity)), scales.spacing
    if not len(spheres.x) or not scene.wall.may_touch:
        return ContactRule(0.0, 0.0, 0.0, np.inf, float(min(critical_step(scene))), 0.0)
    size, weight = _rocks(spheres, g)
    footprint = 2.0 * size * scales.area / s if scene.dim == 2 else np.pi * size**2
    pressure = scales.rho * g * scales.height + float((weight / footprint).max())
    heaviest = spheres.contact_mass.max()

    def largest(m: float, gap: float) -> float:
        energy = 0.5 * m * heaviest / (m + heaviest) * speed**2 + scales.area * pressure * (gap + DEPTH) * s
        return float(2.5 * energy / (DEPTH * s) + scales.area * scales.rho * scales.wave * speed)

    lone, many = ALONE[scene.dim] * scales.mass, TOGETHER * scales.mass
    force = largest(lone, GAP)
    if not force > 0.0:
        raise ValueError("nothing presses rocks and soil on each other (speed and gravity are 0): give "
                         "speed=, at which they meet [m/s]")
    E, R, rock = _pairs(scene, spheres)
    needed = float((0.75 * force / np.sqrt(R * (DEPTH * s) ** 3)).max())
    depth = float(((0.75 * force / (E * np.sqrt(R))) ** (2.0 / 3.0)).max()) / s
    stiffness = 2.0 * E * np.sqrt(R * min(depth, DEPTH) * s)
    around = np.maximum(np.pi * size / s if scene.dim == 2 else 2.0 * np.pi * (size / s) ** 2, 1.0)
    swing = SWING * float(np.sqrt(spheres.contact_mass / (around * stiffness)).min())
    ball = scene.materials[scene.wall.material]
    window = min(longest_window(scene, lone, force), longest_window(scene, many, largest(many, 0.0)))
    return ContactRule(_modulus(needed, ball.nu, rock), force, depth, window,
                       min(*critical_step(scene), swing), ball.E)


def _pairs(scene: SceneData, spheres: SphereTable) -> Tuple[np.ndarray, np.ndarray, float]:
    """Effective modulus [Pa] and radius [m] of the contact of each sphere with the wall, (n,); and the
    largest (1 - nu^2)/E of the spheres [1/Pa]."""
    names = list(scene.names)
    wall = names.index(scene.wall.material)
    E = constant(law_table(scene, scene.wall_pairs()), "E")[spheres.material, wall]
    disc = scene.wall.radius
    R = spheres.radius if disc is None else spheres.radius * disc / (spheres.radius + disc)
    rocks = [scene.materials[names[k]] for k in np.unique(spheres.material)]
    return E, R, max((1.0 - rock.nu**2) / rock.E for rock in rocks)


def _rocks(spheres: SphereTable, g: float) -> Tuple[np.ndarray, np.ndarray]:
    """Radius [m] of the rock that each sphere is or belongs to, (n,), about its centre of mass; and its
    weight [N], 0 of one that is held."""
    size = spheres.radius.copy()
    reach = np.linalg.norm(spheres.arm, axis=1) + spheres.radius
    for number in np.unique(spheres.cluster[spheres.cluster >= 0]):
        own = spheres.cluster == number
        size[own] = reach[own].max()
    held = spheres.contact_mass >= 0.5 * IMMOVABLE * spheres.mass
    return size, np.where(held, 0.0, spheres.contact_mass * g)


def _modulus(effective: float, nu: float, rock: float) -> float:
    """E [Pa] of balls with which the effective modulus is as given; rock: (1 - nu^2)/E of the rocks."""
    if not effective * rock < 0.9:
        raise ValueError(f"the rocks have an E / (1 - nu^2) of {1.0 / rock:.3g} Pa, and the soil presses its "
                         f"points further into them than {DEPTH} of their spacing, whatever the modulus of "
                         f"the balls: give the rocks a modulus of at least {2.0 * effective:.2g} Pa")
    return float((1.0 - nu**2) / (1.0 / effective - rock))


def depth_at_wall(scene: SceneData, force: float) -> float:
    """Deepest overlap [m] of a sphere of ``scene`` with the moving wall under ``force`` [N]: Hertz's law with
    the smallest stiffness."""
    spheres = sphere_table(scene)
    if not len(spheres.x) or not scene.wall.may_touch:
        return 0.0
    E, R, _ = _pairs(scene, spheres)
    return float(((0.75 * force / (E * np.sqrt(R))) ** (2.0 / 3.0)).max())
