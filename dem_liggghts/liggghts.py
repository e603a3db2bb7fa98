"""The LIGGGHTS back end: Debian's libliggghts in this process, through the project's own shim (``shim/wall.cpp``)."""
import ctypes
import os
import zlib
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path

import numpy as np
from mpi4py import MPI

from .checks import check_finite
from .contact import contact_energy, in_space, kinetic_energy, potential_energy
from .protocol import PARTICLE
from .script import commands

SHIM = Path(__file__).with_name("libdemshim.so")
SOURCE = Path(__file__).with_name("shim")  # there when the package is used from its source tree
ARGUMENTS = ("liggghts", "-screen", "/dev/null", "-log", "none", "-nocite")  # with "-screen none" it may crash

_Comm = ctypes.c_void_p if MPI._sizeof(MPI.Comm) == ctypes.sizeof(ctypes.c_void_p) else ctypes.c_int
_SIGNATURES = {
    "dem_open": (ctypes.c_int, ctypes.POINTER(ctypes.c_char_p), _Comm, ctypes.POINTER(ctypes.c_void_p)),
    "dem_close": (ctypes.c_void_p,),
    "dem_command": (ctypes.c_void_p, ctypes.c_char_p),
    "dem_same_layout": (ctypes.c_void_p,),
    "dem_add_spheres": (ctypes.c_void_p, ctypes.c_int, ctypes.c_void_p),
    "dem_set_wall": (ctypes.c_void_p, ctypes.c_int, ctypes.c_int, ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p),
    "dem_advance": (ctypes.c_void_p, ctypes.c_int, ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p),
    "dem_count": (ctypes.c_void_p,),
    "dem_particles": (ctypes.c_void_p, ctypes.c_void_p),
    "dem_get_state": (ctypes.c_void_p, ctypes.c_int, ctypes.POINTER(ctypes.c_void_p), ctypes.POINTER(ctypes.c_int),
                      ctypes.c_void_p, ctypes.c_void_p),
    "dem_set_state": (ctypes.c_void_p, ctypes.c_int, ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p),
}


class MissingLiggghts(ImportError):
    """LIGGGHTS or the shim compiled against it is not there."""


class LiggghtsError(RuntimeError):
    """LIGGGHTS stopped with an error; its text is the message."""


@lru_cache(maxsize=None)
def load(path):
    """The shim at ``path``. It must come into the process before libliggghts, whose error handling it replaces:
    it brings the library along. Raises MissingLiggghts."""
    try:
        library = ctypes.CDLL(str(path))
    except OSError as error:
        raise MissingLiggghts(
            "LIGGGHTS is not available: install it with `apt install liggghts libliggghts-dev libopenmpi-dev` and "
            "reinstall this package to compile its shim, or use dem=reference, which works without "
            f"({error})") from None
    library.dem_last_error.restype, library.dem_source.restype = ctypes.c_char_p, ctypes.c_uint
    source = [file.read_bytes() for file in sorted(SOURCE.glob("*")) if file.suffix in (".cpp", ".h")]
    if source and library.dem_source() != zlib.crc32(b"".join(source)):
        raise MissingLiggghts(f"the LIGGGHTS shim {path} is older than its source: reinstall this package to compile "
                              "it, or use dem=reference, which works without")
    for name, arguments in _SIGNATURES.items():
        getattr(library, name).argtypes = arguments
    return library


@contextmanager
def _quiet():
    """Nothing on stderr: from the second instance on, LIGGGHTS lists all its contact models there."""
    keep = os.dup(2)
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, 2)
    try:
        yield
    finally:
        os.dup2(keep, 2)
        os.close(keep)
        os.close(null)


def _pointer(array):
    return array.ctypes.data


class LiggghtsDEM:
    """The protocol of `protocol.DEM` for ``scene``, time step ``dt`` [s], on the ranks of the mpi4py communicator
    ``comm`` (default: all).

    A restitution of exactly 0.05 becomes 0.0500001 (see `script`). Raises MissingLiggghts when LIGGGHTS or the shim is
    not installed, LiggghtsError with LIGGGHTS' own text, ValueError for a negative Poisson's ratio. An instance that
    raised LiggghtsError is lost; the process and other instances go on. An error on some of several ranks ends all.
    """

    def __init__(self, scene, dt, comm=None):
        self.scene, self.dt, self.comm = scene, float(dt), comm or MPI.COMM_WORLD
        self._steps, self._nodes = 0, scene.wall.nodes
        self._handle, self._library = None, load(SHIM)
        script = commands(scene, self.dt)
        self._open()
        for line in script:
            self._command(line)
        balls, wall = scene.spheres, scene.wall
        data = np.column_stack([in_space(balls.x), in_space(balls.v), balls.omega, balls.radius, balls.rho])
        self._call("dem_add_spheres", len(data), _pointer(data))
        elements = np.ascontiguousarray(wall.elements, np.int32)
        nodes = np.ascontiguousarray(wall.nodes)
        self._call("dem_set_wall", scene.dim, len(nodes), len(elements), _pointer(elements), _pointer(nodes))
        self._command("run 0 post no")

    def _open(self):
        arguments = (ctypes.c_char_p * (len(ARGUMENTS) + 1))(*(a.encode() for a in ARGUMENTS), None)
        handle = ctypes.c_void_p()
        with _quiet():
            self._check(self._library.dem_open(len(ARGUMENTS), arguments,
                                               _Comm.from_address(MPI._addressof(self.comm)), ctypes.byref(handle)))
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
        return self._check(getattr(self._library, name)(self._handle, *arguments))

    def _command(self, line):
        self._call("dem_command", line.encode())

    @property
    def time(self):
        """[s]"""
        return self._steps * self.dt

    def advance(self, steps, x, v):
        """See `protocol.DEM.advance`. Raises FloatingPointError when a number is no longer finite."""
        shape = self.scene.wall.nodes.shape
        if np.shape(x) != shape or np.shape(v) != shape:
            raise ValueError(f"wall nodes x {np.shape(x)} and v {np.shape(v)}: both must have shape {shape}")
        if steps < 1:
            raise ValueError(f"steps is {steps}: a window has at least one DEM step")
        x, v = np.ascontiguousarray(x, float), np.ascontiguousarray(v, float)
        out = np.empty(x.size + 2)
        code = self._call("dem_advance", self.scene.dim, steps, _pointer(x), _pointer(v), _pointer(out))
        if code and not (np.isfinite(x).all() and np.isfinite(v).all()):
            raise FloatingPointError(f"the wall given at t = {self.time:.6g} s contains NaN or infinity: "
                                     "look at the motion of the body")
        self._steps += steps
        out = self._sum(out)
        if code or out[-1] or out[-2] != len(self.scene.spheres.x):
            self._report()
        self._nodes = x + v * (steps * self.dt)
        return out[:-2].reshape(shape) / (steps * self.dt)

    def _sum(self, array):
        """Sum over ranks, the same to the last bit on all of them."""
        if self.comm.size == 1:
            return array
        total = np.empty_like(array)
        self.comm.Reduce(array, total, MPI.SUM)
        self.comm.Bcast(total)
        return total

    def _report(self):
        particles = self.particles()
        check_finite(particles["x"], self.time)
        lost = sorted(set(range(1, len(self.scene.spheres.x) + 1)) - set(particles["id"].tolist()))
        raise LiggghtsError(f"particles {lost} were lost at t = {self.time:.6g} s: they flew across a whole rank "
                            "between two neighbour lists; use fewer ranks")

    def particles(self):
        """See `protocol.DEM.particles`; the ids count from 1 in the order of the scene."""
        mine = np.empty((self._library.dem_count(self._handle), 12)) if self._handle else np.empty((0, 12))
        self._call("dem_particles", _pointer(mine))
        table = mine if self.comm.size == 1 else np.concatenate(self.comm.allgather(mine))
        table = table[np.argsort(table[:, 0])]
        out = np.empty(len(table), PARTICLE)
        out["id"], out["x"], out["v"], out["omega"] = table[:, 0], table[:, 1:4], table[:, 4:7], table[:, 7:10]
        out["radius"], out["mass"] = table[:, 10], table[:, 11]
        return out

    def energy(self):
        """See `protocol.DEM.energy`."""
        particles = self.particles()
        return dict(kinetic=kinetic_energy(particles), potential=potential_energy(particles, self.scene.gravity),
                    contact=contact_energy(self.scene, particles["x"], self._nodes))

    def get_state(self):
        """See `protocol.DEM.get_state`. LIGGGHTS makes its neighbour lists anew here as in `set_state`, so that both
        go on with the same order of summation."""
        records, count = ctypes.c_void_p(), ctypes.c_int()
        wall, force = np.empty(self._nodes.shape), np.empty(self._nodes.shape)
        code = self._call("dem_get_state", self.scene.dim, ctypes.byref(records), ctypes.byref(count), _pointer(wall),
                          _pointer(force))
        if code:
            self._report()
        mine = np.array((ctypes.c_double * count.value).from_address(records.value)) if count.value else np.empty(0)
        parts = [mine] if self.comm.size == 1 else self.comm.allgather(mine)
        particles = sorted((r for part in parts for r in _split(part)), key=lambda r: r[1])
        state = dict(particles=np.concatenate(particles), wall=wall, wall_force=self._sum(force),
                     steps=np.array(self._steps))
        self.set_state(state)
        return state

    def set_state(self, state):
        """See `protocol.DEM.set_state`. The state may come from another instance of the same scene, on any ranks."""
        particles, wall = np.array(state["particles"]), np.array(state["wall"])
        force = np.array(state["wall_force"]) if self.comm.rank == 0 else np.zeros(wall.shape)
        if wall.shape != self._nodes.shape or len(_split(particles)) != len(self.scene.spheres.x):
            raise ValueError("the state belongs to another scene: it has other numbers of spheres or wall nodes")
        code = self._call("dem_set_state", self.scene.dim, len(particles), _pointer(particles), _pointer(wall),
                          _pointer(force))
        if code:
            self._report()
        self._steps, self._nodes = int(state["steps"]), wall

    def close(self):
        """Free the LIGGGHTS instance; a second call does nothing."""
        if self._handle is not None:
            handle, self._handle = self._handle, None
            self._check(self._library.dem_close(handle))


def _split(records):
    """The records of the particles one after the other; each starts with its length."""
    out, start = [], 0
    while start < len(records):
        stop = start + int(records[start])
        out.append(records[start:stop])
        start = stop
    return out
