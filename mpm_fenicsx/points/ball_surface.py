"""An interface of material points: which of them take part in a window, and what is asked of these."""
from typing import NamedTuple

import numpy as np

from ..collective import total
from ..scene.balls import Balls
from ..scene.interface import Interface
from .boundary_particles import BoundaryParticles
from .near import FAR, TOUCHABLE, Particles, Reach, find_near

SPARE = 64  # so many and twice those that are near may be chosen, then there is a new choice
LOADED = 1e-10  # of the largest force: what carries less may go, and its force acts on the next one


class BallChange(NamedTuple):
    """From a choice of m points to one of n, ``x`` [m], shape (n, D); elements: (n, 1). ``was``: number that
    each had, -1 of those that are new, shape (n,); new_velocity [m/s], shape (n, D): of these, zero of
    others. x_before [m], (m, D)."""

    x: np.ndarray
    elements: np.ndarray
    was: np.ndarray
    new_velocity: np.ndarray
    x_before: np.ndarray

    keeps_numbers = False

    def interpolate(self, values):
        """Values at the points, shape (n, …), of those before, shape (m, …); zero at those that are new."""
        out, stays = np.zeros((len(self.was), *values.shape[1:])), self.was >= 0
        out[stays] = values[self.was[stays]]
        return out

    def redistribute(self, loads):
        """Loads, shape (n, …), of those before, (m, …): the sum stays, as the nearest point takes what a
        point has that is no longer there."""
        out, gone = self.interpolate(loads), np.ones(len(loads), bool)
        gone[self.was[self.was >= 0]] = False
        for i in np.flatnonzero(gone & loads.any(axis=1)):
            out[np.argmin(((self.x - self.x_before[i])**2).sum(axis=1))] += loads[i]
        return out


class BallSurface(BoundaryParticles):
    """``Balls`` of the material points of ``bodies``, terms with points. There are no particles besides
    these: places and velocities are theirs, and forces reach their nodes, see ``ball_forces``. ``numbers``:
    of the points that take part, rising, shape (n,), alike on every rank, as is ``force``, the last one on
    them [N], shape (n, D). ``own``: for each body which of these are its points here: their places among
    ``numbers``, and among its points. Collective."""

    def __init__(self, comm, dim, balls, start, bodies):
        super().__init__(comm, dim, Interface(np.zeros((0, dim)), np.zeros((0, 1), int)), start)
        chosen = range(len(bodies)) if balls.bodies is None else balls.bodies
        self._bodies = [body if n in chosen else None for n, body in enumerate(bodies)]
        self.radius, self.numbers = balls.radius, np.zeros(0, np.int64)
        self.force, self._last = np.zeros((2, 0, dim))
        self._coming = self.force
        self.attach()

    def names(self):
        """What it is, for the fingerprint of the scene."""
        chosen = [n for n, body in enumerate(self._bodies) if body is not None]
        return [("balls", self.radius, chosen)]

    # ---------------------------------------------------------------- what is asked in a window

    def attach(self):
        """Where the points are; needed whenever they, or their number on a rank, change."""
        self.own = []
        for body in self._bodies:
            rows = at = np.zeros(0, np.int64)
            if body is not None and len(body.points):
                gid = body.points.gid
                at = np.minimum(np.searchsorted(gid, self.numbers), len(gid) - 1)
                rows = np.flatnonzero(gid[at] == self.numbers)
                at = at[rows]
            self.own.append((rows, at))
        self._rows = self._number = np.concatenate([rows for rows, _ in self.own])
        if self._comm.size > 1:
            everybody = self._comm.allgather(self._rows)
            self._number = np.concatenate(everybody)
            self._counts = np.array([len(part) for part in everybody])
            self._count_bytes(self._number.nbytes, self._rows.nbytes)

    def share(self, force):
        """Of the ``force`` on all, shape (n, D), which is the coming one, that on this rank's points, body
        after body."""
        self._coming = force
        return force[self._rows]

    def begin(self):
        """The coming force acts from now on."""
        self.force = np.array(self._coming)

    @property
    def own_force(self):
        """The last one on this rank's points [N]."""
        return self.force[self._rows]

    def gather(self, *names):
        """Fields x, v or a of shape (n, D) of all that take part, the same on every rank. What has left the
        grid stays where it was seen last, at rest."""
        mine = np.hstack([np.concatenate([getattr(body.points, name)[at] for body, (_, at) in
                                          zip(self._bodies, self.own) if body is not None])
                          for name in names])
        ordered = np.zeros((len(self.numbers), mine.shape[1]))
        if "x" in names:
            k = self._dim * names.index("x")
            ordered[:, k:k + self._dim] = self._last
        if self._comm.size > 1:
            parts = np.empty((len(self._number), mine.shape[1]))
            self._comm.Allgatherv(mine, [parts, self._counts * mine.shape[1]])
            self._count_bytes(parts.nbytes, mine.nbytes)
            ordered[self._number] = parts
        else:
            ordered[self._rows] = mine
        fields = [ordered[:, k:k + self._dim].copy() for k in range(0, ordered.shape[1], self._dim)]
        if "x" in names:
            self._last = fields[names.index("x")].copy()
        return fields

    def gather_values(self, values):
        """Values of this rank's points, of all on every rank; infinite for what has left the grid."""
        whole = np.full(len(self.numbers), np.inf)
        whole[self._number] = np.concatenate(self._comm.allgather(values)) if self._comm.size > 1 else values
        return whole

    # ---------------------------------------------------------------- between windows

    def select(self, particles, dt):
        """Choose anew which points take part in windows of ``dt`` [s] where ``particles``, alike on every
        rank, have come near others, far more are chosen than are near, or some have left the grid. Returns
        the ``BallChange``, or None."""
        marks = [np.zeros(0, np.int8) if body is None else
                 find_near(body.points.x, body.points.v, particles, Reach(self.radius, dt))
                 for body in self._bodies]
        near = [np.flatnonzero(mark != FAR) for mark in marks]
        missing = 0
        for mark, (_, at) in zip(marks, self.own):
            missing += np.count_nonzero(mark == TOUCHABLE) - np.count_nonzero(mark[at] == TOUCHABLE)
        missing, count = total(self._comm, [missing, sum(map(len, near))])
        if not missing and len(self._number) == len(self.numbers) <= 2 * count + SPARE:
            return None
        mine = np.concatenate([body.points.gid[here] for body, here in zip(self._bodies, near)
                               if body is not None])
        return self._choose(mine)

    def _choose(self, mine):
        """Those that are near, ``mine`` on this rank, and those in the grid that carry a force; of none the
        first one stays, for what the loop still has to give to it."""
        if self._comm.size > 1:
            near = np.concatenate(self._comm.allgather(mine))
            self._count_bytes(near.nbytes, mine.nbytes)
        else:
            near = mine
        size = np.sqrt((self.force**2).sum(axis=1))
        there = np.zeros(len(self.numbers), bool)
        there[self._number] = True
        loaded = self.numbers[there & (size > LOADED * size.max(initial=0.0))]
        numbers, before = np.union1d(near, loaded), self.numbers
        numbers = numbers if len(numbers) else before[:1]
        if np.array_equal(numbers, before):
            return None
        was = np.full(len(numbers), -1)
        if len(before):
            at = np.minimum(np.searchsorted(before, numbers), len(before) - 1)
            was = np.where(before[at] == numbers, at, -1)
        x_before, start = self._last, self.interface.x
        self.numbers, self._last = numbers, np.zeros((len(numbers), self._dim))
        self._last[was >= 0] = x_before[was[was >= 0]]
        self.attach()
        x, v = self.gather("x", "v")
        v[was >= 0] = 0.0
        change = BallChange(x, np.arange(len(x))[:, None], was, v, x_before)
        first = x.copy()
        first[was >= 0] = start[was[was >= 0]]
        self.interface = Interface(first, change.elements)
        self.force = self._coming = change.redistribute(self.force)
        return change

    # ---------------------------------------------------------------- state

    def get_state(self):
        """As name → array copy."""
        return {"balls.numbers": self.numbers.copy(), "balls.force": self.force.copy(),
                "balls.start": np.array(self.interface.x), "balls.last": self._last.copy()}

    def set_state(self, state):
        """Go back to what ``get_state`` gave; ``attach`` comes afterwards."""
        self.numbers, self._last = state["balls.numbers"].copy(), state["balls.last"].copy()
        self.force = self._coming = state["balls.force"].copy()
        self.interface = Interface(state["balls.start"].copy(), np.arange(len(self.numbers))[:, None])


def make_surface(comm, dim, interface, start, bodies):
    """The interface of a scene: ``Balls`` of the ``bodies``, or boundary particles, see
    ``BoundaryParticles``."""
    if isinstance(interface, Balls):
        return BallSurface(comm, dim, interface, start, bodies)
    return BoundaryParticles(comm, dim, interface, start)


def read_particles(table, origin, dim):
    """``Particles`` of a structured array with x, v and radius, in the frame with this ``origin`` [m]; those
    without extent, as they have been removed, are left out."""
    table = table[table["radius"] > 0.0]
    return Particles(np.ascontiguousarray(table["x"][:, :dim] - origin),
                     np.ascontiguousarray(table["radius"]),
                     np.sqrt((table["v"]**2).sum(axis=1)))
