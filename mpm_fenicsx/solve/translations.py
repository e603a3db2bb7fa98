"""Momentum of a step whose linear systems are solved inexactly, or with a tangent that is kept.

Inner forces add up to nothing and inertia is linear, so that a Newton step g = -K^-1 r that solves its linear
system exactly gives a free body exactly the momentum that the loads bring, however far Newton's method is
from its end. A system that is solved to some residual leaves a part of that, and so does a tangent K of
another step, when the nodes had other masses. The translation c of all free unknowns takes the sum of what is
left out of the step,

    sum of (r + (K + alpha dm) (g + c)) = 0,

dm being what the nodes have gained in mass since the tangent was made: consistent inertia, too, adds up to
the nodal masses over the rows. It is Galerkin's coarse correction with the rigid translations, as in a
two-level method.
"""
import numpy as np

from ..collective import total


class Translations:
    """Of steps of Newton's method with the ``matrix`` of the ``equations``, on its ranks. of_factors: of
    steps by a factor, too, as that may be of a tangent that is kept. Collective."""

    def __init__(self, matrix, equations, of_factors):
        self._matrix, self._equations, self._comm = matrix, equations, matrix.comm.tompi4py()
        self._of_factors = of_factors
        self._values = None  # PETSc's number of the values in the matrix, of which the sums are
        self._sums_now = None

    def begin(self):
        """A solve begins, with the masses of its step."""
        self._sums_now = None

    def correct(self, snes, y):
        """What the linear solver of the ``snes`` has made of its residual, in ``y`` = -g; returns whether it
        was inexact, and changed. Loads whose stiffness is not in the matrix are left alone."""
        operator, matrix = snes.getKSP().getOperators()
        exact = snes.getKSP().getType() == "preonly" and not self._of_factors
        if exact or operator.handle != matrix.handle:
            return False
        if self._values != matrix.stateGet():
            self._values, self._sums_now = matrix.stateGet(), None
            self._read((~self._equations.known.idle).astype(float))
        if self._sums_now is None:
            self._follow_masses()
        residual, step = (vector.array_r for vector in (snes.getFunction()[0], y))
        left = total(self._comm, self._over_free(residual) - self._sums_now @ step)
        y.array_w.reshape(self._free.shape)[:] += (self._inverse @ left) * self._free
        return True

    def _read(self, free):
        """The matrix is another one, with these rows ``free``, 1.0 or 0.0, (owned, dim). Its sums over those
        of each direction, (dim, owned * dim)."""
        rows, sums = self._matrix.createVecs()
        self._free, self._sums = free, np.empty((free.shape[1], free.size))
        for axis, of_axis in enumerate(self._sums):
            rows.array_w.reshape(free.shape)[:] = free * (np.arange(free.shape[1]) == axis)
            self._matrix.multTranspose(rows, sums)
            of_axis[:] = sums.array_r
        rows.destroy()
        sums.destroy()

    def _follow_masses(self):
        """The sums with the masses as they are, and the inverse of what they change with a translation."""
        self._sums_now, gained = self._sums.copy(), self._equations.gained_inertia()
        for axis, of_axis in enumerate(self._sums_now):
            of_axis.reshape(self._free.shape)[:, axis] += self._free[:, axis] * gained
        changes = total(self._comm, [self._over_free(row) for row in self._sums_now])
        self._inverse = np.linalg.pinv(changes, rcond=1e-12)  # nothing along axes where nothing is free

    def _over_free(self, values):
        """Sums of the ``values`` (owned * dim,) over the free rows of each direction, on this rank."""
        return np.einsum("nd,nd->d", self._free, values.reshape(self._free.shape))
