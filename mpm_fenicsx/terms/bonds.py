"""Bodies that share grid nodes move as one: they stick, and there is no contact between them.

That is meant for layers of one soil, and wrong for bodies that only touch. Nobody else can tell, so a warning
says it once for each pair, unless the scene says that it is ``bonded``."""
import warnings
from itertools import combinations

import numpy as np

from ..collective import somewhere


class Bonds:
    """Looks for the pairs of ``bodies`` that share grid nodes. Collective."""

    every = 10  # steps between two looks, besides those where other cells become active

    def __init__(self, bodies, comm, bonded):
        self._bodies, self._comm = bodies, comm
        self._left = [] if bonded else list(combinations(range(len(bodies)), 2))

    def look(self, step, time):
        """Warn of the pairs that share nodes of the ``step``'s active cells at ``time`` [s], and were not
        named before."""
        if not self._left:
            return
        active_cells = step.active_cells
        flags = np.zeros((len(active_cells.node), len(self._bodies)))
        for n, body in enumerate(self._bodies):
            flags[active_cells.cells[np.unique(body.points.cell)], n] = 1.0
        active_cells.accumulate(flags)
        reached = flags > 0.0
        shared = somewhere(self._comm, *((reached[:, a] & reached[:, b]).any() for a, b in self._left))
        for (a, b), together in zip(self._left, shared):
            if together:
                self._warn(a, b, self._distance(active_cells, reached, a, b), step.background.h.max(), time)
        self._left = [pair for pair, together in zip(self._left, shared) if not together]

    def _distance(self, active_cells, reached, a, b):
        """Between the nearest of their points in cells at shared nodes [m]."""
        from scipy.spatial import cKDTree  # takes time to import, and few scenes need it

        near = (reached[:, a] & reached[:, b])[active_cells.cells].any(axis=1) & (active_cells.cells[:, 0]
                                                                                  >= 0)
        places = [np.concatenate(self._comm.allgather(p.x[near[p.cell]]))
                  for p in (self._bodies[n].points for n in (a, b))]
        return cKDTree(places[0]).query(places[1])[0].min()

    def _warn(self, a, b, distance, h, time):
        if self._comm.rank == 0:
            warnings.warn(f"bodies {a + 1} and {b + 1}, {distance:.3g} m from point to point, share grid "
                          f"nodes at t = {time:.6g} s and stick together from now on, as there is no "
                          f"contact between bodies: keep them two cells ({2 * h:.3g} m) apart, or say "
                          "MPM(bonded=True) if they are one", stacklevel=2)
