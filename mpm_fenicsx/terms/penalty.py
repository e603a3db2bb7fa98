"""Boundary particles with springs: ``Penalty`` records of a scene on this rank."""
import numpy as np

import mpm_dem_checks as check

from ..compiled import specialise
from ..points.moments import wrenches
from ..points.points import Points
from .soil_distance import SoilDistance
from .springs import (
    AHEAD,
    CLOSED,
    LEAD,
    STICK,
    Answer,
    Springs,
    respond,
    spend,
    spring_matrix,
    tangent,
    weigh,
)

HALF = 0.5 - 1e-9  # share of its basis on nodes with mass from which a particle in space touches the body
# Mass of a node, over that of a full cell, below which it takes no part: one that the body has just reached
# would fly off and come back with the springs on and off, and Newton's method with it.
LIGHT = 0.01
STICKS = 1e30  # normal force [N] at which friction holds whatever comes


def has_kinks(penalty):
    """Whether the force of a ``Penalty`` is not smooth."""
    return penalty.separates or (penalty.normal is not None and 0.0 < penalty.friction < np.inf)


def walls_in_reach(penalties, background):
    """Mask of the local cells that may hold particles of walls; None, on all ranks, where there are no
    springs."""
    springs = [penalty for penalty in penalties if penalty.points is not None]  # else on material points
    walls = [penalty for penalty in springs if not penalty.follows]
    if not springs:
        return None
    mask = np.full(len(background.cells), any(wall.moves for wall in walls))
    for wall in walls:
        mask[wall.points.cell] = True
    return mask


class Penalties:
    """The ``Penalty`` records of a scene that all follow the body, or all do not, as a term of a step.
    ``points``: their particles on this rank with force [N] on the body, gap [m] at the end of the step and
    status in the tangent in use."""

    cell_names = ()  # of force cells: only structures have some

    def __init__(self, penalties, stiffnesses, start, background):
        """stiffnesses: of the springs, one array per penalty [N/m]; start: the bodies, see
        ``bodies.Start``."""
        self.penalties, self.follows = tuple(penalties), penalties[0].follows
        counts = [len(p.surface.x) for p in penalties]
        ends = np.cumsum(counts)
        self._of_penalty = [slice(end - n, end) for end, n in zip(ends, counts)]
        self._dim, self.count, h = background.dim, int(ends[-1]), background.h.max()
        repeated = lambda values, kind=float: np.repeat(np.array(values, kind), counts)  # noqa: E731
        self._start = np.concatenate([np.asarray(p.surface.x, float) for p in penalties])
        self._normal = np.concatenate([np.zeros(np.shape(p.surface.x)) if p.normal is None else p.normal
                                       for p in penalties])
        self._friction = repeated([np.inf if p.normal is None else p.friction for p in penalties])
        self._separates = repeated([p.separates for p in penalties], bool)
        self._stiffness = np.concatenate(stiffnesses)
        self.kinks = any(has_kinks(p) for p in penalties)
        self.moves = any(p.motion is not None for p in penalties)
        self.names = np.repeat([p.name for p in penalties], counts)
        self.points = self._make_points(start)
        if not self.follows:
            self.points.field = start.only_field
        measured = self._separates if not self.follows else np.zeros(self.count, bool)
        self._away = np.where(measured[:, None], h * self._normal, 0.0)  # gap where there is no soil
        self._distance = SoilDistance(h, measured, self._normal, self._start) if measured.any() else None
        size = dict(D=self._dim, K=background.cells.shape[1])
        self._weigh, self._respond = specialise(weigh, K=size["K"]), specialise(respond, **size)
        self._tangent = specialise(tangent, **size, spring_matrix=specialise(spring_matrix, D=self._dim))

    def _make_points(self, start):
        n, x = self.count, self._start.copy()
        gap = np.zeros_like(x)
        for penalty, own in zip(self.penalties, self._of_penalty):
            if penalty.at is not None:
                distance = np.sum((x[own] - penalty.at) * penalty.normal, axis=1)
                gap[own] = distance[:, None] * penalty.normal
        return Points(gid=np.arange(n), cell=np.zeros(n, np.int32), x=x, v=start.velocity(x),
                      a=start.acceleration(x), force=np.zeros_like(x), gap=gap, status=np.zeros(n, np.int8),
                      **(start.field(x) if self.follows else {}))

    def _motion(self, time):
        """Displacement of what holds [m] since the start, shape (count, D)."""
        w = np.zeros_like(self._start)
        for penalty, own in zip(self.penalties, self._of_penalty):
            if penalty.motion is not None:
                what = f"the motion of {penalty.name} at t = {time:.6g} s"
                w[own] = check.values(what, penalty.motion, (time,), (self._dim,), w[own].shape, unit="m")
        return w

    # ---------------------------------------------------------------- one step, see ``grid_state``

    def locate(self, grid):
        """Basis at the particles in active cells, on nodes that are not light. Returns the first particle
        that has lost its body, or -1."""
        p, cells = self.points, grid.active_cells
        index = np.flatnonzero(cells.row[p.cell] >= 0)
        self._cell, share = p.cell[index], np.empty(len(index))
        n, K = len(index), cells.cells.shape[1]
        self._N, G = np.empty((n, K)), np.empty((n, self._dim, K))
        grid.shapes(self._cell, p.x[index], self._N, G)
        self._weigh(self._cell, cells.cells, grid.mass > LIGHT * grid.full_mass, self._N, share)
        self._index, self._on = index, share > 0.0 if self.follows else share >= HALF
        return index[np.argmin(self._on)] if self.follows and not self._on.all() else -1

    def begin(self, grid, load):
        """Gap and velocity at the start of the step, and what the walls will do in it. There is no load."""
        p, gid = self.points, self._take_those_in_contact()
        if self._distance:
            self._come_near(grid, gid)
        velocity = np.zeros((len(gid), self._dim))
        grid.kernels.interpolate(self._cell, grid.active_cells.cells, self._N, grid.v, velocity)
        base = p.gap[self._index] - AHEAD * grid.dt * velocity
        self._wall = 0.0
        if self.moves:
            before, half, now = (self._motion(grid.time + k * grid.dt)[gid] for k in (0.0, 0.5, 1.0))
            self._wall = now - before
            at_end = before - 4.0 * half + 3.0 * now  # its velocity at the end, times dt
            base -= self._wall + AHEAD * at_end
        normal, stiffness, limit = self._normal[gid], self._stiffness[gid], self._friction[gid]
        separates, pressed = self._separates[gid], np.sum(p.force[self._index] * normal, axis=1)
        limit[separates & (pressed <= 0.0)] = 0.0
        rubs = np.isfinite(limit)
        limit[rubs] *= np.maximum(pressed[rubs], 0.0) / stiffness[rubs]
        lead = LEAD if grid.dt > 0.0 else 1.0
        self._springs = Springs(base, normal, stiffness, limit, separates, lead)
        self._answer = Answer(np.empty_like(base), np.zeros_like(base), np.empty(len(gid), np.int8))

    def expect(self, growth):
        """Before ``begin`` of a load step without inertia: friction is that of normal forces that have grown
        by this factor since the last one. None: they begin to grow, and friction sticks."""
        if growth is None:
            self.points.force[:] = STICKS * self._normal[self.points.gid]
        else:
            self.points.force *= growth

    def _take_those_in_contact(self):
        """Keep in contact who has material near, let the others forget; returns the gid of the former."""
        p, on, self._some_left = self.points, self._on, False
        if not (self.follows and on.all()):
            self._cell, self._N, self._index = self._cell[on], self._N[on], self._index[on]
            off = np.ones(len(p), bool)
            off[self._index] = False
            self._some_left = bool(p.status[off].any())
            p.force[off] = 0.0
            p.gap[off] = self._away[p.gid[off]]
            p.status[off] = 0
        return p.gid[self._index]

    def _come_near(self, grid, gid):
        """No gap is wider than the soil that is there now leaves it, whichever soil opened it."""
        gap, normal = self.points.gap[self._index], self._normal[gid]
        bodies = [body for body in grid.bodies if body.field == self.points.field]
        nearest = self._distance(bodies, grid.active_cells.comm)[gid]
        along = np.sum(gap * normal, axis=1)
        arrived = along >= 0.999 * np.linalg.norm(self._away[gid], axis=1)
        least = np.maximum(np.where(arrived, nearest[:, 1], nearest[:, 0]), 0.0)
        excess = np.where(self._separates[gid], np.maximum(along - least, 0.0), 0.0)
        self.points.gap[self._index] = gap - excess[:, None] * normal

    def accelerate(self, grid, jump):
        """The share of particles that follow the body in a ``jump`` of the nodes' acceleration [m/s^2],
        (nodes, D)."""
        grid.kernels.interpolate(self.points.cell, grid.active_cells.cells, self._N, jump, self.points.a)

    def first_trial(self, grid, increment):
        """Gap, force and status of the springs at the increment, an ``Answer``."""
        self._respond(self._cell, grid.active_cells.cells, self._N, increment.u, self._springs, self._answer)
        return self._answer

    def residual(self, grid, increment, R):
        """Subtract the forces [N] from R, shape (nodes, D). Returns the ``Answer`` of the springs."""
        answer = self.first_trial(grid, increment)
        self.spread(grid, answer, R)
        return answer

    def spread(self, grid, answer, R):
        """Subtract the forces of the ``answer`` [N] from R, shape (nodes, D)."""
        grid.kernels.spread(self._cell, grid.active_cells.cells, self._N, -answer.force, R)

    def stored(self):
        """Energy in the springs of this rank [J]."""
        return 0.5 * np.sum(self.points.force**2 / self._stiffness[self.points.gid, None])

    def held(self):
        """Force [N] and moment about the origin [N m] on the body at the end of the last step by name, this
        rank's share, shape (D + 1,) in a plane, (6,) in space."""
        rows, names = wrenches(self.points.x, self.points.force), self.names[self.points.gid]
        return {penalty.name: rows[names == penalty.name].sum(axis=0) for penalty in self.penalties}

    def switched(self, answer):
        """Whether a particle of this rank sticks, slides or has separated otherwise than in the tangent."""
        return self._some_left or not np.array_equal(answer.status, self.points.status[self._index])

    def tangent(self, grid, answer):
        """Add the springs to the matrix."""
        self.points.status[self._index], self._some_left = answer.status, False
        grid.active_cells.add_in_cells(self._cell, lambda row, matrices: self._tangent(
            self._cell, row, self._N, self._springs, answer, matrices))

    def finish(self, grid, answer, increment):
        """Keep forces and gaps; particles that follow the body move with the nodes."""
        p, cells, index, (_, force, status) = self.points, grid.active_cells.cells, self._index, answer
        normal, stiffness = self._springs.normal, self._springs.stiffness
        moved = p.gap[index] - self._wall
        grid.kernels.interpolate(self._cell, cells, self._N, increment.u, moved)
        self.spent = spend(self._springs, p.force[index], force, moved - p.gap[index], self._wall)
        along = lambda vectors: np.sum(vectors * normal, axis=1)[:, None] * normal
        spring = np.where(status[:, None] % CLOSED == STICK, moved, -force / stiffness[:, None])
        p.gap[index] = along(moved) + spring - along(spring)
        p.force[index] = force
        if self.follows:
            grid.kernels.to_points(p.cell, cells, self._N, increment, p.x, p.v, p.a)

    def move(self, time):
        """Take particles that do not follow the body to their places at ``time`` [s]."""
        if self.moves and not self.follows:
            x = self._start + self._motion(time)
            self.points.x[:] = x[self.points.gid]
            if self._distance:
                self._distance.place(x)
