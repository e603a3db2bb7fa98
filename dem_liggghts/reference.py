"""The built-in DEM: spheres, Hertz-Mindlin contact, velocity Verlet; small, obvious, the same on every rank."""
from collections import namedtuple

import numpy as np

from .checks import check_finite
from .contact import contact_energy, contact_force, in_space, kinetic_energy, law, potential_energy
from .protocol import PARTICLE
from .wall import COLUMNS, DISTANCE, PAIR, POINT, WEIGHT, MovingWall, Near, compiled, find_contacts, hand_over, \
    near_elements, with_history

# x, v, omega, force, torque, shape (n, 3); radius, mass (n,); gravity (3,): SI units
Balls = namedtuple("Balls", "x v omega force torque radius mass gravity")

# Wall nodes (n, 3): impulse of the window [N s], force at its end [N]
Loads = namedtuple("Loads", "impulse force")

# Near spheres and wall elements, good until centres and wall nodes have moved by skin [m] in all since they were at
# x and wall [m], shape (n, 3)
Lists = namedtuple("Lists", "spheres elements x wall skin")

MOVING = ("x", "v", "omega", "force", "torque")
NONE = Near(np.zeros(1, np.int64), np.zeros(0, np.int64), np.zeros(0, np.bool_), np.zeros((0, 3)))


@compiled
def near_spheres(x, radius, skin, old, history):
    """List of the partners j > i of each sphere whose gap is less than ``skin`` [m]."""
    n = len(x)
    start, partner, count = np.zeros(n + 1, np.int64), np.empty(64, np.int64), 0
    for i in range(n):
        for j in range(i + 1, n):
            dx, dy, dz = x[i, 0] - x[j, 0], x[i, 1] - x[j, 1], x[i, 2] - x[j, 2]
            if dx * dx + dy * dy + dz * dz < (radius[i] + radius[j] + skin) ** 2:
                if count == len(partner):
                    partner = np.append(partner, partner)  # room for twice as many
                partner[count] = j
                count += 1
        start[i + 1] = count
    return with_history(start, partner[:count], old, history)


@compiled
def add_sphere_forces(b, near, between, dt):
    """Add force and torque of all contacts between spheres at the velocities of the half step."""
    n, v, spin = np.empty(3), np.empty(3), np.empty(3)
    shear, vt, force, history = np.zeros(3), np.empty(3), np.empty(3), between.friction > 0.0
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
                          b.mass[i] * b.mass[j] / (b.mass[i] + b.mass[j]), between, dt, history, shear, vt, force)
            for k in range(3):
                torque = n[(k + 1) % 3] * force[(k + 2) % 3] - n[(k + 2) % 3] * force[(k + 1) % 3]
                b.force[i, k] += force[k]
                b.force[j, k] -= force[k]
                b.torque[i, k] -= arm_i * torque
                b.torque[j, k] -= arm_j * torque


@compiled
def add_wall_forces(b, wall, t, near, at_wall, dt, weight, last, loads, found):
    """Add force and torque of the wall at time t [s] of the window; its nodes collect ``weight`` [s] times minus the
    force in ``loads.impulse``, and in the ``last`` step minus the force itself."""
    n, v, spin, corner = np.empty(3), np.empty(3), np.empty(3), np.empty((3, 3))
    shear, vt, force, history = np.zeros(3), np.empty(3), np.empty(3), at_wall.friction > 0.0
    for i in range(len(b.x)):
        if near.start[i] == near.start[i + 1]:
            continue
        kept = find_contacts(b.x[i], b.radius[i], near, i, wall, t, corner, found)
        if history:
            hand_over(near, i, wall.elements, found, kept)
        for c in range(kept):
            q, r = int(found[c, PAIR]), found[c, DISTANCE]
            nodes, overlap = wall.elements[near.partner[q]], b.radius[i] - r
            arm = b.radius[i] - 0.5 * overlap
            if history:
                shear = near.shear[q]
            for k in range(3):
                n[k] = -found[c, POINT + k] / r
                v[k] = b.v[i, k]
                spin[k] = arm * b.omega[i, k]
                for a in range(len(nodes)):
                    v[k] -= found[c, WEIGHT + a] * wall.v[nodes[a], k]
            contact_force(n, overlap, v, spin, b.radius[i], b.mass[i], at_wall, dt, history, shear, vt, force)
            for k in range(3):
                b.force[i, k] += force[k]
                b.torque[i, k] -= arm * (n[(k + 1) % 3] * force[(k + 2) % 3] - n[(k + 2) % 3] * force[(k + 1) % 3])
                for a in range(len(nodes)):
                    loads.impulse[nodes[a], k] -= weight * found[c, WEIGHT + a] * force[k]
                    if last:
                        loads.force[nodes[a], k] -= found[c, WEIGHT + a] * force[k]


@compiled
def forces(b, wall, t, lists, between, at_wall, dt, weight, last, loads, found):
    """All forces at the positions now; a step dt = 0 leaves the tangential history alone."""
    for i in range(len(b.x)):
        for k in range(3):
            b.force[i, k] = b.mass[i] * b.gravity[k]
            b.torque[i, k] = 0.0
    add_sphere_forces(b, lists.spheres, between, dt)
    add_wall_forces(b, wall, t, lists.elements, at_wall, dt, weight, last, loads, found)


@compiled
def kick(b, half):
    """Half a step of velocity and spin [s], I = 2/5 m R^2."""
    for i in range(len(b.x)):
        for k in range(3):
            b.v[i, k] += half / b.mass[i] * b.force[i, k]
            b.omega[i, k] += half / (0.4 * b.mass[i] * b.radius[i] ** 2) * b.torque[i, k]


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
def ball_travel(b, built, dt):
    """Largest distance of a centre from ``built`` [m] at the end of the coming step."""
    largest = 0.0
    for i in range(len(b.x)):
        away2 = step2 = 0.0
        for k in range(3):
            away2 += (b.x[i, k] - built[i, k]) ** 2
            step2 += (b.v[i, k] + 0.5 * dt / b.mass[i] * b.force[i, k]) ** 2
        largest = max(largest, np.sqrt(away2) + dt * np.sqrt(step2))
    return largest


@compiled
def run(b, wall, first, steps, dt, lists, between, at_wall, loads, found, fresh):
    """Velocity Verlet from step ``first`` to ``steps`` of the window, in the order of LIGGGHTS: half kick, drift,
    forces with the velocities of the half step, half kick.

    Returns the number of steps done: fewer when the lists became too old (at least one when they are ``fresh``), -1
    when the wall holds NaN.
    """
    node, node_speed = wall_travel(wall, lists.wall, first * dt)
    if not np.isfinite(node + node_speed):
        return -1
    for step in range(first, steps):
        ball = ball_travel(b, lists.x, dt)
        closed_in = max(2.0 * ball, ball + node + node_speed * (step + 1 - first) * dt)
        if closed_in > lists.skin and not (fresh and step == first):
            return step
        kick(b, 0.5 * dt)
        for i in range(len(b.x)):
            for k in range(3):
                b.x[i, k] += dt * b.v[i, k]
        last = step + 1 == steps
        forces(b, wall, (step + 1) * dt, lists, between, at_wall, dt, 0.5 * dt if last else dt, last, loads, found)
        kick(b, 0.5 * dt)
    return steps


@compiled
def build_lists(b, wall, t, skin, old, keep, keep_wall):
    """Lists of near partners for spheres and wall as they are at time t [s] of the window."""
    here = np.empty_like(wall.x)
    for i in range(len(here)):
        for k in range(3):
            here[i, k] = wall.x[i, k] + wall.v[i, k] * t
    return Lists(near_spheres(b.x, b.radius, skin, old.spheres, keep),
                 near_elements(b.x, b.radius, skin, wall, t, old.elements, keep_wall), b.x.copy(), here, skin)


class ReferenceDEM:
    """The protocol of `protocol.DEM` for ``scene``, time step ``dt`` [s]. ``comm`` is not used: the work is repeated
    on every rank, with the same result."""

    def __init__(self, scene, dt, comm=None):
        balls = scene.spheres
        self.scene, self.dt = scene, float(dt)
        self._steps = 0
        zeros = np.zeros((len(balls.x), 3))
        gravity = in_space(np.array([scene.gravity]))[0]
        self._balls = Balls(in_space(balls.x), in_space(balls.v), balls.omega.copy(), zeros, zeros.copy(),
                            balls.radius.copy(), balls.mass, gravity)
        self._between = law(scene.material, scene.material, scene.between)
        self._at_wall = law(scene.material, scene.wall_material, scene.at_wall)
        self._elements = np.array(scene.wall.elements)
        self._found = np.empty((len(self._elements) + 1, COLUMNS))
        self._wall = self._still_wall(in_space(scene.wall.nodes))
        self._loads = Loads(np.zeros_like(self._wall.x), np.zeros_like(self._wall.x))
        self._lists = Lists(NONE, NONE, self._balls.x, self._wall.x, 0.0)
        self._build_lists(self._wall, 0.0)
        forces(self._balls, self._wall, 0.0, self._lists, self._between, self._at_wall, 0.0, 0.0, True, self._loads,
               self._found)

    @property
    def time(self):
        """[s]"""
        return self._steps * self.dt

    def _still_wall(self, nodes):
        return MovingWall(nodes, np.zeros_like(nodes), self._elements)

    def _build_lists(self, wall, t):
        """A skin that lasts some ten steps at the speeds of now: long enough to be cheap, short enough to be short."""
        speed = np.sqrt((self._balls.v**2).sum(axis=1).max()) + np.sqrt((wall.v**2).sum(axis=1).max())
        skin = max(0.1 * self._balls.radius.min(), 20.0 * self.dt * speed)
        self._lists = build_lists(self._balls, wall, t, skin, self._lists, self._between.friction > 0.0,
                                  self._at_wall.friction > 0.0)

    def advance(self, steps, x, v):
        """See `protocol.DEM.advance`. Raises FloatingPointError when a number is no longer finite."""
        shape = self.scene.wall.nodes.shape
        if np.shape(x) != shape or np.shape(v) != shape:
            raise ValueError(f"wall nodes x {np.shape(x)} and v {np.shape(v)}: both must have shape {shape}")
        if steps < 1:
            raise ValueError(f"steps is {steps}: a window has at least one DEM step")
        wall = MovingWall(in_space(x), in_space(v), self._elements)
        loads = self._loads
        np.multiply(loads.force, 0.5 * self.dt, out=loads.impulse)
        loads.force[:] = 0.0
        done, fresh = 0, False
        while True:
            done = run(self._balls, wall, done, steps, self.dt, self._lists, self._between, self._at_wall, loads,
                       self._found, fresh)
            if done == steps:
                break
            if done < 0:
                raise FloatingPointError(f"the wall given at t = {self.time:.6g} s contains NaN or infinity: "
                                         "look at the motion of the body")
            self._build_lists(wall, done * self.dt)
            fresh = True
        self._steps += steps
        self._wall = self._still_wall(wall.x + wall.v * (steps * self.dt))
        check_finite(self._balls.x, self.time)
        return loads.impulse[:, :self.scene.dim] / (steps * self.dt)

    def particles(self):
        """See `protocol.DEM.particles`; the ids count from 1 in the order of the scene."""
        out = np.empty(len(self._balls.x), PARTICLE)
        out["id"] = np.arange(1, len(out) + 1)
        for name in ("x", "v", "omega", "radius", "mass"):
            out[name] = getattr(self._balls, name)
        return out

    def energy(self):
        """See `protocol.DEM.energy`."""
        particles = self.particles()
        return dict(kinetic=kinetic_energy(particles), potential=potential_energy(particles, self.scene.gravity),
                    contact=contact_energy(self.scene, particles["x"], self._wall.x))

    def get_state(self):
        """See `protocol.DEM.get_state`."""
        state = {name: getattr(self._balls, name).copy() for name in MOVING}
        state.update(steps=np.array(self._steps), wall=self._wall.x.copy(), wall_force=self._loads.force.copy())
        for of in ("spheres", "elements"):
            near = getattr(self._lists, of)
            state.update({f"{of}_{name}": getattr(near, name).copy() for name in Near._fields})
        return state

    def set_state(self, state):
        """See `protocol.DEM.set_state`."""
        for name in MOVING:
            getattr(self._balls, name)[:] = state[name]
        self._steps = int(state["steps"])
        self._wall = self._still_wall(np.array(state["wall"]))
        self._loads.force[:] = state["wall_force"]
        spheres, elements = (Near(*(state[f"{of}_{name}"] for name in Near._fields)) for of in ("spheres", "elements"))
        self._lists = Lists(spheres, elements, self._balls.x, self._wall.x, 0.0)
        self._build_lists(self._wall, 0.0)

    def close(self):
        """Nothing to free."""
