"""Arrays that LIGGGHTS and its shim understand: records of particles, rows of clusters, which are its
bodies."""
import ctypes
from typing import NamedTuple, Tuple

import numpy as np
from mpi4py import MPI

from .. import quaternion
from ..scene.arrays import in_space
from ..scene.tables import ClusterTable, SphereTable

CONSTANT = 16  # numbers of a body that never change, before those that do (shim/bodies.h)
SPRING = 8  # tag of a particle, of its partner or minus that of an element, six displacements (shim.cpp)
CHANGING = 22  # x, v, omega, angular momentum (3 each), quaternion (4), force, torque (3 each)


class Load(NamedTuple):
    """What acts on walls: of the nodes of a terrain few are hit. Rows are numbers of nodes, rising; after the
    last node follow the two last rows of shim/wall.h."""

    row: np.ndarray  # (n,)
    values: np.ndarray  # (n, dim)

    def dense(self, first: int, count: int) -> np.ndarray:
        """Of the ``count`` rows from ``first`` on all values, (count, dim)."""
        out = np.zeros((count, self.values.shape[1]))
        some = (self.row >= first) & (self.row < first + count)
        out[self.row[some] - first] = self.values[some]
        return out

    def with_others(self, first: int, count: int, values: np.ndarray) -> "Load":
        """The same with ``values``, (n, dim), in the place of the ``count`` rows from ``first`` on."""
        before, after = self.row < first, self.row >= first + count
        row = np.concatenate([self.row[before], first + np.arange(len(values)),
                              self.row[after] + len(values) - count])
        return Load(row, np.concatenate([self.values[before], values, self.values[after]]))

    def in_space(self, nodes: int) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Nodes, what acts on them, (n, 3), and the two last rows, (2, 3), when there are so many ``nodes``:
        in a plane the first number of a moment is that about z."""
        whole = in_space(self.dense(nodes, 2))
        if self.values.shape[1] == 2:
            whole[0] = 0.0, 0.0, whole[0, 0]
        hit = self.row < nodes
        hit[hit] = self.values[hit].any(axis=1)
        return self.row[hit], in_space(self.values[hit]), whole

    def table(self, here: bool) -> np.ndarray:
        """As the shim takes it, empty unless ``here``."""
        return np.column_stack([self.row, self.values])[:None if here else 0].copy()


def record_starts(records: np.ndarray) -> np.ndarray:
    """Where the records of the particles begin, and the end of the last one; each starts with its length."""
    numbers, first = memoryview(records), [0]  # reads one number several times faster than an array does
    while first[-1] < len(numbers):
        first.append(first[-1] + int(numbers[first[-1]]))
    return np.array(first)


def copied(address: ctypes.c_void_p, count: int) -> np.ndarray:
    """``count`` numbers that begin at an address of the shim, as an array of its own."""
    out = np.empty(count)
    ctypes.memmove(out.ctypes.data, address, out.nbytes)
    return out


def gathered(comm: MPI.Comm, mine: np.ndarray) -> np.ndarray:
    """The rows or numbers of all ranks, one after the other, on every rank."""
    return mine if comm.size == 1 else np.concatenate(comm.allgather(mine))


def sorted_by_tag(records: np.ndarray, out: np.ndarray) -> np.ndarray:
    """The records in the order of their second number, the tag from 1 on, without those that are ``out``,
    (n,) bool."""
    first = record_starts(records)
    tag = records[first[:-1] + 1].astype(int)
    order = np.argsort(tag, kind="stable")
    order = order[~out[tag[order] - 1]]
    lengths = np.diff(first)[order]
    # where a record comes from, less where it goes to
    shift = first[order] - np.concatenate([[0], np.cumsum(lengths)[:-1]])
    return records[np.repeat(shift, lengths) + np.arange(lengths.sum())]


def constant_rows(clusters: ClusterTable, spheres: SphereTable) -> np.ndarray:
    """What never changes of the clusters (shim/bodies.h), shape (clusters, CONSTANT)."""
    out = np.zeros((len(clusters.mass), CONSTANT))
    for b, (start, stop) in enumerate(zip(clusters.first[:-1], clusters.first[1:])):
        arm = spheres.arm[start:stop]
        middle = arm.mean(axis=0)
        bound = (np.sqrt(((arm - middle) ** 2).sum(axis=1)) + spheres.radius[start:stop]).max()
        out[b] = (b + 1, clusters.mass[b], stop - start, *clusters.inertia[b], *clusters.free[b], bound,
                  *middle)
    return out


def initial_rows(clusters: ClusterTable) -> np.ndarray:
    """What changes of the clusters, as it is at the start, shape (clusters, CHANGING)."""
    spin = np.empty((len(clusters.mass), 3))
    for b, axes in enumerate(map(quaternion.matrix, clusters.q)):
        spin[b] = axes @ (clusters.inertia[b] * (axes.T @ clusters.omega[b]))
    return np.column_stack([clusters.x, clusters.v, clusters.omega, spin, clusters.q,
                            np.zeros((len(spin), 6))])
