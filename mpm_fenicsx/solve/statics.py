"""Load steps without inertia: equilibrium of inner forces and loads, and the points move there.

A step takes the load factor from ``before`` to ``after``. With the inner forces f (springs among them) and
the loads p on the nodes, both where the displacement u of the step has taken them, and g, the part of f at
the start of the step that the loads do not explain,

    f(u) - after p(u) - (1 - after) / (1 - before) g = 0,     g = f(0) - before p(0).

A body without stress at the start has g = 0, and its loads rise from zero. Stress that it has already, such
as that of its weight, gives way to the loads at the same rate. No time passes: springs have no lead, supports
stay where they are, and laws are told dt = inf, for which rates are zero. Loads that follow the surface are
those of the end of the step, see ``following`` for their stiffness.

The tangent is made anew in every iteration. Beside it, WEAK of a cell's stiffness holds each node: what
nothing resists, and nothing pushes, stays where it is. It is not in the residual, so it does not carry.
"""
from typing import NamedTuple

import numpy as np
from mpi4py import MPI

from ..collective import total
from ..terms.ghost import GhostStiffness
from ..terms.newmark import Increment
from ..terms.scene_penalties import softest
from . import following
from .equations import Equations, Known
from .held import check_held
from .step import Step
from .tangents import Tangent
from .tolerance import LATE_AT_REST, Norms

WEAK = 1e-10
TOUCH = 1e-9  # cells


class LoadStep(NamedTuple):
    """Load factors at the start and the end of a step [-]."""

    before: float
    after: float

    @property
    def growth(self):
        """Of the loads, and of normal forces with them; None where there were none."""
        return self.after / self.before if self.before > 0.0 else None

    @property
    def left(self):
        """Of the forces that loads do not explain, the part at the end."""
        return 0.0 if self.after >= 1.0 else (1.0 - self.after) / (1.0 - self.before)


class StaticEquations(Equations):
    """Equations of a load step. ``stiffness``: of a cell [N/m], to be set before they are used."""

    stiffness = 0.0

    def begin_load(self, grid, known, following, factors):
        """A ``LoadStep`` from the state ``grid``; known: with the loads that do not follow, whole;
        following: terms with the others."""
        self.begin(grid, known)
        self._following, self._dead, n = following, known.load, self._active_cells.owned
        self._factor, self._rest = factors.before, np.zeros_like(known.load)
        start = np.zeros((n, self._active_cells.dim))
        unexplained = np.empty_like(start)
        self._set_load(start)
        super().residual(start, unexplained)
        unexplained[known.idle] = 0.0
        self._factor, self._rest[:n] = factors.after, factors.left * unexplained
        self._set_load(start)

    @property
    def shape(self):
        """Of displacements of the owned nodes."""
        return self._active_cells.owned, self._active_cells.dim

    def change_of_loads(self, u):
        """Central difference of the loads [N], shape (owned, D), by the displacement u around that of
        the tangent in the matrix, zero on idle rows."""
        change = np.zeros_like(self._dead)
        for sign in (0.5, -0.5):
            moved = self._active_cells.with_ghosts(self._at + sign * 2.0 * u)
            change += sign * sum(term.on_nodes(self._grid, moved) for term in self._following)
        self._active_cells.accumulate(change)
        change = self._factor * change[:len(u)]
        change[self.known.idle] = 0.0
        return change

    def _set_load(self, u):
        """The known load where the nodes have moved by u [m], shape (owned, D)."""
        load = self._dead
        if self._following:
            u = self._active_cells.with_ghosts(u)
            following = sum(term.on_nodes(self._grid, u) for term in self._following)
            self._active_cells.accumulate(following)
            load = load + following
        self.known = self.known._replace(load=self._factor * load + self._rest)

    def increment(self, u):
        """See ``Equations.increment``: without time and acceleration."""
        u = self._active_cells.with_ghosts(u)
        return Increment(0.0, 0.0, u, np.zeros_like(u))

    def residual(self, u, r):
        """The equation above [N] into r at the displacement u, both (owned, D). Returns the trial."""
        if self._following:
            self._set_load(u)
        return super().residual(u, r)

    def tangent(self, trial):
        """Its derivative at ``trial`` into the matrix, see ``Equations.tangent``."""
        cells, idle, n = self._active_cells, self.known.idle, self._active_cells.owned
        self._at = trial.u
        cells.clear()
        for term, of_term in zip(self.terms, trial.of_terms):
            term.tangent(self._grid, of_term)
        cells.fill_matrix(np.where(idle, self.stiffness, WEAK * self.stiffness))
        diagonal = cells.matrix.getDiagonal().array.reshape(n, cells.dim)
        self._clock.lap("tangent")
        return Tangent(0.0, self.stiffness, float(np.sum(diagonal[~idle] ** 2)), np.inf)


class StaticStep(Step):
    """One load step, as often as the points stay in the active cells, see ``Step``."""

    static, late, equations_of = True, LATE_AT_REST, StaticEquations

    def __init__(self, *args):
        super().__init__(*args)
        h = np.prod(self.background.h) ** (1.0 / self.dim)
        self.equations.stiffness = softest(self.problem.bodies) * h ** (self.dim - 2)
        if not any(penalty.kinks for penalty in self.problem.penalties):
            self.newton.full_steps_first()  # on the way to a bent body the residual grows, as it stretches
        self._whole = None
        if any(load.follows for load in self.problem.loads):
            self.newton.linear.bears_any_sign = False  # its solver is GMRES already
            self._whole = following.use(self.newton, self.equations, self.active_cells.matrix, h)

    def _make_ghost(self, facets, h):
        return GhostStiffness(facets, self.active_cells, softest(self.problem.bodies), h)

    def begin_load(self, factors, time, force):
        """State of the nodes and loads in a ``LoadStep`` at ``time`` [s], under ``force`` on this rank's
        particles of the interface [N], shape (n, D)."""
        self.grid, self._factors, self._v = self._to_grid(0.0, time, force), factors, None
        grid = self.grid
        self._check_located()
        if self.ghost and self.ghost.begin(grid):
            self.tangents.drop()
        idle = (self.active_cells.fixed | ~self.active[:, None])[:self.active_cells.owned]
        for penalty in self.problem.penalties:
            penalty.expect(factors.growth)
        known = Known(self._dead_loads(), np.zeros_like(grid.v), idle, None)
        self.equations.begin_load(grid, known, self.problem.loads, factors)
        self.clock.lap("to grid")

    def _dead_loads(self):
        """Loads that do not follow the surface [N], shape (nodes, D)."""
        grid, load = self.grid, np.zeros_like(self.grid.v)
        self.problem.interface.begin(grid, load)
        for penalty in self.problem.penalties:
            penalty.begin(grid, load)
        load += grid.mass[:, None] * self.problem.gravity
        self._body_force = self._body_load() if self.problem.bodies[0].has_body_force else None
        return load if self._body_force is None else load + self._body_force

    def solve(self, when, look=False):
        """See ``Step.solve``. look: whether anything holds the body, see ``held``."""
        guess = self._towards_loads()
        if self.tangents.count == 0 or (self.tangents.by_user and self.tangents.start(0.0)):
            self.newton.make_tangent(self.equations.first_trial(guess))
            if self._whole:
                following.use_gmres(self.newton)
        if look:
            self.check_held()
        trial, iterations = self.newton.solve(guess, guess, self._norms(), when)
        self.clock.lap("solve")
        return trial, iterations

    def _towards_loads(self):
        """The guess [m], shape (owned, D): rest, but with walls a tiny motion along the loads, so that they
        hold what touches them and does not yet press on them."""
        load = self.equations.known.load[:self.active_cells.owned]
        if not self.problem.penalties:
            return np.zeros_like(load)
        most = self.comm.allreduce(np.abs(load).max(initial=0.0), MPI.MAX) or 1.0
        return np.where(self.equations.known.idle, 0.0, TOUCH * self.background.h.min() / most * load)

    def check_held(self):
        """MPMError where nothing holds a part of the bodies against its loads, by the tangent in the matrix.
        Collective."""
        check_held(self.background, self.active_cells, self.equations.known, self.grid)

    def work(self, increment):
        """Of the loads in the step [J]. Collective."""
        n = self.active_cells.owned
        return float(total(self.comm, [np.sum(self.equations.known.load[:n] * increment.u[:n])])[0])

    def _norms(self):
        """Of the loads, with round-off as that of a step."""
        n, eps = self.active_cells.owned, np.finfo(float).eps
        loads, stiff = np.sqrt(total(self.comm, [
            np.sum(self.equations.known.load[:n] ** 2),
            self.tangents.now.stiffness2 * self.background.h.max() ** 2]))
        return Norms(loads, 0.0, 4 * eps * stiff)

    def destroy(self):
        """Free matrices and solver."""
        super().destroy()
        if self._whole:
            self._whole.destroy()

    def finish(self, trial):
        """The points move; they and the boundary particles are at rest there."""
        forces = self._forces(trial, 1.0)
        for load in self.problem.loads:
            load.on_nodes(self.grid, trial.increment.u)
        for load in (self.problem.interface, *self.problem.loads):
            load.finish(self.grid, None, trial.increment)
        for term, of_term in zip(self.equations.terms, trial.of_terms):
            term.finish(self.grid, of_term, trial.increment)
        self.problem.impulses.settled(self.grid, self.problem, forces, self._factors.after)
        self.problem.on_bodies.settled(self.grid, self.problem, forces)
        self.clock.lap("to points")
