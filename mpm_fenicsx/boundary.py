"""Supports: grid nodes whose motion is given."""
import numpy as np

from .errors import MPMError
from .scene import AXES


class Supports:
    """The supports of a scene on this rank's grid nodes x, shape (n, D). ``fixed``: mask of held directions, (n, D).

    Where several supports hold a node in the same direction, the last one counts.
    """

    def __init__(self, supports, x):
        self._supports = tuple(supports)
        self.fixed = np.zeros(x.shape, bool)
        self._holder = np.full(x.shape, -1)
        self._moving = any(s.motion is not None for s in supports)
        for number, support in enumerate(self._supports):
            directions = [AXES.index(letter) for letter in support.fix]
            if max(directions) >= x.shape[1]:
                raise ValueError(f"{support.name} fixes {support.fix!r}, the scene has {x.shape[1]} dimensions")
            held = np.ix_(np.asarray(support.where(x), bool), directions)
            self.fixed[held] = True
            self._holder[held] = number

    def check(self, active, cover, time):
        """Raise MPMError when a support holds no node that carries mass: it would be ignored. Collective."""
        holder = self._holder[cover.node[:cover.owned]][active[:cover.owned]]
        holds = np.array([np.count_nonzero(holder == n) for n in range(len(self._supports))], int)
        for support, count in zip(self._supports, cover.comm.allreduce(holds)):
            if count == 0:
                raise MPMError(f"{support.name} (fix {support.fix!r}) holds no grid node of the body at t = {time:.6g} s"
                               ": move it to nodes of cells that contain material points, or leave it out")

    def displacement(self, node, time, dt, v, a):
        """Known displacement over the step [m], shape (n, D), zero where free; sets velocity and acceleration of held
        nodes in v and a. A motion is asked at time - dt, time and time + dt for its derivatives."""
        known = np.zeros(v.shape)
        fixed = self.fixed[node]
        v[fixed] = 0.0
        a[fixed] = 0.0
        for number, support in enumerate(self._supports if self._moving else ()):
            if support.motion is None:
                continue
            before, now, after = (np.broadcast_to(support.motion(t), (len(support.fix),))
                                  for t in (time - dt, time, time + dt))
            for k, letter in enumerate(support.fix):
                d = AXES.index(letter)
                held = self._holder[node, d] == number
                known[held, d] = after[k] - now[k]
                v[held, d] = (after[k] - before[k]) / (2 * dt)
                a[held, d] = (after[k] - 2 * now[k] + before[k]) / dt**2
        return known
