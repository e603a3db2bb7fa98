"""Hertz-Mindlin contact with damping and adhesion: constants of a pair of materials, force on a sphere.

The formulas are those of LIGGGHTS 3.8 `model hertz tangential history cohesion sjkr` (files
surface_model_default.h, normal_model_hertz.h, tangential_model_history.h, cohesion_model_sjkr.h,
global_properties.cpp), with three changes that liggghts/shim/models.h makes there too: the damping ratio is
given, the normal force of a contact that does not pull is cut at zero, and Coulomb's limit holds for spring
and damper together. Rolling friction is an elastic-plastic spring with a damper (type C of Ai, Chen, Rotter
and Ooi, Powder Technology 206, 269, 2011), as stiff as Iwashita and Oda take it (J. Eng. Mech. 124, 285,
1998): LIGGGHTS' `rolling_friction epsd2` (rolling_model_epsd2.h) with changes, see `contact_force`.
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
    rolling: float  # coefficient of rolling friction [-]


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
    unused: np.ndarray  # stands for the displacements of the springs where there is no friction [m]
    turn: np.ndarray  # angular velocity relative to the partner [rad/s], with rolling friction
    couple: np.ndarray  # torque of rolling friction on the sphere [N m]
    levers: np.ndarray  # of a wall's nodes, see `rolling.relative_turn`, (4, 3)


def new_vectors() -> Vectors:
    """Room for one contact."""
    return Vectors(*np.zeros((8, 3)), np.zeros((4, 3)))


def law(a: Material, b: Material, between: Interaction) -> Law:
    """Effective constants of materials ``a`` and ``b``: 1/E* = sum (1 - nu^2)/E, 1/G* = sum 2 (2 - nu)(1 +
    nu)/E (Johnson, Contact Mechanics, 1985; Mindlin 1949), beta = -`damping_ratio`."""
    E = 1.0 / ((1.0 - a.nu**2) / a.E + (1.0 - b.nu**2) / b.E)
    G = 1.0 / (2.0 * (2.0 - a.nu) * (1.0 + a.nu) / a.E + 2.0 * (2.0 - b.nu) * (1.0 + b.nu) / b.E)
    beta = -damping_ratio(between.restitution, between.pulls)
    return Law(E, G, beta, float(between.friction), float(between.adhesion), float(between.pulls),
               float(between.rolling))


def law_table(scene: SceneData, pairs: List[Tuple[str, str]]) -> np.ndarray:
    """The laws of the ``pairs`` (name, name) of materials, shape (materials, materials, fields of `Law`): one
    array costs a call of compiled code less than five. NaN where none is needed, zero friction and adhesion
    there."""
    number = {name: k for k, name in enumerate(scene.names)}
    out = np.full((len(number), len(number), len(Law._fields)), [np.nan] * 3 + [0.0] * 4)
    for a, b in pairs:
        out[number[a], number[b]] = out[number[b], number[a]] = law(scene.materials[a], scene.materials[b],
                                                                    scene.interaction(a, b))
    return out


def laws_of(scene: SceneData) -> Laws:
    """Both tables of ``scene``."""
    return Laws(law_table(scene, scene.pairs()), law_table(scene, scene.wall_pairs()))


def count_springs(table: np.ndarray) -> int:
    """How many springs the contacts of a table have, see `Interaction.springs`: the most of all pairs."""
    return 2 if constant(table, "rolling").any() else int(constant(table, "friction").any())


def constant(table: np.ndarray, name: str) -> np.ndarray:
    """One field of `Law` of all pairs, shape (materials, materials)."""
    return table[..., Law._fields.index(name)]


@compiled
def pair_law(table, a, b):
    """The law of the materials numbered a and b."""
    row = table[a, b]
    return Law(row[0], row[1], row[2], row[3], row[4], row[5], row[6])


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
def spring_force(n, rate, force, spring, stiffness, damping, limit, dt):
    """Force [N] of a spring and a damper in the tangent plane of the unit normal n, into ``force``; updates
    the displacement ``spring`` [m] (tangential_model_history.h).

    It grows by rate dt, rate [m/s] a vector in that plane, and is projected on it. Beyond ``limit`` [N] it is
    cut back and slides without damping; below, damping is added as far as the whole stays within the limit.
    """
    along, size2, whole2 = 0.0, 0.0, 0.0
    for k in range(3):
        spring[k] += rate[k] * dt
        along += spring[k] * n[k]
    for k in range(3):
        spring[k] -= along * n[k]
        size2 += spring[k] * spring[k]
    elastic = stiffness * np.sqrt(size2)
    slides = elastic > limit
    for k in range(3):
        if slides:
            spring[k] *= limit / elastic
        force[k] = -stiffness * spring[k] - (0.0 if slides else damping * rate[k])
        whole2 += force[k] * force[k]
    if whole2 > limit * limit and not slides:
        for k in range(3):
            force[k] *= limit / np.sqrt(whole2)


@compiled
def contact_force(vectors, spring, touch, law, dt, springs):
    """Force on a sphere [N] from one contact, into ``vectors.force``, from their normal, velocity and spin,
    with two ``springs`` the torque [N m] of rolling friction into ``vectors.couple``, from their turn.

    Adhesion pulls with law.adhesion times the area and has no part in Coulomb's limit: friction times the
    normal force, none when that pulls. springs: see `count_springs`; spring: their displacements so far [m],
    (3,) each, brought up to date.

    The rolling displacement grows with R* (turn - (turn . n) n), R* the effective radius; on it act a spring
    and a damper as stiff and as strong as the tangential ones, with the limit law.rolling F_n, and the torque
    is R* times their force: k_r = k_t R*^2, |M| <= law.rolling R* F_n. In LIGGGHTS the torque of the spring
    keeps its direction in space when the normal turns, a pull counts in its limit like a push, and there is
    no damper, without which two spheres that are pressed together roll to and fro for ever.
    """
    n, v, spin, vt, force = vectors.n, vectors.v, vectors.spin, vectors.vt, vectors.force
    vn = v[0] * n[0] + v[1] * n[1] + v[2] * n[2]
    normal, stiffness, damping = normal_force(touch, vn, law)
    if springs:
        for k in range(3):
            a, b = (k + 1) % 3, (k + 2) % 3
            vt[k] = v[k] - vn * n[k] + n[a] * spin[b] - n[b] * spin[a]
        spring_force(n, vt, force, spring, stiffness, damping, law.friction * max(normal, 0.0), dt)
    else:
        force[:] = 0.0
    if springs > 1:
        turn, couple, R = vectors.turn, vectors.couple, touch.radius
        along = turn[0] * n[0] + turn[1] * n[1] + turn[2] * n[2]
        for k in range(3):
            vt[k] = R * (turn[k] - along * n[k])
        spring_force(n, vt, couple, spring[3:], stiffness, damping, law.rolling * max(normal, 0.0), dt)
        for k in range(3):
            couple[k] *= R
    for k in range(3):
        force[k] += (normal - law.adhesion * touch.area) * n[k]
