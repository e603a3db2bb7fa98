"""The residual at which Newton's method stops."""
from petsc4py import PETSc

from .options import PREFIX

# Springs that stick and slide in turn keep the last digits from Newton's method: from this iteration on so
# many times the tolerance will do.
LATE, LOOSER = 10, 100.0


class Tolerance:
    """In each solve anew. What the user's options decide is left to them."""

    def __init__(self) -> None:
        given = PETSc.Options(PREFIX).hasName
        self._by_user, self._atol = given("snes_atol"), 0.0
        self._loosens = not (self._by_user or given("snes_rtol"))

    def begin(self, snes: PETSc.SNES, atol: float) -> None:
        """A solve that is to end at the norm ``atol`` [N]."""
        self._atol = atol
        if not self._by_user:
            snes.setTolerances(atol=atol)

    def loosen(self, snes: PETSc.SNES, iteration: int) -> None:
        """At the start of an iteration, where the residual has kinks."""
        if self._loosens and iteration == LATE:
            snes.setTolerances(atol=LOOSER * self._atol)
