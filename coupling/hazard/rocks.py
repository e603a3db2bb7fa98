"""Paths of rocks over a terrain: place, speed, spin, height above it and energy, and the largest of each."""
from pathlib import Path
from typing import Any, Dict, List, NamedTuple, Tuple

import numpy as np

from ..ledger.momentum import rotation
from .raster import Ground, write_table

AXES = "xyz"


class Motion(NamedTuple):
    """Of all rocks at one time: places x [m] and velocities v [m/s], (n, D), spin [rad/s], height above the
    terrain [m], kinetic energy [J], and who is still there, (n,) each."""

    x: np.ndarray
    v: np.ndarray
    spin: np.ndarray
    height: np.ndarray
    energy: np.ndarray
    there: np.ndarray

    @property
    def speed(self) -> np.ndarray:
        """[m/s], (n,)."""
        return np.linalg.norm(self.v, axis=1)


class Rocks:
    """The rocks of ``grains``, clusters first, then single spheres, over the ``ground``. ``motion``: where
    they are now; ``path``: (time [s], ``Motion``) at the times of the output; ``largest``: height, speed and
    energy since the start, shape (n,) each.

    The height above the terrain is the smallest vertical distance from the surface of a rock to the terrain:
    from each of its spheres along the terrain's normal below its centre. It is zero where a rock touches a
    plane, below zero where it is pressed in, or lies in the flow's bed.
    """

    def __init__(self, grains: Any, ground: Ground, dim: int) -> None:
        self._grains, self._ground, self._dim = grains, ground, dim
        self._clusters = tuple(getattr(grains.scene, "clusters", ()))
        body = self._body_of(grains.particles())
        single, count = body == 0, len(self._clusters)
        self.owner = np.where(single, count + np.cumsum(single) - 1, body - 1)  # of each sphere: its rock
        self._single, self.count = np.flatnonzero(single), count + int(single.sum())
        self._inertia = np.zeros((count, 3, 3))
        for n, cluster in enumerate(self._clusters):
            self._inertia[n][(2, 2) if np.ndim(cluster.inertia) == 0 else slice(None)] = cluster.inertia
        self.path: List[Tuple[float, Motion]] = []
        self.look()
        self.start = self.motion.x.copy()
        self.end = self.start.copy()
        self.largest = {"height": self.motion.height.copy(), "speed": self.motion.speed,
                        "energy": self.motion.energy.copy()}

    def _body_of(self, particles: np.ndarray) -> np.ndarray:
        return particles["body"] if self._clusters else np.zeros(len(particles), int)

    def look(self) -> None:
        """Where they are now. Collective."""
        particles = self._grains.particles()
        bodies = self._grains.bodies() if self._clusters else None
        single, dim = particles[self._single], self._dim
        there = np.zeros(self.count, bool)
        there[self.owner[particles["radius"] > 0.0]] = True
        spin = single["omega"]
        energy = 0.5 * single["mass"] * ((single["v"] ** 2).sum(axis=1)
                                         + 0.4 * single["radius"] ** 2 * (spin**2).sum(axis=1))
        x, v, self.mass = single["x"], single["v"], single["mass"]
        if bodies is not None:
            turns = np.array([rotation(q) for q in bodies["quaternion"]])
            own = np.einsum("nji,nj->ni", turns, bodies["omega"])  # in the frame of the cluster
            of_spin = np.einsum("ni,nij,nj->n", own, self._inertia, own)
            of_bodies = 0.5 * (bodies["mass"] * (bodies["v"] ** 2).sum(axis=1) + of_spin)
            x, v, spin = (np.concatenate(pair) for pair in ((bodies["x"], x), (bodies["v"], v),
                                                            (bodies["omega"], spin)))
            energy = np.concatenate([of_bodies, energy])
            self.mass = np.concatenate([bodies["mass"], self.mass])
        self.spheres = particles["x"][:, :dim].copy(), particles["radius"].copy()
        self.motion = Motion(x[:, :dim].copy(), v[:, :dim].copy(), np.linalg.norm(spin, axis=1),
                             self._heights(there), np.where(there, energy, 0.0), there)

    def _heights(self, there: np.ndarray) -> np.ndarray:
        """Above the terrain [m], NaN of rocks that are gone, shape (n,)."""
        x, radius = self.spheres
        some = radius > 0.0
        x, radius, owner = x[some], radius[some], self.owner[some]
        steps = np.eye(self._dim - 1)[:, None] * radius[:, None]
        sides = np.concatenate([x[:, :-1] + way * step for way in (1, -1) for step in steps])  # one call
        above, below = self._ground.height(sides).reshape(2, self._dim - 1, len(x))
        normal = np.column_stack([(below - above).T / (2.0 * radius[:, None]), np.ones(len(x))])
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        lowest = x - radius[:, None] * normal
        heights = np.full(self.count, np.inf)
        np.minimum.at(heights, owner, lowest[:, -1] - self._ground.height(lowest[:, :-1]))
        return np.where(there, heights, np.nan)

    def follow(self) -> None:
        """Update the largest values."""
        now = self.motion
        for name, values in (("height", now.height), ("speed", now.speed), ("energy", now.energy)):
            self.largest[name][:] = np.where(now.there, np.fmax(self.largest[name], values),
                                             self.largest[name])
        self.end[now.there] = now.x[now.there]

    def keep(self, time: float) -> None:
        """The motion now belongs to the path."""
        self.path.append((time, self.motion))

    # ---------------------------------------------------------------- files

    def write_path(self, path: Path) -> None:
        """rocks.csv: a line per rock and time of the output, as long as it is there."""
        axes = AXES[:self._dim]
        columns = {"time": ("s", "of the output"), "rock": ("1", "number, clusters first, then spheres"),
                   **{a: ("m", f"its {a}, of the centre of mass") for a in axes},
                   **{f"v_{a}": ("m/s", f"its velocity along {a}") for a in axes},
                   "speed": ("m/s", "of the centre of mass"), "spin": ("rad/s", "angular speed"),
                   "height": ("m", "of its lowest point above the terrain"),
                   "energy": ("J", "kinetic, with that of the spin")}
        parts = [np.column_stack([np.full(self.count, time), np.arange(1, self.count + 1), m.x, m.v, m.speed,
                                  m.spin, m.height, m.energy])[m.there] for time, m in self.path]
        write_table(path, columns, np.concatenate([*parts, np.zeros((0, len(columns)))]))

    def write_largest(self, path: Path) -> None:
        """rocks_largest.csv: a line per rock."""
        axes = AXES[:self._dim]
        columns = {"rock": ("1", "number, clusters first, then spheres"), "mass": ("kg", "of the rock"),
                   **{f"{a}_start": ("m", f"its {a} at the start") for a in axes},
                   **{f"{a}_end": ("m", f"its {a} at the end, or where it was last seen") for a in axes},
                   "runout": ("m", "horizontal distance from start to end"),
                   "height": ("m", "highest of its lowest point above the terrain: of its jumps"),
                   "speed": ("m/s", "largest"), "energy": ("J", "largest kinetic energy")}
        write_table(path, columns, np.column_stack([
            np.arange(1, self.count + 1), self.mass, self.start, self.end, self.runout,
            *self.largest.values()]))

    @property
    def runout(self) -> np.ndarray:
        """Horizontal distance from start to end [m], (n,)."""
        return np.linalg.norm((self.end - self.start)[:, :-1], axis=1)

    # ---------------------------------------------------------------- a run that goes on

    def get_state(self) -> Dict[str, Any]:
        """All since the start, as plain data."""
        path = tuple((time, tuple(motion)) for time, motion in self.path)
        return {"path": path, "start": self.start.copy(), "end": self.end.copy(), **{
            name: values.copy() for name, values in self.largest.items()}}

    def set_state(self, state: Dict[str, Any]) -> None:
        """The counterpart."""
        self.path = [(float(time), Motion(*motion)) for time, motion in state["path"]]
        self.start, self.end = state["start"].copy(), state["end"].copy()
        for name, values in self.largest.items():
            values[:] = state[name]
