"""The steps of the built-in DEM: forces of all contacts, velocity Verlet, lists of near partners; all compiled."""
from collections import namedtuple

import numpy as np

from .compiled import compiled
from .contact import area_at_wall, area_of_spheres, contact_force, law_of, radius_at_wall
from .near import Near, hand_over, near_elements, near_spheres
from .rigid import Bodies, carry_spheres, drift_bodies, gather_forces, kick_bodies, speed_bound
from .wall import DEPTH, DISTANCE, KIND, NEAREST, PAIR, POINT, RADIUS, SHARE, WEIGHT, MovingWall
from .wall_contacts import find_contacts

# Distance of a centre from a wall with two sides, as a fraction of the radius, at which the force of now must be enough
# to stop it before the wall
THROUGH = 0.05

# x, v, omega, force, torque, shape (n, 3); radius; mass: the one that counts in a contact; kind: number of the
# material, (n,); gravity (3,); the first ``single`` spheres are no cluster's: SI units
Balls = namedtuple("Balls", "x v omega force torque radius mass kind gravity single")

# Wall nodes (n, 3): impulse of the window [N s], force at its end [N]
Loads = namedtuple("Loads", "impulse force")

# Room so that a step allocates nothing: found (contacts, COLUMNS), corner (3, 3), the others (3,)
Scratch = namedtuple("Scratch", "found corner n v spin shear vt force")

# Near spheres and wall elements, good until centres and wall nodes have moved by skin [m] in all since they were at
# x and wall [m], shape (n, 3)
Lists = namedtuple("Lists", "spheres elements x wall skin")


@compiled
def add_sphere_forces(b, near, between, dt, scratch):
    """Add force and torque of all contacts between spheres at the velocities of the half step."""
    n, v, spin, shear, vt, force = scratch.n, scratch.v, scratch.spin, scratch.shear, scratch.vt, scratch.force
    history = len(near.shear) > 0
    for i in range(len(b.x)):
        for q in range(near.start[i], near.start[i + 1]):
            j = near.partner[q]
            r = np.sqrt((b.x[i, 0] - b.x[j, 0])**2 + (b.x[i, 1] - b.x[j, 1])**2 + (b.x[i, 2] - b.x[j, 2])**2)
            overlap = b.radius[i] + b.radius[j] - r
            if history:
                near.active[q] = overlap > 0.0
                shear = near.shear[q]
                if overlap <= 0.0:
                    shear[:] = 0.0
            if overlap <= 0.0:
                continue
            arm_i, arm_j = b.radius[i] - 0.5 * overlap, b.radius[j] - 0.5 * overlap
            for k in range(3):
                n[k] = (b.x[i, k] - b.x[j, k]) / r
                v[k] = b.v[i, k] - b.v[j, k]
                spin[k] = arm_i * b.omega[i, k] + arm_j * b.omega[j, k]
            contact_force(n, overlap, v, spin, b.radius[i] * b.radius[j] / (b.radius[i] + b.radius[j]),
                          b.mass[i] * b.mass[j] / (b.mass[i] + b.mass[j]), area_of_spheres(r, b.radius[i], b.radius[j]),
                          law_of(between, b.kind[i], b.kind[j]), dt, history, shear, vt, force)
            for k in range(3):
                torque = n[(k + 1) % 3] * force[(k + 2) % 3] - n[(k + 2) % 3] * force[(k + 1) % 3]
                b.force[i, k] += force[k]
                b.force[j, k] -= force[k]
                b.torque[i, k] -= arm_i * torque
                b.torque[j, k] -= arm_j * torque


@compiled
def add_wall_forces(b, wall, t, near, at_wall, dt, weight, last, loads, scratch):
    """Add force and torque of the walls at time t [s] of the window; their nodes collect ``weight`` [s] times minus the
    force in ``loads.impulse``, and in the ``last`` step minus the force itself. Returns the number of a sphere, from 1,
    whose centre is about to go through a wall, or 0."""
    n, v, spin, shear, vt, force = scratch.n, scratch.v, scratch.spin, scratch.shear, scratch.vt, scratch.force
    found, history, through = scratch.found, len(near.shear) > 0, 0
    for i in range(len(b.x)):
        if near.start[i] == near.start[i + 1]:
            continue
        kept = find_contacts(b.x[i], b.radius[i], near, i, wall, t, scratch.corner, found)
        if history:
            hand_over(near, i, b.x[i], b.radius[i], wall, t, found, kept, scratch.corner)
        for c in range(kept):
            q, r = int(found[c, PAIR]), found[c, DISTANCE]
            e, overlap = near.partner[q], b.radius[i] - found[c, NEAREST]
            nodes, radius = wall.elements[e], radius_at_wall(b.radius[i], wall.traits[e, RADIUS])
            # a wall takes the force at its surface; a disc does not turn: there the middle of the overlap
            arm = r if wall.traits[e, RADIUS] == 0.0 else b.radius[i] - 0.5 * overlap
            if history:
                shear = near.shear[q]
            for k in range(3):
                n[k] = -found[c, POINT + k] / r
                v[k] = b.v[i, k]
                spin[k] = arm * b.omega[i, k]
                for a in range(len(nodes)):
                    v[k] -= found[c, WEIGHT + a] * wall.v[nodes[a], k]
            law = law_of(at_wall, b.kind[i], int(wall.traits[e, KIND]))
            contact_force(n, overlap, v, spin, radius, b.mass[i], area_at_wall(radius - overlap, radius), law, dt,
                          history, shear, vt, force)
            if r < THROUGH * b.radius[i] and wall.traits[e, DEPTH] < 0.0 and wall.traits[e, RADIUS] == 0.0:
                vn = min(v[0] * n[0] + v[1] * n[1] + v[2] * n[2], 0.0)
                if 0.5 * b.mass[i] * vn**2 > (force[0] * n[0] + force[1] * n[1] + force[2] * n[2]) * r:
                    through = i + 1
            for k in range(3):
                force[k] *= found[c, SHARE]
            for k in range(3):
                b.force[i, k] += force[k]
                b.torque[i, k] -= arm * (n[(k + 1) % 3] * force[(k + 2) % 3] - n[(k + 2) % 3] * force[(k + 1) % 3])
                for a in range(len(nodes)):
                    loads.impulse[nodes[a], k] -= weight * found[c, WEIGHT + a] * force[k]
                    if last:
                        loads.force[nodes[a], k] -= found[c, WEIGHT + a] * force[k]
    return through


@compiled
def forces(b, bodies, wall, t, lists, between, at_wall, dt, weight, last, loads, scratch):
    """All forces at the positions now; a step dt = 0 leaves the tangential history alone. Returns what
    ``add_wall_forces`` does."""
    through = 0
    for i in range(len(b.x)):
        for k in range(3):
            b.force[i, k] = b.mass[i] * b.gravity[k] if i < b.single else 0.0
            b.torque[i, k] = 0.0
    if len(lists.spheres.partner):  # a call with so many arrays costs more than a short loop
        add_sphere_forces(b, lists.spheres, between, dt, scratch)
    if len(lists.elements.partner):
        through = add_wall_forces(b, wall, t, lists.elements, at_wall, dt, weight, last, loads, scratch)
    if bodies is not None:
        gather_forces(Bodies(*bodies), b.x, b.force, b.torque, b.gravity)
    return through


@compiled
def kick(b, half):
    """Half a step of velocity and spin [s] of the single spheres, I = 2/5 m R^2."""
    for i in range(b.single):
        for k in range(3):
            b.v[i, k] += half / b.mass[i] * b.force[i, k]
            b.omega[i, k] += half / (0.4 * b.mass[i] * b.radius[i] ** 2) * b.torque[i, k]


@compiled
def kick_and_drift(b, bodies, dt, scratch):
    """Half a kick and the way of a step dt [s]."""
    kick(b, 0.5 * dt)
    for i in range(b.single):
        for k in range(3):
            b.x[i, k] += dt * b.v[i, k]
    if bodies is not None:
        drift_bodies(Bodies(*bodies), dt, scratch.vt)
        carry_spheres(Bodies(*bodies), b.x, b.v, b.omega, True)


@compiled
def last_kick(b, bodies, half):
    """The second half kick of a step [s]."""
    kick(b, half)
    if bodies is not None:
        kick_bodies(Bodies(*bodies), half)
        carry_spheres(Bodies(*bodies), b.x, b.v, b.omega, False)


@compiled
def wall_travel(wall, built_wall, t):
    """Largest distance of a wall node at time t [s] from where it was when the lists were built, ``built_wall`` [m],
    and largest speed of a node [m/s]; NaN when a node is."""
    away2, speed2, total = 0.0, 0.0, 0.0
    for i in range(len(wall.x)):
        a2 = s2 = 0.0
        for k in range(3):
            a2 += (wall.x[i, k] + wall.v[i, k] * t - built_wall[i, k]) ** 2
            s2 += wall.v[i, k] ** 2
        away2, speed2, total = max(away2, a2), max(speed2, s2), total + a2
    return (np.sqrt(away2) if np.isfinite(total) else np.nan), np.sqrt(speed2)


@compiled
def ball_travel(b, bodies, built, dt):
    """Largest distance of a centre from ``built`` [m] at the end of the coming step."""
    largest = 0.0
    for i in range(b.single):
        step2 = 0.0
        for k in range(3):
            step2 += (b.v[i, k] + 0.5 * dt / b.mass[i] * b.force[i, k]) ** 2
        largest = max(largest, _away(b.x, built, i) + dt * np.sqrt(step2))
    if bodies is not None:
        r = Bodies(*bodies)
        for c in range(len(r.x)):
            away = 0.0
            for i in range(r.first[c], r.first[c + 1]):
                away = max(away, _away(b.x, built, i))
            largest = max(largest, away + dt * speed_bound(r, c, dt))
    return largest


@compiled
def _away(x, built, i):
    return np.sqrt((x[i, 0] - built[i, 0]) ** 2 + (x[i, 1] - built[i, 1]) ** 2 + (x[i, 2] - built[i, 2]) ** 2)


@compiled
def run(first, begin, end, steps, dt, skin, fresh, bodies, *fields):
    """Velocity Verlet from step ``begin`` to ``end`` of a window of ``steps``, in the order of LIGGGHTS: half kick,
    drift, forces with the velocities of the half step, half kick. The lists are in use since step ``first``.

    ``fields`` are those of `Balls`, `Loads`, `Scratch`, `MovingWall`, both `Near` of the lists, the places they were
    built at, and the two tables of laws, in one row: numba recognises that in a call much faster than nested tuples.
    ``bodies`` is None in a scene without clusters, which compiles to a loop without them. Returns the number of steps
    done: fewer when the lists became too old (at least one when they are ``fresh``), -1 when the wall holds NaN,
    -1 - i when sphere i is about to go through a wall.
    """
    b, loads, scratch = Balls(*fields[:10]), Loads(*fields[10:12]), Scratch(*fields[12:20])
    wall, lists = MovingWall(*fields[20:24]), Lists(Near(*fields[24:28]), Near(*fields[28:32]), *fields[32:34], skin)
    between, at_wall = fields[34:]
    node, node_speed = wall_travel(wall, lists.wall, first * dt)
    if not np.isfinite(node + node_speed):
        return -1
    for step in range(begin, end):
        ball = ball_travel(b, bodies, lists.x, dt)
        closed_in = max(2.0 * ball, ball + node + node_speed * (step + 1 - first) * dt)
        if closed_in > lists.skin and not (fresh and step == first):
            return step
        kick_and_drift(b, bodies, dt, scratch)
        last = step + 1 == steps
        through = forces(b, bodies, wall, (step + 1) * dt, lists, between, at_wall, dt, 0.5 * dt if last else dt, last,
                         loads, scratch)
        if through:
            return -1 - through
        last_kick(b, bodies, 0.5 * dt)
    return end


@compiled
def build_lists(b, body, wall, t, skin, old, keep, keep_wall):
    """Lists of near partners for spheres of different ``body`` and walls as they are at time t [s] of the window."""
    here = np.empty_like(wall.x)
    for i in range(len(here)):
        for k in range(3):
            here[i, k] = wall.x[i, k] + wall.v[i, k] * t
    return Lists(near_spheres(b.x, b.radius, body, skin, old.spheres, keep),
                 near_elements(b.x, b.radius, skin, wall, t, old.elements, keep_wall), b.x.copy(), here, skin)
