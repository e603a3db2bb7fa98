"""Where Newton's method stops, and how exactly its linear systems are solved."""
from typing import Dict

from petsc4py import PETSc

from .options import PREFIX

# Springs that stick and slide in turn, and soil at a free surface that comes apart and meets again, keep the
# last digits from Newton's method: from these iterations on so many times the tolerance will do. Without
# inertia there may be no equilibrium, which a tolerance as large as the second one would hide.
LATE, LATE_AT_REST = {10: 1e2, 20: 1e4}, {10: 1e2}
# A linear system that is solved loosely, in an iteration which would be the last one if it were solved well:
# to so much of the residual where Newton's method stops, but no more exactly than this.
SHARE, FINEST = 0.3, 1e-5


def stops_at(snes: PETSc.SNES) -> float:
    """The norm [N] at which the ``snes`` stops, which is at its first residual."""
    rtol, atol, *_ = snes.getTolerances()
    return float(max(atol, rtol * snes.getFunctionNorm()))


class Tolerance:
    """In each solve anew. late: iteration → how many times the tolerance will do from there on. What the
    user's options decide is left to them."""

    def __init__(self, late: Dict[int, float]) -> None:
        given = PETSc.Options(PREFIX).hasName
        self._by_user, self._linear_by_user = given("snes_atol"), given("ksp_rtol")
        self._late = {} if self._by_user or given("snes_rtol") else late
        self._atol = self._goal = 0.0
        self._preset = self._linear = 0.0  # of the linear solver, as its preset has it and now

    def begin(self, snes: PETSc.SNES, atol: float) -> None:
        """A solve that is to end at the norm ``atol`` [N]."""
        self._atol = atol
        if not self._by_user:
            snes.setTolerances(atol=atol)

    def loosen(self, snes: PETSc.SNES, iteration: int) -> None:
        """At the start of an iteration."""
        if iteration in self._late:
            snes.setTolerances(atol=self._late[iteration] * self._atol)

    def aim(self, snes: PETSc.SNES) -> None:
        """Before the linear system of an iteration: a residual that one iteration can bring to where the
        ``snes`` stops must not miss that because the system was solved loosely."""
        if self._linear_by_user:
            return
        residual, ksp = snes.getFunctionNorm(), snes.getKSP()
        if snes.getIterationNumber() == 0:
            self._goal = stops_at(snes)
        now = ksp.getTolerances()[0]
        if now != self._linear:  # the linear solver is another one
            self._preset = now
        asked = SHARE * self._goal / residual if residual > 0.0 else 1.0
        self._linear = min(self._preset, asked) if asked >= FINEST else self._preset
        if self._linear != now:
            ksp.setTolerances(rtol=self._linear)
