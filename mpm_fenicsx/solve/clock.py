"""Where the time of a step goes, and what its ranks send each other."""
from time import perf_counter

import numpy as np

from ..grid import compat

PHASES = ("search", "to grid", "tangent", "residual", "solve", "to points")


class Clock:
    """Seconds per phase, added to ``phases``; on several ranks also ``traffic``: messages and bytes that
    PETSc sent from this rank, by phase."""

    def __init__(self, comm, phases):
        self._comm, self.phases = comm, phases
        self.traffic = {phase: np.zeros(2) for phase in PHASES}
        self._sent = compat.sent()
        self.restart()

    def restart(self):
        """Time before now belongs to no phase."""
        self._last = perf_counter()

    def lap(self, phase):
        """Book what has passed since the last lap under ``phase``."""
        now = perf_counter()
        self.phases[phase] += now - self._last
        self._last = now
        if self._comm.size > 1:
            messages, size = compat.sent()
            self.traffic[phase] += (messages - self._sent[0], size - self._sent[1])
            self._sent = messages, size
