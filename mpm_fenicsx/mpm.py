"""The MPM partition: owns the points and advances them, one implicit step at a time."""
import numpy as np
from mpi4py import MPI

from . import output
from .boundary import Supports
from .collective import somewhere, total
from .errors import MPMError
from .grid import Background
from .kernels import compile_kernels
from .migrate import Router
from .points import Points, seed
from .snes import unused_options
from .step import PHASES, Step


class MPM:
    """A body on a background grid.

    supports: ``Support`` records; interface: ``Interface`` of boundary particles that carry loads and follow the
    motion; gravity: [m/s^2], shape (dim,); inertia: "consistent" (eq. 11) or "lumped"; rebalance: imbalance of material
    points over the ranks from which the grid is partitioned anew. ``phases`` sums the seconds
    spent per phase, ``iterations`` is the number of Newton iterations of the last step, ``count`` the number of material
    points in all. Everything is collective.

    ``balance`` lists the times that happened: (step, imbalance before, after).

    Raises ValueError for a scene that cannot be run, MPMError and MPMDiverged when a step fails.
    """

    balance_every = 50  # steps between two looks at the balance

    def __init__(self, grid, body, supports=(), interface=None, gravity=None, inertia="consistent",
                 rebalance=1.2, comm=MPI.COMM_WORLD):
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

    def _keep_mine(self, points):
        """Of points seeded alike on every rank, keep those in cells of this rank."""
        rank, number = self.background.search.assign(points.x)
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
        return self.surface()

    @property
    def applied(self):
        """Sum of the interface forces that reached the nodes in the last step [N], shape (dim,)."""
        return self.step.applied

    def _search(self):
        """Phase I: cell of every point; points travel to the rank of their cell; the cover follows them."""
        search, slot = self.background.search, self._no_slot if self.step is None else self.step.cover.slot
        sets = (self.points, self.boundary)
        away, bare = np.array([search.settle(points, slot) for points in sets]).T
        flags = somewhere(self.comm, *away, bare.max())
        for points, somebody in zip(sets, flags):
            if somebody:
                rank, number = search.destinations(points)
                self._raise_if_outside(points, rank)
                numbers = points.migrate(self._router, rank, number)
                points.cell[:] = search.local(numbers)
                flags[2] |= somewhere(self.comm, (slot[points.cell] < 0).any())[0]
        if flags[2]:
            self._make_step(np.unique(np.concatenate([self.points.cell, self.boundary.cell])))
        elif flags[:2].any():
            self._attach()

    def _make_step(self, filled):
        if self.step is not None:
            self.step.destroy()
        self.step = Step(self.background, filled, self.supports, self.body, self.gravity, self.kernels,
                         self._consistent, self.phases)
        self._attach()

    def _attach(self):
        """Work arrays for the points now here, and the order in which their surface is put together."""
        self.step.attach(self.points, self.boundary)
        if self.comm.size > 1:
            numbers = self.comm.allgather(self.boundary.gid)
            self._surface_number = np.concatenate(numbers)
            self._surface_counts = 2 * self.dim * np.array([len(part) for part in numbers])

    def _raise_if_outside(self, points, rank):
        """Name the first point that left the grid, on all ranks alike."""
        outside = np.flatnonzero(rank < 0)[:1]
        found = [(int(points.gid[p]), points.x[p].tolist()) for p in outside]
        found = sum(self.comm.allgather(found), [])
        if found:
            number, x = min(found)
            kind = "material point" if points is self.points else "boundary particle"
            raise MPMError(f"{kind} {number} left the grid at x = {x} m, t = {self.time:.6g} s: enlarge the grid, or "
                           "look for the cause in an unstable step")

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
        for points in (self.points, self.boundary):
            rank, number = self.background.search.relocate(points)
            self._raise_if_outside(points, rank)
            numbers = points.migrate(self._router, rank, number)
            points.cell[:] = self.background.search.local(numbers)
        self._make_step(np.unique(np.concatenate([self.points.cell, self.boundary.cell])))
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
        """This rank's piece of what ParaView shows, see ``output``. Collective."""
        return output.snapshot(self)

    def describe(self):
        """Solver and balance, for the report: see ``output``. Collective."""
        return output.describe(self)

    def get_state(self):
        """Everything that decides the future, as name → array copy: points and boundary particles of this rank, time,
        cover and kept tangent."""
        state = {f"points.{name}": values for name, values in self.points.copy().items()}
        state.update({f"boundary.{name}": values for name, values in self.boundary.copy().items()})
        state.update(self.step.get_state(), time=np.array([self.time, self.steps]))
        return state

    def set_state(self, state):
        """Go back to ``state``; the run continues bit for bit."""
        for name in ("points", "boundary"):
            part = {key.split(".")[1]: values for key, values in state.items() if key.startswith(name + ".")}
            getattr(self, name).restore(part)
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
