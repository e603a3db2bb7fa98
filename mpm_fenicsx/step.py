"""One implicit step on one cover: nodal fields, loads, residual and tangent for the SNES (the paper's phases I to III)."""
from time import perf_counter, time_ns

import numpy as np

from . import compat, newmark
from .collective import somewhere, total
from .cover import Cover
from .errors import MPMError
from .snes import Newton

PHASES = ("search", "to grid", "tangent", "residual", "solve", "to points")


class Step:
    """Advances ``points`` and ``boundary`` by one step, as often as they stay in the cells of ``cover``.

    phases: seconds per phase, added to. After ``begin``: ``mass`` (nodes,) [kg], ``v``, ``a`` (nodes, D) at the start of
    the step, and ``applied`` (D,), the sum of the loads [N] that reached the nodes. Collective.
    """

    tolerance = 1e-6  # of the residual, relative to loads and inertia (-mpm_snes_atol replaces it)
    slow = 4  # more Newton iterations than this: the kept tangent is out of date

    def __init__(self, background, filled, supports, body, gravity, kernels, consistent, phases):
        self.comm, self.dim, self.background = background.comm, background.dim, background
        self.cover = Cover(background, filled, supports.fixed)
        self.filled, self.supports, self.gravity, self.kernels = filled, supports, gravity, kernels
        self.params, self.consistent, self.phases = body.law.params, consistent, phases
        self._smallest_mass = 1e-14 * body.rho * np.prod(background.h) * (body.thickness if self.dim == 2 else 1.0)  # "numeric zero" of eq. 14
        self.newton = Newton(self.cover, self.residual, self.tangent)
        nodes = len(self.cover.node)
        self.mass = None  # until begin
        self.active = np.zeros(nodes, bool)
        self._nodal, self._R = np.empty((nodes, 1 + 2 * self.dim)), np.empty((nodes, self.dim))
        self._load = np.empty((nodes, self.dim))
        self.tangent_is_valid, self.tangents, self.tangent_dt = False, 0, 0.0
        self._tangent_made = 0  # [ns], tells one tangent from another
        self.idle_scale = self.stiffness2 = self.stiff = 0.0
        self._clock, self._sent = perf_counter(), compat.sent()
        self.traffic = {phase: np.zeros(2) for phase in PHASES}  # messages and bytes sent by PETSc for this rank

    def lap(self, phase):
        """Book the time since the last lap under ``phase``."""
        now = perf_counter()
        self.phases[phase] += now - self._clock
        self._clock = now
        if self.comm.size > 1:
            messages, size = compat.sent()
            self.traffic[phase] += (messages - self._sent[0], size - self._sent[1])
            self._sent = messages, size

    def restart_clock(self):
        self._clock = perf_counter()

    def attach(self, points, boundary):
        """Work arrays for these points; needed whenever their number on this rank changes."""
        self.points, self.boundary = points, boundary
        n, K, D = len(points), self.cover.cells.shape[1], self.dim
        self._N, self._G = np.empty((n, K)), np.empty((n, K, D))
        self._Nb, self._Gb = np.empty((len(boundary), K)), np.empty((len(boundary), K, D))
        self._F, self._F33, self._state = np.empty((n, D, D)), np.empty(n), points.state.copy()

    # ---------------------------------------------------------------- phase I

    def begin(self, dt, time, force):
        """Basis values, nodal mass, velocity and acceleration, known displacements, loads. ``force`` [N] on this rank's
        boundary particles, shape (n, D)."""
        points, boundary, D = self.points, self.boundary, self.dim
        self.dt = dt
        for p, N, G in ((points, self._N, self._G), (boundary, self._Nb, self._Gb)):
            self.kernels.shapes(p.cell, p.x, self.background.corner, self.background.inverse, N, G)
        self.lap("search")
        self._nodal[:] = 0.0
        self.kernels.to_grid(points.cell, self.cover.cells, self._N, points.mass, points.v, points.a, self._nodal)
        self.cover.accumulate(self._nodal)
        self.mass = self._nodal[:, 0].copy()
        jumps, loaded = self._take_stock(time, force)
        self.v, self.a = np.zeros((len(self.mass), D)), np.zeros((len(self.mass), D))
        self.v[self.active] = self._nodal[self.active, 1:1 + D] / self.mass[self.active, None]
        self.a[self.active] = self._nodal[self.active, 1 + D:] / self.mass[self.active, None]
        self._known = self.supports.displacement(self.cover.node, time, dt, self.v, self.a)
        self._idle = (self.cover.fixed | ~self.active[:, None])[:self.cover.owned]
        if jumps:
            self._jump(force - boundary.force)
            boundary.force[:] = force
        self._add_loads(force, loaded)
        self.lap("to grid")

    def _take_stock(self, time, force):
        """Active nodes and the basis of eq. 14; whether the force has changed anywhere and whether there is any."""
        boundary, active = self.boundary, self.mass > self._smallest_mass
        lost = self.kernels.only_active(boundary.cell, self.cover.cells, active, self._Nb)
        changed, alone, jumps, loaded = somewhere(
            self.comm, not np.array_equal(active, self.active), lost >= 0, (force != boundary.force).any(), force.any())
        if changed:  # a kept tangent has identity rows for nodes without mass
            self.supports.check(active, self.cover, time)
            self.active, self.tangent_is_valid = active, False
        if alone:
            found = [] if lost < 0 else [(int(boundary.gid[lost]), boundary.x[lost].tolist())]
            number, x = min(sum(self.comm.allgather(found), []))
            raise MPMError(f"boundary particle {number} at x = {x} m has no material point near it at t = {time:.6g} s: "
                           "move the interface into the body (shift) or seed more points")
        return jumps, loaded

    def _add_loads(self, force, loaded):
        """Eq. 13 with the basis of eq. 14, and gravity."""
        self._load[:] = 0.0
        self.applied = np.zeros(self.dim)
        if loaded:
            self.kernels.spread(self.boundary.cell, self.cover.cells, self._Nb, force, self._load)
            self.cover.accumulate(self._load)
            self.applied = total(self.comm, self._load[:self.cover.owned].sum(axis=0))
        self._load += self.mass[:, None] * self.gravity

    def _jump(self, change):
        """A load that is constant over each step jumps between steps, and the acceleration with it: Newmark's method
        then does the work of the load and takes up its impulse, step by step."""
        cover, load = self.cover, self._load
        load[:] = 0.0
        self.kernels.spread(self.boundary.cell, cover.cells, self._Nb, change, load)
        cover.accumulate(load)
        load[self.active] /= self.mass[self.active, None]
        load[cover.fixed] = 0.0
        self.a += load
        for p, N in ((self.points, self._N), (self.boundary, self._Nb)):
            self.kernels.interpolate(p.cell, cover.cells, N, load, p.a)

    # ---------------------------------------------------------------- phase II

    def solve(self, when):
        """Displacement of the nodes over the step [m], shape (nodes, D), and the number of Newton iterations."""
        dt, n = self.dt, self.cover.owned
        if not self.tangent_is_valid or self.tangent_dt != dt:
            self._F[:], self._F33[:] = self.points.F, self.points.F33
            self.tangent()
        guess = (dt * self.v + 0.5 * dt**2 * self.a)[:n]
        guess[self._idle] = self._known[:n][self._idle]
        rest = np.where(self._idle, guess, 0.0)
        u, iterations = self.newton.solve(guess, rest, self._atol(guess), when)
        if iterations > self.slow:
            self.tangent_is_valid = False
        self.lap("solve")
        return self.cover.with_ghosts(u), iterations

    def _atol(self, u):
        """Norm of the residual [N] to stop at: ``tolerance`` times loads and inertia of the step, but not below what is
        round-off: an error of eps * h in the displacement times the stiffness, and of eps in the inertia."""
        n, eps = self.cover.owned, np.finfo(float).eps
        mass = self.mass[:n, None]
        norm2 = total(self.comm, [
            np.sum(self._load[:n] ** 2), np.sum((mass * self.a[:n]) ** 2),
            np.sum((newmark.alpha(self.dt) * mass * u) ** 2), self.stiffness2 * self.background.h.max() ** 2])
        return max(self.tolerance * np.sqrt(norm2[:2].max()), 4 * eps * np.sqrt(norm2[2:].sum()))

    def residual(self, u, r):
        """Eq. 11 [N] into r at the displacement u, both (owned, D)."""
        self.lap("solve")
        points, n = self.points, self.cover.owned
        u = self.cover.with_ghosts(u)
        a = newmark.acceleration(u, self.v, self.a, self.dt)
        self._R[:] = 0.0
        self.kernels.residual(points.cell, self.cover.cells, self._N, self._G, points.mass, points.V0, points.F,
                              points.F33, points.state, self.params, u, a, self._F, self._F33, self._state, self._R)
        self.cover.accumulate(self._R)
        r[:] = self._R[:n] - self._load[:n]
        if not self.consistent:
            r += self.mass[:n, None] * a[:n]
        r[self._idle] = self.idle_scale * (u[:n] - self._known[:n])[self._idle]
        self.lap("residual")

    def tangent(self):
        """Eq. 10 at the deformation of the last residual, into the cover's matrix."""
        self.lap("solve")
        cover, points, n = self.cover, self.points, self.cover.owned
        alpha = newmark.alpha(self.dt)
        cover.element_matrices[:] = 0.0
        self.kernels.tangent(points.cell, cover.slot, self._N, self._G, points.mass, points.V0, points.F, points.F33,
                             points.state, self.params, alpha, self._F, self._F33, self._state, cover.element_matrices)
        mass, nodes = total(self.comm, [self.mass[:n].sum(), np.count_nonzero(self.mass[:n])])
        self.idle_scale = alpha * mass / nodes  # idle rows of the size of the others keep the matrix well scaled
        inertia = alpha * self.mass[:n, None]
        cover.fill_matrix(np.where(self._idle, self.idle_scale, 0.0 if self.consistent else inertia))
        stiffness = cover.matrix.getDiagonal().array.reshape(n, self.dim) - inertia
        self.stiffness2 = float(np.sum(stiffness[~self._idle] ** 2))
        norms = total(self.comm, [self.stiffness2, np.sum(inertia**2) * self.dim])
        self.stiff = float(np.sqrt(norms[0] / norms[1]))
        self._choose_solver()
        self.tangent_is_valid, self.tangent_dt = True, self.dt
        self.tangents += 1
        self._tangent_made = time_ns()
        self.lap("tangent")

    def _choose_solver(self):
        self.newton.choose_solver(self.stiff, self.background.x[self.cover.node[:self.cover.owned]])

    # ---------------------------------------------------------------- phase III

    def finish(self, u):
        """Points and boundary particles move with the grid, which then goes back to rest."""
        points, boundary = self.points, self.boundary
        a = newmark.acceleration(u, self.v, self.a, self.dt)
        a[~self.active] = 0.0
        for p, N in ((points, self._N), (boundary, self._Nb)):
            self.kernels.to_points(p.cell, self.cover.cells, N, u, a, self.dt, p.x, p.v, p.a)
        points.F, self._F = self._F, points.F
        points.F33, self._F33 = self._F33, points.F33
        points.state, self._state = self._state, points.state
        self.lap("to points")

    # ---------------------------------------------------------------- state

    def get_state(self):
        """Cover, active nodes and kept tangent as name → array copy."""
        state = dict(filled=self.filled.copy(), active=self.active.copy(),
                     tangent=np.array([self._tangent_made, self.tangent_is_valid]))
        if self.tangent_is_valid:
            state.update(matrix=self.cover.values.copy(),
                         tangent_data=np.array([self.tangent_dt, self.idle_scale, self.stiffness2, self.stiff]))
        return state

    def set_state(self, state):
        """Go back; the factorisation is made again only if the tangent has changed since."""
        self.active = state["active"].copy()
        made, valid = int(state["tangent"][0]), bool(state["tangent"][1])
        if valid:
            self.tangent_dt, self.idle_scale, self.stiffness2, self.stiff = map(float, state["tangent_data"])
            self._choose_solver()
            if made != self._tangent_made or not self.tangent_is_valid:
                self.cover.set_values(state["matrix"])
        self._tangent_made, self.tangent_is_valid = made, valid

    def destroy(self):
        self.newton.destroy()
        self.cover.destroy()
