"""The equations of one step: residual and tangent (eq. 10 and 11) of all terms, for the displacement of the
nodes."""
from typing import NamedTuple

import numpy as np

from ..collective import somewhere, total
from ..terms.failing import find_failing
from ..terms.ghost import Ghost
from ..terms.newmark import Increment
from .tangents import Tangent


class Trial(NamedTuple):
    """What a residual has computed: the displacement ``u`` that it belongs to, shape (owned, D), the
    ``increment`` of all local nodes, and the trial of each term. It holds until the next one."""

    u: np.ndarray
    increment: Increment
    of_terms: list


class Known(NamedTuple):
    """What the equations are told at the start of a step: ``load`` [N] and ``displacement`` [m], shape
    (nodes, D), of the ``idle`` unknowns, mask (owned, D): supports and nodes without mass; ``lumped``
    (nodes,), mass [kg] with lumped inertia, or None where there is none."""

    load: np.ndarray
    displacement: np.ndarray
    idle: np.ndarray
    lumped: np.ndarray


class Equations:
    """Over the ``active_cells``, of ``terms`` with the methods of ``terms.grid_state``, of which ``watched``
    may switch branches. Rows of idle unknowns say that their displacement is the known one. Collective."""

    def __init__(self, active_cells, terms, watched, tangents, clock):
        self._active_cells, self._comm, self.terms = active_cells, active_cells.comm, terms
        self._watched = [n for n, term in enumerate(terms) if term in watched]
        self._tangents, self._clock = tangents, clock
        self._R = np.empty((len(active_cells.node), active_cells.dim))
        self.remember(np.zeros(len(active_cells.node)))

    def remember(self, mass):
        """The tangent is that of nodes with this ``mass`` [kg], shape (nodes,), in ``mass_then``."""
        self.mass_then = mass

    def begin(self, grid, known):
        """A step from the state ``grid`` of the nodes."""
        self._grid, self.known = grid, known

    @property
    def lumped(self):
        """Whether all of the inertia is: where a ghost penalty has a part in it, it is consistent."""
        return self.known.lumped is not None and not any(isinstance(term, Ghost) for term in self.terms)

    def gained_inertia(self):
        """What the rows of this rank's nodes [N/m], shape (owned,), have gained since the tangent was made:
        alpha times mass, which inertia adds up to in each column, lumped or not."""
        grid, n = self._grid, self._active_cells.owned
        alpha = grid.rule.alpha(grid.dt) if grid.dt > 0.0 else 0.0  # none in load steps
        return alpha * (grid.mass - self.mass_then)[:n]

    def increment(self, u):
        """Of all local nodes at the displacement u, shape (owned, D) [m]."""
        grid, u = self._grid, self._active_cells.with_ghosts(u)
        a = grid.rule.acceleration(u, grid.v, grid.a, grid.dt)
        return Increment(grid.dt, grid.rule.alpha(grid.dt), u, a)

    def first_trial(self, u):
        """For a tangent before the first residual: the bodies as they are, the springs at the guess u,
        (owned, D)."""
        increment = self.increment(u)
        return Trial(u, increment, [term.first_trial(self._grid, increment) for term in self.terms])

    def residual(self, u, r):
        """Eq. 11 [N] into r at the displacement u, both (owned, D). Returns the trial."""
        self._clock.lap("solve")
        n, increment, (load, known, idle, lumped) = self._active_cells.owned, self.increment(u), self.known
        self._R[:] = 0.0
        trial = Trial(u, increment, [term.residual(self._grid, increment, self._R) for term in self.terms])
        self._active_cells.accumulate(self._R)
        r[:] = self._R[:n] - load[:n]
        if lumped is not None:
            r += lumped[:n, None] * increment.a[:n]
        r[idle] = self._tangents.now.idle_scale * (u - known[:n])[idle]
        self._clock.lap("residual")
        return trial

    def failing(self, trial):
        """The first point of this rank without a stress in ``trial``, a ``NoStress``, or None."""
        return find_failing(self.terms, trial.of_terms, self._active_cells.origin)

    def imbalance(self, trial):
        """Forces [N], shape (owned, D), that the last residual, that of ``trial``, leaves to the supports and
        to nodes without mass; of the other unknowns, what Newton's method has left."""
        n, (load, _, _, lumped) = self._active_cells.owned, self.known
        left = self._R[:n] - load[:n]
        return left if lumped is None else left + lumped[:n, None] * trial.increment.a[:n]

    def tangent(self, trial):
        """Eq. 10 at ``trial`` into the matrix of the active cells. Returns what is known of it, a
        ``Tangent``."""
        self._clock.lap("solve")
        cells, grid, n = self._active_cells, self._grid, self._active_cells.owned
        self.remember(grid.mass.copy())
        cells.clear()
        for term, of_term in zip(self.terms, trial.of_terms):
            term.tangent(grid, of_term)
        alpha = trial.increment.alpha
        mass, nodes = total(self._comm, [grid.mass[:n].sum(), np.count_nonzero(grid.mass[:n])])
        idle_scale = alpha * mass / nodes  # idle rows of the size of the others keep the matrix well scaled
        lumped = np.zeros(n) if self.known.lumped is None else self.known.lumped[:n]
        cells.fill_matrix(np.where(self.known.idle, idle_scale, alpha * lumped[:, None]))
        inertia = alpha * grid.mass[:n, None]
        stiffness = cells.matrix.getDiagonal().array.reshape(n, cells.dim) - inertia
        stiffness2 = float(np.sum(stiffness[~self.known.idle] ** 2))
        norms = total(self._comm, [stiffness2, np.sum(inertia**2) * cells.dim])
        self._clock.lap("tangent")
        return Tangent(grid.dt, idle_scale, stiffness2, float(np.sqrt(norms[0] / norms[1])))

    def switched(self, trial):
        """Whether a spring, on any rank, has taken another branch of its law in ``trial`` than in the last
        tangent."""
        return bool(self._watched) and somewhere(
            self._comm, any(self.terms[n].switched(trial.of_terms[n]) for n in self._watched))[0]
