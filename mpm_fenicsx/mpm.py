"""The MPM partition: owns the points and advances them, one implicit step at a time."""
import numpy as np
from mpi4py import MPI

import mpm_dem_checks as check

from .arguments import check_arguments
from .errors import MPMError
from .grid.background import Background, check_inside
from .grid.supports import Supports
from .output.answers import Answers
from .output.states import check_state, fingerprint, while_open
from .points.boundary_particles import BoundaryParticles, near_mass
from .points.migrate import Router
from .points.outflow import Outflow, read_ways
from .points.sets import Set, Sets
from .scene.frame import Frame
from .scene.numerics import Numerics
from .scene.room import room_at_walls
from .solve.step import PHASES, Step
from .terms.behind import watch
from .terms.bonds import Bonds
from .terms.ghost import Facets
from .terms.kernels import compile_grid_kernels
from .terms.loads import SurfaceLoads
from .terms.parts import Start, make_parts, warn_if_in_pieces
from .terms.scene_penalties import make_penalties


class MPM(Answers):
    """One body, or a list of several, on a background grid.

    supports: ``Support`` records; interface: ``Interface`` of boundary particles that carry the forces given to
    ``advance`` and follow the motion; loads: ``Load`` records; penalties: ``Penalty`` and ``GridWall`` records; gravity:
    [m/s^2], shape (dim,); inertia: "consistent" (eq. 11), "lumped" or "ghost", see ``ghost``; rebalance: imbalance of
    material points over the ranks from which the grid is distributed anew; body_force: force per mass [m/s^2] besides
    gravity, a function of the points' positions at rest [m], shape (n, dim), and time [s], with values of shape (n, dim);
    solver: of ``SOLVERS``; outflow: what happens to material that leaves the grid, "stop" (the run ends), "hold" (at
    the edge, at rest) or "remove", or a dict by side, such as {"+x": "remove"}, whose other sides stop, see ``outflow``
    and ``removed``; bonded: that bodies stick where they share grid nodes is meant (layers of one soil), else a warning
    says so, as there is no contact between bodies.

    ``parts`` are the bodies with their points, numbered through, see ``parts.Part``; ``phases`` sums the seconds spent
    per phase, ``iterations`` is the number of Newton iterations of the last ``advance``, ``ghost_since`` the time [s]
    from which the ghost penalty has been needed, or None, see ``fall_back``, ``count`` the number of material points,
    ``rebalances`` lists the new distributions over the ranks: (step, imbalance before, after). Everything is
    collective.

    Raises ValueError for a scene that cannot be run, MPMError and MPMDiverged when a step fails.
    """

    rebalance_every = 50  # steps between two looks at the imbalance

    def __new__(cls, *arguments, **keys):
        """Keeps the scene for ``anew``."""
        new = super().__new__(cls)
        new._scene = arguments, keys
        return new

    def anew(self):
        """Another partition of the same scene, at its start."""
        arguments, keys = self._scene
        return type(self)(*arguments, **keys)

    def __init__(self, grid, body, supports=(), interface=None, *, gravity=None,  # noqa: PLR0913 - states a scene
                 inertia="consistent", loads=(), penalties=(), body_force=None, outflow="stop", bonded=False,
                 numerics=Numerics(), comm=MPI.COMM_WORLD):
        bodies = body if isinstance(body, (list, tuple)) else [body]
        check_arguments(grid, bodies, supports, interface, gravity, inertia, loads, penalties, body_force, numerics)
        check.truth("bonded", bonded)
        self.comm, self.dim, self.grid, self._frame = comm, grid.box.dim, grid, Frame(grid.box)
        self._grid, body_force = self._frame.enter(grid), self._frame.enter_function(body_force)
        self.gravity = np.zeros(self.dim) if gravity is None else np.array(gravity, float)
        self.time, self.steps, self.iterations = 0.0, 0, 0
        self._inertia, self.ghost_since, self.closed = inertia, None, False
        self._located, self.phases = False, dict.fromkeys(PHASES, 0.0)  # located: the points are in their cells
        self._parts = make_parts(self._frame.enter(bodies), self._grid, self.gravity, body_force)
        x = np.concatenate([part.points.x for part in self._parts])
        check_inside(self._grid, x, "the body reaches out of the grid: a material point", self.origin)
        self._count, self.numerics, self.rebalances, self.outflow = len(x), numerics, [], outflow
        self._outflow = Outflow(read_ways(outflow, self.dim), self._grid, comm, self.gravity)
        self._bonds = Bonds(self._parts, comm, bonded)
        self._support_scene = tuple(self._frame.enter(list(supports)))
        penalties = self._frame.enter(list(penalties))
        self._room = room_at_walls(self._grid, penalties)
        self._lay_out(np.array_split(x, comm.size)[comm.rank])
        self._consistent = inertia != "lumped"
        self.kernels = compile_grid_kernels(self.background)
        self._make_conditions(*map(self._frame.enter, (interface, list(loads))), penalties,
                              Start(self._parts, self.gravity, body_force))
        self._fingerprint = fingerprint(self, self._support_scene, self._sets.names(), inertia)
        for part in self._parts:
            part.compile(self.background, self._consistent)
            self.background.keep_mine(part.points, np.full(len(part.points), "the body"))
        warn_if_in_pieces(self._parts, self.background)
        self._search()

    def _make_conditions(self, interface, loads, penalties, start):
        """What acts through particles of its own."""
        self._surface = BoundaryParticles(self.comm, self.dim, interface, start)
        self.boundary = self._surface.points
        check_inside(self._grid, self.boundary.x, "a boundary particle", self.origin)
        self.background.keep_mine(self.boundary, np.full(len(self.boundary), "the interface"))
        self.loads = (SurfaceLoads(loads, self.dim, start),) if loads else ()
        self.penalties = make_penalties(penalties, self.background, start)
        self._behind = watch(penalties, self.background, self._parts)
        for condition in (*self.loads, *self.penalties):
            self.background.keep_mine(condition.points, condition.names)
        self._sets = Sets(self.comm, [
            *(Set(f"points{n or ''}", part.points, leave=self._outflow.of_material(part))
              for n, part in enumerate(self._parts)),
            *(Set(name, points, leave=None if points is self.boundary and self._surface.resampled
                  else self._outflow.of_boundary(points))
              for name, points in (("boundary", self.boundary), *(("loads", a.points) for a in self.loads))),
            *(Set("hinges" if held.follows else "walls", held.points, held.follows, held.follows or held.moves)
              for held in self.penalties)], self.origin)

    # ---------------------------------------------------------------- one step

    @while_open
    def advance(self, dt, force=None):
        """Advance by ``dt`` [s] in one step, under point loads ``force`` on the boundary particles [N], shape (n, dim),
        constant meanwhile, the same on every rank. Returns ``surface()``. MPMDiverged when Newton's method fails; all
        points are then as they were."""
        dt = check.positive("dt", dt, "s", "it must be positive")
        shape = self._surface.count, self.dim
        force = np.zeros(shape) if force is None else check.shaped("force", force, shape)
        if not np.isfinite(force).all():
            raise MPMError(f"the force on boundary particle {np.argwhere(~np.isfinite(force))[0][0]} is not a number "
                           f"at t = {self.time:.6g} s: look at the grains that sent it")
        self.step.restart_clock()
        if self.comm.size > 1 and self.steps and self.steps % self.rebalance_every == 0:
            if self._outflow.active:
                self._search()  # so that what has left is not looked for on the new distribution
            self._rebalance()
        self._search()
        self._outflow.check_left(self._count, self.time)
        self._located = False
        self.step.begin(dt, self.time, force[self.boundary.gid])
        u, self.iterations = self.step.solve(f"step {self.steps + 1}, t = {self.time + dt:.6g} s")
        self.step.finish(u)
        self.time, self.steps = self.time + dt, self.steps + 1
        for held in self.penalties:
            held.move(self.time)
        if self._behind:
            self._behind(self.time)
        return self.surface()

    @while_open
    def fall_back(self):
        """After a step that failed: consistent inertia gets the ghost penalty from now on, as it is singular alone where
        cells at the rim of a free body are nearly empty, see ``ghost``. Returns what it has changed, or ""."""
        if self._inertia != "consistent" or self.ghost_since is not None:
            return ""
        self.ghost_since = self.time
        self._make_step(self.step.filled)
        return "the ghost penalty on inertia"

    @while_open
    def resample(self):
        """Between steps, renew the particles of an interface with a ``Resampling``: ``outline.Change`` or None."""
        if not self._surface.resampled:
            return None
        changed = self._surface.stay_inside(self._grid.box)
        self._search()
        has_mass = near_mass(self.background, self.step.active_cells, self._parts, self.kernels)
        change = self._surface.renew(has_mass, self.time, changed)
        if change is not None:
            self.background.keep_mine(self.boundary, ["the interface"] * len(self.boundary))
            self._attach()
        return change and change._replace(x=self._frame.leave(change.x))

    def _search(self):
        """Phase I: points go to their cells, and the active cells follow them; once in a step."""
        if self._located:
            return
        row = self._no_row if self.step is None else self.step.active_cells.point_row
        self._located, (travelled, inactive) = True, self._sets.locate(self.background.search, row, self._router, self.time)
        if inactive:
            self._make_step(self._sets.filled())
        elif travelled:
            self._attach()
        if inactive or self.steps % self._bonds.every == 0:
            self._bonds.look(self.step, self.time)

    def _make_step(self, filled):
        if self.step is not None:
            self.step.destroy()
        facets = None
        if self._inertia == "ghost" or self.ghost_since is not None:
            facets = self._facets = self._facets or Facets(self.background, self.kernels.shapes)
        self.step = Step(self.background, filled, self.supports, self._parts, self.gravity, self.kernels,
                         self._consistent, self.phases, self.loads, self.penalties, self.numerics.solver, facets,
                         self._outflow)
        self.step.newton.otherwise = ', or inertia="lumped"' if self._consistent else ""
        self._attach()

    def _attach(self):
        """Work arrays for the points now here, and the order in which their surface is put together."""
        self.step.attach(self.boundary)
        self._surface.attach()

    def _rebalance(self):
        """A new distribution of the grid when the points have gathered on few ranks; they move with all they carry. It
        costs a new mesh, so it is looked at only every ``rebalance_every`` steps."""
        before = self.imbalance()
        if before <= self.numerics.rebalance:
            return
        self.step.destroy()
        self._router.free()
        self._lay_out(np.concatenate([part.points.x for part in self._parts]))
        self._sets.relocate(self.background.search, self._router, self.time)
        self._make_step(self._sets.filled())
        self.rebalances.append((self.steps, before, self.imbalance()))

    def _lay_out(self, filling):
        """Background grid, supports and routes for points at ``filling`` [m], shape (n, dim)."""
        averaged = any(part.body.f_bar for part in self._parts)
        self.background = Background(self._grid, self.comm, filling, averaged, self.origin, self._room)
        self.supports = Supports(self._support_scene, self.background.x, self.steps > 0)
        self._router = Router(self.comm, self.background.neighbours)
        self._no_row = np.full(len(self.background.cells), -1, np.int32)
        self.step = self._facets = None

    @while_open
    def get_state(self):
        """Everything that decides the future of this rank's points, as name → array copy."""
        state, time = self._sets.get_state(), np.array([self.time, self.steps, len(self.rebalances)])
        state.update(self._surface.get_state(), **self._outflow.get_state(), **self.step.get_state(), time=time,
                     scene=self._fingerprint.copy(),
                     ghost_since=np.array([np.nan if self.ghost_since is None else self.ghost_since]))
        return state

    @while_open
    def set_state(self, state):
        """Go back to ``state``; the run continues bit for bit, but over a new distribution of the grid to round-off.
        ValueError for a state of another scene."""
        check_state(state, self._fingerprint)
        self._sets.set_state(state)
        self._surface.set_state(state)
        self._outflow.set_state(state)
        since, before = float(state["ghost_since"][0]), self.ghost_since
        self._located, self.ghost_since = False, None if np.isnan(since) else since
        other = (before is None) != (self.ghost_since is None)
        self.time, self.steps = float(state["time"][0]), int(state["time"][1])
        if state["time"][2] != len(self.rebalances):
            self._sets.relocate(self.background.search, self._router, self.time)
            return self._make_step(self._sets.filled())
        same = not other and np.array_equal(self.step.filled, state["filled"])
        if not self.comm.allreduce(int(same), MPI.MIN):
            self._make_step(state["filled"].copy())
        self._attach()
        self.step.set_state(state)

    def close(self):
        """Free matrix and solver. Afterwards it can still be asked what it has computed."""
        if not self.closed:
            self.step.destroy()
        self.closed = True
