"""Many spheres: each rank steps its part of them.

At both ends of a window, and when neighbour lists are due, every rank knows all spheres and clusters. New
lists begin with a new partition, which depends on the places alone. In a step only what is near to spheres of
other ranks goes there, and one sum over all ranks says whether lists are due.

The forces on a sphere are added in another order than without sharing, so that other numbers of ranks differ
by round-off. A state is that of all spheres with the lists of all, as without sharing: any number of ranks
goes on from it, the same number bit for bit, as places and lists in it decide all that ranks have.
"""
from typing import Any, NamedTuple, Optional

import numpy as np

from mpm_dem_direct import direct

from ..common.chunks import Chunks
from ..compiled import compiled
from ..contact.law import Laws
from ..search.elements import MovingWall
from ..search.neighbours import NeighbourList, NeighbourLists
from .bisection import around, bisected
from .forces import Moment, Scratch, SphereState, WallForce, forces
from .ghosts import Ghosts, Room, pack, unpack
from .loads import Loads
from .pairs import Pairs, gathered, list_of, pairs_of, routed
from .part import Part, gather, part_of
from .verlet import Span, build_lists, choose_skin, kick_and_drift, last_kick, sphere_travel, wall_travel

BEYOND = 1.0 + 1e-9  # room for round-off


class Share(NamedTuple):
    """What a rank steps, as kernels take it."""

    spheres: SphereState  # its own, then the ghosts
    clusters: Any  # its own, or None in a scene without
    lists: NeighbourLists
    room: Room


@compiled
def half_step(share, dt, room):
    """Half a kick and the way of a step dt [s], and what others need of it. room: (3,)."""
    kick_and_drift(share.spheres, share.clusters, dt, room)
    pack(share.spheres, share.room)


@compiled
def other_half(share, wall, laws, moment, on_wall, scratch):
    """The rest of a step: forces with the ghosts where they have come to, half a kick, and what
    ``room.largest`` says of the next step."""
    unpack(share.spheres, share.room)
    through = forces(share.spheres, share.clusters, wall, share.lists, laws, moment, on_wall, scratch)
    last_kick(share.spheres, share.clusters, 0.5 * moment.dt)
    look_ahead(share, moment.dt)
    share.room.largest[1] = through


@compiled
def look_ahead(share, dt):
    """How far a sphere will have come in the next step, into ``room.largest``."""
    way = sphere_travel(share.spheres, share.clusters, share.lists.x, dt)
    share.room.largest[0] = 0.0 if np.isnan(way) else way  # the largest of NaN and another is not defined


class Shared:
    """As `replicated.Replicated`, for ranks of ``comm`` that share the spheres; every method is
    collective."""

    lists: NeighbourLists

    def __init__(self, laws: Laws, springs: tuple, dt: float, comm: Any) -> None:
        self._laws, self._springs, self._dt, self._comm = laws, springs, dt, comm
        self.first, self.chunks = comm.rank == 0, Chunks(comm)
        self._build, self._travel = direct(build_lists), direct(wall_travel)
        # with clusters and without: a direct call does not look at what it gets
        self._kernels = {some: [direct(kernel) for kernel in (half_step, other_half, look_ahead)]
                         for some in (True, False)}
        self._known: Optional[NeighbourLists] = None  # lists of all spheres that new ones follow
        self._part: Optional[Part] = None
        self.traffic = np.zeros(3)  # steps so far, messages and bytes that this rank has sent others in them

    def use(self, spheres: SphereState, clusters: Any, cluster: np.ndarray) -> None:
        """See `Replicated.use`."""
        self._all, self._all_clusters, self._cluster = spheres, clusters, cluster
        self._half, self._rest, self._ahead = self._kernels[clusters is not None]
        # of a cluster the place of its first sphere counts: it belongs whole to one rank
        self._place, self._current, self._known = np.arange(len(cluster)), True, None
        if clusters is not None:
            self._place[spheres.single:] = clusters.first[cluster[spheres.single:]]

    @property
    def spheres(self) -> SphereState:
        """Those of this rank, then its ghosts."""
        return self._share.spheres

    def remember(self, lists: NeighbourLists) -> None:
        """See `Replicated.remember`."""
        self._known = lists

    def whole_lists(self) -> NeighbourLists:
        """See `Replicated.whole_lists`."""
        found, number = [], self._part.number
        for near, springs, among in zip(self.lists, self._springs, (True, False)):
            pairs = gathered(pairs_of(near, number, among), springs, self._comm)
            found.append(list_of(pairs, np.arange(len(self._all.x)), len(self._all.x), among))
        return NeighbourLists(*found, self._built, *self.lists[3:])

    def adopt(self, lists: NeighbourLists) -> None:
        """See `Replicated.adopt`."""
        rank, own = bisected(lists.x[self._place], self._comm.size), self._comm.rank
        mine = rank == own
        pairs = [pairs_of(near, np.arange(len(rank)), among) for near, among in zip(lists, (True, False))]
        between, at_walls = pairs[0], pairs[1].some(mine[pairs[1].first])
        between = between.some(mine[between.first] | mine[between.second])
        near = np.unique(np.append(between.first, between.second))
        part = part_of(rank, own, near[~mine[near]])
        found = [list_of(some, part.index, part.own, among)
                 for some, among in ((between, True), (at_walls, False))]
        self._take(part, NeighbourLists(*found, lists.x[part.number], *lists[3:]), lists.x)

    def renew(self, wall: MovingWall, t: float) -> None:
        """See `Replicated.renew`."""
        self._gather()
        skin = choose_skin(self._all, wall, self._dt)
        rank, own = bisected(self._all.x[self._place], self._comm.size), self._comm.rank
        reach = BEYOND * (2.0 * self._all.radius.max(initial=0.0) + skin)
        part = part_of(rank, own, around(self._all.x, rank, own, reach))
        old = NeighbourLists(self._old(0, part), self._old(1, part), self._all.x[:0], self._all.x[:0], 0.0)
        near = part.spheres(self._all)
        lists = self._build(near, self._cluster[part.number], wall, t, skin, old, self._springs)
        self._known = None
        part, between = part.with_ghosts_of(lists.spheres)
        self._take(part, lists._replace(spheres=between), self._all.x.copy())

    def _old(self, kind: int, part: Part) -> NeighbourList:
        """What new lists of ``part`` remember: of spheres with each other, 0, or at walls, 1."""
        springs, among = self._springs[kind], kind == 0
        near = self.lists[kind] if self._known is None else self._known[kind]
        number = self._part.number if self._known is None else np.arange(len(part.rank))
        pairs = pairs_of(near, number, among)
        pairs = pairs.some(pairs.active & (pairs.second >= 0)) if springs else pairs.some(slice(0, 0))
        if self._known is not None:  # all know these
            pairs = pairs.some(part.rank[pairs.first] == self._comm.rank)
        also = part.rank[pairs.second] if among else None
        here: Pairs = routed(pairs, springs, part.rank[pairs.first], also, self._comm) if springs else pairs
        return list_of(here, part.index, part.own, among)

    def _take(self, part: Part, lists: NeighbourLists, built: np.ndarray) -> None:
        """Step this ``part`` with its ``lists``; built: places of all spheres then [m], (n, 3)."""
        self._part, self.lists, self._built, self._current = part, lists, built, True
        self._ghosts = Ghosts(part.number[part.own:], part.rank[part.number[part.own:]],
                              part.number[:part.own], self._comm)
        clusters = None if self._all_clusters is None else part.clusters(self._all_clusters)
        self._share = Share(part.spheres(self._all), clusters, lists, self._ghosts.room)
        self._ahead(self._share, self._dt)
        self._ghosts.room.largest[1] = 0.0
        self._ghosts.agree()

    def _gather(self) -> None:
        """All spheres and clusters as the ranks have them."""
        if not self._current:
            gather(self._part, self._share[:2], (self._all, self._all_clusters), self._comm)
            self._current = True

    def forces_of_now(self, wall: MovingWall, loads: Loads, scratch: Scratch) -> None:
        """See `Replicated.forces_of_now`."""
        share = self._share
        forces(share.spheres, share.clusters, wall, self.lists, self._laws, Moment(0.0, 0.0, 0.0, True),
               loads.now, scratch)
        self._ahead(share, self._dt)
        self._ghosts.agree()
        self._current = False
        self.finish(loads)

    def steps(self, span: Span, wall: MovingWall, on_wall: WallForce, scratch: Scratch) -> int:
        """See `verlet.run`."""
        share, ghosts, first, dt = self._share, self._ghosts, span.first, span.dt
        node, node_speed = self._travel(wall, self.lists.wall, first * dt)
        if not np.isfinite(node + node_speed):
            return -1
        largest = ghosts.room.largest
        for step in range(span.begin, span.end):
            closed_in = max(2.0 * largest[0], largest[0] + node + node_speed * (step + 1 - first) * dt)
            if closed_in > self.lists.skin and not (span.fresh and step == first):
                return step
            self._current = False
            self._half(share, dt, scratch.vectors.vt)
            ghosts.exchange()
            last = step + 1 == span.steps
            moment = Moment((step + 1) * dt, dt, 0.5 * dt if last else dt, last)
            self._rest(share, wall, self._laws, moment, on_wall, scratch)
            if largest[1]:
                largest[1] = 1 + self._part.number[int(largest[1]) - 1]
            ghosts.agree()
            self.traffic += 1, *ghosts.traffic
            if largest[1]:
                self._gather()
                return -1 - int(largest[1])
        return span.end

    def finish(self, loads: Loads) -> None:
        """See `Replicated.finish`."""
        self._gather()
        loads.sum_over(self._comm)
