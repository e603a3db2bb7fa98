"""Hertz-Mindlin contact with adhesion; the time step it allows.

The formulas are those of LIGGGHTS 3.8 `model hertz tangential history cohesion sjkr` (files surface_model_default.h,
normal_model_hertz.h, tangential_model_history.h, cohesion_model_sjkr.h, global_properties.cpp), with three changes that
shim/models.h makes there too: the damping ratio is given, the normal force of a contact that does not pull is cut at
zero, and Coulomb's limit holds for spring and damper together.
"""
from collections import namedtuple

import numpy as np

from . import parts
from .compiled import compiled
from .damping import damping_ratio

# Effective moduli [Pa], minus the damping ratio [-], Coulomb's coefficient [-], adhesion [Pa] of one pair of materials;
# attraction: 1 if the dashpot may pull, or 0
Law = namedtuple("Law", "E G beta friction adhesion attraction")

CriticalStep = namedtuple("CriticalStep", "rayleigh hertz")  # longest sensible time steps [s]


def law(a, b, between):
    """Effective constants of materials ``a`` and ``b``: 1/E* = sum (1 - nu^2)/E, 1/G* = sum 2 (2 - nu)(1 + nu)/E
    (Johnson, Contact Mechanics, 1985; Mindlin 1949), beta = -`damping_ratio`."""
    E = 1.0 / ((1.0 - a.nu**2) / a.E + (1.0 - b.nu**2) / b.E)
    G = 1.0 / (2.0 * (2.0 - a.nu) * (1.0 + a.nu) / a.E + 2.0 * (2.0 - b.nu) * (1.0 + b.nu) / b.E)
    beta = -damping_ratio(between.restitution, between.pulls)
    return Law(E, G, beta, float(between.friction), float(between.adhesion), float(between.pulls))


def laws(scene, pairs):
    """The laws of the ``pairs`` (name, name) of materials in one array, shape (materials, materials, fields of `Law`):
    one array costs a call of compiled code less than five. NaN where none is needed, no friction and no adhesion
    there."""
    number = {name: k for k, name in enumerate(scene.names)}
    out = np.full((len(number), len(number), len(Law._fields)), [np.nan, np.nan, np.nan, 0.0, 0.0, 0.0])
    for a, b in pairs:
        out[number[a], number[b]] = out[number[b], number[a]] = law(scene.materials[a], scene.materials[b],
                                                                    scene.interaction(a, b))
    return out


def field(laws, name):
    """One field of `Law` of all pairs, shape (materials, materials)."""
    return laws[..., Law._fields.index(name)]


@compiled
def law_of(laws, a, b):
    """The law of the materials numbered a and b."""
    row = laws[a, b]
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
    """Effective radius [m] of a sphere at a wall, or at one of its discs of radius ``disc`` [m], 0 for none."""
    return radius * disc / (radius + disc) if disc > 0.0 else radius


@compiled
def normal_force(overlap, vn, radius, mass, law):
    """Normal force [N], tangential stiffness k_t [N/m] and damping gamma_t [kg/s] (normal_model_hertz.h).

    overlap [m], vn: normal velocity [m/s], negative when approaching; radius, mass: effective ones [m], [kg].
    k_n = 4/3 E* sqrt(R* d), k_t = 8 G* sqrt(R* d), gamma = -2 sqrt(5/6) beta sqrt(S m*) with S_n = 2 E* sqrt(R* d)
    and S_t = k_t; F_n = k_n d - gamma_n vn. At the end of the contact the damper would pull: without law.attraction
    F_n is zero then.
    """
    root = np.sqrt(radius * overlap)
    damping = -2.0 * np.sqrt(5.0 / 6.0) * law.beta * np.sqrt(mass)
    stiffness = 8.0 * law.G * root
    force = 4.0 / 3.0 * law.E * root * overlap - damping * np.sqrt(2.0 * law.E * root) * vn
    if force < 0.0 and law.attraction == 0.0:
        force = 0.0
    return force, stiffness, damping * np.sqrt(stiffness)


@compiled
def tangential_force(shear, n, vt, normal, stiffness, damping, friction, dt, force):
    """Tangential force [N] into ``force``, shape (3,); updates the history ``shear`` [m] (tangential_model_history.h).

    The displacement grows by vt dt and is projected on the tangent plane of the unit normal n. Beyond Coulomb's
    limit, friction times the normal force, none when that pulls, it is cut back and slides without damping; below,
    damping is added as far as the whole stays within the limit.
    """
    along, size2, whole2 = 0.0, 0.0, 0.0
    for k in range(3):
        shear[k] += vt[k] * dt
        along += shear[k] * n[k]
    for k in range(3):
        shear[k] -= along * n[k]
        size2 += shear[k] * shear[k]
    elastic, limit = stiffness * np.sqrt(size2), friction * max(normal, 0.0)
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
def contact_force(n, overlap, v, arm_spin, radius, mass, area, law, dt, history, shear, vt, force):
    """Force on a sphere [N] from one contact into ``force``, shape (3,).

    n: unit normal towards the sphere; v: velocity relative to the partner [m/s]; arm_spin: sum of contact arm times
    spin of both [m/s]; area [m^2]: adhesion pulls with law.adhesion times it and has no part in Coulomb's limit;
    ``history``: whether there is friction; ``shear`` [m] and ``vt`` (scratch): shape (3,).
    """
    vn = v[0] * n[0] + v[1] * n[1] + v[2] * n[2]
    normal, stiffness, damping = normal_force(overlap, vn, radius, mass, law)
    if history:
        for k in range(3):
            a, b = (k + 1) % 3, (k + 2) % 3
            vt[k] = v[k] - vn * n[k] + n[a] * arm_spin[b] - n[b] * arm_spin[a]
        tangential_force(shear, n, vt, normal, stiffness, damping, law.friction, dt, force)
    else:
        force[:] = 0.0
    for k in range(3):
        force[k] += (normal - law.adhesion * area) * n[k]


def critical_step(scene):
    """Longest sensible time steps of ``scene`` [s].

    ``rayleigh``: 0.2 of the time a surface wave needs around the smallest sphere, pi R sqrt(rho/G) / (0.163 nu +
    0.8766) (Thornton and Randall 1988; Li, Xu and Thornton 2005). ``hertz``: 1/20 of the shortest elastic contact, 2.87
    (m*^2 / (R* E*^2 v))^(1/5) at the largest speed at the start (Johnson 1985), or a twentieth of the smallest radius
    at that speed, so that no sphere jumps over a wall; infinite at rest. With a damping ratio z beyond 2.7 it is 1/(7.4
    z), mass over damping m* / gamma_n at the largest overlap. A sphere of a cluster counts with its share of the mass.
    """
    balls = parts.grains(scene)
    if not len(balls.x):
        return CriticalStep(np.inf, np.inf)
    E, nu = np.array([(scene.materials[name].E, scene.materials[name].nu) for name in scene.names])[balls.kind].T
    rho = balls.mass / (4.0 / 3.0 * np.pi * balls.radius**3)
    rayleigh = np.pi * balls.radius * np.sqrt(rho / (E / (2.0 * (1.0 + nu)))) / (0.163 * nu + 0.8766)
    speed = np.sqrt((balls.v**2).sum(axis=1).max())
    shortest, damped = np.inf, 0.0
    if speed > 0.0:
        tables = laws(scene, scene.pairs()), laws(scene, scene.wall_pairs())
        between, at_wall = (field(table, "E") for table in tables)
        damped = max(np.nan_to_num(-field(table, "beta")).max() for table in tables)
        largest = lambda E: np.nanmax(np.where(np.isnan(E), 0.0, E), axis=1)[balls.kind]  # noqa: E731
        hertz = lambda m, R, E, v: m**2 / (R * E**2 * v)  # noqa: E731
        with np.errstate(divide="ignore"):
            shortest = 2.87 * min(hertz(balls.mass, balls.radius, largest(at_wall), speed).min(),
                                  hertz(balls.mass / 2, balls.radius / 2, largest(between), 2 * speed).min()) ** 0.2
        shortest = min(shortest, balls.radius.min() / speed)
    return CriticalStep(0.2 * rayleigh.min(), shortest / max(20.0, 7.4 * damped))
