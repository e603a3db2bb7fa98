"""How the interface force went on so far: where it is going, and how large it is."""
from typing import NamedTuple, Optional

import numpy as np

from ..protocols import InterfaceChange
from .relaxation import norm


class Trend(NamedTuple):
    """Force on the interface in the ``last`` window and in the one ``before`` [N], shape (n, dim), and their
    lengths [s]; ``impulse`` [N s]: sum of the forces' norms times the windows, over the ``time`` [s] in which
    there was a force; ``peak`` [N]: the largest norm."""

    last: Optional[np.ndarray] = None
    dt_last: float = 0.0
    before: Optional[np.ndarray] = None
    dt_before: float = 0.0
    impulse: float = 0.0
    time: float = 0.0
    peak: float = 0.0

    def after(self, force: np.ndarray, dt: float) -> "Trend":
        """The trend with another window."""
        size = norm(force)
        return Trend(force, dt, self.last, self.dt_last, self.impulse + size * dt,
                     self.time + dt * (size > 0.0), max(size, self.peak))

    def transferred(self, change: InterfaceChange) -> "Trend":
        """The trend on the other points that the interface has after a ``change``."""
        return self._replace(last=None if self.last is None else change.redistribute(self.last),
                             before=None if self.before is None else change.redistribute(self.before))

    def mean(self) -> float:
        """Norm of the force while there was one, mean over the run [N]."""
        return self.impulse / self.time if self.time else 0.0

    def predict(self, dt: float) -> Optional[np.ndarray]:
        """Mean force in the coming window of ``dt`` [s], by linear extrapolation, none where it would change
        its sign [N]; None when nothing is known."""
        if self.last is None or self.before is None:
            return self.last
        slope = (self.last - self.before) * ((self.dt_last + dt) / (self.dt_before + self.dt_last))
        guess = self.last + slope
        guess[guess * self.last <= 0.0] = 0.0
        return guess

    def error(self, force: np.ndarray, dt: float) -> float:
        """How far the ``force`` of the coming window is from its prediction, relative to the largest so
        far."""
        guess, largest = self.predict(dt), max(self.peak, norm(force))
        return norm(force if guess is None else force - guess) / largest if largest else 0.0
