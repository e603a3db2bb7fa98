"""What has come into the grid or has left it since the start, added up."""
import numpy as np

from ..collective import total


class Passed:
    """Sums over material points, the same on every rank. gravity: [m/s^2], shape (D,)."""

    def __init__(self, gravity, comm):
        self._gravity, self._comm = gravity, comm
        self.values = np.zeros(4 + len(gravity))  # count, mass, energy, volume, momentum: a state is a copy

    @property
    def count(self):
        """Number of the points."""
        return int(self.values[0])

    def add(self, body, chosen):
        """The ``chosen`` points of the ``body``, each on its rank. Collective."""
        p = body.points
        energy, momentum = sum(body.energies(self._gravity, chosen)), p.mass[chosen] @ p.v[chosen]
        self.values += total(self._comm, [len(chosen), p.mass[chosen].sum(), energy, p.V0[chosen].sum(),
                                          *momentum])

    def by_name(self):
        """"count", "mass" [kg], "volume" at rest [m^3], "momentum" [kg m/s], shape (D,), and "energy"
        [J]."""
        _, mass, energy, volume = self.values[:4].tolist()
        return {"count": self.count, "mass": mass, "volume": volume, "momentum": self.values[4:].copy(),
                "energy": energy}
