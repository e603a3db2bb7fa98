"""Spheres of other ranks that are near to those of this one, its ghosts: what they do in each step."""
from typing import Any, List, NamedTuple, Tuple

import numpy as np
from mpi4py import MPI

from ..compiled import compiled
from .forces import SphereState

COLUMNS = 9  # of what is sent of each sphere: place, velocity, angular velocity
TAG = 1  # of these messages


class Room(NamedTuple):
    """Numbers that go from rank to rank in a step, as kernels take them."""

    send: np.ndarray  # own spheres that others need, by these ranks, (m,)
    out: np.ndarray  # of these, (m, COLUMNS)
    into: np.ndarray  # of the ghosts, (ghosts, COLUMNS)
    # longest way that a sphere will have come [m], and 1 + number of one that is about to go through a wall
    # or 0, (2,): of this rank, then the largest of all
    largest: np.ndarray


class Ghosts:
    """Those with this ``number``, (n,), by the ``rank`` that has each of them, (n,), and rising; own: numbers
    of this rank's own spheres, rising. Collective."""

    def __init__(self, number: np.ndarray, rank: np.ndarray, own: np.ndarray, comm: Any) -> None:
        self._comm, counts = comm, np.bincount(rank, minlength=comm.size)
        asked = np.empty_like(counts)  # how many of its own each other rank needs
        comm.Alltoall(counts, asked)
        send = np.empty(asked.sum(), np.int64)
        comm.Alltoallv([number, counts], [send, asked])
        self.room = Room(np.searchsorted(own, send), np.empty((len(send), COLUMNS)),
                         np.empty((len(number), COLUMNS)), np.zeros(2))
        self._come, self._go = self._parts(self.room.into, counts), self._parts(self.room.out, asked)

    @staticmethod
    def _parts(array: np.ndarray, counts: np.ndarray) -> List[Tuple[int, np.ndarray]]:
        """Rank and rows of what comes from it, or goes to it."""
        ends = np.cumsum(counts)
        return [(rank, array[ends[rank] - counts[rank]:ends[rank]])
                for rank in np.flatnonzero(counts).tolist()]

    @property
    def traffic(self) -> np.ndarray:
        """Messages and bytes that this rank sends in a step, its part in one sum over all ranks aside."""
        return np.array([len(self._go), self.room.out.nbytes])

    def exchange(self) -> None:
        """Fill ``room.into`` with what the other ranks have in their ``room.out``. Collective."""
        requests = [self._comm.Irecv(rows, rank, TAG) for rank, rows in self._come]
        requests += [self._comm.Isend(rows, rank, TAG) for rank, rows in self._go]
        MPI.Request.Waitall(requests)

    def agree(self) -> np.ndarray:
        """``room.largest``, after it has become that of all ranks. Collective."""
        self._comm.Allreduce(MPI.IN_PLACE, self.room.largest, MPI.MAX)
        return self.room.largest


@compiled
def pack(spheres: SphereState, room: Room) -> None:
    """Write what others need."""
    for m in range(len(room.send)):
        i = room.send[m]
        for k in range(3):
            room.out[m, k], room.out[m, 3 + k] = spheres.x[i, k], spheres.v[i, k]
            room.out[m, 6 + k] = spheres.omega[i, k]


@compiled
def unpack(spheres: SphereState, room: Room) -> None:
    """The ghosts, the last ones of the ``spheres``, are where their ranks have them."""
    first = len(spheres.x) - len(room.into)
    for m in range(len(room.into)):
        for k in range(3):
            spheres.x[first + m, k], spheres.v[first + m, k] = room.into[m, k], room.into[m, 3 + k]
            spheres.omega[first + m, k] = room.into[m, 6 + k]
