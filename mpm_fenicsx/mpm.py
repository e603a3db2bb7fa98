"""The MPM partition: owns the points and advances them, one implicit step at a time (the paper's phases I to III)."""
from time import perf_counter

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from . import newmark, output, shape, transfer, weakform
from .boundary import Supports
from .cover import Cover
from .errors import MPMDiverged, MPMError
from .grid import Background, settle
from .points import Points, seed
from .snes import Newton, unused_options
from .specialise import specialise
from .stress_state import point_functions

PHASES = ("search", "to grid", "tangent", "residual", "solve", "to points")


class MPM:
    """A body on a background grid.

    supports: ``Support`` records; interface: ``Interface`` of boundary particles that carry loads and follow the
    motion; gravity: [m/s^2], shape (dim,); inertia: "consistent" (eq. 11) or "lumped". ``phases`` sums the seconds
    spent per phase, ``iterations`` is the number of Newton iterations of the last step. Everything is collective.

    Raises ValueError for a scene that cannot be run, MPMError and MPMDiverged when a step fails.
    """

    slow = 4  # more Newton iterations than this: the kept tangent is out of date

    def __init__(self, grid, body, supports=(), interface=None, gravity=None, inertia="consistent",
                 comm=MPI.COMM_WORLD):
        if inertia not in ("consistent", "lumped"):
            raise ValueError(f"inertia is {inertia!r}: choose consistent or lumped")
        self.comm, self.dim, self.grid, self.body = comm, grid.box.dim, grid, body
        self.gravity = np.zeros(self.dim) if gravity is None else np.array(gravity, float)
        self.time, self.steps, self.iterations = 0.0, 0, 0
        self.phases = dict.fromkeys(PHASES, 0.0)
        self._consistent = inertia == "consistent"
        x, volume = seed(body)
        inside = (x > grid.box.lower).all(axis=1) & (x < grid.box.upper).all(axis=1)
        if not inside.all():
            raise ValueError(f"the body reaches out of the grid: a point lies at {x[~inside][0]} m, the grid covers "
                             f"{grid.box.lower} to {grid.box.upper} m: enlarge the grid")
        self.background = Background(grid, comm, x)
        self.supports = Supports(supports, self.background.x)
        self._make_points(x, volume)
        self._make_boundary(interface)
        self._compile()
        self._cover = self._newton = None
        self._no_cover = np.full(len(self.background.cells), -1, np.int32)
        self._tangents = 0  # made so far
        self._search()

    # ---------------------------------------------------------------- set-up

    def _make_points(self, x, volume):
        body, n = self.body, len(x)
        v = body.velocity(x) if callable(body.velocity) else np.broadcast_to(body.velocity, x.shape)
        identity = np.tile(np.eye(self.dim), (n, 1, 1))
        self.points = Points(
            gid=np.arange(n), cell=np.zeros(n, np.int32), x=x, v=np.array(v, float),
            a=np.tile(self.gravity, (n, 1)),  # an unstressed body starts in free fall
            mass=body.rho * volume, V0=volume, F=identity, F33=np.ones(n), state=np.zeros(n, body.law.state))
        self.count = n
        self.points.take(self.background.owner_of[self.background.find(x)] == self.comm.rank)

    def _make_boundary(self, interface):
        x = np.zeros((0, self.dim)) if interface is None else np.array(interface.x, float)
        target = self.background.find(x)
        if len(x) and target.min() < 0:
            raise ValueError(f"boundary particle {np.argmin(target)} at {x[np.argmin(target)]} m lies outside the "
                             "grid: enlarge the grid")
        self.interface, n = interface, len(x)
        v = self.body.velocity(x) if callable(self.body.velocity) else np.broadcast_to(self.body.velocity, x.shape)
        self.boundary = Points(gid=np.arange(n), cell=np.zeros(n, np.int32), x=x, v=np.array(v, float),
                               a=np.tile(self.gravity, (n, 1)), force=np.zeros((n, self.dim)))
        self.boundary.take(self.background.owner_of[target] == self.comm.rank)
        self._boundary_count = n

    def _compile(self):
        law, size = self.body.law, dict(D=self.dim, K=self.background.cells.shape[1])
        stress, tangent = point_functions(law, self.body.stress_state, self.dim)
        self._shapes = specialise(shape.shapes, **size)
        self._to_grid_kernel = specialise(transfer.to_grid, **size)
        self._to_points_kernel = specialise(transfer.to_points, **size)
        self._spread = specialise(transfer.spread, **size)
        self._add_interpolated = specialise(transfer.add_interpolated, **size)
        self._only_active = specialise(transfer.only_active, K=size["K"])
        self._residual_kernel = specialise(weakform.residual, **size, CONSISTENT=self._consistent, point_stress=stress)
        self._tangent_kernel = specialise(weakform.tangent, **size, CONSISTENT=self._consistent, point_tangent=tangent)
        self._energies = specialise(weakform.energies, D=self.dim, strain_energy=specialise(law.energy, D=self.dim))
        self._cauchy = specialise(weakform.cauchy, D=self.dim, stress=specialise(law.stress, D=self.dim))

    # ---------------------------------------------------------------- one step

    def advance(self, dt, force=None):
        """Advance one step of ``dt`` [s] under point loads ``force`` on the boundary particles [N], shape (n, dim),
        constant over the step, the same on every rank. Returns ``surface()``."""
        self._clock = perf_counter()
        if not dt > 0:
            raise ValueError(f"dt is {dt} s: it must be positive")
        force = np.zeros((self._boundary_count, self.dim)) if force is None else np.asarray(force, float)
        if not np.isfinite(force).all():
            raise MPMError(f"the force on boundary particle {np.argwhere(~np.isfinite(force))[0][0]} is not a number "
                           f"at t = {self.time:.6g} s")
        self._search()
        self._to_grid(dt, force)
        u = self._solve(dt)
        self._to_points(dt, u)
        self.time += dt
        self.steps += 1
        return self.surface()

    def _lap(self, phase):
        now = perf_counter()
        self.phases[phase] += now - self._clock
        self._clock = now

    def _search(self):
        """Phase I: cell of every point; points travel to the rank of their cell; the cover follows them."""
        travelled = uncovered = 0
        for points in (self.points, self.boundary):
            outside, moved, bare = self._settle(points)
            self._raise_if_outside(points, outside)
            if self.comm.allreduce(moved, MPI.MAX):
                points.migrate(self.comm, self.background.owner_of[self.background.find(points.x)])
                _, _, bare = self._settle(points)
                travelled = 1
            uncovered |= bare
        if self.comm.allreduce(uncovered, MPI.MAX):
            self._make_cover(np.unique(np.concatenate([self.points.cell, self.boundary.cell])))
            travelled = 1
        if travelled:
            self._make_work_arrays()

    def _settle(self, points):
        background = self.background
        slot = self._no_cover if self._cover is None else self._cover.slot
        return settle(background.find(points.x), background.owner_of, background.local_of, slot, self.comm.rank,
                      points.cell)

    def _raise_if_outside(self, points, outside):
        """Name the first point that left the grid, on all ranks alike."""
        mine = [] if outside < 0 else [(int(points.gid[outside]), points.x[outside].tolist())]
        if self.comm.allreduce(outside, MPI.MAX) < 0:
            return
        number, x = min(sum(self.comm.allgather(mine), []))
        kind = "material point" if points is self.points else "boundary particle"
        raise MPMError(f"{kind} {number} left the grid at x = {x} m, t = {self.time:.6g} s: enlarge the grid, or look "
                       f"for the cause in an unstable step")

    def _make_cover(self, filled):
        if self._cover is not None:
            self._newton.destroy()
            self._cover.destroy()
        self._filled = filled
        self._cover = Cover(self.background, filled, self.supports.fixed)
        self._newton = Newton(self._cover, self._residual, self._tangent)
        self._tangent_is_valid = False
        self._active = np.zeros(len(self._cover.node), bool)

    def _make_work_arrays(self):
        n, nodes, (K, D) = len(self.points), len(self._cover.node), (self.background.cells.shape[1], self.dim)
        self._N, self._G = np.empty((n, K)), np.empty((n, K, D))
        self._Nb, self._Gb = np.empty((len(self.boundary), K)), np.empty((len(self.boundary), K, D))
        self._F, self._F33 = np.empty((n, D, D)), np.empty(n)
        self._state = self.points.state.copy()
        self._nodal, self._R = np.empty((nodes, 1 + 2 * D)), np.empty((nodes, D))
        self._load = np.empty((nodes, D))

    def _to_grid(self, dt, force):
        """Phase I: basis values, nodal mass, velocity and acceleration; loads and known displacements."""
        points, boundary, cover, D = self.points, self.boundary, self._cover, self.dim
        maps = self.background.origin, self.background.inverse
        self._shapes(points.cell, points.x, *maps, self._N, self._G)
        self._shapes(boundary.cell, boundary.x, *maps, self._Nb, self._Gb)
        self._lap("search")
        self._nodal[:] = 0.0
        self._to_grid_kernel(points.cell, cover.cells, self._N, points.mass, points.v, points.a, self._nodal)
        cover.accumulate(self._nodal)
        self._mass = self._nodal[:, 0].copy()
        active = self._mass > 1e-14 * self.body.rho * np.prod(self.background.h) * self.body.thickness
        if self.comm.allreduce(int(not np.array_equal(active, self._active)), MPI.MAX):
            self.supports.check(active, cover, self.time)
            self._active, self._tangent_is_valid = active, False
        self._v, self._a = np.zeros((len(active), D)), np.zeros((len(active), D))
        self._v[active] = self._nodal[active, 1:1 + D] / self._mass[active, None]
        self._a[active] = self._nodal[active, 1 + D:] / self._mass[active, None]
        self._known = self.supports.displacement(cover.node, self.time, dt, self._v, self._a)
        self._idle = (cover.fixed | ~active[:, None])[:cover.owned]
        self._load[:] = 0.0
        self._add_loads(force)
        self._lap("to grid")

    def _add_loads(self, force):
        """Eq. 13 with the basis of eq. 14, and gravity."""
        boundary, cover = self.boundary, self._cover
        lost = self._only_active(boundary.cell, cover.cells, self._active, self._Nb)
        if self.comm.allreduce(lost, MPI.MAX) >= 0:
            found = [] if lost < 0 else [(int(boundary.gid[lost]), boundary.x[lost].tolist())]
            number, x = min(sum(self.comm.allgather(found), []))
            raise MPMError(f"boundary particle {number} at x = {x} m has no material point near it at t = "
                           f"{self.time:.6g} s: move the interface into the body (shift) or seed more points")
        force = force[boundary.gid]
        self._jump(force - boundary.force)
        boundary.force[:] = force
        self._spread(boundary.cell, cover.cells, self._Nb, force, self._load)
        cover.accumulate(self._load)
        self.applied = self.comm.allreduce(self._load[:cover.owned].sum(axis=0))  # [N], for the ledger
        self._load += self._mass[:, None] * self.gravity

    def _jump(self, change):
        """A load that is constant over each step jumps between steps, and the acceleration with it: Newmark's method
        then does the work of the load and takes up its impulse, step by step."""
        points, boundary, cover = self.points, self.boundary, self._cover
        if not self.comm.allreduce(int(change.any()), MPI.MAX):
            return
        self._spread(boundary.cell, cover.cells, self._Nb, change, self._load)
        cover.accumulate(self._load)
        self._load[self._active] /= self._mass[self._active, None]
        self._load[cover.fixed] = 0.0
        self._a += self._load
        for p, N in ((points, self._N), (boundary, self._Nb)):
            self._add_interpolated(p.cell, cover.cells, N, self._load, p.a)
        self._load[:] = 0.0

    def _solve(self, dt):
        """Phase II: the displacement of the nodes over the step, shape (local nodes, D)."""
        cover, points = self._cover, self.points
        self._dt, self._inside = dt, 0.0
        if not self._tangent_is_valid or self._tangent_dt != dt:
            self._F[:], self._F33[:] = points.F, points.F33
            self._lap("solve")
            self._tangent()
        guess = dt * self._v[:cover.owned]
        guess[self._idle] = self._known[:cover.owned][self._idle]
        when = f"step {self.steps + 1}, t = {self.time + dt:.6g} s"
        u, self.iterations = self._newton.solve(guess, self._round_off(guess), when)
        if self.iterations > self.slow:
            self._tangent_is_valid = False
        self._lap("solve")
        return cover.with_ghosts(u)

    def _round_off(self, u):
        """Norm of the residual [N] that is nothing but round-off: an error of eps * h in the displacement times the
        stiffness, and of eps in the inertia."""
        eps = np.finfo(float).eps
        inertia = newmark.alpha(self._dt) * self._mass[:self._cover.owned, None] * u
        sums = self.comm.allreduce(np.array([np.sum(inertia**2), self._stiffness2 * self.background.h.max() ** 2]))
        return 4 * eps * np.sqrt(sums.sum())

    def _residual(self, u, r):
        """Eq. 11 at the displacement u, both arrays (owned, D)."""
        self._lap("solve")
        cover, points = self._cover, self.points
        u = cover.with_ghosts(u)
        a = newmark.acceleration(u, self._v, self._a, self._dt)
        self._R[:] = 0.0
        self._residual_kernel(points.cell, cover.cells, self._N, self._G, points.mass, points.V0, points.F, points.F33,
                              points.state, self.body.law.params, u, a, self._F, self._F33, self._state, self._R)
        cover.accumulate(self._R)
        n = cover.owned
        r[:] = self._R[:n] - self._load[:n]
        if not self._consistent:
            r += self._mass[:n, None] * a[:n]
        r[self._idle] = self._idle_scale * (u[:n] - self._known[:n])[self._idle]
        self._lap("residual")

    def _tangent(self):
        """Eq. 10 at the deformation of the last residual, into the cover's matrix."""
        self._lap("solve")
        cover, points, n = self._cover, self.points, self._cover.owned
        alpha = newmark.alpha(self._dt)
        cover.element_matrices[:] = 0.0
        self._tangent_kernel(points.cell, cover.slot, self._N, self._G, points.mass, points.V0, points.F, points.F33,
                             points.state, self.body.law.params, alpha, self._F, self._F33, self._state,
                             cover.element_matrices)
        total, nodes = self.comm.allreduce(np.array([self._mass[:n].sum(), np.count_nonzero(self._mass[:n])]))
        self._idle_scale = alpha * total / nodes
        diagonal = np.where(self._idle, self._idle_scale, 0.0 if self._consistent else alpha * self._mass[:n, None])
        cover.fill_matrix(diagonal)
        stiffness = cover.matrix.getDiagonal().array.reshape(n, -1) - alpha * self._mass[:n, None]
        self._stiffness2 = float(np.sum(stiffness[~self._idle] ** 2))
        self._tangent_is_valid, self._tangent_dt = True, self._dt
        self._tangents += 1
        self._lap("tangent")

    def _to_points(self, dt, u):
        """Phase III: points and boundary particles move with the grid, which then goes back to rest."""
        cover, points, boundary = self._cover, self.points, self.boundary
        a = newmark.acceleration(u, self._v, self._a, dt)
        a[~self._active] = 0.0
        for p, N in ((points, self._N), (boundary, self._Nb)):
            self._to_points_kernel(p.cell, cover.cells, N, u, a, dt, p.x, p.v, p.a)
        points.F, self._F = self._F, points.F
        points.F33, self._F33 = self._F33, points.F33
        points.state, self._state = self._state, points.state
        self._lap("to points")

    # ---------------------------------------------------------------- what others ask

    def surface(self):
        """Boundary particles: positions [m] and velocities [m/s], shape (n, dim) each, in the order of the interface,
        the same on every rank."""
        return self._gather(self.boundary.x), self._gather(self.boundary.v)

    def _gather(self, values):
        if self.comm.size == 1:
            return values.copy()
        out = np.zeros((self._boundary_count, values.shape[1]))
        for number, part in self.comm.allgather((self.boundary.gid, values)):
            out[number] = part
        return out

    def energy(self):
        """``kinetic``, ``strain`` and ``potential`` (in gravity, zero at the origin) energy of the points [J]."""
        p = self.points
        kinetic, strain = self._energies(p.mass, p.V0, p.v, p.F, p.F33, p.state, self.body.law.params)
        potential = -np.sum(p.mass[:, None] * p.x * self.gravity)
        return dict(zip(("kinetic", "strain", "potential"),
                        map(float, self.comm.allreduce(np.array([kinetic, strain, potential])))))

    def momentum(self):
        """Momentum of the points [kg m/s], shape (dim,)."""
        return self.comm.allreduce((self.points.mass[:, None] * self.points.v).sum(axis=0))

    def cauchy_stress(self):
        """Cauchy stress of this rank's points [Pa], shape (n, dim, dim)."""
        p, law = self.points, self.body.law
        sigma = np.empty_like(p.F)
        self._cauchy(law.params, p.F, p.F33, p.state, sigma)
        return sigma

    def snapshot(self):
        """What ParaView shows, see ``output``. Collective."""
        return output.snapshot(self)

    def get_state(self):
        """Everything that decides the future, as name → array copy: points and boundary particles of this rank, time,
        the cover and the kept tangent."""
        state = {f"points.{k}": v for k, v in self.points.copy().items()}
        state.update({f"boundary.{k}": v for k, v in self.boundary.copy().items()})
        state.update(time=np.array([self.time, self.steps]), filled=self._filled.copy(), active=self._active.copy(),
                     tangent=np.array([self._tangents, self._tangent_is_valid]))
        if self._tangent_is_valid:
            state.update(matrix=self._cover.values.copy(), dt=np.array([self._tangent_dt]),
                         scale=np.array([self._idle_scale, self._stiffness2]))
        return state

    def set_state(self, state):
        """Go back to ``state``; the run continues bit for bit."""
        for name in ("points", "boundary"):
            getattr(self, name).restore({k.split(".")[1]: v for k, v in state.items() if k.startswith(name + ".")})
        self.time, self.steps = float(state["time"][0]), int(state["time"][1])
        if not np.array_equal(self._filled, state["filled"]):
            self._make_cover(state["filled"].copy())
        self._make_work_arrays()
        self._active = state["active"].copy()
        tangents, valid = int(state["tangent"][0]), bool(state["tangent"][1])
        if valid:
            self._tangent_dt = float(state["dt"][0])
            self._idle_scale, self._stiffness2 = map(float, state["scale"])
            if tangents != self._tangents or not self._tangent_is_valid:
                self._cover.set_values(state["matrix"])
        self._tangents, self._tangent_is_valid = tangents, valid

    def unused_options(self):
        """Dash options of the command line that neither PETSc nor anybody else asked for."""
        return unused_options()

    def close(self):
        """Free matrix and solver."""
        self._newton.destroy()
        self._cover.destroy()
