"""The built-in DEM: spheres and rigid clusters, Hertz-Mindlin contact, velocity Verlet; the same on every rank."""
from dataclasses import replace

import numpy as np

from . import parts, quaternion
from .arrays import in_space
from .carry import carry_force, with_wall
from .checks import PerforatedError, check_finite, check_window, through_the_wall
from .contact import field, laws
from .energy import contact_energy, kinetic_energy, potential_energy
from .frame import find_origin, leave, moved, shifted
from .near import Near, nothing, renumber
from .outflow import Outflow
from .pieces import Pieces
from .protocol import BODY, PARTICLE
from .rigid import Bodies, omega_to_spin, turn_axes
from .states import check_state, fingerprint
from .subset import of_grains, of_near, of_rigid
from .verlet import Balls, Lists, Loads, Scratch, build_lists, forces, run
from .wall import COLUMNS, MovingWall, at_rest
from .window import AtWall

MOVING = ("x", "v", "omega", "force", "torque")
LARGE = 2000  # elements of a wall
BODY_MOVING = ("x", "v", "omega", "spin", "force", "torque", "q", "axes")
NAMES = (*MOVING, "origin", "steps", "wall", "wall_elements", "wall_force", "near_x", "near_wall", "skin",  # of a state
         *(f"near_{of}_{name}" for of in ("spheres", "elements") for name in Near._fields))


class ReferenceDEM(AtWall):
    """The protocol of `protocol.DEM` for ``scene`` and the time step ``dt`` [s]. ``comm`` is not used: the work is
    repeated on every rank, with the same result."""

    def __init__(self, scene, dt, comm=None):
        self.dt, self._steps, self._closed, self._pieces = float(dt), 0, False, Pieces()
        self._fingerprint, self.origin = fingerprint(scene, self.dt), find_origin(scene)
        inside = moved(scene, -self.origin)
        self._whole, self.scene = (parts.grains(inside), parts.rigid(inside)), scene
        self._outflow = Outflow(scene, self._whole[0].body)
        self._populate(np.ones(len(self._whole[0].x), np.bool_), np.ones(len(scene.clusters), np.bool_))
        between, at_wall = laws(scene, scene.pairs()), laws(scene, scene.wall_pairs())
        self._laws, self._keep = (between, at_wall), [field(pairs, "friction").any() for pairs in (between, at_wall)]
        self._use(scene)
        none = nothing(len(self._start.x))
        self._lists = Lists(none, none, self._balls.x, self._wall.x, 0.0)
        self._begin()

    def _populate(self, present, bodies):
        """The spheres and clusters that are ``present``, (n,) bool each, as they were at the start."""
        self._ids, self._body_ids = 1 + np.flatnonzero(present), 1 + np.flatnonzero(bodies)
        grains, rigid = self._whole
        self._start, self._rigid = g, r = of_grains(grains, present, bodies), of_rigid(rigid, present, bodies)
        self._balls = Balls(g.x.copy(), g.v.copy(), g.omega.copy(), np.zeros_like(g.x), np.zeros_like(g.x), g.radius,
                            g.partner, g.kind, in_space([self.scene.gravity])[0], int(r.first[0]))
        self._bodies = _bodies(r, g.arm) if len(r.mass) else None
        self._plain_bodies = None if self._bodies is None else tuple(self._bodies)  # which numba recognises faster

    def _begin(self):
        """Lists and forces of now."""
        self._build_lists(self._wall, 0.0)
        self._loads.force[:] = 0.0
        forces(self._balls, self._plain_bodies, self._wall, 0.0, self._lists, *self._laws, 0.0, 0.0, True, self._loads,
               self._scratch)

    def _use(self, scene):
        """Take the walls of ``scene``, where they are; no force on them."""
        self.scene, self._inside = scene, moved(scene, -self.origin)
        self._surface = parts.surface(self._inside)
        self._fixed = self._surface.own[0]  # nodes at rest
        self._wall = at_rest(self._surface, self._surface.x)
        self._loads = Loads(np.zeros_like(self._wall.x), np.zeros_like(self._wall.x))
        self._scratch = Scratch(np.empty((len(self._wall.elements) + 1, COLUMNS)), np.empty((3, 3)), *np.zeros((6, 3)))
        self._pack()

    def _pack(self):
        self._own = *self._balls, *self._loads, *self._scratch

    @property
    def time(self):
        """[s]"""
        return self._steps * self.dt

    def _all_nodes(self, own, fixed):
        return np.concatenate([fixed, in_space(own)]) if self._fixed else in_space(own)

    def _build_lists(self, wall, t):
        """The skin is a tenth of the smallest radius, or what lasts some ten steps at the speeds of now, some fifty
        where the wall is large and new lists are dear."""
        speed = sum(np.sqrt((v**2).sum(axis=1).max(initial=0.0)) for v in (self._balls.v, wall.v))
        steps = 20.0 if len(wall.elements) < LARGE else 100.0
        skin = max(0.1 * self._balls.radius.min(initial=np.inf), steps * self.dt * speed)
        self._lists = build_lists(self._balls, self._start.body, wall, t, skin, self._lists, *self._keep)

    def advance(self, steps, x, v):
        """See `protocol.DEM.advance`. Raises FloatingPointError when a number is no longer finite."""
        self._need_open()
        steps = check_window(steps, x, v, self.scene)
        here, x = self._surface.x[:self._fixed], shifted(x, -self.origin)
        wall = MovingWall(self._all_nodes(x, here), self._all_nodes(v, 0.0 * here), *self._surface[1:3])
        loads = self._loads
        np.multiply(loads.force, 0.5 * self.dt, out=loads.impulse)
        loads.force[:] = 0.0
        first, done, fresh = 0, 0, False
        while done < steps:
            near, begin = self._lists, done
            end = begin + self._pieces.next(steps - begin)
            done = run(first, begin, end, steps, self.dt, near.skin, fresh, self._plain_bodies, *self._own, *wall,
                       *near.spheres, *near.elements, near.x, near.wall, *self._laws)
            if done == end:
                self._pieces.done(end - begin)
                continue
            if done < -1:
                raise PerforatedError(through_the_wall(f"sphere {-1 - done}", self.time))
            if done < 0:
                raise FloatingPointError(f"the wall given at t = {self.time:.6g} s contains NaN or infinity: "
                                         "look at the motion of the body")
            self._build_lists(wall, done * self.dt)
            first, fresh = done, True
        self._steps += steps
        self._wall = at_rest(self._surface, wall.x + wall.v * (steps * self.dt))
        check_finite(self._balls.x, self.time, self.origin)
        force = loads.impulse[self._fixed:, :self.scene.dim] / (steps * self.dt)
        if self._outflow.active:
            self._outflow.after_window(self)
        return force

    @property
    def removed(self):
        """See `protocol.DEM.removed`."""
        return self._outflow.removed

    def _take_out(self):
        """Go on without what is out."""
        stay, bodies = ~self._outflow.out[self._ids - 1], ~self._outflow.out_bodies[self._body_ids - 1]
        balls, rigid, lists = self._balls, self._bodies, self._lists
        self._populate(~self._outflow.out, ~self._outflow.out_bodies)
        for name in MOVING:
            getattr(self._balls, name)[:] = getattr(balls, name)[stay]
        for name in BODY_MOVING if self._bodies is not None else ():
            getattr(self._bodies, name)[:] = getattr(rigid, name)[bodies]
        self._lists = Lists(of_near(lists.spheres, stay, True), of_near(lists.elements, stay, False), *lists[2:])
        self._pack()
        self._begin()

    def replace_wall(self, wall):
        """See `protocol.DEM.replace_wall`."""
        self._need_open()
        scene, fixed, old, loads = with_wall(self.scene, wall), self._fixed, self._wall, self._loads
        self._use(scene)
        force = carry_force(old.x[fixed:, :scene.dim], loads.force[fixed:, :scene.dim], self._inside)
        self._loads.force[fixed:] = in_space(force)
        near = self._lists.elements
        if len(near.shear):
            near = near._replace(partner=renumber(near, self._balls.x, old, self._surface.own[1], self._wall))
        else:
            near = nothing(len(self._balls.x))
        self._lists = self._lists._replace(elements=near)
        self._build_lists(self._wall, 0.0)

    def particles(self):
        """See `protocol.DEM.particles`; the ids count from 1 in the order of the scene, single spheres first."""
        return self._outflow.all_particles(leave(self._own_particles(), self.origin))

    def _own_particles(self):
        self._need_open()
        out = np.empty(len(self._balls.x), PARTICLE)
        out["id"], out["body"], out["mass"] = self._ids, self._whole[0].body[self._ids - 1] + 1, self._start.mass
        for name in ("x", "v", "omega", "radius"):
            out[name] = getattr(self._balls, name)
        return out

    def bodies(self):
        """See `protocol.DEM.bodies`."""
        return self._outflow.all_bodies(leave(self._own_bodies(), self.origin))

    def _own_bodies(self):
        self._need_open()
        out = np.empty(len(self._rigid.mass), BODY)
        if len(out):
            out["id"] = self._body_ids
            for name in ("x", "v", "omega", "mass"):
                out[name] = getattr(self._bodies, name)
            out["quaternion"] = quaternion.product(self._bodies.q, quaternion.inverse(self._rigid.turn))
        return out

    def energy(self):
        """See `protocol.DEM.energy`."""
        particles, bodies, r = self._own_particles(), self._own_bodies(), self._rigid
        return dict(kinetic=kinetic_energy(particles, bodies, r.inertia, r.turn),
                    potential=potential_energy(particles, self.scene.gravity, bodies),
                    contact=contact_energy(self._inside, particles["x"], self._wall.x[self._fixed:],
                                            self._ids - 1))

    def get_state(self):
        """See `protocol.DEM.get_state`. The lists of near partners belong to it: they hold the tangential history."""
        self._need_open()
        state = {name: getattr(self._balls, name).copy() for name in MOVING}
        if self._bodies is not None:
            state.update({f"body_{name}": getattr(self._bodies, name).copy() for name in BODY_MOVING})
        state.update(scene=self._fingerprint, origin=self.origin.copy(), steps=np.array(self._steps),
                     wall=self._wall.x[self._fixed:].copy(), wall_elements=np.array(self.scene.wall.elements),
                     wall_force=self._loads.force[self._fixed:].copy(),
                     near_x=self._lists.x.copy(), near_wall=self._lists.wall.copy(), skin=np.array(self._lists.skin))
        for of in ("spheres", "elements"):
            for name, array in zip(Near._fields, getattr(self._lists, of)):
                state[f"near_{of}_{name}"] = array.copy()
        return {**state, **self._outflow.get_state()}

    def set_state(self, state):
        """See `protocol.DEM.set_state`."""
        self._need_open()
        check_state(state, NAMES + self._outflow.names, self._fingerprint)
        if self._outflow.active:
            self._outflow.set_state(state)
            self._populate(~self._outflow.out, ~self._outflow.out_bodies)
            self._pack()
        for name in MOVING:
            getattr(self._balls, name)[:] = state[name]
        if self._bodies is not None:
            for name in BODY_MOVING:
                getattr(self._bodies, name)[:] = state[f"body_{name}"]
        self._steps = int(state["steps"])
        wall, there = self.scene.wall, np.array(state["origin"])
        if not (np.array_equal(state["wall_elements"], wall.elements) and np.array_equal(there, self.origin)):
            self.origin, nodes = there, shifted(state["wall"][:, :self.scene.dim], there)
            self._use(with_wall(self.scene, replace(wall, nodes=nodes, elements=state["wall_elements"])))
        self._wall = at_rest(self._surface, self._all_nodes(state["wall"], self._surface.x[:self._fixed]))
        self._loads.force[self._fixed:] = state["wall_force"]
        near = (Near(*(state[f"near_{of}_{name}"].copy() for name in Near._fields)) for of in ("spheres", "elements"))
        self._lists = Lists(*near, state["near_x"].copy(), state["near_wall"].copy(), float(state["skin"]))

    def close(self):
        """Nothing to free; whoever uses it then has lost track."""
        self._closed = True

    def _need_open(self):
        if self._closed:
            raise RuntimeError("this DEM is closed: open a new one")


def _bodies(rigid, arm):
    """The clusters at the start, as the kernels want them."""
    n = len(rigid.mass)
    axes, spin, zeros = np.empty((n, 3, 3)), np.empty((n, 3)), lambda: np.zeros((n, 3))
    for b in range(n):
        turn_axes(rigid.q[b], axes[b])
        omega_to_spin(rigid.omega[b], axes[b], rigid.inertia[b], spin[b])
    extent = np.maximum.reduceat(np.sqrt((arm**2).sum(axis=1)), rigid.first[:-1])
    return Bodies(rigid.x.copy(), rigid.v.copy(), rigid.omega.copy(), spin, zeros(), zeros(), rigid.q.copy(), axes,
                  rigid.mass, rigid.inertia, rigid.free, rigid.first, arm, extent)
