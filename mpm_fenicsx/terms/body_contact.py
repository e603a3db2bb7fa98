"""Contact of bodies in different fields of the grid: they push, rub, and part.

The material points of the softer body of two are its springs to the other, each with the area of its share.
Gap and normal are measured from the points of both, see ``meeting``: each is as thick as its share of the
body, so contact begins where bodies touch, not where they come to share nodes. A spring takes the weights w_i
of the linear basis at the foot of its point, on the nodes of its cell that both bodies reach, of which each
field has one in the same place, and pulls on both with equal and opposite forces:

    g = sum_i w_i (u_i - u'_i),     f_i = w_i f,     f'_i = -w_i f,

so momentum and, about any axis, its moment are kept, and the forces do the work that the gap tells. From the
moment a point touches, its gap is what this adds up, not what is measured anew: no step makes energy by a
measurement, and where that lies beside the sum by more than ``DRIFT`` the gap goes along. What arrives from
the side, deep in the other body, starts with no force. Springs, friction and their lead in time: see
``springs``."""
from typing import NamedTuple

import numpy as np

from mpm_dem_direct import direct

from ..compiled import specialise
from ..points.points import surface_shares
from ..points.transfer import interpolate, spread
from .meeting import Meetings
from .meeting_search import MeetingSearch
from .penalty import STICKS
from .springs import AHEAD, CLOSED, LEAD, STICK, Answer, Springs, respond, spend, spring_matrix, tangent

DRIFT = 0.25  # cells
TOUCH = 1e-7  # cells


class Other(NamedTuple):
    """What a body meets: those in a ``field``, with a coefficient of ``friction`` and springs with a
    ``stiffness`` per area [Pa/m]; ``name`` of the contact, ``sign`` of its force there."""

    field: int
    friction: float
    stiffness: float
    name: str
    sign: float


class BodyContact:
    """Contact of one ``body``, a term of a step, with the ``others``, a list of ``Other``, as a term (see
    ``grid_state``).

    Each of its points keeps, per field, force [N], gap along the surface and normal to it [m], status in the
    tangent in use, and by how much it reached into the other body at the start [m], where that was by
    intent."""

    follows, points, moves, kinks = False, None, False, True
    _sticks, cell_names = False, ()

    def __init__(self, body, others, background):
        self._body, self._dim, self._h = body, background.dim, background.h.max()
        self._others, self.names = others, [other.name for other in others]
        self.pairs = [(body.field, other.field) for other in others]
        self._friction = np.array([other.friction for other in others], float)
        p, n, W, D = body.points, len(body.points), len(others), self._dim
        self._stiffness = np.array([other.stiffness for other in others])
        area = surface_shares(p.V0, body.thickness, D)
        p.add(meet_stiffness=self._stiffness * area[:, None], meet_force=np.zeros((n, W, D)),
              meet_gap=np.zeros((n, W, D)), meet_normal=np.full((n, W), np.inf),
              meet_status=np.zeros((n, W), np.int8), meet_sunk=np.full((n, W), np.nan))
        self._search = MeetingSearch(body, background)
        self._compile(background)

    def enter(self, body, chosen, gravity):
        """The points ``chosen`` of a ``body`` are new: they get springs like the others, and met nothing
        before."""
        if body is self._body:
            p, area = body.points, surface_shares(body.points.V0[chosen], body.thickness, self._dim)
            p.meet_stiffness[chosen] = area[:, None] * self._stiffness
            p.meet_normal[chosen], p.meet_sunk[chosen] = np.inf, np.nan

    def _compile(self, background):
        D, K = self._dim, background.cells.shape[1]
        both = dict(D=D, K=2 * K)
        self._respond = direct(specialise(respond, **both))
        self._follow, self._spread = (specialise(kernel, **both) for kernel in (interpolate, spread))
        self._tangent = direct(specialise(tangent, **both, spring_matrix=specialise(spring_matrix, D=D)))

    # ---------------------------------------------------------------- one step, see ``grid_state``

    def locate(self, grid):
        """Nothing: the points are in their cells. Returns -1, as no point can lose its body."""
        return -1

    def expect(self, growth):
        """See ``penalty.Penalties.expect``."""
        self._sticks = growth is None
        self._body.points.meet_force *= growth or 0.0

    def begin(self, grid, load):
        """Where the bodies meet, and what the springs will do in the step. There is no load."""
        K = grid.active_cells.cells.shape[1]
        none = (Meetings(np.zeros(0, int), np.zeros((0, 2 * K)), np.zeros((0, self._dim)), np.zeros(0)),
                np.zeros(0, np.int32))
        parts = [self._search(grid, other.field) or none for other in self._others]
        number = np.repeat(np.arange(len(parts)), [len(part.gap) for part, _ in parts])
        found = Meetings(*(np.concatenate(values) for values in zip(*(part for part, _ in parts))))
        self._pair, self._weights = np.concatenate([pair for _, pair in parts]), found.weights
        self._index, normal, p = (found.point, number), found.normal, self._body.points
        self._forget_others()
        rub, force = p.meet_gap[self._index], p.meet_force[self._index]
        gap = self._gap(found.gap)
        self._start = gap[:, None] * normal
        self._start += rub - np.sum(rub * normal, axis=1)[:, None] * normal
        velocity = np.zeros_like(normal)
        self._follow(self._pair, grid.active_cells.pairs.nodes, self._weights, grid.v, velocity)
        base = self._start - AHEAD * grid.dt * velocity
        if grid.dt == 0.0:  # without inertia, bodies that touch hold each other from the first guess on
            base -= TOUCH * self._h * normal
        pressed, stiffness = np.sum(force * normal, axis=1), p.meet_stiffness[self._index]
        if self._sticks:
            pressed, self._sticks = np.where(gap <= TOUCH * self._h, STICKS, 0.0), False
        limit = np.where(pressed > 0.0, self._friction[number], 0.0) * pressed / stiffness
        self._springs = Springs(base, normal, stiffness, limit, np.ones(len(limit), bool),
                                LEAD if grid.dt > 0.0 else 1.0)
        self._answer = Answer(np.empty_like(base), np.zeros_like(base), np.empty(len(limit), np.int8))

    def _gap(self, measured):
        """Normal gaps at the start of the step [m] from those ``measured``, shape (m,)."""
        p, index = self._body.points, self._index
        new = np.isnan(p.meet_sunk)
        if new.any():  # the first step
            p.meet_sunk[index] = np.where(new[index], np.maximum(-measured, 0.0), p.meet_sunk[index])
            p.meet_sunk[np.isnan(p.meet_sunk)] = 0.0
        measured = measured + p.meet_sunk[index]
        kept, drift = p.meet_normal[index], DRIFT * self._h
        return np.where(kept < 0.0, np.clip(kept, measured - drift, measured + drift),
                        np.maximum(measured, 0.0))

    def _forget_others(self):
        """Points that are near no other body have neither force nor gap there."""
        p = self._body.points
        off = np.ones(p.meet_status.shape, bool)
        off[self._index] = False
        self._some_left = bool(p.meet_status[off].any())
        p.meet_force[off], p.meet_gap[off], p.meet_status[off], p.meet_normal[off] = 0.0, 0.0, 0, np.inf

    def first_trial(self, grid, increment):
        """Gap, force and status of the springs at the increment, an ``Answer``."""
        self._respond(self._pair, grid.active_cells.pairs.nodes, self._weights, increment.u, self._springs,
                      self._answer)
        return self._answer

    def residual(self, grid, increment, R):
        """Subtract the forces [N] from R, shape (nodes, D). Returns the ``Answer`` of the springs."""
        answer = self.first_trial(grid, increment)
        self.spread(grid, answer, R)
        return answer

    def spread(self, grid, answer, R):
        """Subtract the forces of the ``answer`` [N] from R, shape (nodes, D)."""
        self._spread(self._pair, grid.active_cells.pairs.nodes, self._weights, -answer.force, R)

    def springs_now(self, grid):
        """The material points of the body; of the springs in this step the numbers of their points, shape
        (m,), the nodes on which they pull and the weights of these, (m, 2K) each, see ``Meetings``."""
        return self._body.points, self._index[0], grid.active_cells.pairs.nodes[self._pair], self._weights

    def switched(self, answer):
        """Whether a point of this rank sticks, slides or has separated otherwise than in the tangent."""
        kept = self._body.points.meet_status[self._index]
        return self._some_left or not np.array_equal(answer.status, kept)

    def tangent(self, grid, answer):
        """Add the springs to the matrices of the pairs of cells."""
        self._body.points.meet_status[self._index], self._some_left = answer.status, False
        matrices = grid.active_cells.pair_matrices
        self._tangent(self._pair, np.arange(len(matrices)), self._weights, self._springs, answer, matrices)

    def finish(self, grid, answer, increment):
        """Keep forces and gaps."""
        p, (_, force, status), springs = self._body.points, answer, self._springs
        along = lambda vectors: np.sum(vectors * springs.normal, axis=1)  # noqa: E731
        moved = np.zeros_like(force)
        self._follow(self._pair, grid.active_cells.pairs.nodes, self._weights, increment.u, moved)
        self.spent = spend(springs, p.meet_force[self._index], force, moved)
        moved += self._start
        gap = np.where(status[:, None] % CLOSED == STICK, moved, -force / springs.stiffness[:, None])
        p.meet_normal[self._index] = along(moved)
        p.meet_gap[self._index] = gap - along(gap)[:, None] * springs.normal
        p.meet_force[self._index] = force

    def move(self, time):
        """Nothing: the bodies move by themselves."""

    def stored(self):
        """Energy in the springs of this rank [J]."""
        p = self._body.points
        return 0.5 * np.sum(p.meet_force**2 / p.meet_stiffness[..., None])

    def held(self):
        """Nothing: what bodies give to each other is zero in sum."""
        return {}

    def reaction(self, name):
        """Force of the second on the first of the bodies of that name, by this rank's points [N], shape
        (D,)."""
        return sum((other.sign * self._body.points.meet_force[:, w].sum(axis=0)
                    for w, other in enumerate(self._others) if other.name == name), np.zeros(self._dim))
