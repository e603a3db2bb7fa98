"""The built-in DEM: spheres, Hertz-Mindlin contact, velocity Verlet; small, obvious, the same on every rank."""
import numpy as np

from .checks import check_finite
from .contact import contact_energy, in_space, kinetic_energy, law, potential_energy
from .protocol import PARTICLE
from .verlet import Balls, Lists, Loads, Scratch, build_lists, forces, run
from .wall import COLUMNS, MovingWall, Near

MOVING = ("x", "v", "omega", "force", "torque")
NONE = Near(np.zeros(1, np.int64), np.zeros(0, np.int64), np.zeros(0, np.bool_), np.zeros((0, 3)))


class ReferenceDEM:
    """The protocol of `protocol.DEM` for ``scene`` and the time step ``dt`` [s]. ``comm`` is not used: the work is
    repeated on every rank, with the same result."""

    def __init__(self, scene, dt, comm=None):
        self.scene, self.dt, self._steps = scene, float(dt), 0
        balls, zeros = scene.spheres, np.zeros((len(scene.spheres.x), 3))
        self._balls = Balls(in_space(balls.x), in_space(balls.v), balls.omega.copy(), zeros, zeros.copy(),
                            balls.radius.copy(), balls.mass, in_space([scene.gravity])[0])
        self._elements = np.array(scene.wall.elements)
        self._wall = self._at_rest(in_space(scene.wall.nodes))
        self._loads = Loads(np.zeros_like(self._wall.x), np.zeros_like(self._wall.x))
        scratch = Scratch(np.empty((len(self._elements) + 1, COLUMNS)), np.empty((3, 3)), *np.zeros((6, 3)))
        self._own = tuple(self._balls), tuple(self._loads), tuple(scratch)
        between = law(scene.material, scene.material, scene.between)
        at_wall = law(scene.material, scene.wall_material, scene.at_wall)
        self._laws = tuple(between), tuple(at_wall)
        self._lists = Lists(NONE, NONE, self._balls.x, self._wall.x, 0.0)
        self._build_lists(self._wall, 0.0)
        forces(self._balls, self._wall, 0.0, self._lists, between, at_wall, 0.0, 0.0, True, self._loads, scratch)

    @property
    def time(self):
        """[s]"""
        return self._steps * self.dt

    def _at_rest(self, nodes):
        return MovingWall(nodes, np.zeros_like(nodes), self._elements)

    def _build_lists(self, wall, t):
        """The skin is a tenth of the smallest radius, or what lasts some ten steps at the speeds of now."""
        speed = np.sqrt((self._balls.v**2).sum(axis=1).max()) + np.sqrt((wall.v**2).sum(axis=1).max())
        skin = max(0.1 * self._balls.radius.min(), 20.0 * self.dt * speed)
        (*_, friction), (*_, wall_friction) = self._laws
        self._lists = build_lists(self._balls, wall, t, skin, self._lists, friction > 0.0, wall_friction > 0.0)

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
            done = run(self._own, tuple(wall), done, steps, self.dt, _plain(self._lists), self._laws, fresh)
            if done == steps:
                break
            if done < 0:
                raise FloatingPointError(f"the wall given at t = {self.time:.6g} s contains NaN or infinity: "
                                         "look at the motion of the body")
            self._build_lists(wall, done * self.dt)
            fresh = True
        self._steps += steps
        self._wall = self._at_rest(wall.x + wall.v * (steps * self.dt))
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
        """See `protocol.DEM.get_state`. The lists of near partners belong to it: they hold the tangential history."""
        state = {name: getattr(self._balls, name).copy() for name in MOVING}
        state.update(steps=np.array(self._steps), wall=self._wall.x.copy(), wall_force=self._loads.force.copy(),
                     near_x=self._lists.x.copy(), near_wall=self._lists.wall.copy(), skin=np.array(self._lists.skin))
        for of in ("spheres", "elements"):
            for name, array in zip(Near._fields, getattr(self._lists, of)):
                state[f"near_{of}_{name}"] = array.copy()
        return state

    def set_state(self, state):
        """See `protocol.DEM.set_state`."""
        for name in MOVING:
            getattr(self._balls, name)[:] = state[name]
        self._steps = int(state["steps"])
        self._wall = self._at_rest(state["wall"].copy())
        self._loads.force[:] = state["wall_force"]
        near = (Near(*(state[f"near_{of}_{name}"].copy() for name in Near._fields)) for of in ("spheres", "elements"))
        self._lists = Lists(*near, state["near_x"].copy(), state["near_wall"].copy(), float(state["skin"]))

    def close(self):
        """Nothing to free."""


def _plain(lists):
    """``lists`` without names: numba recognises plain tuples much faster."""
    return tuple(lists.spheres), tuple(lists.elements), lists.x, lists.wall, lists.skin
