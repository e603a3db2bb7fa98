"""The MPM partition: owns the points and advances them, one implicit step at a time."""
import numpy as np
from mpi4py import MPI

from . import output
from .boundary import Supports
from .collective import total
from .errors import MPMError
from .grid import Background
from .kernels import compile_kernels
from .loads import SurfaceLoads
from .migrate import Router
from .penalty import make_penalties, reaction
from .points import Points, seed
from .sets import Set, Sets
from .snes import unused_options
from .step import PHASES, Step


class MPM:
    """A body on a background grid.

    supports: ``Support`` records; interface: ``Interface`` of boundary particles that carry the forces given to
    ``advance`` and follow the motion; loads: ``Load`` records; penalties: ``Penalty`` and ``GridWall`` records;
    gravity: [m/s^2], shape (dim,); inertia: "consistent" (eq. 11) or "lumped"; rebalance: imbalance of material points over the
    ranks from which the grid is partitioned anew. ``phases`` sums the seconds spent per phase, ``iterations`` is the
    number of Newton iterations of the last step, ``count`` the number of material points in all. Everything is
    collective.

    ``balance`` lists the times that happened: (step, imbalance before, after).

    Raises ValueError for a scene that cannot be run, MPMError and MPMDiverged when a step fails.
    """

    balance_every = 50  # steps between two looks at the balance

    def __init__(self, grid, body, supports=(), interface=None, gravity=None, inertia="consistent",
                 rebalance=1.2, comm=MPI.COMM_WORLD, loads=(), penalties=()):
        if inertia not in ("consistent", "lumped"):
            raise ValueError(f"inertia is {inertia!r}: choose consistent or lumped")
        self.comm, self.dim, self.grid, self.body, self.interface = comm, grid.box.dim, grid, body, interface
        self.gravity = np.zeros(self.dim) if gravity is None else np.array(gravity, float)
        self.time, self.steps, self.iterations = 0.0, 0, 0
        self.phases = dict.fromkeys(PHASES, 0.0)
        x, volume = seed(body)
        self._check_inside(x, "the body reaches out of the grid: a material point")
        self._support_scene, self.rebalance, self.balance = tuple(supports), rebalance, []
        self._lay_out(np.array_split(x, comm.size)[comm.rank])
        self._consistent = inertia == "consistent"
        self.kernels = compile_kernels(body, self.background, self._consistent)
        self._make_points(x, volume)
        self._make_boundary()
        self._make_conditions(loads, penalties)
        self._search()

    # ---------------------------------------------------------------- set-up

    def _check_inside(self, x, what):
        outside = ~((x > self.grid.box.lower) & (x < self.grid.box.upper)).all(axis=1)
        if outside.any():
            raise ValueError(f"{what} lies at {x[outside][0]} m, the grid covers {self.grid.box.lower} to "
                             f"{self.grid.box.upper} m: enlarge the grid")

    def _velocity_at(self, x):
        given = self.body.velocity
        return np.array(given(x) if callable(given) else np.broadcast_to(given, x.shape), float)

    def _keep_mine(self, points, names=None):
        """Of points seeded alike on every rank, keep those in cells of this rank."""
        rank, number = self.background.search.assign(points.x)
        if (rank < 0).any():
            p = np.argmin(rank)
            raise ValueError(f"particle {p} of {names[p]} lies at {points.x[p]} m, outside the grid: enlarge the grid "
                             "or shorten the surface")
        mine = rank == self.comm.rank
        points.take(mine)
        points.cell[:] = self.background.search.local(number[mine])

    def _make_points(self, x, volume):
        n, body = len(x), self.body
        self.points = Points(
            gid=np.arange(n), cell=np.zeros(n, np.int32), x=x, v=self._velocity_at(x),
            a=np.tile(self.gravity, (n, 1)),  # an unstressed body starts in free fall
            mass=body.rho * volume, V0=volume, F=np.tile(np.eye(self.dim), (n, 1, 1)), F33=np.ones(n),
            state=np.zeros(n, body.law.state))
        self.count = n
        self._keep_mine(self.points)

    def _make_boundary(self):
        x = np.zeros((0, self.dim)) if self.interface is None else np.array(self.interface.x, float)
        self._check_inside(x, "a boundary particle")
        n = len(x)
        self.boundary = Points(gid=np.arange(n), cell=np.zeros(n, np.int32), x=x, v=self._velocity_at(x),
                               a=np.tile(self.gravity, (n, 1)), force=np.zeros((n, self.dim)))
        self._boundary_count = n
        self._keep_mine(self.boundary)

    def _make_conditions(self, loads, penalties):
        """What acts through particles of its own."""
        given, thickness = (self._velocity_at, self.gravity), self.body.thickness if self.dim == 2 else 1.0
        self.loads = (SurfaceLoads(loads, self.dim, thickness, *given),) if loads else ()
        self.penalties = make_penalties(penalties, self.background, self.body.law, thickness, *given)
        for condition in (*self.loads, *self.penalties):
            self._keep_mine(condition.points, condition.names)
        self._sets = Sets(self.comm, [
            Set("points", self.points), Set("boundary", self.boundary), *(Set("loads", a.points) for a in self.loads),
            *(Set("hinges" if held.follows else "walls", held.points, held.follows, held.follows or held.moves)
              for held in self.penalties)])

    # ---------------------------------------------------------------- one step

    def advance(self, dt, force=None):
        """Advance one step of ``dt`` [s] under point loads ``force`` on the boundary particles [N], shape (n, dim),
        constant over the step, the same on every rank. Returns ``surface()``."""
        if not (dt > 0 and np.isfinite(dt)):
            raise ValueError(f"dt is {dt} s: it must be positive")
        force = np.zeros((self._boundary_count, self.dim)) if force is None else np.asarray(force, float)
        if not np.isfinite(force).all():
            raise MPMError(f"the force on boundary particle {np.argwhere(~np.isfinite(force))[0][0]} is not a number "
                           f"at t = {self.time:.6g} s: look at the grains that sent it")
        self.step.restart_clock()
        if self.comm.size > 1 and self.steps and self.steps % self.balance_every == 0:
            self._rebalance()
        self._search()
        self.step.begin(dt, self.time, force[self.boundary.gid])
        u, self.iterations = self.step.solve(f"step {self.steps + 1}, t = {self.time + dt:.6g} s")
        self.step.finish(u)
        self.time += dt
        self.steps += 1
        for held in self.penalties:
            held.move(self.time)
        return self.surface()

    @property
    def applied(self):
        """Sum of the interface forces that reached the nodes in the last step [N], shape (dim,)."""
        return self.step.applied

    def _search(self):
        """Phase I: points go to their cells, and the cover follows them."""
        slot = self._no_slot if self.step is None else self.step.cover.slot
        travelled, bare = self._sets.settle(self.background.search, slot, self._router, self.time)
        if bare:
            self._make_step(self._sets.filled())
        elif travelled:
            self._attach()

    def _make_step(self, filled):
        if self.step is not None:
            self.step.destroy()
        self.step = Step(self.background, filled, self.supports, self.body, self.gravity, self.kernels,
                         self._consistent, self.phases, self.loads, self.penalties)
        self._attach()

    def _attach(self):
        """Work arrays for the points now here, and the order in which their surface is put together."""
        self.step.attach(self.points, self.boundary)
        if self.comm.size > 1:
            numbers = self.comm.allgather(self.boundary.gid)
            self._surface_number = np.concatenate(numbers)
            self._surface_counts = 2 * self.dim * np.array([len(part) for part in numbers])

    def imbalance(self):
        """Most material points on one rank over the mean."""
        return self.comm.allreduce(len(self.points), MPI.MAX) * self.comm.size / self.count

    def _rebalance(self):
        """A new partition of the grid when the points have gathered on few ranks; they move with all they carry. It
        costs a new mesh, so it is looked at only every ``balance_every`` steps."""
        before = self.imbalance()
        if before <= self.rebalance:
            return
        self.step.destroy()
        self._router.free()
        self._lay_out(self.points.x)
        self._sets.relocate(self.background.search, self._router, self.time)
        self._make_step(self._sets.filled())
        self.balance.append((self.steps, before, self.imbalance()))

    def _lay_out(self, filling):
        """Background grid, supports and routes for points at ``filling`` [m], shape (n, dim)."""
        self.background = Background(self.grid, self.comm, filling)
        self.supports = Supports(self._support_scene, self.background.x)
        self._router = Router(self.comm, self.background.neighbours)
        self._no_slot = np.full(len(self.background.cells), -1, np.int32)
        self.step = None

    # ---------------------------------------------------------------- what others ask

    def surface(self):
        """Boundary particles: positions [m] and velocities [m/s], shape (n, dim) each, in the order of the interface,
        the same on every rank."""
        if self.comm.size == 1:
            return self.boundary.x.copy(), self.boundary.v.copy()
        mine = np.hstack([self.boundary.x, self.boundary.v])
        parts, ordered = np.empty((2, self._boundary_count, 2 * self.dim))
        self.comm.Allgatherv(mine, [parts, self._surface_counts])
        ordered[self._surface_number] = parts
        return ordered[:, :self.dim].copy(), ordered[:, self.dim:].copy()

    def reaction(self, name):
        """Force of the penalties of that name on the body over the last step [N], shape (dim,)."""
        return total(self.comm, reaction(self.penalties, name))

    def energy(self):
        """``kinetic``, ``strain`` and ``potential`` (in gravity, zero at the origin) energy of the points [J]."""
        p = self.points
        kinetic, strain = self.kernels.energies(p.mass, p.V0, p.v, p.F, p.F33, p.state, self.body.law.params)
        potential = -float(p.mass @ (p.x @ self.gravity)) if self.gravity.any() else 0.0
        return dict(zip(("kinetic", "strain", "potential"),
                        total(self.comm, [kinetic, strain, potential]).tolist()))

    def momentum(self):
        """Momentum of the points [kg m/s], shape (dim,)."""
        return total(self.comm, self.points.mass @ self.points.v)

    def cauchy_stress(self):
        """Cauchy stress of this rank's points [Pa], shape (n, dim, dim)."""
        p = self.points
        sigma = np.empty_like(p.F)
        self.kernels.cauchy(self.body.law.params, p.F, p.F33, p.state, sigma)
        return sigma

    def snapshot(self):
        """What ParaView shows, see ``output``. Collective."""
        return output.snapshot(self)

    def get_state(self):
        """Everything that decides the future, as name → array copy: points and boundary particles of this rank, time,
        cover and kept tangent."""
        state = self._sets.get_state()
        state.update(self.step.get_state(), time=np.array([self.time, self.steps]))
        return state

    def set_state(self, state):
        """Go back to ``state``; the run continues bit for bit."""
        self._sets.set_state(state)
        self.time, self.steps = float(state["time"][0]), int(state["time"][1])
        same = np.array_equal(self.step.filled, state["filled"])
        if not self.comm.allreduce(int(same), MPI.MIN):
            self._make_step(state["filled"].copy())
        self._attach()
        self.step.set_state(state)

    def unused_options(self):
        """Dash options of the command line that neither PETSc nor anybody else asked for."""
        return unused_options()

    def close(self):
        """Free matrix and solver."""
        self.step.destroy()
