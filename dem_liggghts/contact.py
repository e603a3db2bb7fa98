"""Hertz-Mindlin contact, its energy and the time step it allows.

The formulas are those of LIGGGHTS 3.8 `model hertz tangential history` with its default options (files
surface_model_default.h, normal_model_hertz.h, tangential_model_history.h, global_properties.cpp).
"""
from collections import namedtuple

import numpy as np

from .wall import COLUMNS, DISTANCE, MovingWall, Near, compiled, find_contacts, near_elements

Law = namedtuple("Law", "E G beta friction")  # effective moduli [Pa], damping ratio [-], Coulomb's coefficient [-]

CriticalStep = namedtuple("CriticalStep", "rayleigh hertz")  # longest sensible time steps [s]


def law(a, b, between):
    """Effective constants of materials ``a`` and ``b``: 1/E* = sum (1 - nu^2)/E, 1/G* = sum 2 (2 - nu)(1 + nu)/E
    (Johnson, Contact Mechanics, 1985; Mindlin 1949), beta = ln e / sqrt(ln^2 e + pi^2) (Tsuji et al. 1992)."""
    E = 1.0 / ((1.0 - a.nu**2) / a.E + (1.0 - b.nu**2) / b.E)
    G = 1.0 / (2.0 * (2.0 - a.nu) * (1.0 + a.nu) / a.E + 2.0 * (2.0 - b.nu) * (1.0 + b.nu) / b.E)
    ln_e = np.log(between.restitution)
    return Law(E, G, ln_e / np.sqrt(ln_e**2 + np.pi**2), float(between.friction))


@compiled
def normal_force(overlap, vn, radius, mass, law):
    """Normal force [N], tangential stiffness k_t [N/m] and damping gamma_t [kg/s] (normal_model_hertz.h).

    overlap [m], vn: normal velocity [m/s], negative when approaching; radius, mass: effective ones [m], [kg].
    k_n = 4/3 E* sqrt(R* d), k_t = 8 G* sqrt(R* d), gamma = -2 sqrt(5/6) beta sqrt(S m*) with S_n = 2 E* sqrt(R* d)
    and S_t = k_t; F_n = k_n d - gamma_n vn. The damped force may pull at the end of the contact, as in LIGGGHTS with
    `limitForce off`: the nominal restitution is met only so.
    """
    root = np.sqrt(radius * overlap)
    damping = -2.0 * np.sqrt(5.0 / 6.0) * law.beta * np.sqrt(mass)
    stiffness = 8.0 * law.G * root
    force = 4.0 / 3.0 * law.E * root * overlap - damping * np.sqrt(2.0 * law.E * root) * vn
    return force, stiffness, damping * np.sqrt(stiffness)


@compiled
def tangential_force(shear, n, vt, normal, stiffness, damping, friction, dt, force):
    """Tangential force [N] into ``force``, shape (3,); updates the history ``shear`` [m] (tangential_model_history.h).

    The displacement grows by vt dt and is projected on the tangent plane of the unit normal n. Beyond Coulomb's
    limit, friction times |normal|, it is cut back and slides without damping; below, damping is added unlimited.
    """
    along, size2 = 0.0, 0.0
    for k in range(3):
        shear[k] += vt[k] * dt
        along += shear[k] * n[k]
    for k in range(3):
        shear[k] -= along * n[k]
        size2 += shear[k] * shear[k]
    elastic, limit = stiffness * np.sqrt(size2), friction * abs(normal)
    if elastic > limit:
        for k in range(3):
            shear[k] *= limit / elastic
            force[k] = -stiffness * shear[k]
    else:
        for k in range(3):
            force[k] = -stiffness * shear[k] - damping * vt[k]


@compiled
def contact_force(n, overlap, v, arm_spin, radius, mass, law, dt, history, shear, vt, force):
    """Force on a sphere [N] from one contact into ``force``, shape (3,).

    n: unit normal towards the sphere; v: velocity relative to the partner [m/s]; arm_spin: sum of contact arm times
    spin of both [m/s]; ``history``: whether there is friction; ``shear`` [m] and ``vt`` (scratch): shape (3,).
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
        force[k] += normal * n[k]


@compiled
def _normal_energy(x, radius, wall, between, at_wall):
    """Sum of 2/5 k d^2.5 with k = 4/3 E* sqrt(R*) over all contacts [J]."""
    energy, n = 0.0, len(x)
    for i in range(n):
        for j in range(i + 1, n):
            d = radius[i] + radius[j] - np.sqrt(np.sum((x[i] - x[j]) ** 2))
            if d > 0.0:
                energy += 8.0 / 15.0 * between.E * np.sqrt(radius[i] * radius[j] / (radius[i] + radius[j])) * d**2.5
    none = Near(np.zeros(1, np.int64), np.zeros(0, np.int64), np.zeros(0, np.bool_), np.zeros((0, 3)))
    near = near_elements(x, radius, 0.0, wall, 0.0, none, False)
    corner, found = np.empty((3, 3)), np.empty((len(wall.elements) + 1, COLUMNS))
    for i in range(n):
        for c in range(find_contacts(x[i], radius[i], near, i, wall, 0.0, corner, found)):
            energy += 8.0 / 15.0 * at_wall.E * np.sqrt(radius[i]) * (radius[i] - found[c, DISTANCE]) ** 2.5
    return energy


def contact_energy(scene, x, nodes):
    """Elastic energy of all normal contacts [J], 2/5 k d^2.5 each: the integral of Hertz' force over the overlap d.

    x: centres of the spheres of ``scene`` [m], shape (n, dim) or (n, 3); nodes: wall nodes [m], the same.
    """
    between = law(scene.material, scene.material, scene.between)
    at_wall = law(scene.material, scene.wall_material, scene.at_wall)
    nodes = in_space(nodes)
    wall = MovingWall(nodes, np.zeros_like(nodes), np.ascontiguousarray(scene.wall.elements))
    return _normal_energy(in_space(x), scene.spheres.radius, wall, between, at_wall)


def kinetic_energy(particles):
    """Energy of translation and spin [J] of ``particles`` (dtype PARTICLE), with I = 2/5 m R^2."""
    p = particles
    spin = 0.4 * p["radius"] ** 2 * (p["omega"] ** 2).sum(axis=1)
    return float(0.5 * (p["mass"] * ((p["v"] ** 2).sum(axis=1) + spin)).sum())


def potential_energy(particles, gravity):
    """Energy in gravity [J], zero at the origin: -sum m g . x."""
    return float(-(particles["mass"] * (particles["x"][:, :len(gravity)] @ np.asarray(gravity))).sum())


def in_space(array):
    """Fresh array with three columns: a third one of zeros is added to a plane array."""
    out = np.zeros((len(array), 3))
    out[:, :np.shape(array)[1]] = array
    return out


def critical_step(scene):
    """Longest sensible time steps of ``scene`` [s].

    ``rayleigh``: 0.2 of the time a surface wave needs around the smallest sphere, pi R sqrt(rho/G) /
    (0.163 nu + 0.8766) (Thornton and Randall 1988; Li, Xu and Thornton 2005). ``hertz``: 1/20 of the shortest elastic
    contact, 2.87 (m*^2 / (R* E*^2 v))^(1/5) at the largest speed at the start (Johnson 1985); infinite at rest.
    """
    balls, material = scene.spheres, scene.material
    G = material.E / (2.0 * (1.0 + material.nu))
    rayleigh = np.pi * balls.radius * np.sqrt(balls.rho / G) / (0.163 * material.nu + 0.8766)
    speed = np.sqrt((balls.v**2).sum(axis=1).max(initial=0.0))
    if speed == 0.0 or not len(balls.x):
        return CriticalStep(0.2 * rayleigh.min(initial=np.inf), np.inf)
    E_wall = law(material, scene.wall_material, scene.at_wall).E
    E_ball = law(material, material, scene.between).E
    at_wall = balls.mass**2 / (balls.radius * E_wall**2 * speed)
    between = (balls.mass / 2.0) ** 2 / (balls.radius / 2.0 * E_ball**2 * 2.0 * speed)
    shortest = 2.87 * (at_wall.min() if len(balls.x) == 1 else min(at_wall.min(), between.min())) ** 0.2
    return CriticalStep(0.2 * rayleigh.min(), shortest / 20.0)
