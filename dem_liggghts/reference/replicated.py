"""Few spheres: every rank steps all of them, with the same result, and nothing is sent."""
from typing import Any

import numpy as np

from mpm_dem_direct import direct

from ..common.chunks import Chunks
from ..contact.law import Laws
from ..search.elements import MovingWall
from ..search.neighbours import NeighbourLists
from .forces import Moment, Scratch, SphereState, WallForce, forces
from .loads import Loads
from .verlet import Span, build_lists, choose_skin, run


class Replicated:
    """The steps of a window on all spheres and clusters.

    spheres, clusters, lists: what this rank steps, here all; first: whether this rank counts what all of them
    know; chunks: lengths of the parts of a window. `shared.Shared` does the same with a part of the spheres.
    """

    spheres: SphereState
    clusters: Any
    lists: NeighbourLists
    first = True

    def __init__(self, laws: Laws, springs: tuple, dt: float) -> None:
        self._laws, self._springs, self._dt, self.chunks = laws, springs, dt, Chunks()
        # with clusters and without: a direct call does not look at what it gets
        self._runs, self._build = {some: direct(run) for some in (True, False)}, direct(build_lists)

    def use(self, spheres: SphereState, clusters: Any, cluster: np.ndarray) -> None:
        """From now on all there is: ``spheres``, ``clusters`` or None, and of which cluster each sphere is,
        (n,). Both change in place."""
        self.spheres, self.clusters, self._cluster = spheres, clusters, cluster
        self._run = self._runs[clusters is not None]

    def remember(self, lists: NeighbourLists) -> None:
        """The next new lists take their springs from ``lists``, those of all spheres."""
        self.lists = lists

    def adopt(self, lists: NeighbourLists) -> None:
        """Go on with ``lists``, those of all spheres, as they are."""
        self.lists = lists

    def whole_lists(self) -> NeighbourLists:
        """Of all spheres."""
        return self.lists

    def renew(self, wall: MovingWall, t: float) -> None:
        """New lists of now, t [s] in the window."""
        skin = choose_skin(self.spheres, wall, self._dt)
        self.lists = self._build(self.spheres, self._cluster, wall, t, skin, self.lists, self._springs)

    def forces_of_now(self, wall: MovingWall, loads: Loads, scratch: Scratch) -> None:
        """Forces of now on spheres, clusters and nodes of the walls, at the start and after a break."""
        forces(self.spheres, self.clusters, wall, self.lists, self._laws, Moment(0.0, 0.0, 0.0, True),
               loads.now, scratch)

    def steps(self, span: Span, wall: MovingWall, on_wall: WallForce, scratch: Scratch) -> int:
        """See `verlet.run`."""
        return self._run(span, self.spheres, self.clusters, wall, self.lists, self._laws, on_wall, scratch)

    def finish(self, loads: Loads) -> None:
        """A window ends: all ranks know what all have done."""
