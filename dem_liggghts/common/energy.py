"""Energies of particles and bodies, the same for both back ends."""
from typing import Any, NamedTuple

import numpy as np

from .. import quaternion
from ..compiled import compiled
from ..contact.law import Laws, laws_of, pair_law, radius_at_wall
from ..scene.arrays import in_space
from ..scene.scene import SceneData
from ..scene.tables import MATERIAL, RADIUS, SphereTable, sphere_table, wall_table
from ..search.elements import COLUMNS, NEAREST, PAIR, SHARE, MovingWall, at_rest
from ..search.neighbours import Query, near_elements, near_spheres, no_neighbours
from ..search.wall_contacts import find_contacts


class Shapes(NamedTuple):
    """Spheres as far as the energy of their contacts depends on them, (n, …) each."""

    x: np.ndarray  # centres [m], (n, 3)
    radius: np.ndarray  # [m]
    material: np.ndarray  # number
    cluster: np.ndarray  # number, -1 for a single sphere


@compiled
def _of_pairs(spheres, near, between):
    """Sum over all pairs in contact: 2/5 k d^2.5 with k = 4/3 E* sqrt(R*), less the work of adhesion [J]."""
    energy, x, radius = 0.0, spheres.x, spheres.radius
    for i in range(len(x)):
        for q in range(near.start[i], near.start[i + 1]):
            j = near.partner[q]
            a, b, r = radius[i], radius[j], np.sqrt(np.sum((x[i] - x[j]) ** 2))
            if r < a + b:
                law = pair_law(between, spheres.material[i], spheres.material[j])
                energy += 8.0 / 15.0 * law.E * np.sqrt(a * b / (a + b)) * (a + b - r) ** 2.5
                energy -= law.adhesion * (_area_integral(a + b, a, b) - _area_integral(r, a, b))
    return energy


@compiled
def _area_integral(r, a, b):
    """Antiderivative of `law.area_of_spheres` over the distance r [m^3]."""
    s, d = (a + b) ** 2, (a - b) ** 2
    return 0.25 * np.pi * ((s + d) * r - r**3 / 3.0 + s * d / r)


@compiled
def _at_walls(spheres, near, wall, at_wall):
    """The same over all contacts with walls [J]."""
    query = Query(near, wall, 0.0, np.empty((len(near.partner) + 1, COLUMNS)), np.empty((3, 3)))
    energy, found, radius = 0.0, query.found, spheres.radius
    for i in range(len(radius)):
        for c in range(find_contacts(query, i, spheres.x[i], radius[i])):
            traits = wall.traits[near.partner[int(found[c, PAIR])]]
            law = pair_law(at_wall, spheres.material[i], int(traits[MATERIAL]))
            d, reduced = radius[i] - found[c, NEAREST], radius_at_wall(radius[i], traits[RADIUS])
            energy += found[c, SHARE] * 8.0 / 15.0 * law.E * np.sqrt(reduced) * d**2.5
            energy -= found[c, SHARE] * law.adhesion * np.pi * (reduced * d**2 - d**3 / 3.0)
    return energy


@compiled
def energy_of_contacts(spheres: Shapes, wall: MovingWall, laws: Laws) -> float:
    """Energy of all contacts of the spheres with each other and the walls [J]; for ``direct``."""
    x, radius, none, energy = spheres.x, spheres.radius, no_neighbours(len(spheres.x)), 0.0
    springs = 0 * len(x)  # none; for a plain 0 numba would compile the searches once more
    if len(x) > 1:
        pairs = near_spheres(x, radius, spheres.cluster, 0.0, none, springs)
        energy += _of_pairs(spheres, pairs, laws.between)
    near = near_elements(x, radius, 0.0, wall, 0.0, none, springs)
    return energy + _at_walls(spheres, near, wall, laws.at_wall)


def select_shapes(table: SphereTable, x: np.ndarray, present: Any) -> Shapes:
    """The spheres of ``table`` that are ``present``, at x [m], (n, 3)."""
    return Shapes(x, table.radius[present], table.material[present], table.cluster[present])


def contact_energy(scene: SceneData, x: Any, nodes: Any, present: Any = slice(None)) -> float:
    """Potential energy of all contacts [J]: 2/5 k d^2.5 each, the integral of Hertz' force over the overlap
    d, less what adhesion has done on the way in.

    x: centres of the spheres of ``scene`` [m], shape (n, dim) or (n, 3); nodes: nodes of the moving wall [m],
    the same; present: which of the spheres of the scene these are.

    >>> from dem_liggghts import Material, Scene, Spheres, Wall
    >>> steel, wall = Material(2.1e11, 0.3), Wall([[-1.0, 0.0], [1.0, 0.0]], [[0, 1]])
    >>> sphere = Spheres(x=[[0.0, 0.01]], v=[[0.0, -0.01]], radius=0.01, rho=7800.0)
    >>> scene = Scene(sphere, wall, material=steel, wall_material=steel)
    >>> f"{contact_energy(scene, [[0.0, 0.01 - 1e-5]], wall.nodes):.3g} J"
    '0.00195 J'
    """
    spheres, table = sphere_table(scene), wall_table(scene)
    table.x[table.moving[0]:] = in_space(nodes)
    shapes = select_shapes(spheres, in_space(x), present)
    return energy_of_contacts(shapes, at_rest(table, table.x), laws_of(scene))


def kinetic_energy(particles: np.ndarray, bodies: Any = (), inertia: Any = (), turn: Any = ()) -> float:
    """Energy of translation and spin [J]: of single ``particles`` (dtype PARTICLE) with I = 2/5 m R^2, of
    ``bodies`` (dtype BODY) with their principal moments ``inertia`` [kg m^2], (n, 3), about axes that
    ``turn``, (n, 4), brings to theirs.

    >>> from dem_liggghts import PARTICLE
    >>> particle = np.zeros(1, PARTICLE)
    >>> particle["mass"], particle["v"] = 2.0, (3.0, 0.0, 0.0)
    >>> kinetic_energy(particle)
    9.0
    """
    p = particles[particles["body"] == 0]
    spin = 0.4 * p["radius"] ** 2 * (p["omega"] ** 2).sum(axis=1)
    energy = float(0.5 * (p["mass"] * ((p["v"] ** 2).sum(axis=1) + spin)).sum())
    for body, moments, axes in zip(bodies, inertia, turn):
        omega = quaternion.matrix(quaternion.product(body["quaternion"], axes)).T @ body["omega"]
        energy += float(0.5 * (body["mass"] * body["v"] @ body["v"] + moments @ omega**2))
    return energy


def potential_energy(particles: np.ndarray, gravity: Any, bodies: Any = ()) -> float:
    """Energy in gravity [J], zero where x is: -sum m g . x.

    >>> from dem_liggghts import PARTICLE
    >>> particle = np.zeros(1, PARTICLE)
    >>> particle["mass"], particle["x"] = 2.0, (0.0, 1.5, 0.0)
    >>> potential_energy(particle, gravity=(0.0, -10.0))
    30.0
    """
    energy = 0.0
    for some in (particles[particles["body"] == 0], bodies):
        if len(some):
            energy -= float((some["mass"] * (some["x"][:, :len(gravity)] @ np.asarray(gravity))).sum())
    return energy
