"""Supports: grid nodes whose motion is given."""
import warnings

import numpy as np

import mpm_dem_checks as check

from ..scene.bodies import AXES

# Second derivatives at both ends of a unit interval of the cubic through four values at equal distances.
CURVATURE = 9.0 * np.array([[2.0, -5.0, 4.0, -1.0], [-1.0, 4.0, -5.0, 2.0]])


class Supports:
    """The supports of a scene on this rank's grid nodes x, shape (n, D). ``fixed``: mask of held directions,
    (n, D).

    Where several supports hold a node in the same direction, the last one counts.
    """

    def __init__(self, supports, x, checked=False):
        """checked: whether they have been looked at, on another distribution of the grid."""
        self._supports, self._checked = tuple(supports), checked
        self.fixed = np.zeros(x.shape, bool)
        self._holder = np.full(x.shape, -1)
        self._moving = any(s.motion is not None for s in supports)
        for number, support in enumerate(self._supports):
            directions = [AXES.index(letter) for letter in support.fix]
            if max(directions) >= x.shape[1]:
                raise ValueError(f"{support.name} fixes {support.fix!r}, the scene has {x.shape[1]} "
                                 f"dimensions: give some of {AXES[:x.shape[1]]}")
            held = np.ix_(check.mask(f"where of {support.name}", support.where, x), directions)
            self.fixed[held] = True
            self._holder[held] = number

    @property
    def names(self):
        """Of the supports, in their order."""
        return [support.name for support in self._supports]

    def holders(self, node):
        """Number of the support that holds each direction of the grid nodes ``node``, shape (n, D), -1 where
        free."""
        return self._holder[node]

    def check(self, active, active_cells, time):
        """Warn, on the first rank, of every support that holds no node with mass: the first time, and not
        later, when the body may have left it. Collective, on all ranks alike."""
        if self._checked:
            return
        self._checked = True
        holder = self._holder[active_cells.node[:active_cells.owned]][active[:active_cells.owned]]
        holds = np.array([np.count_nonzero(holder == n) for n in range(len(self._supports))], int)
        for support, count in zip(self._supports, active_cells.comm.allreduce(holds)):
            if count == 0 and active_cells.comm.rank == 0:
                warnings.warn(f"{support.name} (fix {support.fix!r}) holds no grid node of the body at t = "
                              f"{time:.6g} s: move it to nodes of cells that contain material points, "
                              "unless the body comes to it later", stacklevel=2)

    def displacement(self, node, time, dt, v, a):
        """Known displacement over the step [m], shape (n, D), zero where free; sets velocity and acceleration
        of held nodes at the start of the step in v and a.

        The accelerations at both ends of the step are those of the cubic through four times in it, so that
        nobody asks the motion for a time outside the run; the velocity is such that Newmark's method ends the
        step with the second one, which differs from the first one of the next step by O(dt^2)."""
        known = np.zeros(v.shape)
        fixed = self.fixed[node]
        v[fixed] = 0.0
        a[fixed] = 0.0
        for number, support in enumerate(self._supports if self._moving else ()):
            if support.motion is None:
                continue
            at = np.array([self._place(support, time + dt * (k / 3)) for k in range(4)])
            start, end = CURVATURE @ at / dt**2
            for k, letter in enumerate(support.fix):
                d = AXES.index(letter)
                held = self._holder[node, d] == number
                known[held, d] = at[3, k] - at[0, k]
                v[held, d] = known[held, d] / dt - 0.25 * dt * (start[k] + end[k])
                a[held, d] = start[k]
        return known

    @staticmethod
    def _place(support, time):
        """Displacement of a support at ``time`` [s] along each of its directions [m]."""
        n = len(support.fix)
        place = check.values(f"the motion of {support.name} at t = {time:.6g} s", support.motion, (time,), (),
                             (n,), unit="m")
        return np.broadcast_to(place, (n,))
