"""Steps of Newton's method with a kept tangent, corrected by what the steps before have done.

With a tangent K that is kept, the steps g = -K^-1 r(u) make the residual smaller by a constant factor. How
u and g have changed over the iterations before, du and dg, tells how g depends on u in these directions, so
that the step (Anderson acceleration: Walker & Ni 2011, doi 10.1137/10078356X)

    g - sum_j c_j (du_j + dg_j),    c such that |g - sum_j c_j dg_j| is least,

leaves less: it is Broyden's method with several secants at once. It costs some scalar products.
"""
import numpy as np

from ..collective import total

MOST = 3  # secants: more bring nothing (measured on soil that flows in space)


class Secants:
    """Of the iterations with one tangent, on the ranks of ``comm``."""

    def __init__(self, comm):
        self._comm = comm
        self.forget()

    def forget(self):
        """Another solve begins, or the tangent is another one."""
        self._last, self._secants = None, []

    def correct(self, x, y):
        """PETSc's callback between the linear solver and the line search, which goes from ``x`` along -``y``;
        returns whether it has changed ``y``. Collective."""
        u, g = np.array(x.array_r), -y.array_r
        if self._last is not None:
            self._secants = [*self._secants, (u - self._last[0], g - self._last[1])][-MOST:]
        self._last = u, g
        if not self._secants:
            return False
        added = y.array_w
        for share, (du, dg) in zip(self._shares(g), self._secants):
            added += share * (du + dg)
        return True

    def _shares(self, g):
        """c of all secants for the step g."""
        changes = [dg for _, dg in self._secants]
        products = total(self._comm, [[dg @ other for other in (*changes, g)] for dg in changes])
        if len(changes) == 1:
            (square, along), = products.tolist()
            return [along / square if square else 0.0]
        return np.linalg.lstsq(products[:, :-1], products[:, -1], rcond=1e-12)[0].tolist()
