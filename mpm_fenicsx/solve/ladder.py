"""What is tried when Newton's method fails in a step, which leaves the points as they were.

    1. new tangents, a start from rest, full Newton steps: inside the solver, see ``snes``
    2. with consistent inertia: the ghost penalty on it, see ``ghost``, from this step of the run on. At the rim of a body
       that moves freely cells are nearly empty, and there consistent inertia alone is singular at any step
    3. two steps of half the length, each with the same rungs, ``halvings`` times over

What is left then is for the user to try, and the message says it.
"""
import numpy as np

from ..errors import MPMDiverged


class Ladder:
    """The rungs of one run: ``halved``, the number of steps that were halved, and ``penalised_since``, the time [s] from
    which the ghost penalty has been needed, or None. inertia: as the scene has it; halvings: of one step."""

    def __init__(self, inertia, halvings):
        self._inertia, self._most = inertia, halvings
        self.halved, self.penalised_since = 0, None

    @property
    def penalises(self):
        """Whether inertia has the ghost penalty now."""
        return self._inertia == "ghost" or self.penalised_since is not None

    def climb(self, mpm, dt, force, left=None):
        """Advance ``mpm`` by ``dt`` [s] under ``force`` [N]. left: halvings, all at first. Raises MPMDiverged when
        nothing helps."""
        left = self._most if left is None else left
        try:
            return mpm.take_step(dt, force)
        except MPMDiverged as error:
            failure = error
        if self._inertia == "consistent" and not self.penalises:
            self.penalised_since = mpm.time
            mpm.renew_step()
            return self.climb(mpm, dt, force, left)
        if not left:
            raise self._at_its_end(failure, dt) from None
        self.halved += 1
        for _ in range(2):
            self.climb(mpm, dt / 2, force, left - 1)

    def _at_its_end(self, failure, dt):
        """The error that says what has been tried and what remains."""
        tried = ["new tangents", *["the ghost penalty on inertia"] * (self._inertia == "consistent"),
                 *[f"steps down to {dt:.3g} s"] * (self._most > 0)]
        remains = f'{failure.advice}, or inertia="lumped"' if self._inertia != "lumped" else failure.advice
        return MPMDiverged(f"{failure.what}; {', '.join(tried)} did not help", remains)

    def get_state(self):
        """The rungs on which the run stands, as an array."""
        return np.array([self.halved, np.nan if self.penalised_since is None else self.penalised_since])

    def set_state(self, state):
        """Go back; returns whether inertia is another than before."""
        before, since = self.penalises, float(state[1])
        self.halved, self.penalised_since = int(state[0]), None if np.isnan(since) else since
        return self.penalises != before

    def describe(self):
        """Entries of report.json."""
        return {"halved_steps": self.halved, "ghost_since": self.penalised_since}
