"""The LIGGGHTS back end: Debian's libliggghts in this process, through the project's own shim (`library`)."""
import ctypes
from dataclasses import replace
from typing import Any, Callable, Dict

import numpy as np

from mpm_dem_direct import direct

from .. import quaternion
from ..common.booking import Hits, WallBooks
from ..common.checks import check_finite, check_window
from ..common.chunks import Chunks
from ..common.energy import energy_of_contacts, kinetic_energy, potential_energy, select_shapes
from ..common.outflow import Outflow
from ..common.states import check_state, fingerprint
from ..common.wall_change import with_wall
from ..contact.law import laws_of
from ..contact.window import contact_at_wall
from ..protocol import BODY, PARTICLE
from ..scene.arrays import in_space
from ..scene.frame import find_origin, to_true_positions, translated, translated_points
from ..scene.scene import SceneData
from ..scene.tables import cluster_table, sphere_table
from .buffers import CHANGING, Load, constant_rows, copied, gathered, initial_rows, sorted_by_tag
from .instance import Instance, pointer
from .library import SHIM, LiggghtsError, load, ranks_of
from .resting import Resting
from .script import commands, pull_of_now

STATE = ["origin", "particles", "bodies", "wall", "wall_elements", "wall_rows", "wall_force", "impulses",
         "placed", "steps"]


class LiggghtsDEM(Resting):
    """The protocol of `protocol.DEM` for ``scene``, time step ``dt`` [s], on the ranks of the mpi4py
    communicator ``comm`` (default: all), see `library.ranks_of`.

    Raises MissingLiggghts when LIGGGHTS or the shim is not installed, LiggghtsError with LIGGGHTS' own text,
    ValueError for a negative Poisson's ratio. An instance that raised LiggghtsError is lost; the process and
    other instances go on. An error on some of several ranks ends all.
    """

    kind = "DEM liggghts"

    def __init__(self, scene: SceneData, dt: float, comm: Any = None):
        library = load(SHIM)
        self.scene, self.dt, self.comm = scene, float(dt), ranks_of(library, comm)
        self._fingerprint, self.origin = fingerprint(scene, self.dt), find_origin(scene)
        self._inside = translated(scene, -self.origin)
        self._steps, self._chunks = 0, Chunks(self.comm)
        self._spheres, self._clusters = sphere_table(self._inside), cluster_table(self._inside)
        self._constant = constant_rows(self._clusters, self._spheres)
        self._outflow, self._books = Outflow(scene, self._spheres.cluster), WallBooks(scene)
        script = commands(self._inside, self.dt)
        self._instance = Instance(library, self.comm)
        for line in script:
            self._instance.command(line)
        s = self._spheres
        data = np.column_stack([s.x, s.v, s.omega, s.radius, s.contact_mass, s.material + 1, s.cluster + 1,
                                s.arm])
        self._instance.call("dem_add_spheres", len(data), pointer(data))
        if scene.clusters:
            data = np.hstack([self._constant, initial_rows(self._clusters)])
            self._instance.call("dem_set_bodies", len(data), pointer(data))
        self._laws, self._contact_energy = laws_of(self._inside), direct(energy_of_contacts)
        self._use(self._inside)
        self._instance.command("run 0 post no")
        self._give_springs(scene.contacts)
        self._books.begin(self.particles(), self.bodies())

    @property
    def time(self) -> float:
        """[s]"""
        return self._steps * self.dt

    def advance(self, steps: int, x: np.ndarray, v: np.ndarray) -> np.ndarray:
        """See `protocol.DEM.advance`. Raises FloatingPointError when a number is no longer finite."""
        steps = check_window(steps, x, v, self.scene)
        span, walls = steps * self.dt, self._walls
        here, there = self._books.motion(self.time, span, self.origin)
        self._pull(self._books.shake(self.time, steps, self.dt))
        x, v = walls.both(here, translated_points(x, -self.origin)), walls.both(there, v)
        code = self._chunks.run(steps, lambda begin, count: self._instance.call(
            "dem_advance", self.scene.dim, steps, begin, count, pointer(x), pointer(v)))
        if code and not (np.isfinite(x).all() and np.isfinite(v).all()):
            raise FloatingPointError(f"the wall given at t = {self.time:.6g} s contains NaN or infinity: "
                                     "look at the motion of the body")
        self._steps += steps
        if code:
            self._report()
        load = self._load_on_walls(impulse=1)
        present, lost = load.values[0, :2]
        if lost or present != self._outflow.present:
            self._report()
        load = Load(load.row[1:], load.values[1:])
        walls.place(x, v)
        node, impulse, whole = load.in_space(len(walls.now.x))
        self._books.add(Hits(node, walls.at(node, 0.5 * span), impulse, whole), span, self.particles,
                        self.bodies, self.origin)
        walls.stop(span)
        if self._outflow.active:
            self._let_out()
        return load.dense(walls.fixed, len(walls.now.x) - walls.fixed) / span

    def _pull(self, pull: np.ndarray) -> None:
        """From now on gravity and the motion of the base are ``pull`` [m/s^2], (3,)."""
        for line in pull_of_now(pull) if self.scene.base else ():
            self._instance.command(line)

    @property
    def removed(self) -> Dict[str, Any]:
        """See `protocol.DEM.removed`."""
        return self._outflow.removed

    def _let_out(self) -> None:
        """Go on without what has left the domain in this window."""
        leaving = self._outflow.leaving(self.particles(), self.bodies(), self.time)
        if leaving is None:
            return
        energy = sum(self.energy().values())
        self._outflow.let_out(leaving)
        self._restore(self._read()(), keep=0)
        self._books.begin(self.particles(), self.bodies())
        self._outflow.count_energy(energy - sum(self.energy().values()))

    def _report(self) -> None:
        particles = to_true_positions(self._own_particles(), self.origin)
        check_finite(particles["x"], self.time)
        self._lose("particles", self._outflow.out, particles["id"])

    def _lose(self, what: str, out: np.ndarray, found: np.ndarray) -> None:
        lost = sorted(set((1 + np.flatnonzero(~out)).tolist()) - set(found.astype(int).tolist()))
        raise LiggghtsError(f"{what} {lost} were lost at t = {self.time:.6g} s: they flew across a whole "
                            "rank between two neighbour lists; use fewer ranks")

    def particles(self) -> np.ndarray:
        """See `protocol.DEM.particles`; the ids count from 1 in the order of the scene, single spheres
        first."""
        return self._outflow.all_particles(to_true_positions(self._own_particles(), self.origin))

    def _own_particles(self) -> np.ndarray:
        table = self._table("dem_count", "dem_particles", 12)
        out, index = np.empty(len(table), PARTICLE), table[:, 0].astype(int) - 1
        out["id"], out["x"], out["v"] = table[:, 0], table[:, 1:4], table[:, 4:7]
        out["omega"] = table[:, 7:10]
        out["body"], out["mass"] = self._spheres.cluster[index] + 1, self._spheres.mass[index]
        out["radius"] = table[:, 10]
        return out

    def bodies(self) -> np.ndarray:
        """See `protocol.DEM.bodies`."""
        return self._outflow.all_bodies(to_true_positions(self._own_bodies(), self.origin))

    def _own_bodies(self) -> np.ndarray:
        table, r, number = self._changing(), self._clusters, np.flatnonzero(~self._outflow.out_clusters)
        out = np.empty(len(table), BODY)
        if len(out):
            out["id"], out["mass"] = number + 1, r.mass[number]
            out["x"], out["v"], out["omega"] = table[:, :3], table[:, 3:6], table[:, 6:9]
            out["quaternion"] = quaternion.product(table[:, 12:16], quaternion.inverse(r.turn[number]))
        return out

    def _changing(self) -> np.ndarray:
        """What changes of the bodies that are present, shape (bodies, CHANGING), by id."""
        if not self.scene.clusters and self._instance.alive:
            return np.empty((0, CHANGING))
        table, out = self._table("dem_count_bodies", "dem_bodies", 1 + CHANGING), self._outflow.out_clusters
        table = table[~out[table[:, 0].astype(int) - 1]]
        if len(table) != np.count_nonzero(~out):
            self._lose("clusters", out, table[:, 0])
        return np.ascontiguousarray(table[:, 1:])

    def _table(self, count: str, read: str, width: int) -> np.ndarray:
        """Rows of all ranks, sorted by the id in the first column."""
        mine = np.empty((self._instance.count(count), width))
        self._instance.call(read, pointer(mine))
        table = gathered(self.comm, mine)
        return table[np.argsort(table[:, 0])]

    def impulses(self) -> Dict[str, np.ndarray]:
        """See `protocol.DEM.impulses`."""
        return self._books.sums()

    @property
    def base_work(self) -> float:
        """See `protocol.DEM.base_work`."""
        return self._books.base_work

    def contact_at_wall(self, force: float) -> np.ndarray:
        """See `protocol.DEM.contact_at_wall`."""
        return contact_at_wall(self.scene, force)

    def energy(self) -> Dict[str, float]:
        """See `protocol.DEM.energy`."""
        particles, bodies, table = self._own_particles(), self._own_bodies(), self._clusters
        number = bodies["id"] - 1
        shapes = select_shapes(self._spheres, in_space(particles["x"]), particles["id"] - 1)
        return dict(kinetic=kinetic_energy(particles, bodies, table.inertia[number], table.turn[number]),
                    potential=potential_energy(particles, self.scene.gravity, bodies),
                    contact=self._contact_energy(shapes, self._walls.now, self._laws))

    def get_state(self) -> Dict[str, np.ndarray]:
        """See `protocol.DEM.get_state`. LIGGGHTS makes its neighbour lists anew here as in `set_state`, so
        that both go on with the same order of summation."""
        state = self._read()()
        self.set_state(state)
        return state

    def remember(self) -> Callable[[], None]:
        """A function that sets everything back to where it is now, to round-off; costs less than a state."""
        state = self._read()
        return lambda: self.set_state(state())

    def _read(self) -> Callable[[], Dict[str, np.ndarray]]:
        """What a state consists of now: a function that makes the state of it. Both are collective."""
        records, count = ctypes.c_void_p(), ctypes.c_int()
        if self._instance.call("dem_get_state", ctypes.byref(records), ctypes.byref(count)):
            self._report()
        mine, out = copied(records, count.value), self._outflow.out.copy()
        load = self._load_on_walls(impulse=0)
        kept = dict(scene=self._fingerprint, origin=self.origin.copy(), bodies=self._changing(),
                    wall=self._nodes.copy(), wall_elements=np.array(self.scene.wall.elements),
                    wall_rows=load.row, wall_force=load.values, steps=np.array(self._steps),
                    **self._books.get_state(), **self._outflow.get_state())
        return lambda: dict(kept, particles=sorted_by_tag(gathered(self.comm, mine), out))

    def set_state(self, state: Dict[str, Any]) -> None:
        """See `protocol.DEM.set_state`. The state may come from another instance of the same scene, on any
        ranks."""
        check_state(state, (*STATE, *self._outflow.names), self._fingerprint)
        self._outflow.set_state(state)
        wall, old, there = np.array(state["wall"]), self.scene.wall, np.array(state["origin"])
        if not (np.array_equal(state["wall_elements"], old.elements) and np.array_equal(there, self.origin)):
            new = replace(old, nodes=translated_points(wall, there), elements=state["wall_elements"])
            self._change_wall(with_wall(self.scene, new), there)
        self._restore(state, keep=1)

    def _restore(self, state: Dict[str, Any], keep: int) -> None:
        """Particles, bodies and wall of the state, with its forces when ``keep``, else those of the contacts
        now."""
        particles, own = np.array(state["particles"], float), np.array(state["wall"])
        self._steps = int(state["steps"])
        self._books.set_state(state)
        self._pull(self._books.pull)
        wall = self._walls.both(self._books.places(self.time, self.origin), own)
        self._walls.place(wall, np.zeros_like(wall))
        force = Load(state["wall_rows"], state["wall_force"]).table(self.comm.rank == 0)
        bodies = np.hstack([self._constant[~self._outflow.out_clusters], state["bodies"]])
        if self._instance.call("dem_set_state", self.scene.dim, len(particles), pointer(particles),
                               len(bodies), pointer(bodies), pointer(wall), len(force), pointer(force), keep):
            self._report()

    def close(self) -> None:
        """Free the LIGGGHTS instance; a second call does nothing."""
        self._instance.close()
