"""The LIGGGHTS back end: Debian's libliggghts in this process, through the project's own shim (`library`)."""
import ctypes
from dataclasses import replace

import numpy as np
from mpi4py import MPI

from . import parts, quaternion
from .carry import carry_force, with_wall
from .checks import check_finite, check_window
from .energy import contact_energy, kinetic_energy, potential_energy
from .frame import find_origin, leave, moved, shifted
from .library import ARGUMENTS, SHIM, Comm, LiggghtsError, MissingLiggghts, check_sizes, load, quiet
from .outflow import Outflow
from .pieces import Pieces
from .protocol import BODY, PARTICLE
from .records import CHANGING, always, at_start, by_tag, copied, gathered
from .script import commands
from .states import check_state, fingerprint
from .window import AtWall

__all__ = ["LiggghtsDEM", "LiggghtsError", "MissingLiggghts"]

NAMES = "origin", "particles", "bodies", "wall", "wall_elements", "wall_force", "steps"  # of a state


def _pointer(array):
    return array.ctypes.data


class LiggghtsDEM(AtWall):
    """The protocol of `protocol.DEM` for ``scene``, time step ``dt`` [s], on the ranks of the mpi4py communicator
    ``comm`` (default: all).

    Raises MissingLiggghts when LIGGGHTS or the shim is not installed, LiggghtsError with LIGGGHTS' own text, ValueError
    for a negative Poisson's ratio. An instance that raised LiggghtsError is lost; the process and other instances go
    on. An error on some of several ranks ends all.
    """

    def __init__(self, scene, dt, comm=None):
        self.scene, self.dt, self.comm = scene, float(dt), comm or MPI.COMM_WORLD
        self._fingerprint, self.origin = fingerprint(scene, self.dt), find_origin(scene)
        self._inside = moved(scene, -self.origin)
        self._steps, self._nodes, self._pieces = 0, self._inside.wall.nodes, Pieces(self.comm)
        self._grains, self._rigid = parts.grains(self._inside), parts.rigid(self._inside)
        self._always, self._outflow = always(self._rigid, self._grains), Outflow(scene, self._grains.body)
        self._handle, self._library = None, load(SHIM)
        script = commands(self._inside, self.dt)
        self._open()
        for line in script:
            self._command(line)
        g = self._grains
        data = np.column_stack([g.x, g.v, g.omega, g.radius, g.partner, g.kind + 1, g.body + 1, g.arm])
        self._call("dem_add_spheres", len(data), _pointer(data))
        if scene.clusters:
            data = np.hstack([self._always, at_start(self._rigid)])
            self._call("dem_set_bodies", len(data), _pointer(data))
        self._set_wall(keep=0)
        self._command("run 0 post no")

    def _set_wall(self, keep):
        """Hand over all walls of the scene; tangential springs go on when ``keep``."""
        s, dim = parts.surface(self._inside), self.scene.dim
        data = np.zeros((len(s.elements), 3 + s.traits.shape[1]))
        data[:, :dim], data[:, 3:] = s.elements, s.traits
        data[:, dim:3] = s.elements[:, :3 - dim]  # a segment names its first node twice
        data[:, 3] += 1  # atom types count from 1
        self._call("dem_set_wall", dim, len(s.x), len(s.elements), *s.own, _pointer(data), _pointer(s.x), keep)

    def _open(self):
        arguments = (ctypes.c_char_p * (len(ARGUMENTS) + 1))(*(a.encode() for a in ARGUMENTS), None)
        handle = ctypes.c_void_p()
        with quiet():
            self._check(self._library.dem_open(len(ARGUMENTS), arguments,
                                               Comm.from_address(MPI._addressof(self.comm)), ctypes.byref(handle)))
        if not self._library.dem_same_layout(handle):
            raise LiggghtsError("the shim was compiled for another version of LIGGGHTS than the one installed: "
                                "reinstall this package, or use dem=reference")
        self._handle = handle

    def _check(self, code):
        if code == 1:
            self._handle = None  # not closed: after some errors that would free memory twice
            raise LiggghtsError("LIGGGHTS: " + self._library.dem_last_error().decode(errors="replace"))
        return code

    def _call(self, name, *arguments):
        if self._handle is None:
            raise LiggghtsError("this LIGGGHTS instance is closed, or was lost in an error before: make a new one")
        check_sizes(name, arguments)
        return self._check(getattr(self._library, name)(self._handle, *arguments))

    def _command(self, line):
        self._call("dem_command", line.encode())

    @property
    def time(self):
        """[s]"""
        return self._steps * self.dt

    def advance(self, steps, x, v):
        """See `protocol.DEM.advance`. Raises FloatingPointError when a number is no longer finite."""
        steps = check_window(steps, x, v, self.scene)
        x, v = np.ascontiguousarray(shifted(x, -self.origin), float), np.ascontiguousarray(v, float)
        out = np.empty(x.size + 2)
        code = self._pieces.run(steps, lambda begin, count: self._call(
            "dem_advance", self.scene.dim, steps, begin, count, _pointer(x), _pointer(v), _pointer(out)))
        if code and not (np.isfinite(x).all() and np.isfinite(v).all()):
            raise FloatingPointError(f"the wall given at t = {self.time:.6g} s contains NaN or infinity: "
                                     "look at the motion of the body")
        self._steps += steps
        out = self._sum(out)
        if code or out[-1] or out[-2] != self._outflow.present:
            self._report()
        self._nodes = x + v * (steps * self.dt)
        if self._outflow.active:
            self._outflow.after_window(self)
        return out[:-2].reshape(x.shape) / (steps * self.dt)

    @property
    def removed(self):
        """See `protocol.DEM.removed`."""
        return self._outflow.removed

    def _take_out(self):
        """Go on without what is out."""
        self._restore(self._read()(), keep=0)

    def _sum(self, array):
        """Sum over ranks, the same to the last bit on all of them."""
        if self.comm.size == 1:
            return array
        total = np.empty_like(array)
        self.comm.Reduce(array, total, MPI.SUM)
        self.comm.Bcast(total)
        return total

    def _report(self):
        particles = leave(self._own_particles(), self.origin)
        check_finite(particles["x"], self.time)
        self._lose("particles", self._outflow.out, particles["id"])

    def _lose(self, what, out, found):
        lost = sorted(set((1 + np.flatnonzero(~out)).tolist()) - set(found.astype(int).tolist()))
        raise LiggghtsError(f"{what} {lost} were lost at t = {self.time:.6g} s: they flew across a whole rank between "
                            "two neighbour lists; use fewer ranks")

    def replace_wall(self, wall):
        """See `protocol.DEM.replace_wall`."""
        scene, force = with_wall(self.scene, wall), np.empty(self._nodes.shape)
        self._call("dem_wall_force", scene.dim, _pointer(force))
        inside = moved(scene, -self.origin)
        self._put_wall(scene, carry_force(self._nodes, self._sum(force), inside), keep=1)

    def _put_wall(self, scene, force, keep):
        self.scene, self._inside = scene, moved(scene, -self.origin)
        self._nodes = self._inside.wall.nodes
        self._set_wall(keep)
        force = np.ascontiguousarray(force if self.comm.rank == 0 else np.zeros_like(force))
        self._call("dem_set_wall_force", scene.dim, _pointer(force))

    def particles(self):
        """See `protocol.DEM.particles`; the ids count from 1 in the order of the scene, single spheres first."""
        return self._outflow.all_particles(leave(self._own_particles(), self.origin))

    def _own_particles(self):
        table = self._table("dem_count", "dem_particles", 12)
        out, index = np.empty(len(table), PARTICLE), table[:, 0].astype(int) - 1
        out["id"], out["x"], out["v"], out["omega"] = table[:, 0], table[:, 1:4], table[:, 4:7], table[:, 7:10]
        out["body"], out["radius"], out["mass"] = self._grains.body[index] + 1, table[:, 10], self._grains.mass[index]
        return out

    def bodies(self):
        """See `protocol.DEM.bodies`."""
        return self._outflow.all_bodies(leave(self._own_bodies(), self.origin))

    def _own_bodies(self):
        table, r, number = self._changing(), self._rigid, np.flatnonzero(~self._outflow.out_bodies)
        out = np.empty(len(table), BODY)
        if len(out):
            out["id"], out["mass"] = number + 1, r.mass[number]
            out["x"], out["v"], out["omega"] = table[:, :3], table[:, 3:6], table[:, 6:9]
            out["quaternion"] = quaternion.product(table[:, 12:16], quaternion.inverse(r.turn[number]))
        return out

    def _changing(self):
        """What changes of the bodies that are present, shape (bodies, CHANGING), by id."""
        if not self.scene.clusters and self._handle is not None:
            return np.empty((0, CHANGING))
        table, out = self._table("dem_count_bodies", "dem_bodies", 1 + CHANGING), self._outflow.out_bodies
        table = table[~out[table[:, 0].astype(int) - 1]]
        if len(table) != np.count_nonzero(~out):
            self._lose("clusters", out, table[:, 0])
        return np.ascontiguousarray(table[:, 1:])

    def _table(self, count, read, width):
        """Rows of all ranks, sorted by the id in the first column."""
        mine = np.empty((getattr(self._library, count)(self._handle) if self._handle else 0, width))
        self._call(read, _pointer(mine))
        table = gathered(self.comm, mine)
        return table[np.argsort(table[:, 0])]

    def energy(self):
        """See `protocol.DEM.energy`."""
        particles, bodies, r = self._own_particles(), self._own_bodies(), self._rigid
        number = bodies["id"] - 1
        return dict(kinetic=kinetic_energy(particles, bodies, r.inertia[number], r.turn[number]),
                    potential=potential_energy(particles, self.scene.gravity, bodies),
                    contact=contact_energy(self._inside, particles["x"], self._nodes, particles["id"] - 1))

    def get_state(self):
        """See `protocol.DEM.get_state`. LIGGGHTS makes its neighbour lists anew here as in `set_state`, so that both
        go on with the same order of summation."""
        state = self._read()()
        self.set_state(state)
        return state

    def remember(self):
        """A function that sets everything back to where it is now, to round-off; costs less than a state."""
        state = self._read()
        return lambda: self.set_state(state())

    def _read(self):
        """What a state consists of, as it is now: a function that makes the state of it. Both are collective."""
        records, count, (wall, force) = ctypes.c_void_p(), ctypes.c_int(), np.empty((2, *self._nodes.shape))
        if self._call("dem_get_state", self.scene.dim, ctypes.byref(records), ctypes.byref(count), _pointer(wall),
                      _pointer(force)):
            self._report()
        mine, out = copied(records, count.value), self._outflow.out.copy()
        kept = dict(scene=self._fingerprint, origin=self.origin.copy(), bodies=self._changing(), wall=wall,
                    wall_elements=np.array(self.scene.wall.elements), steps=np.array(self._steps),
                    **self._outflow.get_state())
        return lambda: dict(kept, particles=by_tag(gathered(self.comm, mine), out), wall_force=self._sum(force))

    def set_state(self, state):
        """See `protocol.DEM.set_state`. The state may come from another instance of the same scene, on any ranks."""
        check_state(state, NAMES + self._outflow.names, self._fingerprint)
        self._outflow.set_state(state)
        wall, old, there = np.array(state["wall"]), self.scene.wall, np.array(state["origin"])
        if not (np.array_equal(state["wall_elements"], old.elements) and np.array_equal(there, self.origin)):
            self.origin = there
            new = replace(old, nodes=shifted(wall, there), elements=state["wall_elements"])
            self._put_wall(with_wall(self.scene, new), np.zeros(wall.shape), keep=0)
        self._restore(state, keep=1)

    def _restore(self, state, keep):
        """Particles, bodies and wall of the state, with its forces when ``keep``, else those of the contacts now."""
        particles, wall = np.array(state["particles"], float), np.array(state["wall"])
        force = np.array(state["wall_force"]) if self.comm.rank == 0 else np.zeros(wall.shape)
        bodies = np.hstack([self._always[~self._outflow.out_bodies], state["bodies"]])
        if self._call("dem_set_state", self.scene.dim, len(particles), _pointer(particles), len(bodies),
                      _pointer(bodies), _pointer(wall), _pointer(force), keep):
            self._report()
        self._steps, self._nodes = int(state["steps"]), wall

    def close(self):
        """Free the LIGGGHTS instance; a second call does nothing."""
        if self._handle is not None:
            handle, self._handle = self._handle, None
            self._check(self._library.dem_close(handle))
