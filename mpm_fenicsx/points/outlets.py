"""Planes in the grid at which material leaves: points beyond them are removed and counted."""
import numpy as np

from ..collective import somewhere, total


class Outlets:
    """Of the ``planes``, ``openings.Outflow`` records. ``volume`` [m^3], shape (planes,): what has left
    through each since the start, at rest; ``discharge`` [m^3/s]: mean of the last step. outflow: an
    ``outflow.Outflow``, which books what leaves."""

    def __init__(self, planes, outflow, comm):
        self._planes, self._outflow, self._comm = tuple(planes), outflow, comm
        self._looked = 0.0  # at this time [s]
        self.volume, self.discharge = np.zeros((2, len(self._planes)))

    @property
    def names(self):
        """Of the planes, in their order."""
        return tuple(plane.name for plane in self._planes)

    def __call__(self, bodies, time):
        """Remove the points of the ``bodies`` that are beyond a plane at ``time`` [s]; returns whether there
        were any. Collective."""
        if not self._planes or time <= self._looked:
            return False
        through = [self._through(body.points.x) for body in bodies]
        volume = np.zeros(len(self._planes))
        gone = somewhere(self._comm, any((plane >= 0).any() for plane in through))[0]
        for body, plane in zip(bodies, through) if gone else ():
            chosen = np.flatnonzero(plane >= 0)
            volume += np.bincount(plane[chosen], body.points.V0[chosen], len(volume))
            self._outflow.add_up(body, chosen)
            body.points.take(plane < 0)
        volume = np.array(total(self._comm, volume))
        self.volume, self.discharge = self.volume + volume, volume / (time - self._looked)
        self._looked = time
        return bool(gone)

    def _through(self, x):
        """Number of the plane beyond which each position x [m], shape (n, D), is, -1 of none."""
        found = np.full(len(x), -1)
        for number, plane in enumerate(self._planes):
            found[(found < 0) & plane.passed(x)] = number
        return found

    def columns(self):
        """For the history, see ``MPM.columns``."""
        found = {}
        for k, name in enumerate(self.names):
            found[f"volume_{name}"] = ("m^3", f"volume at rest that has left through {name} since the start",
                                       lambda k=k: float(self.volume[k]))
            found[f"discharge_{name}"] = ("m^3/s", f"discharge through {name}, mean of the last step",
                                          lambda k=k: float(self.discharge[k]))
        return found

    def get_state(self):
        """As name → array copy."""
        return {"outlets": np.array([self._looked, *self.volume, *self.discharge])} if self._planes else {}

    def set_state(self, state):
        """Go back to what ``get_state`` gave."""
        if self._planes:
            self._looked = float(state["outlets"][0])
            self.volume, self.discharge = np.array(state["outlets"][1:]).reshape(2, -1)
