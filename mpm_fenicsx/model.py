"""What there is of a scene on the ranks: its particles, and the background grid that the ranks share."""
from typing import Dict, List, Optional, Tuple

import numpy as np
from mpi4py import MPI

from .accounts import Accounts
from .basis.smooth import Basis
from .grid.background import Background, Choice, Needs, check_inside
from .grid.large import come_in_blocks, make_blocks
from .grid.supports import Supports
from .laws import check_together
from .output.matter import Matter, matter
from .output.states import fingerprint
from .points.ball_surface import make_surface
from .points.migrate import Router
from .points.outflow import Outflow, read_ways
from .points.outlets import Outlets
from .points.points import Points
from .points.sets import Set, Sets
from .scene.bodies import Body, Grid
from .scene.frame import Frame, Seen, seen_points
from .scene.interface import Interface
from .scene.margin import margins_at_walls
from .scene.solid import SolidScene
from .solve import options
from .solve.impulses import make_impulses
from .solve.ladder import Ladder
from .solve.losses import Losses
from .solve.on_bodies import OnBodies
from .solve.works import Works
from .terms.ball_forces import make_forces
from .terms.behind import watch
from .terms.bodies import BodyTerm
from .terms.feeds import Feeds
from .terms.force_cells import ForceCells
from .terms.kernels import compile_grid_kernels
from .terms.loads import SurfaceLoads
from .terms.scene_contacts import make_meetings, warn_if_thin
from .terms.scene_penalties import make_contacts, make_penalties
from .terms.start import Start, start_from_checkpoints, warn_if_in_pieces
from .terms.transfers import TRANSFERS, make_bodies


class Model(Accounts):
    """Material points and boundary particles of a ``SolidScene``, and the grid that ``MPM`` moves them with.

    It computes in the frame of ``origin``, see ``frame``; what is asked here is answered in the user's
    coordinates. ``background``, ``supports`` and the router of points between ranks belong to one
    distribution of the grid over the ranks and are made together, by ``_distribute``. Collective, but for
    what is only looked up.
    """

    def __init__(self, scene: SolidScene, comm: MPI.Comm):
        self.comm, self.dim, self.grid, self.scene = comm, scene.grid.box.dim, scene.grid, scene
        self.numerics, self.outflow, self._frame = scene.numerics, scene.outflow, Frame(scene.grid.box)
        self._framed = scene = self._frame.enter(scene)
        self.gravity, self.time, self.steps = scene.acceleration, 0.0, 0
        self.basis, self._transfer = Basis(scene.numerics.basis), TRANSFERS[scene.numerics.transfer]
        self.basis.check_grid(scene.grid, scene.grid.cell, isinstance(scene.grid, Grid))
        self._in_blocks = come_in_blocks(scene, self.basis.smooth)
        free = self.gravity + scene.frame_pull(0.0)
        self._bodies = make_bodies(scene, free, self.basis, self._transfer.body, comm)
        start_from_checkpoints(self._bodies, self.origin, comm)
        self._feeds = self._make_feeds()
        x = np.concatenate([body.points.x for body in self._bodies])
        check_inside(scene.grid, x, "the body reaches out of the grid: a material point", self.origin, comm)
        check_together(body.law for body in scene.bodies)
        self._ladder = Ladder(comm, scene.inertia, not self.flows, self.basis.smooth)
        self._losses = Losses(comm, self.origin, scene.numerics.losses)
        self._count = sum(body.total for body in self._bodies)
        ways = read_ways(scene.outflow, self.dim)
        self._outflow = Outflow(ways, scene.grid, comm, self.gravity, len(scene.outflows) > 0)
        self._outlets = Outlets(scene.outflows, self._outflow, comm)
        self._margin = margins_at_walls(scene.grid, scene.penalties)
        self._distribute(x)
        self.kernels = compile_grid_kernels(self.background, self._transfer.to_points)
        cells = self._make_terms(scene, Start(self._bodies, free, scene.body_force, comm))
        self._outflow.books = self._impulses, self._works
        self._feeds.books = *self._outflow.books, *self._contacts
        self._sets = self._all_points()
        self._fingerprint = fingerprint(self, [
            *self._sets.names(), *self._surface.names(), *(c.names for c in self._contacts), *cells.names])
        self._share_out()

    def _make_terms(self, scene: SolidScene, start: Start) -> ForceCells:
        """All that acts on the bodies of the ``scene`` in this frame, and who books it."""
        self._surface = make_surface(self.comm, self.dim, scene.interface, start, self._bodies)
        self.boundary = self._surface.points
        cells = ForceCells(self._bodies, scene, self.comm)
        cells.mark(self.boundary, start)
        check_inside(scene.grid, self.boundary.x, "a boundary particle", self.origin, self.comm)
        self.background.keep_mine(self.boundary, np.full(len(self.boundary), "the interface"))
        self._forces = make_forces(self._surface, self._bodies, self._outflow)
        self.loads = (SurfaceLoads(scene.loads, self.dim, start, self._outflow),) if scene.loads else ()
        self.penalties = make_penalties(list(scene.penalties), self.background, start)
        self._contacts = (*make_contacts(scene.walls, self.background, start, self._bodies),
                          *make_meetings(self._bodies, self.background))
        self._behind = watch(scene.walls, self.background, self._bodies)
        for condition in (*self.loads, *self.penalties):
            self.background.keep_mine(condition.points, condition.names)
        self._impulses, self._works = make_impulses(self, scene), Works(self.comm)
        self._on_bodies = OnBodies(self.comm, self.origin, cells, self.background.fields > 1,
                                   scene.interface is not None)
        return cells

    def _share_out(self) -> None:
        """The material points go to the ranks of their cells."""
        for body in self._bodies:
            body.compile(self.background, self.scene.inertia != "lumped")
            self.background.deal(body.points, self._router)
        warn_if_in_pieces(self._bodies, self.background)
        warn_if_thin(self._framed.structures, self.background)

    def _make_feeds(self) -> Feeds:
        """Of the inflows, whose columns are inside the grid."""
        grid, scene = self._framed.grid, self._framed

        def make(body: Body, first: int) -> BodyTerm:
            return self._transfer.body(body, first, self.gravity, scene.body_force, self.basis,
                                       grid.cell_size if self.basis.smooth else None)

        feeds = Feeds(scene.inflows, self._bodies, make, grid.cell_size if scene.inflows else None,
                      self.gravity, self.comm)
        for feed in feeds:
            feed.check_inside(grid.box, self.origin)
        return feeds

    def _distribute(self, x: np.ndarray, owner: Optional[np.ndarray] = None,
                    blocks: Optional[np.ndarray] = None) -> None:
        """Distribute the grid over the ranks for points at x [m], (n, dim); each rank gives some. owner, rank
        of each cell, and blocks, numbers of those of a large grid, decide instead."""
        grid, scene = self._framed.grid, None if self.steps else self._framed
        there = make_blocks(grid, [x, *self._feeds.places()], scene, blocks,
                            self.comm) if self._in_blocks else None
        needs = Needs(any(body.body.f_bar for body in self._bodies), max(self.scene.fields) + 1)
        self.background = Background(grid, self.comm, x, needs, self.origin, self._margin, self.basis,
                                     Choice(owner, there))
        self.supports = Supports((*self._framed.supports, *self._feeds.supports()), self.background.x,
                                 self.steps > 0)
        self._router = Router(self.comm, self.background.neighbours)

    def _all_points(self) -> Sets:
        """All points of the scene, with what becomes of those that leave the grid."""
        material = [Set(f"points{n or ''}", body.points, leave=self._outflow.of_material(body))
                    for n, body in enumerate(self._bodies)]
        leave = None if self._surface.resampled else self._outflow.of_boundary(self.boundary)
        loaded = [Set("boundary", self.boundary, leave=leave),
                  *(Set("loads", a.points, leave=self._outflow.of_boundary(a.points)) for a in self.loads)]
        springs = [Set("hinges" if p.follows else f"walls{p.points.field or ''}", p.points, p.follows,
                       p.follows or p.moves) for p in self.penalties]
        return Sets(self.comm, [*material, *loaded, *springs], self.origin)

    # ---------------------------------------------------------------- points

    @property
    def origin(self) -> np.ndarray:
        """Of the frame in which it computes and in which its state is [m], shape (dim,), see ``frame``."""
        return self._frame.origin

    @property
    def bodies(self) -> list:
        """The bodies with their points on this rank, see ``bodies.BodyTerm``; far from zero positions can be
        read, not changed."""
        if not self._frame.moved:
            return self._bodies
        return [Seen(body, points=seen_points(body.points, self._frame)) for body in self._bodies]

    @property
    def points(self) -> Points:
        """Material points of the only body on this rank; ValueError when there are several."""
        if len(self._bodies) > 1:
            raise ValueError(f"there are {len(self._bodies)} bodies: take the points of each from "
                             "bodies[n].points")
        return self.bodies[0].points

    def matter(self) -> List[Matter]:
        """Places, velocities, masses, … of the points of each body on this rank, see ``Matter``."""
        return matter(self.bodies, self.scene.interface)

    @property
    def count(self) -> int:
        """Material points that take part, on all ranks."""
        return self._count + self._feeds.count - self.removed["count"]

    @property
    def removed(self) -> dict:
        """What has left the grid, held or removed by ``outflow``, since the start: "count", "mass" [kg],
        "volume" at rest [m^3], "momentum" [kg m/s], shape (dim,), and "energy" [J] (kinetic, strain and
        potential), the same on every rank."""
        return self._outflow.removed

    @property
    def outlets(self) -> Tuple[str, ...]:
        """Names of the planes in the grid at which material leaves."""
        return self._outlets.names

    @property
    def entered(self) -> Optional[dict]:
        """The same of what inflows have made since the start; None without any."""
        return self._feeds.entered if self._feeds else None

    def held(self) -> list:
        """Points of each body that ``outflow`` holds at the edge on this rank."""
        return [seen_points(points, self._frame) for points in self._outflow.held]

    def imbalance(self) -> float:
        """Most material points on one rank over the mean."""
        most = self.comm.allreduce(sum(len(body.points) for body in self._bodies), MPI.MAX)
        return most * self.comm.size / self.count

    def cauchy_stress(self) -> np.ndarray:
        """Cauchy stress of this rank's points [Pa], shape (n, dim, dim), body after body."""
        return np.concatenate([body.cauchy_stress() for body in self._bodies])

    # ---------------------------------------------------------------- interface

    @property
    def interface(self) -> Optional[Interface]:
        """The ``Interface`` of now, or None."""
        return self._frame.leave(self._surface.interface)

    @property
    def ball_radius(self) -> Optional[float]:
        """Of an interface of ``Balls`` [m], else None."""
        return getattr(self.scene.interface, "radius", None)

    @property
    def exchanged(self) -> int:
        """Bytes of the interface that this rank has got from others since the start."""
        return self._surface.exchanged

    def surface(self) -> Tuple[np.ndarray, np.ndarray]:
        """Boundary particles: positions [m] and velocities [m/s], shape (n, dim) each, in the order of the
        interface, the same on every rank."""
        x, v = self._surface.gather("x", "v")
        return self._frame.leave(x), v

    def displacement(self) -> np.ndarray:
        """Of the boundary particles since the start [m], shape (n, dim): not less exact far from zero."""
        return self._surface.gather("x")[0] - self._surface.interface.x

    @property
    def ghost_since(self) -> Optional[float]:
        """Time from which the ghost penalty on inertia has been needed [s], or None, see ``ladder``."""
        return self._ladder.ghost_since

    @property
    def helped(self) -> Dict[str, List[float]]:
        """What helped where Newton's method failed, name → [time of the first step [s], number of steps]."""
        return {what: list(steps) for what, steps in self._ladder.helped.items()}

    def options(self) -> Dict[str, str]:
        """PETSc's options that a user gave and that somebody asked for, as they are typed, name → text."""
        return options.used()

    def unused_options(self) -> List[str]:
        """Dash options that neither PETSc nor anybody else asked for."""
        return options.unused()
