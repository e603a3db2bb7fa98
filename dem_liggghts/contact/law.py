"""Hertz-Mindlin contact with damping and adhesion: constants of a pair of materials, force on a sphere.

The formulas are those of LIGGGHTS 3.8 `model hertz tangential history cohesion sjkr` (files
surface_model_default.h, normal_model_hertz.h, tangential_model_history.h, cohesion_model_sjkr.h,
global_properties.cpp), with three changes that liggghts/shim/models.h makes there too: the damping ratio is
given, the normal force of a contact that does not pull is cut at zero, and Coulomb's limit holds for spring
and damper together.
"""
from typing import List, NamedTuple, Tuple

import numpy as np

from ..compiled import compiled
from ..scene.materials import Interaction, Material
from ..scene.scene import SceneData
from .damping import damping_ratio


class Law(NamedTuple):
    """Constants of the contact of one pair of materials."""

    E: float  # effective Young's modulus [Pa]
    G: float  # effective shear modulus [Pa]
    beta: float  # minus the damping ratio [-]
    friction: float  # Coulomb's coefficient [-]
    adhesion: float  # [Pa]
    attraction: float  # 1 if the damper may pull, or 0


class Laws(NamedTuple):
    """Tables as of `law_table`: of spheres with each other, and of spheres at walls."""

    between: np.ndarray
    at_wall: np.ndarray


class Touch(NamedTuple):
    """Sizes of one contact of a sphere."""

    overlap: float  # [m]
    radius: float  # effective one [m]
    mass: float  # effective one [kg]
    area: float  # on which adhesion pulls [m^2]


class Vectors(NamedTuple):
    """Vectors of one contact, shape (3,) each: room that is used again for every contact, so that none is
    allocated."""

    n: np.ndarray  # unit normal towards the sphere
    v: np.ndarray  # velocity relative to the partner [m/s]
    spin: np.ndarray  # sum of contact arm times angular velocity of both [m/s]
    vt: np.ndarray  # tangential velocity [m/s]
    force: np.ndarray  # on the sphere [N]
    unused: np.ndarray  # stands for the tangential displacement where there is no friction [m]


def law(a: Material, b: Material, between: Interaction) -> Law:
    """Effective constants of materials ``a`` and ``b``: 1/E* = sum (1 - nu^2)/E, 1/G* = sum 2 (2 - nu)(1 +
    nu)/E (Johnson, Contact Mechanics, 1985; Mindlin 1949), beta = -`damping_ratio`."""
    E = 1.0 / ((1.0 - a.nu**2) / a.E + (1.0 - b.nu**2) / b.E)
    G = 1.0 / (2.0 * (2.0 - a.nu) * (1.0 + a.nu) / a.E + 2.0 * (2.0 - b.nu) * (1.0 + b.nu) / b.E)
    beta = -damping_ratio(between.restitution, between.pulls)
    return Law(E, G, beta, float(between.friction), float(between.adhesion), float(between.pulls))


def law_table(scene: SceneData, pairs: List[Tuple[str, str]]) -> np.ndarray:
    """The laws of the ``pairs`` (name, name) of materials, shape (materials, materials, fields of `Law`): one
    array costs a call of compiled code less than five. NaN where none is needed, no friction and no adhesion
    there."""
    number = {name: k for k, name in enumerate(scene.names)}
    out = np.full((len(number), len(number), len(Law._fields)), [np.nan, np.nan, np.nan, 0.0, 0.0, 0.0])
    for a, b in pairs:
        out[number[a], number[b]] = out[number[b], number[a]] = law(scene.materials[a], scene.materials[b],
                                                                    scene.interaction(a, b))
    return out


def laws_of(scene: SceneData) -> Laws:
    """Both tables of ``scene``."""
    return Laws(law_table(scene, scene.pairs()), law_table(scene, scene.wall_pairs()))


def constant(table: np.ndarray, name: str) -> np.ndarray:
    """One field of `Law` of all pairs, shape (materials, materials)."""
    return table[..., Law._fields.index(name)]


@compiled
def pair_law(table, a, b):
    """The law of the materials numbered a and b."""
    row = table[a, b]
    return Law(row[0], row[1], row[2], row[3], row[4], row[5])


@compiled
def area_of_spheres(r, a, b):
    """Area of the circle in which two spheres of radii a and b, r [m] apart, cut each other [m^2]."""
    return 0.25 * np.pi * ((a + b) ** 2 - r**2) * (r**2 - (a - b) ** 2) / r**2


@compiled
def area_at_wall(r, radius):
    """Area of the circle that a plane r [m] from the centre cuts out of a sphere [m^2]."""
    return np.pi * (radius**2 - r**2)


@compiled
def radius_at_wall(radius, disc):
    """Effective radius [m] of a sphere at a wall, or at one of its discs of radius ``disc`` [m], 0 for
    none."""
    return radius * disc / (radius + disc) if disc > 0.0 else radius


@compiled
def normal_force(touch, vn, law):
    """Normal force [N], tangential stiffness k_t [N/m] and damping gamma_t [kg/s] (normal_model_hertz.h).

    vn: normal velocity [m/s], negative when approaching. k_n = 4/3 E* sqrt(R* d), k_t = 8 G* sqrt(R* d),
    gamma = -2 sqrt(5/6) beta sqrt(S m*) with S_n = 2 E* sqrt(R* d) and S_t = k_t; F_n = k_n d - gamma_n vn.
    At the end of the contact the damper would pull: without law.attraction F_n is zero then.
    """
    root = np.sqrt(touch.radius * touch.overlap)
    damping = -2.0 * np.sqrt(5.0 / 6.0) * law.beta * np.sqrt(touch.mass)
    stiffness = 8.0 * law.G * root
    force = 4.0 / 3.0 * law.E * root * touch.overlap - damping * np.sqrt(2.0 * law.E * root) * vn
    if force < 0.0 and law.attraction == 0.0:
        force = 0.0
    return force, stiffness, damping * np.sqrt(stiffness)


@compiled
def tangential_force(vectors, shear, stiffness, damping, limit, dt):
    """Tangential force [N] into ``vectors.force``; updates the displacement ``shear`` [m]
    (tangential_model_history.h).

    It grows by vt dt and is projected on the tangent plane of the unit normal. Beyond Coulomb's ``limit`` [N]
    it is cut back and slides without damping; below, damping is added as far as the whole stays within the
    limit.
    """
    n, vt, force = vectors.n, vectors.vt, vectors.force
    along, size2, whole2 = 0.0, 0.0, 0.0
    for k in range(3):
        shear[k] += vt[k] * dt
        along += shear[k] * n[k]
    for k in range(3):
        shear[k] -= along * n[k]
        size2 += shear[k] * shear[k]
    elastic = stiffness * np.sqrt(size2)
    slides = elastic > limit
    for k in range(3):
        if slides:
            shear[k] *= limit / elastic
        force[k] = -stiffness * shear[k] - (0.0 if slides else damping * vt[k])
        whole2 += force[k] * force[k]
    if whole2 > limit * limit and not slides:
        for k in range(3):
            force[k] *= limit / np.sqrt(whole2)


@compiled
def contact_force(vectors, shear, touch, law, dt, history):
    """Force on a sphere [N] from one contact, into ``vectors.force``, from their normal, velocity and spin.

    Adhesion pulls with law.adhesion times the area and has no part in Coulomb's limit: friction times the
    normal force, none when that pulls. ``history``: whether there is friction; shear: tangential displacement
    so far [m], (3,), brought up to date.
    """
    n, v, spin, vt, force = vectors.n, vectors.v, vectors.spin, vectors.vt, vectors.force
    vn = v[0] * n[0] + v[1] * n[1] + v[2] * n[2]
    normal, stiffness, damping = normal_force(touch, vn, law)
    if history:
        for k in range(3):
            a, b = (k + 1) % 3, (k + 2) % 3
            vt[k] = v[k] - vn * n[k] + n[a] * spin[b] - n[b] * spin[a]
        tangential_force(vectors, shear, stiffness, damping, law.friction * max(normal, 0.0), dt)
    else:
        force[:] = 0.0
    for k in range(3):
        force[k] += (normal - law.adhesion * touch.area) * n[k]
