"""What a body says of its points: energies, momentum, volumes, stress."""
import numpy as np

from ..laws import ELASTIC_STATE, hencky
from ..laws.algebra import stored
from ..points.moments import momentum
from .fields import Deformation


class BodyReadings:
    """The part of ``bodies.BodyTerm`` that others ask of its ``points`` and its ``body``."""

    def energies(self, gravity, chosen=slice(None)):
        """Kinetic, strain and potential energy of this rank's points [J], or of the ``chosen``, in
        ``gravity`` [m/s^2], shape (D,)."""
        p = self.points
        mass, V0, v, *now = (values[chosen] for values in (p.mass, p.V0, p.v, *self._deformation()))
        kinetic, strain = self._kernels.energies(mass, V0, v, Deformation(*now), self._params)
        return kinetic, strain, -mass @ (p.x[chosen] @ gravity)

    def plastic_work(self, chosen=slice(None)):
        """What plastic flow has taken from this rank's points, or from the ``chosen``, since the start [J];
        nan where the law flows and does not remember it."""
        state = self.points.state
        if self.body.law.state == ELASTIC_STATE:
            return 0.0
        known = "plastic_work" in state.dtype.names
        return float(self.points.V0[chosen] @ state["plastic_work"][chosen]) if known else np.nan

    def momentum(self, chosen=slice(None)):
        """Of this rank's points, or of the ``chosen``, [kg m/s], followed by their angular momentum about
        zero [kg m^2/s], see ``moments.momentum``."""
        p = self.points
        return momentum(p.mass[chosen], p.x[chosen], p.v[chosen])

    def volume(self):
        """Of this rank's points as deformed [m^3], shape (n,)."""
        p, F = self.points, self.points.F
        if self.body.dim == 2:  # an order of magnitude faster than numpy.linalg.det
            return p.V0 * p.F33 * (F[:, 0, 0] * F[:, 1, 1] - F[:, 0, 1] * F[:, 1, 0])
        return p.V0 * np.einsum("pi,pi->p", F[:, 0], np.cross(F[:, 1], F[:, 2]))

    def cauchy_stress(self):
        """Of this rank's points [Pa], shape (n, D, D)."""
        return self._cauchy(self._deformation())

    def _cauchy(self, now):
        sigma = np.empty_like(self.points.F)
        self._kernels.cauchy(now, self._params, sigma)
        return sigma

    def _kirchhoff(self, now):
        """Of the points as deformed ``now``, where the law remembers the whole of it, that."""
        if self.body.law.stress is hencky.stress:
            return now.state["kirchhoff_stress"]
        J = np.linalg.det(now.F) * now.F33
        return stored(J[:, None, None] * self._cauchy(now))
