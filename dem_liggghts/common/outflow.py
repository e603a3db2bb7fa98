"""What has left the domain of a scene: it ends the run, stays at the edge at rest, or is removed; in either
case it is counted.

A single sphere leaves with its centre, a cluster with its centre of mass; looked for at the end of every
window. Held or removed it takes part no more: nothing touches it, and the sums have its mass, momentum and
energy, so that what is left plus what has left is what was there.
"""
from typing import Any, Dict, List, NamedTuple, Optional, Tuple

import numpy as np

from ..protocol import BODY, PARTICLE
from ..scene.domain import read_ways
from ..scene.scene import SceneData


class LeftDomain(RuntimeError):  # noqa: N818 - as the one of the MPM
    """A particle has left the domain where that is not allowed."""


class Leaving(NamedTuple):
    """Single spheres and clusters that have left the domain in a window."""

    particles: np.ndarray  # all of them, dtype PARTICLE
    bodies: np.ndarray  # all of them, dtype BODY
    rows: np.ndarray  # of ``particles``: which single spheres leave
    ways: List[str]  # "hold" or "remove", of each
    clusters: np.ndarray  # rows of ``bodies``: which clusters leave
    cluster_ways: List[str]


class Outflow:
    """For a ``scene``, with or without a domain.

    cluster: number of the cluster of each sphere, -1 for none. out, out_clusters: which spheres, shape (n,),
    and clusters have been held or removed; the others, so many spheres as ``present`` says, are in the
    calculation.
    """

    def __init__(self, scene: SceneData, cluster: np.ndarray):
        self.active, self._dim = scene.domain is not None, scene.dim
        self._ways = read_ways(scene.outflow, scene.dim)
        self._domain, self.present = scene.domain, len(cluster)
        # of those that are out, as they are shown
        self._particles, self._bodies = np.zeros(len(cluster), PARTICLE), np.zeros(len(scene.clusters), BODY)
        for table in (self._particles, self._bodies):
            table["id"] = 1 + np.arange(len(table))
        self._particles["body"] = cluster + 1
        self.out, self.out_clusters = (np.zeros(n, np.bool_) for n in (len(cluster), len(scene.clusters)))
        self._sums = np.zeros(3 + scene.dim)  # count, mass, energy, momentum

    @property
    def removed(self) -> Dict[str, Any]:
        """See `protocol.DEM.removed`."""
        count, mass, energy = self._sums[:3].tolist()
        return {"count": int(count), "mass": mass, "momentum": self._sums[3:].copy(), "energy": energy}

    def all_particles(self, present: np.ndarray) -> np.ndarray:
        """Rows of all spheres from those of the present ones."""
        return _filled(present, self._particles, self.out)

    def all_bodies(self, present: np.ndarray) -> np.ndarray:
        """Rows of all clusters from those of the present ones."""
        return _filled(present, self._bodies, self.out_clusters)

    def leaving(self, particles: np.ndarray, bodies: np.ndarray, time: float) -> Optional[Leaving]:
        """What of all ``particles`` and ``bodies`` is outside at the ``time`` [s]. Raises LeftDomain."""
        rows, ways = self._outside(particles, (particles["body"] == 0) & ~self.out)
        clusters, cluster_ways = self._outside(bodies, ~self.out_clusters)
        if not (len(rows) or len(clusters)):
            return None
        self._stop(particles, rows, ways, "sphere", time)
        self._stop(bodies, clusters, cluster_ways, "cluster", time)
        return Leaving(particles, bodies, rows, ways, clusters, cluster_ways)

    def let_out(self, leaving: Leaving) -> None:
        """Count it, and show it from now on as what is out; the back end then goes on without it."""
        for table, rows in ((leaving.particles, leaving.rows), (leaving.bodies, leaving.clusters)):
            self._count(table[rows])
        self._show(leaving.particles, leaving.rows, leaving.ways)
        for cluster, way in zip(leaving.clusters, leaving.cluster_ways):
            self._show_cluster(leaving.particles, leaving.bodies, cluster, way)
        self.out[leaving.rows] = True
        self.out_clusters[leaving.clusters] = True
        self.present = int(np.count_nonzero(~self.out))

    def count_energy(self, energy: float) -> None:
        """``energy`` [J] has left with what has left."""
        self._sums[2] += energy

    def _outside(self, table: np.ndarray, present: np.ndarray) -> Tuple[np.ndarray, List[str]]:
        """Numbers of the rows that are outside, and what happens to each, by the side beyond which it is
        farthest."""
        x, (lower, upper) = table["x"][:, :self._dim], self._domain
        beyond = np.stack([lower - x, x - upper], axis=2).reshape(len(x), 2 * self._dim)
        rows = np.flatnonzero(present & (beyond > 0.0).any(axis=1))
        return rows, [self._ways[side] for side in beyond[rows].argmax(axis=1)]

    def _stop(self, table: np.ndarray, rows: np.ndarray, ways: List[str], what: str, time: float) -> None:
        for row, way in zip(rows, ways):
            if way == "stop":
                lower, upper = self._domain
                raise LeftDomain(f"{what} {row + 1} has left the domain, {lower} to {upper} m, and is at "
                                 f"{table['x'][row, :self._dim]} m at t = {time:.6g} s: enlarge the domain, "
                                 "or let go what leaves with outflow=hold or outflow=remove")

    def _count(self, rows: np.ndarray) -> None:
        self._sums[0] += len(rows)
        self._sums[1] += rows["mass"].sum()
        self._sums[3:] += rows["mass"] @ rows["v"][:, :self._dim]

    def _show(self, particles: np.ndarray, rows: np.ndarray, ways: List[str]) -> None:
        shown = particles[rows]
        _at_rest(shown)
        shown["radius"] *= [way == "hold" for way in ways]
        for row, way in zip(shown, ways):
            if way == "hold":
                row["x"][:self._dim] = np.clip(row["x"][:self._dim], *self._domain)
        self._particles[rows] = shown

    def _show_cluster(self, particles: np.ndarray, bodies: np.ndarray, cluster: int, way: str) -> None:
        rows = np.flatnonzero(particles["body"] == cluster + 1)
        shown, place = particles[rows], bodies["x"][cluster].copy()
        if way == "hold":
            place[:self._dim] = np.clip(place[:self._dim], *self._domain)
        shown["x"] += place - bodies["x"][cluster]
        _at_rest(shown)
        if way == "remove":
            shown["radius"] = 0.0
        self._particles[rows], self.out[rows] = shown, True
        self._bodies[cluster] = bodies[cluster]
        self._bodies["x"][cluster] = place
        _at_rest(self._bodies[cluster:cluster + 1])

    def get_state(self) -> Dict[str, np.ndarray]:
        """As name → array copy; nothing without a domain."""
        if not self.active:
            return {}
        return dict(removed=self._sums.copy(), out=self.out.copy(), out_clusters=self.out_clusters.copy(),
                    out_x=self._particles["x"].copy(), out_radius=self._particles["radius"].copy(),
                    out_body_x=self._bodies["x"].copy(),
                    out_body_quaternion=self._bodies["quaternion"].copy())

    def set_state(self, state: Dict[str, Any]) -> None:
        """Go back to ``state``."""
        if not self.active:
            return
        self._sums, self.out = np.array(state["removed"]), np.array(state["out"])
        self.out_clusters = np.array(state["out_clusters"])
        self.present = int(np.count_nonzero(~self.out))
        self._particles["x"], self._particles["radius"] = state["out_x"], state["out_radius"]
        self._bodies["x"], self._bodies["quaternion"] = state["out_body_x"], state["out_body_quaternion"]
        for table in (self._particles, self._bodies):
            _at_rest(table)

    @property
    def names(self) -> Tuple[str, ...]:
        """Of what ``get_state`` gives."""
        return tuple(self.get_state())


def _at_rest(rows: np.ndarray) -> None:
    rows["v"] = rows["omega"] = 0.0
    rows["mass"] = 0.0


def _filled(present: np.ndarray, shown: np.ndarray, out: np.ndarray) -> np.ndarray:
    if not out.any():
        return present
    rows = shown.copy()
    rows[~out] = present
    return rows
