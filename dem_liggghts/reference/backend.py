"""The built-in DEM: spheres, rigid clusters, Hertz-Mindlin contact, velocity Verlet; alike on all ranks."""
from dataclasses import replace
from typing import Any, Dict

import numpy as np

from mpm_dem_direct import direct

from .. import quaternion
from ..common.booking import WallBooks
from ..common.checks import PerforatedError, check_finite, check_window, through_the_wall
from ..common.energy import energy_of_contacts, kinetic_energy, potential_energy, select_shapes
from ..common.outflow import Outflow
from ..common.states import check_state, fingerprint
from ..common.touching import lists_of
from ..common.wall_change import with_wall
from ..contact.law import count_springs, laws_of
from ..contact.window import contact_at_wall
from ..protocol import BODY, PARTICLE
from ..scene.frame import find_origin, to_true_positions, translated, translated_points
from ..scene.scene import SceneData
from ..scene.tables import cluster_table, sphere_table
from ..search.neighbours import NeighbourList, NeighbourLists
from .forces import SphereState, new_scratch
from .part import CLUSTER_MOVING, MOVING
from .replicated import Replicated
from .resting import Resting
from .rigid import cluster_state
from .selection import select_clusters, select_neighbours, select_spheres
from .shared import Shared
from .verlet import Span

LISTS = [(f"near_{of}_{name}", of, name) for of in ("spheres", "elements") for name in NeighbourList._fields]
NAMES = (*MOVING, "origin", "steps", "wall", "wall_elements", "wall_rows", "wall_force",  # of a state
         "impulses", "placed", "near_x", "near_wall", "skin", *(name for name, _, _ in LISTS))


class ReferenceDEM(Resting):
    """The protocol of `protocol.DEM` for ``scene`` and the time step ``dt`` [s]. ``comm``: of the ranks that
    share the work where there are many spheres; that on few is repeated on every rank."""

    kind = "DEM reference"
    many = 500  # spheres of a rank, from which on ranks share them: below, messages take longer than steps

    def __init__(self, scene: SceneData, dt: float, comm: Any = None):
        self.dt, self.comm, self._steps, self._closed = float(dt), comm, 0, False
        self._fingerprint, self.origin = fingerprint(scene, self.dt), find_origin(scene)
        inside = translated(scene, -self.origin)
        self._all_spheres, self._all_clusters, self.scene = sphere_table(inside), cluster_table(inside), scene
        self._outflow, self._books = Outflow(scene, self._all_spheres.cluster), WallBooks(scene)
        self._laws, self._contact_energy = laws_of(scene), direct(energy_of_contacts)
        self._scratch = new_scratch(0)
        self._springs = tuple(count_springs(table) for table in self._laws)
        self._part = self._new_part()
        self._populate(np.ones(len(self._all_spheres.x), np.bool_), np.ones(len(scene.clusters), np.bool_))
        self._use(scene)
        known = lists_of(scene.contacts, len(self._table.x), self._springs)
        self._part.remember(NeighbourLists(*known, self._spheres.x, np.zeros((0, 3)), 0.0))
        self._begin()
        self._books.begin(self.particles(), self.bodies())

    def _new_part(self) -> Any:
        ranks = self._ranks()
        if ranks.size > 1 and len(self._all_spheres.x) >= self.many * ranks.size:
            return Shared(self._laws, self._springs, self.dt, ranks)
        return Replicated(self._laws, self._springs, self.dt)

    def _populate(self, present: np.ndarray, clusters: np.ndarray) -> None:
        """The spheres and clusters that are ``present``, (n,) bool each, as they were at the start."""
        self._ids, self._cluster_ids = 1 + np.flatnonzero(present), 1 + np.flatnonzero(clusters)
        self._table = s = select_spheres(self._all_spheres, present, clusters)
        self._cluster_table = c = select_clusters(self._all_clusters, present, clusters)
        self._spheres = SphereState(s.x.copy(), s.v.copy(), s.omega.copy(), np.zeros_like(s.x),
                                    np.zeros_like(s.x), s.radius, s.contact_mass, s.material,
                                    self._books.pull, int(c.first[0]))
        self._clusters = cluster_state(c, s.arm) if len(c.mass) else None
        self._part.use(self._spheres, self._clusters, s.cluster)

    def _begin(self) -> None:
        """Lists and forces of now."""
        self._build_lists(0.0)
        self._loads.clear()
        self._part.forces_of_now(self._walls.now, self._loads, self._scratch)

    @property
    def time(self) -> float:
        """[s]"""
        return self._steps * self.dt

    def _build_lists(self, t: float) -> None:
        self._part.renew(self._walls.now, t)
        self._listed()

    def advance(self, steps: int, x: np.ndarray, v: np.ndarray) -> np.ndarray:
        """See `protocol.DEM.advance`. Raises FloatingPointError when a number is no longer finite."""
        self._need_open()
        steps = check_window(steps, x, v, self.scene)
        span, x = steps * self.dt, translated_points(x, -self.origin)
        here, there = self._books.motion(self.time, span, self.origin)
        self._spheres.gravity[:] = self._books.shake(self.time, steps, self.dt)
        walls, loads = self._walls, self._loads
        walls.place(walls.both(here, x), walls.both(there, v))
        loads.begin(0.5 * self.dt if self._part.first else 0.0)
        gone = 0.0
        try:
            self._run(steps)
            self._part.finish(loads)
            hits, gone = loads.hits(0.5 * span), span
        finally:
            walls.stop(gone)
        self._steps += steps
        check_finite(self._spheres.x, self.time, self.origin)
        force = loads.now.impulse[walls.fixed:-2, :self.scene.dim] / span
        self._books.add(hits, span, self.particles, self.bodies, self.origin)
        self._let_out()
        return force

    def _run(self, steps: int) -> None:
        """All steps of a window, chunk by chunk, with new lists where they are due."""
        part, first, done, fresh = self._part, 0, 0, False
        while done < steps:
            begin, end = done, done + part.chunks.next(steps - done)
            span = Span(first, begin, end, steps, self.dt, fresh)
            done = part.steps(span, self._walls.now, self._loads.now, self._scratch)
            if done == end:
                part.chunks.done(end - begin)
                continue
            if done < -1:
                raise PerforatedError(through_the_wall(f"sphere {-1 - done}", self.time))
            if done < 0:
                raise FloatingPointError(f"the wall given at t = {self.time:.6g} s contains NaN or infinity: "
                                         "look at the motion of the body")
            self._build_lists(done * self.dt)
            first, fresh = done, True

    @property
    def removed(self) -> Dict[str, Any]:
        """See `protocol.DEM.removed`."""
        return self._outflow.removed

    def _let_out(self) -> None:
        """Go on without what has left the domain in this window."""
        leaving = self._outflow.active and self._outflow.leaving(self.particles(), self.bodies(), self.time)
        if not leaving:
            return
        energy = sum(self.energy().values())
        self._outflow.let_out(leaving)
        stay = ~self._outflow.out[self._ids - 1]  # of those that were there
        clusters = ~self._outflow.out_clusters[self._cluster_ids - 1]
        spheres, rigid, lists = self._spheres, self._clusters, self._part.whole_lists()
        self._populate(~self._outflow.out, ~self._outflow.out_clusters)
        for name in MOVING:
            getattr(self._spheres, name)[:] = getattr(spheres, name)[stay]
        for name in CLUSTER_MOVING if self._clusters is not None else ():
            getattr(self._clusters, name)[:] = getattr(rigid, name)[clusters]
        self._part.remember(NeighbourLists(select_neighbours(lists.spheres, stay, True),
                                           select_neighbours(lists.elements, stay, False), *lists[2:]))
        self._begin()
        self._books.begin(self.particles(), self.bodies())
        self._outflow.count_energy(energy - sum(self.energy().values()))

    def particles(self) -> np.ndarray:
        """See `protocol.DEM.particles`; ids count from 1 in the scene's order, single spheres first."""
        return self._outflow.all_particles(to_true_positions(self._own_particles(), self.origin))

    def _own_particles(self) -> np.ndarray:
        self._need_open()
        out = np.empty(len(self._spheres.x), PARTICLE)
        out["id"], out["body"] = self._ids, self._all_spheres.cluster[self._ids - 1] + 1
        out["mass"] = self._table.mass
        for name in ("x", "v", "omega", "radius"):
            out[name] = getattr(self._spheres, name)
        return out

    def bodies(self) -> np.ndarray:
        """See `protocol.DEM.bodies`."""
        return self._outflow.all_bodies(to_true_positions(self._own_bodies(), self.origin))

    def _own_bodies(self) -> np.ndarray:
        self._need_open()
        table, out = self._cluster_table, np.empty(len(self._cluster_table.mass), BODY)
        if len(out):
            out["id"] = self._cluster_ids
            for name in ("x", "v", "omega", "mass"):
                out[name] = getattr(self._clusters, name)
            out["quaternion"] = quaternion.product(self._clusters.q, quaternion.inverse(table.turn))
        return out

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
        particles, bodies, table = self._own_particles(), self._own_bodies(), self._cluster_table
        shapes = select_shapes(self._all_spheres, self._spheres.x, self._ids - 1)
        return dict(kinetic=kinetic_energy(particles, bodies, table.inertia, table.turn),
                    potential=potential_energy(particles, self.scene.gravity, bodies),
                    contact=self._contact_energy(shapes, self._walls.now, self._laws))

    def get_state(self) -> Dict[str, np.ndarray]:
        """See `protocol.DEM.get_state`. Neighbour lists belong to it, with the springs of contacts."""
        self._need_open()
        state = {name: getattr(self._spheres, name).copy() for name in MOVING}
        if self._clusters is not None:
            state.update({f"cluster_{name}": getattr(self._clusters, name).copy() for name in CLUSTER_MOVING})
        (rows, force), lists = self._loads.get(), self._part.whole_lists()
        state.update(scene=self._fingerprint, origin=self.origin.copy(), steps=np.array(self._steps),
                     wall=self._walls.own().x, wall_elements=np.array(self.scene.wall.elements),
                     wall_rows=rows, wall_force=force, near_x=lists.x.copy(),
                     near_wall=lists.wall.copy(), skin=np.array(lists.skin),
                     **self._books.get_state())
        state.update({name: getattr(getattr(lists, of), field).copy() for name, of, field in LISTS})
        return {**state, **self._outflow.get_state()}

    def set_state(self, state: Dict[str, Any]) -> None:
        """See `protocol.DEM.set_state`."""
        self._need_open()
        check_state(state, NAMES + self._outflow.names, self._fingerprint)
        if self._outflow.active:
            self._outflow.set_state(state)
            self._populate(~self._outflow.out, ~self._outflow.out_clusters)
        for name in MOVING:
            getattr(self._spheres, name)[:] = state[name]
        for name in CLUSTER_MOVING if self._clusters is not None else ():
            getattr(self._clusters, name)[:] = state[f"cluster_{name}"]
        self._steps = int(state["steps"])
        wall, there = self.scene.wall, np.array(state["origin"])
        if not (np.array_equal(state["wall_elements"], wall.elements) and np.array_equal(there, self.origin)):
            nodes = translated_points(state["wall"][:, :self.scene.dim], there)
            scene = with_wall(self.scene, replace(wall, nodes=nodes, elements=state["wall_elements"]))
            kept, self.origin = np.array_equal(there, self.origin), there
            self._replace(scene) if kept else self._use(scene)
        self._books.set_state(state)
        self._spheres.gravity[:] = self._books.pull
        x = np.concatenate([self._books.places(self.time, self.origin), state["wall"]])
        self._walls.place(x, np.zeros_like(x))
        near = [NeighbourList(*(state[name].copy() for name, of, _ in LISTS if of == which))
                for which in ("spheres", "elements")]
        self._part.adopt(NeighbourLists(near[0], near[1], state["near_x"].copy(), state["near_wall"].copy(),
                                        float(state["skin"])))
        self._loads.set(np.array(state["wall_rows"]), state["wall_force"])
        self._listed()

    def close(self) -> None:
        """Nothing to free; whoever uses it then has lost track."""
        self._closed = True

    def _need_open(self) -> None:
        if self._closed:
            raise RuntimeError("this DEM is closed: open a new one")
