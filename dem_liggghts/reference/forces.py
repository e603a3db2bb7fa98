"""Forces on spheres, clusters and walls at one moment; all compiled."""
from typing import NamedTuple

import numpy as np

from ..compiled import compiled
from ..contact.law import (
    Touch,
    Vectors,
    area_at_wall,
    area_of_spheres,
    contact_force,
    new_vectors,
    pair_law,
    radius_at_wall,
)
from ..scene.tables import DEPTH, MATERIAL, RADIUS
from ..search.elements import COLUMNS, DISTANCE, NEAREST, PAIR, POINT, SHARE, WEIGHT
from ..search.history import transfer_history
from ..search.neighbours import Query, springs_in
from ..search.wall_contacts import find_contacts
from .rigid import gather_forces
from .rolling import add_couple, relative_turn

# Distance of a centre from a wall with two sides, as a fraction of the radius, at which the force of now must
# be enough to stop it before the wall
THROUGH = 0.05


class SphereState(NamedTuple):
    """All spheres now; the first ``single`` ones belong to no cluster; SI units. Where ranks share the
    spheres, these are those of this rank, then those of others that are near to them."""

    x: np.ndarray  # (n, 3), as all to torque
    v: np.ndarray
    omega: np.ndarray
    force: np.ndarray
    torque: np.ndarray
    radius: np.ndarray  # (n,), as all to material
    mass: np.ndarray  # the one that counts in a contact
    material: np.ndarray  # number
    gravity: np.ndarray  # (3,)
    single: int


class WallForce(NamedTuple):
    """What acts on the nodes of the walls, (n + 2, 3) each. The last two rows are of the particles: moment of
    all walls about the origin at the points of contact [N m], and mass times place of all [kg m]."""

    impulse: np.ndarray  # of the window [N s]
    force: np.ndarray  # at its end [N]


class Scratch(NamedTuple):
    """Room so that a step allocates nothing."""

    found: np.ndarray  # as in `neighbours.Query`
    corner: np.ndarray
    vectors: Vectors


def new_scratch(elements: int) -> Scratch:
    """Room for spheres that are each near so many elements of walls at most."""
    return Scratch(np.empty((elements + 1, COLUMNS)), np.empty((3, 3)), new_vectors())


class Moment(NamedTuple):
    """A moment in a window at which forces are wanted."""

    t: float  # [s]
    dt: float  # by which tangential displacements grow [s]
    weight: float  # with which forces count in the impulse on the walls [s]
    last: bool  # whether the window ends here


@compiled
def add_sphere_forces(spheres, near, laws, dt, vectors):
    """Add force and torque of all contacts between spheres at the velocities of the half step."""
    b, n, v, spin, force, spring = spheres, vectors.n, vectors.v, vectors.spin, vectors.force, vectors.unused
    springs = springs_in(near)
    for i in range(len(near.start) - 1):
        for q in range(near.start[i], near.start[i + 1]):
            j = near.partner[q]
            r = np.sqrt((b.x[i, 0] - b.x[j, 0])**2 + (b.x[i, 1] - b.x[j, 1])**2 + (b.x[i, 2] - b.x[j, 2])**2)
            overlap = b.radius[i] + b.radius[j] - r
            if springs:
                near.active[q] = overlap > 0.0
                spring = near.shear[q]
                if overlap <= 0.0:
                    spring[:] = 0.0
            if overlap <= 0.0:
                continue
            arm_i, arm_j = b.radius[i] - 0.5 * overlap, b.radius[j] - 0.5 * overlap
            for k in range(3):
                n[k] = (b.x[i, k] - b.x[j, k]) / r
                v[k] = b.v[i, k] - b.v[j, k]
                spin[k] = arm_i * b.omega[i, k] + arm_j * b.omega[j, k]
                if springs > 1:
                    vectors.turn[k] = b.omega[i, k] - b.omega[j, k]
            touch = Touch(overlap, b.radius[i] * b.radius[j] / (b.radius[i] + b.radius[j]),
                          b.mass[i] * b.mass[j] / (b.mass[i] + b.mass[j]),
                          area_of_spheres(r, b.radius[i], b.radius[j]))
            law = pair_law(laws.between, b.material[i], b.material[j])
            contact_force(vectors, spring, touch, law, dt, springs)
            for k in range(3):
                torque = n[(k + 1) % 3] * force[(k + 2) % 3] - n[(k + 2) % 3] * force[(k + 1) % 3]
                b.force[i, k] += force[k]
                b.force[j, k] -= force[k]
                b.torque[i, k] -= arm_i * torque
                b.torque[j, k] -= arm_j * torque
            if springs > 1:
                for k in range(3):
                    b.torque[i, k] += vectors.couple[k]
                    b.torque[j, k] -= vectors.couple[k]


@compiled
def add_moment(x, arm, vectors, moment, on_wall):
    """Book the moment about the origin of the force on a sphere at x, ``arm`` from the point of contact."""
    n, force = vectors.n, vectors.force
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        turned = (x[i] - arm * n[i]) * force[j] - (x[j] - arm * n[j]) * force[i]
        on_wall.impulse[-2, k] += moment.weight * turned
        if moment.last:
            on_wall.force[-2, k] += turned


@compiled
def add_places(spheres, clusters, moment, on_wall):
    """Book mass times place of single spheres and clusters."""
    b, row = spheres, len(on_wall.force) - 1
    for i in range(b.single):
        add_place(b.mass[i], b.x[i], row, moment, on_wall)
    if clusters is not None:
        for i in range(len(clusters.x)):
            add_place(clusters.mass[i], clusters.x[i], row, moment, on_wall)


@compiled
def add_place(mass, x, row, moment, on_wall):
    """Book mass times place."""
    for k in range(3):
        on_wall.impulse[row, k] += moment.weight * mass * x[k]
        if moment.last:
            on_wall.force[row, k] += mass * x[k]


@compiled
def add_wall_forces(spheres, query, laws, moment, on_wall, vectors):
    """Add force and torque of the walls; their nodes collect ``moment.weight`` [s] times minus the force in
    ``on_wall.impulse``, and in the last step minus the force itself. Returns the number of a sphere, from 1,
    whose centre is about to go through a wall, or 0."""
    b, near, wall, found, through = spheres, query.near, query.wall, query.found, 0
    n, v, spin, force, spring = vectors.n, vectors.v, vectors.spin, vectors.force, vectors.unused
    springs = springs_in(near)
    for i in range(len(near.start) - 1):
        if near.start[i] == near.start[i + 1]:
            continue
        kept = find_contacts(query, i, b.x[i], b.radius[i])
        if springs:
            transfer_history(query, i, b.x[i], b.radius[i], kept)
        for c in range(kept):
            q, r = int(found[c, PAIR]), found[c, DISTANCE]
            e, overlap = near.partner[q], b.radius[i] - found[c, NEAREST]
            nodes, radius = wall.elements[e], radius_at_wall(b.radius[i], wall.traits[e, RADIUS])
            # a wall takes the force at its surface; a disc does not turn: there the middle of the overlap
            arm = r if wall.traits[e, RADIUS] == 0.0 else b.radius[i] - 0.5 * overlap
            if springs:
                spring = near.shear[q]
            if springs > 1:
                relative_turn(query, e, b.omega[i], vectors)
            for k in range(3):
                n[k] = -found[c, POINT + k] / r
                v[k] = b.v[i, k]
                spin[k] = arm * b.omega[i, k]
                for a in range(len(nodes)):
                    v[k] -= found[c, WEIGHT + a] * wall.v[nodes[a], k]
            law = pair_law(laws.at_wall, b.material[i], int(wall.traits[e, MATERIAL]))
            touch = Touch(overlap, radius, b.mass[i], area_at_wall(radius - overlap, radius))
            contact_force(vectors, spring, touch, law, moment.dt, springs)
            if r < THROUGH * b.radius[i] and wall.traits[e, DEPTH] < 0.0 and wall.traits[e, RADIUS] == 0.0:
                vn = min(v[0] * n[0] + v[1] * n[1] + v[2] * n[2], 0.0)
                if 0.5 * b.mass[i] * vn**2 > (force[0] * n[0] + force[1] * n[1] + force[2] * n[2]) * r:
                    through = i + 1
            for k in range(3):
                force[k] *= found[c, SHARE]
            for k in range(3):
                b.force[i, k] += force[k]
                k1, k2 = (k + 1) % 3, (k + 2) % 3
                b.torque[i, k] -= arm * (n[k1] * force[k2] - n[k2] * force[k1])
                for a in range(len(nodes)):
                    on_wall.impulse[nodes[a], k] -= moment.weight * found[c, WEIGHT + a] * force[k]
                    if moment.last:
                        on_wall.force[nodes[a], k] -= found[c, WEIGHT + a] * force[k]
            add_moment(b.x[i], arm, vectors, moment, on_wall)
            if springs > 1:
                add_couple(vectors, found[c, SHARE], b.torque[i], nodes, moment, on_wall)
    return through


@compiled
def forces(spheres, clusters, wall, lists, laws, moment, on_wall, scratch):
    """All forces at the positions now; with ``moment.dt`` = 0 the tangential history stays. Returns what
    ``add_wall_forces`` does."""
    b, through = spheres, 0
    for i in range(len(b.x)):
        for k in range(3):
            b.force[i, k] = b.mass[i] * b.gravity[k] if i < b.single else 0.0
            b.torque[i, k] = 0.0
    if len(lists.spheres.partner):  # a call with so many arrays costs more than a short loop
        add_sphere_forces(spheres, lists.spheres, laws, moment.dt, scratch.vectors)
    if len(lists.elements.partner):
        query = Query(lists.elements, wall, moment.t, scratch.found, scratch.corner)
        through = add_wall_forces(spheres, query, laws, moment, on_wall, scratch.vectors)
    if clusters is not None:
        gather_forces(clusters, b.x, b.force, b.torque, b.gravity)
    add_places(b, clusters, moment, on_wall)
    return through
