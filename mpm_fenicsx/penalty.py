"""Boundary particles with springs: the ``Penalty`` and ``GridWall`` records of a scene on this rank."""
import numpy as np

from . import laws
from .conditions import GridWall
from .points import Points
from .specialise import specialise
from .springs import AHEAD, CLOSED, STICK, respond, spring_matrix, tangent, weigh
from .surface import areas

# Stiffness of the springs over that of one cell of the body. Those of a support give by 1 % of a cell's strain. A wall
# with friction or separation gives as much as one more cell would: with 100, neighbours in one cell fight each other,
# friction without separation is too large by 10 to 80 % and Newton's method fails (measured on a sliding block).
SUPPORT_FACTOR, WALL_FACTOR = 100.0, 1.0
HALF = 0.5  # share of its basis on nodes with mass from which a particle in space touches the body
# Mass of a node, over that of a full cell, below which it takes no part: one that the body has just reached would fly
# off and come back with the springs on and off, and Newton's method with it.
LIGHT = 0.01


def modulus(law, dim):
    """Stiffness [Pa] of the law at rest against stretch in one direction with the others held."""
    P, A = np.zeros(dim * dim + 1), np.zeros((dim * dim + 1, dim * dim + 1))
    old, new = np.zeros(2, law.state)
    laws.kernels(law, dim)[1](law.params, np.eye(dim), 1.0, old, new, P, A)
    return A[0, 0]


def make_penalties(scene, background, start):
    """``Penalties`` of a scene, those in space and those that follow the body apart, as a tuple of none to two.

    scene: ``Penalty`` and ``GridWall`` records; start: the bodies, see ``parts.Start``. Raises ValueError for a surface
    of another dimension.
    """
    if not scene:
        return ()
    D, groups, h = background.dim, {False: [], True: []}, background.h.min()
    for condition in scene:
        if isinstance(condition, GridWall):
            condition = condition.penalty(background.whole[0])
        if np.shape(condition.surface.x)[1] != D:
            raise ValueError(f"the surface of {condition.name} has {np.shape(condition.surface.x)[1]} dimensions, the "
                             f"scene {D}")
        area = areas(np.asarray(condition.surface.x, float), np.asarray(condition.surface.elements))
        area[area == 0.0] = h ** (D - 1)  # a particle without elements stands for a node
        groups[condition.follows].append((condition, area * start.thickness))
    size = dict(D=D, K=background.cells.shape[1])
    return tuple(Penalties(*zip(*group), size, h, start)
                 for group in groups.values() if group)


def reaction(penalties, name):
    """Force of the penalties of that name on the body, this rank's share [N]; raises ValueError for an unknown name."""
    names = sorted({str(other) for held in penalties for other in held.names})
    if name not in names:
        raise ValueError(f"there is no penalty {name!r}: choose one of {', '.join(names) or 'none'}")
    return sum(held.points.force[held.names[held.points.gid] == name].sum(axis=0) for held in penalties)


def _has_kinks(penalty):
    return penalty.separates or (penalty.normal is not None and 0.0 < penalty.friction < np.inf)


def _stiffness(penalty, h, start):
    """Of the springs per area [Pa/m], shape (n,); by default that of the nearest body."""
    x = np.asarray(penalty.surface.x, float)
    if penalty.stiffness is not None:
        return np.full(len(x), penalty.stiffness)
    factor = WALL_FACTOR if _has_kinks(penalty) else SUPPORT_FACTOR
    return factor * start.modulus(x, modulus) / h


class Penalties:
    """The ``Penalty`` records of a scene that all follow the body, or all do not. ``points``: their particles on this
    rank with force [N] on the body, gap [m] at the end of the step and status in the tangent in use."""

    def __init__(self, penalties, areas, size, h, start):
        """areas: one array per penalty [m^2]; size: dict of D and K; h: smallest cell size [m]; start: the bodies,
        see ``parts.Start``."""
        self.penalties, self.follows = tuple(penalties), penalties[0].follows
        counts = [len(p.surface.x) for p in penalties]
        ends = np.cumsum(counts)
        self._parts = [slice(end - n, end) for end, n in zip(ends, counts)]
        self._dim, self.count = size["D"], int(ends[-1])
        repeated = lambda values, kind=float: np.repeat(np.array(values, kind), counts)  # noqa: E731
        self._start = np.concatenate([np.asarray(p.surface.x, float) for p in penalties])
        self._normal = np.concatenate([np.zeros(np.shape(p.surface.x)) if p.normal is None else p.normal
                                       for p in penalties])
        self._friction = repeated([np.inf if p.normal is None else p.friction for p in penalties])
        self._separates = repeated([p.separates for p in penalties], bool)
        self._stiffness = np.concatenate(areas) * np.concatenate([_stiffness(p, h, start) for p in penalties])
        self.kinks = any(_has_kinks(p) for p in penalties)
        self.moves = any(p.motion is not None for p in penalties)
        self.names = np.repeat([p.name for p in penalties], counts)
        self.points = self._make_points(start)
        self._weigh, self._respond = specialise(weigh, K=size["K"]), specialise(respond, **size)
        self._tangent = specialise(tangent, **size, spring_matrix=specialise(spring_matrix, D=size["D"]))

    def _make_points(self, start):
        n, x = self.count, self._start.copy()
        gap = np.zeros_like(x)
        for penalty, part in zip(self.penalties, self._parts):
            self._check_motion(penalty, part)
            if penalty.at is not None:
                distance = np.sum((x[part] - penalty.at) * penalty.normal, axis=1)
                gap[part] = distance[:, None] * penalty.normal
        return Points(gid=np.arange(n), cell=np.zeros(n, np.int32), x=x, v=start.velocity(x),
                      a=start.acceleration(x), force=np.zeros_like(x), gap=gap, status=np.zeros(n, np.int8))

    def _check_motion(self, penalty, part):
        if penalty.motion is None:
            return
        start = np.asarray(penalty.motion(0.0), float)
        if start.shape not in ((self._dim,), self._start[part].shape) or start.any():
            raise ValueError(f"the motion of {penalty.name} at t = 0 is {start.tolist()} m: it must have shape "
                             f"({self._dim},) or {self._start[part].shape} and start from zero")

    def _motion(self, time):
        """Displacement of what holds [m] since the start, shape (n, D), on this rank's particles."""
        w = np.zeros_like(self._start)
        for penalty, part in zip(self.penalties, self._parts):
            if penalty.motion is not None:
                w[part] = penalty.motion(time)
        return w[self.points.gid]

    # ---------------------------------------------------------------- one step

    def locate(self, step):
        """Basis at the particles in covered cells; returns the first particle that has lost its body, or -1."""
        p, cover = self.points, step.cover
        index = np.flatnonzero(cover.slot[p.cell] >= 0)
        self._cell, share = p.cell[index], np.empty(len(index))
        n, K = len(index), cover.cells.shape[1]
        self.N, G = np.empty((n, K)), np.empty((n, K, self._dim))
        step.shapes(self._cell, p.x[index], self.N, G)
        self._weigh(self._cell, cover.cells, step.mass > LIGHT * step.cell_mass, self.N, share)
        self._index, self._on = index, share > 0.0 if self.follows else share >= HALF
        return index[np.argmin(self._on)] if self.follows and not self._on.all() else -1

    def begin(self, step, time):
        """Gap and velocity at the start of the step, and what the walls will do in it."""
        p, cover, gid = self.points, step.cover, self._take_those_in_contact()
        velocity = np.zeros((len(gid), self._dim))
        step.kernels.interpolate(self._cell, cover.cells, self.N, step.v, velocity)
        self._base = p.gap[self._index] - AHEAD * step.dt * velocity
        self._wall = 0.0
        if self.moves:
            before, now, after = (self._motion(time + k * step.dt)[self._index] for k in (0, 1, 2))
            self._wall = now - before
            self._base -= self._wall + 0.5 * AHEAD * (after - before)
        normal, stiffness, limit = self._normal[gid], self._stiffness[gid], self._friction[gid]
        separates, pressed = self._separates[gid], np.sum(p.force[self._index] * normal, axis=1)
        limit[separates & (pressed <= 0.0)] = 0.0
        rubs = np.isfinite(limit)
        limit[rubs] *= np.maximum(pressed[rubs], 0.0) / stiffness[rubs]
        self._fixed = normal, stiffness, limit, separates
        self._gap, self._force = np.empty_like(self._base), np.zeros_like(self._base)
        self._status = np.empty(len(gid), np.int8)

    def _take_those_in_contact(self):
        """Keep in contact who has material near, let the others forget; returns the gid of the former."""
        p, on, self._some_left = self.points, self._on, False
        if not (self.follows and on.all()):
            self._cell, self.N, self._index = self._cell[on], self.N[on], self._index[on]
            off = np.ones(len(p), bool)
            off[self._index] = False
            self._some_left = bool(p.status[off].any())
            p.force[off] = 0.0
            p.gap[off] = 0.0
            p.status[off] = 0
        return p.gid[self._index]

    def respond(self, step, u):
        """Forces at the displacement u over the step [m], shape (nodes, D)."""
        self._respond(self._cell, step.cover.cells, self.N, u, self._base, *self._fixed, self._gap, self._force,
                      self._status)

    def residual(self, step, u, R):
        """Subtract the forces [N] from R, shape (nodes, D)."""
        self.respond(step, u)
        step.kernels.spread(self._cell, step.cover.cells, self.N, -self._force, R)

    def switched(self):
        """Whether a particle of this rank sticks, slides or has separated otherwise than in the tangent."""
        return self._some_left or not np.array_equal(self._status, self.points.status[self._index])

    def tangent(self, step):
        """Add the springs to the element matrices."""
        normal, stiffness, limit, _ = self._fixed
        self.points.status[self._index], self._some_left = self._status, False
        self._tangent(self._cell, step.cover.slot, self.N, normal, stiffness, limit, self._gap, self._status,
                      step.cover.element_matrices)

    def finish(self, step, u):
        """Keep forces and gaps at the displacement u [m], shape (nodes, D)."""
        p, cover, index = self.points, step.cover, self._index
        self.respond(step, u)
        normal, stiffness = self._fixed[:2]
        moved = p.gap[index] - self._wall
        step.kernels.interpolate(self._cell, cover.cells, self.N, u, moved)
        along = lambda vectors: np.sum(vectors * normal, axis=1)[:, None] * normal  # noqa: E731
        spring = np.where(self._status[:, None] % CLOSED == STICK, moved, -self._force / stiffness[:, None])
        p.gap[index] = along(moved) + spring - along(spring)
        p.force[index] = self._force

    def move(self, time):
        """Take particles that do not follow the body to their places at ``time`` [s]."""
        if self.moves and not self.follows:
            self.points.x[:] = self._start[self.points.gid] + self._motion(time)
