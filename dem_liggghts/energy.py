"""Energies of particles and bodies, the same for both back ends."""
import numpy as np

from . import parts, quaternion
from .arrays import in_space
from .compiled import compiled
from .contact import law_of, laws, radius_at_wall
from .near import near_elements, near_spheres, nothing
from .wall import COLUMNS, KIND, NEAREST, PAIR, RADIUS, SHARE, MovingWall
from .wall_contacts import find_contacts

_last = []  # the scene asked for last, and what ``_prepared`` made of it


@compiled
def _of_pairs(x, radius, kind, near, between):
    """Sum over all pairs in contact: 2/5 k d^2.5 with k = 4/3 E* sqrt(R*), less the work of adhesion [J]."""
    energy = 0.0
    for i in range(len(x)):
        for q in range(near.start[i], near.start[i + 1]):
            j = near.partner[q]
            a, b, r = radius[i], radius[j], np.sqrt(np.sum((x[i] - x[j]) ** 2))
            if r < a + b:
                law = law_of(between, kind[i], kind[j])
                energy += 8.0 / 15.0 * law.E * np.sqrt(a * b / (a + b)) * (a + b - r) ** 2.5
                energy -= law.adhesion * (_pulled(a + b, a, b) - _pulled(r, a, b))
    return energy


@compiled
def _pulled(r, a, b):
    """Antiderivative of `contact.area_of_spheres` over the distance r [m^3]."""
    s, d = (a + b) ** 2, (a - b) ** 2
    return 0.25 * np.pi * ((s + d) * r - r**3 / 3.0 + s * d / r)


@compiled
def _at_walls(x, radius, kind, near, wall, at_wall):
    """The same over all contacts with walls [J]."""
    energy, corner, found = 0.0, np.empty((3, 3)), np.empty((len(wall.elements) + 1, COLUMNS))
    for i in range(len(x)):
        for c in range(find_contacts(x[i], radius[i], near, i, wall, 0.0, corner, found)):
            traits = wall.traits[near.partner[int(found[c, PAIR])]]
            law = law_of(at_wall, kind[i], int(traits[KIND]))
            d, reduced = radius[i] - found[c, NEAREST], radius_at_wall(radius[i], traits[RADIUS])
            energy += found[c, SHARE] * 8.0 / 15.0 * law.E * np.sqrt(reduced) * d**2.5
            energy -= found[c, SHARE] * law.adhesion * np.pi * (reduced * d**2 - d**3 / 3.0)
    return energy


@compiled
def _of_all(x, radius, kind, body, nodes, elements, traits, between, at_wall):
    """Both sums [J]. Takes plain arrays: numba looks up the types of named tuples anew in every call, which costs more
    than the sums."""
    wall, none, energy = MovingWall(nodes, np.zeros_like(nodes), elements, traits), nothing(len(x)), 0.0
    history = len(x) < 0  # no; for the word False numba would compile the searches once more
    if len(x) > 1:
        energy += _of_pairs(x, radius, kind, near_spheres(x, radius, body, 0.0, none, history), between)
    near = near_elements(x, radius, 0.0, wall, 0.0, none, history)
    return energy + _at_walls(x, radius, kind, near, wall, at_wall)


def contact_energy(scene, x, nodes, present=slice(None)):
    """Potential energy of all contacts [J]: 2/5 k d^2.5 each, the integral of Hertz' force over the overlap d, less
    what adhesion has done on the way in.

    x: centres of the spheres of ``scene`` [m], shape (n, dim) or (n, 3); nodes: nodes of the moving wall [m], the same;
    present: which of the spheres of the scene these are.
    """
    (balls, surface, between, at_wall), x = _prepared(scene), in_space(x)
    surface.x[surface.own[0]:] = in_space(nodes)
    return _of_all(x, balls.radius[present], balls.kind[present], balls.body[present], surface.x, surface.elements,
                   surface.traits, between, at_wall)


def _prepared(scene):
    """What stays of a scene from call to call; of the last one, since that is who asks again in every window."""
    if not _last or _last[0] is not scene:
        _last[:] = [scene, (parts.grains(scene), parts.surface(scene), laws(scene, scene.pairs()),
                            laws(scene, scene.wall_pairs()))]
    return _last[1]


def kinetic_energy(particles, bodies=(), inertia=(), turn=()):
    """Energy of translation and spin [J]: of single ``particles`` (dtype PARTICLE) with I = 2/5 m R^2, of ``bodies``
    (dtype BODY) with their principal moments ``inertia`` [kg m^2], (n, 3), about axes that ``turn``, (n, 4), brings to
    theirs."""
    p = particles[particles["body"] == 0]
    spin = 0.4 * p["radius"] ** 2 * (p["omega"] ** 2).sum(axis=1)
    energy = float(0.5 * (p["mass"] * ((p["v"] ** 2).sum(axis=1) + spin)).sum())
    for body, moments, axes in zip(bodies, inertia, turn):
        omega = quaternion.matrix(quaternion.product(body["quaternion"], axes)).T @ body["omega"]
        energy += float(0.5 * (body["mass"] * body["v"] @ body["v"] + moments @ omega**2))
    return energy


def potential_energy(particles, gravity, bodies=()):
    """Energy in gravity [J], zero where x is: -sum m g . x."""
    energy = 0.0
    for some in (particles[particles["body"] == 0], bodies):
        if len(some):
            energy -= float((some["mass"] * (some["x"][:, :len(gravity)] @ np.asarray(gravity))).sum())
    return energy
