"""How far the soil now near a wall is from it, measured from the material points.

A gap that a particle of a wall adds up from the motion of the grid belongs to whatever soil was there when it
opened. Other soil that comes may be nearer, and none of it says so to the grid's nodes; its points do."""
from typing import NamedTuple

import numpy as np
from mpi4py import MPI

from ..compiled import specialise
from ..points.bins import Bins, bin_of, make_bins

D = 2  # fixed by specialise
# radius of a point over the side of the square or cube of its volume: it reaches to its neighbours
ROUND = 0.5
# the same for what has surely come to the wall: every rule of points keeps this from the surface
TOUCHING = 1.0 / 3.0


class WallParticles(NamedTuple):
    """m particles of walls at ``place`` (m, D) [m], with ``normal`` (m, D) to the soil; ``reach``: how far a
    point may be to the side [m], ``depth``: and in front or behind [m]."""

    place: np.ndarray
    normal: np.ndarray
    reach: float
    depth: float


def measure(x, V0, F, bins: Bins, walls: WallParticles, nearest):
    """Distance [m] of the nearest of the points to each particle of the walls, along its normal, if less, to
    ``nearest``, shape (m, 2), less its radius by TOUCHING and by ROUND.

    x: (n, D) [m]; V0: (n,) volume, in the plane area, at rest [m^D]; F: (n, D, D); bins: of the particles.
    """
    start, items = bins.start, bins.items
    place, normal, reach, depth = walls
    for p in range(len(x)):
        b = bin_of(p, x, bins, D)
        if b < 0 or start[b] == start[b + 1]:
            continue
        if D == 2:
            J = F[p, 0, 0] * F[p, 1, 1] - F[p, 0, 1] * F[p, 1, 0]
        else:
            J = 0.0
            for i in range(3):
                j, k = (i + 1) % 3, (i + 2) % 3
                J += F[p, 0, i] * (F[p, 1, j] * F[p, 2, k] - F[p, 1, k] * F[p, 2, j])
        side = abs(V0[p] * J) ** (1.0 / D)
        for item in range(start[b], start[b + 1]):
            w = items[item]
            along, square = 0.0, 0.0
            for i in range(D):
                r = x[p, i] - place[w, i]
                along += r * normal[w, i]
                square += r * r
            if abs(along) <= depth and square - along * along <= reach * reach:
                nearest[w, 0] = min(nearest[w, 0], along - TOUCHING * side)
                nearest[w, 1] = min(nearest[w, 1], along - ROUND * side)


class SoilDistance:
    """Measures at those particles of walls that separate.

    h: size of a cell [m]; separates: mask, shape (n,), of the particles; normal, x [m]: (n, D).
    """

    def __init__(self, h, separates, normal, x):
        self._chosen, self._dim, self._count = np.flatnonzero(separates), normal.shape[1], len(normal)
        self._normal = np.ascontiguousarray(normal[self._chosen])
        self._reach, self._h = h * np.sqrt(self._dim - 1), h
        self._measure = specialise(measure, D=self._dim)
        self.place(x)

    def place(self, x):
        """Put the particles at x [m], shape (n, D)."""
        x = np.ascontiguousarray(x[self._chosen])
        around = np.sqrt(self._reach**2 + self._h**2)
        self._bins = make_bins(x - around, x + around, self._h)
        self._walls = WallParticles(x, self._normal, self._reach, self._h)

    def __call__(self, bodies, comm):
        """For each particle, shape (n, 2): see ``measure``; infinite where no point of ``bodies`` is near.
        Collective."""
        nearest = np.full((len(self._chosen), 2), np.inf)
        for body in bodies:
            p = body.points
            self._measure(p.x, p.V0 / body.thickness, p.F, self._bins, self._walls, nearest)
        if comm.size > 1:
            comm.Allreduce(MPI.IN_PLACE, nearest, MPI.MIN)
        whole = np.full((self._count, 2), np.inf)
        whole[self._chosen] = nearest
        return whole
