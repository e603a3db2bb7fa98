"""The part of all spheres and clusters that a rank steps, and how all ranks get to know all of them."""
from typing import Any, NamedTuple, Tuple

import numpy as np

from ..compiled import compiled
from ..search.neighbours import NeighbourList
from .forces import SphereState
from .gathering import rows_of_all
from .rigid import ClusterState

MOVING = ("x", "v", "omega", "force", "torque")  # what changes of the spheres, and of the clusters
CLUSTER_MOVING = ("x", "v", "omega", "spin", "force", "torque", "q", "axes")


class Part(NamedTuple):
    """Which spheres a rank has: its own, rising, those of its clusters last, then its ghosts, which are near
    to them, by their ranks and rising."""

    here: int  # this rank
    rank: np.ndarray  # of each of all spheres, (n,)
    order: np.ndarray  # numbers of all spheres, by rank and rising, (n,)
    number: np.ndarray  # of those here, (own + ghosts,)
    own: int  # how many of them are its own
    index: np.ndarray  # of each of all spheres among those here, -1 for none, (n,)

    def spheres(self, whole: SphereState) -> SphereState:
        """Copy of those here."""
        single = int(np.searchsorted(self.number[:self.own], whole.single))
        return SphereState(*(array[self.number] for array in whole[:-2]), whole.gravity, single)

    def clusters(self, whole: ClusterState) -> ClusterState:
        """Copy of its own."""
        mine = self.rank[whole.first[:-1]] == self.here
        single = np.searchsorted(self.number[:self.own], whole.first[0])
        first = single + np.append(0, np.cumsum(np.diff(whole.first)[mine]))
        arm = whole.arm[self.number[:self.own]]
        return ClusterState(*(array[mine] for array in whole[:-3]), first, arm, whole.extent[mine])

    def with_ghosts_of(self, near: NeighbourList) -> Tuple["Part", NeighbourList]:
        """This part without the ghosts that are in no pair of the list ``near``, and the list with the
        numbers that remain."""
        far = near.partner >= self.own
        used, new = np.unique(near.partner[far], return_inverse=True)
        partner = near.partner.copy()
        partner[far] = self.own + new
        number = np.append(self.number[:self.own], self.number[used])
        return self._replace(number=number, index=_index(number, len(self.rank))), near._replace(
            partner=partner)


def part_of(rank: np.ndarray, here: int, ghosts: np.ndarray) -> Part:
    """That of the rank ``here``, with the ``ghosts`` of these numbers, rising. rank: of each of all
    spheres, (n,)."""
    own, order = np.flatnonzero(rank == here), np.argsort(rank, kind="stable")
    number = np.append(own, ghosts[np.argsort(rank[ghosts], kind="stable")])
    return Part(here, rank, order, number, len(own), _index(number, len(rank)))


def _index(number: np.ndarray, count: int) -> np.ndarray:
    index = np.full(count, -1)
    index[number] = np.arange(len(number))
    return index


def gather(part: Part, own: Tuple[SphereState, Any], whole: Tuple[SphereState, Any], comm: Any) -> None:
    """Write what each rank has of its ``own`` spheres and clusters to the ``whole`` ones of every rank."""
    (spheres, clusters), (all_spheres, all_clusters) = own, whole
    block = np.concatenate([getattr(spheres, name)[:part.own] for name in MOVING], axis=1)
    _spread(_from_all(block, part.rank, comm), part.order, all_spheres)
    if clusters is None:
        return
    rank = part.rank[all_clusters.first[:-1]]
    arrays = [getattr(clusters, name) for name in CLUSTER_MOVING]
    widths = [int(np.prod(array.shape[1:])) for array in arrays]  # a rank may have none
    block = np.concatenate([array.reshape(len(array), width) for array, width in zip(arrays, widths)], axis=1)
    columns = np.split(_from_all(block, rank, comm), np.cumsum(widths)[:-1], axis=1)
    order = np.argsort(rank, kind="stable")
    for name, rows in zip(CLUSTER_MOVING, columns):
        array = getattr(all_clusters, name)
        array[order] = rows.reshape(array.shape)


def _from_all(block: np.ndarray, rank: np.ndarray, comm: Any) -> np.ndarray:
    """The rows of all ranks, one after the other. rank: of each of all things, (n,)."""
    return rows_of_all(block, comm, np.bincount(rank, minlength=comm.size))


@compiled
def _spread(rows, order, b):
    """Write the ``rows``, as of ``MOVING``, to the spheres b in this ``order``."""
    for m in range(len(order)):
        i = order[m]
        for k in range(3):
            b.x[i, k], b.v[i, k], b.omega[i, k] = rows[m, k], rows[m, 3 + k], rows[m, 6 + k]
            b.force[i, k], b.torque[i, k] = rows[m, 9 + k], rows[m, 12 + k]
