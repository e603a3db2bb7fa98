"""One implicit step on the active cells (the paper's phases I to III): nodal fields, loads, residual and tangent."""
from time import perf_counter, time_ns

import numpy as np

from ..collective import somewhere, total
from ..grid import compat
from ..grid.active_cells import ActiveCells
from ..laws import ELASTIC_STATE
from ..terms import newmark
from ..terms.carriers import Carriers
from ..terms.ghost import Ghost
from ..terms.penalty import walls_in_reach
from .snes import Newton

PHASES = ("search", "to grid", "tangent", "residual", "solve", "to points")


class Step:
    """Advances the points of ``parts`` and ``boundary`` by one step, as often as they stay in the ``active_cells``.

    phases: seconds per phase, added to. After ``begin``: ``mass`` (nodes,) [kg], ``v``, ``a`` (nodes, D) at the start
    of the step, and ``applied`` (D,), the sum of the loads [N] that reached the nodes. cell_mass: of a cell full of the
    lightest body [kg]. Collective.
    """

    tolerance = 1e-6  # of the residual, relative to loads and inertia (-mpm_snes_atol replaces it)
    inert = 0.05  # stiffness over inertia below which a second tangent in a step costs more than it saves
    slow = 4  # more Newton iterations than this: the kept tangent is out of date

    def __init__(self, background, filled, supports, parts, gravity, kernels, consistent, phases, loads, penalties,
                 solver="auto", facets=None, outflow=None):
        self.comm, self.dim, self.background = background.comm, background.dim, background
        self.loads, self.penalties, self.outflow = loads, penalties, outflow
        laws = [part.body.law for part in parts]
        averaged = any(part.body.f_bar for part in parts)
        symmetric = all(law.symmetric for law in laws)
        self.active_cells = ActiveCells(background, filled, supports.fixed, symmetric, averaged, facets,
                           walls_in_reach(penalties, background))
        self.filled, self.supports, self.gravity, self.kernels = filled, supports, gravity, kernels
        self.parts, self.consistent, self.phases = parts, consistent, phases
        bodies = [part.body for part in parts]
        self.cell_mass = np.prod(background.h) * min(b.rho * (b.thickness if self.dim == 2 else 1.0) for b in bodies)
        self.newton = Newton(self.active_cells, self.residual, self._renew_tangent, bool(penalties),
                             any(held.kinks for held in penalties), symmetric,
                             any(law.state != ELASTIC_STATE for law in laws), solver)
        h = np.prod(background.h) ** (1.0 / self.dim)
        self.ghost = facets and Ghost(facets, self.active_cells, self.cell_mass / h**self.dim, h)
        nodes = len(self.active_cells.node)
        self.mass = None  # until begin
        self.active = np.zeros(nodes, bool)
        self._nodal, self._R = np.empty((nodes, 1 + 2 * self.dim)), np.empty((nodes, self.dim))
        self._load = np.empty((nodes, self.dim))
        self.tangent_is_valid, self.tangents, self.tangent_dt = False, 0, 0.0
        self._tangent_made = self._copy_made = 0  # [ns], tells one tangent from another
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

    def attach(self, boundary):
        """Work arrays for the points now here; needed whenever their number on this rank changes."""
        for part in self.parts:
            part.attach(self.active_cells)
        self.carriers = Carriers(self, boundary)

    # ---------------------------------------------------------------- phase I

    def begin(self, dt, time, force):
        """Basis values, nodal mass, velocity and acceleration, known displacements, loads. ``force`` [N] on this rank's
        boundary particles, shape (n, D)."""
        self.dt, D = dt, self.dim
        self.carriers.shapes()
        for part in self.parts:
            part.shapes(self)
        self.lap("search")
        self._nodal[:] = 0.0
        for part in self.parts:
            part.to_grid(self, self._nodal)
        self.active_cells.accumulate(self._nodal)
        self.mass = self._nodal[:, 0].copy()
        active = self.mass > 1e-14 * self.cell_mass  # "numeric zero" of eq. 14
        if self.carriers.take_stock(active, force):  # a kept tangent has identity rows for nodes without mass
            self.supports.check(active, self.active_cells, time)
            self.active, self.tangent_is_valid = active, False
        self._lumped = np.zeros_like(self.mass) if self.consistent else self.mass
        if self.ghost:
            self.tangent_is_valid &= not self.ghost.begin(self)
            self._lumped = self.ghost.lumped
        self.v, self.a = np.zeros((len(self.mass), D)), np.zeros((len(self.mass), D))
        self.v[self.active] = self._nodal[self.active, 1:1 + D] / self.mass[self.active, None]
        self.a[self.active] = self._nodal[self.active, 1 + D:] / self.mass[self.active, None]
        self._known = self.supports.displacement(self.active_cells.node, time, dt, self.v, self.a)
        self._idle = (self.active_cells.fixed | ~self.active[:, None])[:self.active_cells.owned]
        self._load[:] = 0.0
        self.applied = self.carriers.begin(time, force, self._load)
        self._add_forces_by_volume(time + dt)
        self.lap("to grid")

    def _add_forces_by_volume(self, time):
        """Gravity, and the body force at the end of the step, into the load."""
        self._load += self.mass[:, None] * self.gravity
        if self.parts[0].pushed:
            nodal = np.zeros_like(self._load)
            for part in self.parts:
                part.push(self, time, nodal)
            self.active_cells.accumulate(nodal)
            self._load += nodal

    def shapes(self, cell, x, N, G):
        """Basis values and gradients at positions x [m] in this rank's cells, see ``shape.shapes``."""
        self.kernels.shapes(cell, x, self.background.maps, N, G)

    # ---------------------------------------------------------------- phase II

    def solve(self, when):
        """Displacement of the nodes over the step [m], shape (nodes, D), and the number of Newton iterations."""
        dt, n = self.dt, self.active_cells.owned
        guess = (dt * self.v + 0.5 * dt**2 * self.a)[:n]
        guess[self._idle] = self._known[:n][self._idle]
        self._renewed = False
        if not self.newton.renews and (not self.tangent_is_valid or self.tangent_dt != dt):
            for part in self.parts:
                part.rest(self)
            for held in self.penalties:
                held.respond(self, self.active_cells.with_ghosts(guess))
            self.tangent()
        rest = np.where(self._idle, guess, 0.0)
        u, iterations = self.newton.solve(guess, rest, self._atol(guess), when)
        if iterations > self.slow:
            self.tangent_is_valid = False
        self.lap("solve")
        return self.active_cells.with_ghosts(u), iterations

    def _atol(self, u):
        """Norm of the residual [N] to stop at: ``tolerance`` times loads and inertia of the step, but not below what is
        round-off: an error of eps * h in the displacement times the stiffness, and of eps in the inertia."""
        n, eps = self.active_cells.owned, np.finfo(float).eps
        mass = self.mass[:n, None]
        norm2 = total(self.comm, [
            np.sum(self._load[:n] ** 2), np.sum((mass * self.a[:n]) ** 2),
            np.sum((newmark.alpha(self.dt) * mass * u) ** 2), self.stiffness2 * self.background.h.max() ** 2])
        return max(self.tolerance * np.sqrt(norm2[:2].max()), 4 * eps * np.sqrt(norm2[2:].sum()))

    def residual(self, u, r):
        """Eq. 11 [N] into r at the displacement u, both (owned, D)."""
        self.lap("solve")
        n = self.active_cells.owned
        u = self.active_cells.with_ghosts(u)
        a = newmark.acceleration(u, self.v, self.a, self.dt)
        self._R[:] = 0.0
        for part in self.parts:
            part.residual(self, u, a, self._R)
        for held in self.penalties:
            held.residual(self, u, self._R)
        if self.ghost:
            self.ghost.residual(a, self._R)
        self.active_cells.accumulate(self._R)
        r[:] = self._R[:n] - self._load[:n]
        if self.ghost or not self.consistent:
            r += self._lumped[:n, None] * a[:n]
        r[self._idle] = self.idle_scale * (u[:n] - self._known[:n])[self._idle]
        self.lap("residual")

    def tangent(self):
        """Eq. 10 at the deformation of the last residual, into the matrix."""
        self.lap("solve")
        active_cells, n = self.active_cells, self.active_cells.owned
        alpha = newmark.alpha(self.dt)
        active_cells.clear()
        for part in self.parts:
            part.tangent(self)
        for held in self.penalties:
            held.tangent(self)
        if self.ghost:
            self.ghost.tangent(alpha, active_cells.facet_matrices)
        mass, nodes = total(self.comm, [self.mass[:n].sum(), np.count_nonzero(self.mass[:n])])
        self.idle_scale = alpha * mass / nodes  # idle rows of the size of the others keep the matrix well scaled
        inertia = alpha * self.mass[:n, None]
        active_cells.fill_matrix(np.where(self._idle, self.idle_scale, alpha * self._lumped[:n, None]))
        stiffness = active_cells.matrix.getDiagonal().array.reshape(n, self.dim) - inertia
        self.stiffness2 = float(np.sum(stiffness[~self._idle] ** 2))
        norms = total(self.comm, [self.stiffness2, np.sum(inertia**2) * self.dim])
        self.stiff = float(np.sqrt(norms[0] / norms[1]))
        self._choose_solver()
        self.tangent_is_valid, self.tangent_dt = True, self.dt
        self.tangents += 1
        self._tangent_made = time_ns()
        self.lap("tangent")

    def _renew_tangent(self, asked, always):
        """For the SNES: a new tangent when ``asked`` for, unless ``always`` only once in a step in which inertia
        dominates, or when a spring has taken another branch of its law."""
        if asked and not always and self.stiff < self.inert and self._renewed:
            asked = False
        if asked or somewhere(self.comm, any(held.switched() for held in self.penalties))[0]:
            self.tangent()
            self._renewed = True

    def _choose_solver(self):
        self.newton.choose_solver(self.stiff, self.background.x[self.active_cells.node[:self.active_cells.owned]])

    # ---------------------------------------------------------------- phase III

    def finish(self, u):
        """Points and boundary particles move with the grid, which then goes back to rest."""
        a = newmark.acceleration(u, self.v, self.a, self.dt)
        a[~self.active] = 0.0
        self.carriers.finish(u, a)
        for part in self.parts:
            part.finish(self, u, a)
        self.lap("to points")

    # ---------------------------------------------------------------- state

    def get_state(self):
        """Filled cells, active nodes and kept tangent as name → array copy."""
        state = dict(filled=self.filled.copy(), active=self.active.copy(),
                     tangent=np.array([self._tangent_made, self.tangent_is_valid]))
        if self.tangent_is_valid:
            state.update(matrix=self._kept_matrix(),
                         tangent_data=np.array([self.tangent_dt, self.idle_scale, self.stiffness2, self.stiff]))
        if self.ghost:
            state.update(ghost=self.ghost.weight)
        return state

    def _kept_matrix(self):
        """Copy of the tangent's values, the same one until there is a new tangent: it may be most of the state."""
        if self._copy_made != self._tangent_made:
            self._copy, self._copy_made = self.active_cells.values.copy(), self._tangent_made
        return self._copy

    def set_state(self, state):
        """Go back; the factorisation is made again only if the tangent has changed since."""
        self.active = state["active"].copy()
        made, valid = int(state["tangent"][0]), bool(state["tangent"][1])
        if valid:
            self.tangent_dt, self.idle_scale, self.stiffness2, self.stiff = map(float, state["tangent_data"])
            self._choose_solver()
            if made != self._tangent_made or not self.tangent_is_valid:
                self.active_cells.set_values(state["matrix"])
        self._tangent_made, self.tangent_is_valid = made, valid
        if self.ghost:
            self.ghost.weight = state["ghost"]

    def destroy(self):
        self.newton.destroy()
        self.active_cells.destroy()
