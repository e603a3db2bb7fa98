"""Momentum of a step whose linear systems an iterative solver has left inexact.

Inner forces add up to nothing and inertia is linear, so that a Newton step g = -K^-1 r that solves its linear
system exactly gives a free body exactly the momentum that the loads bring, however far Newton's method is
from its end. A system that is solved to some residual leaves a part of that. The translation c of all free
unknowns takes the sum of what is left out of the step,

    sum of (r + K (g + c)) = 0.

It is Galerkin's coarse correction with the rigid translations, as in a two-level method.
"""
import numpy as np

from ..collective import total


class Translations:
    """Of steps of Newton's method with the ``matrix`` of the ``equations``, on its ranks. Collective."""

    def __init__(self, matrix, equations):
        self._matrix, self._equations, self._comm = matrix, equations, matrix.comm.tompi4py()
        self._values = None  # PETSc's number of the values in the matrix, of which the sums are

    def correct(self, snes, y):
        """What the linear solver of the ``snes`` has made of its residual, in ``y`` = -g; returns whether it
        was inexact, and changed. Loads whose stiffness is not in the matrix are left alone."""
        operator, matrix = snes.getKSP().getOperators()
        if snes.getKSP().getType() == "preonly" or operator.handle != matrix.handle:
            return False
        if self._values != matrix.stateGet():
            self._values = matrix.stateGet()
            self._read((~self._equations.known.idle).astype(float))
        residual, step = (vector.array_r for vector in (snes.getFunction()[0], y))
        left = self._over_free(residual) - self._sums @ step
        y.array_w.reshape(self._free.shape)[:] += (self._inverse @ total(self._comm, left)) * self._free
        return True

    def _read(self, free):
        """The matrix is another one, with these rows ``free``, 1.0 or 0.0, (owned, dim). Its sums over those
        of each direction, (dim, owned * dim), and the inverse of what they change with a translation."""
        rows, sums = self._matrix.createVecs()
        self._free, self._sums = free, np.empty((free.shape[1], free.size))
        for axis, of_axis in enumerate(self._sums):
            rows.array_w.reshape(free.shape)[:] = free * (np.arange(free.shape[1]) == axis)
            self._matrix.multTranspose(rows, sums)
            of_axis[:] = sums.array_r
        rows.destroy()
        sums.destroy()
        changes = total(self._comm, [self._over_free(row) for row in self._sums])
        self._inverse = np.linalg.pinv(changes, rcond=1e-12)  # nothing along axes where nothing is free

    def _over_free(self, values):
        """Sums of the ``values`` (owned * dim,) over the free rows of each direction, on this rank."""
        return np.einsum("nd,nd->d", self._free, values.reshape(self._free.shape))
