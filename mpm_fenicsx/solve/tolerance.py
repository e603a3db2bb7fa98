"""Where Newton's method stops, and how exactly its linear systems are solved."""
from typing import Dict, NamedTuple

from petsc4py import PETSc

from ..compiled import compiled
from .options import PREFIX

# Of loads and inertia the residual may be so much. Of soil in motion it may be more of its inertia: what this
# leaves is a hundredth of what the length of the step does, see docs/tangents.md. At rest that is nothing.
TO_FORCES, TO_INERTIA_OF_SOIL = 1e-6, 1e-4
# Springs that stick and slide in turn, and soil at a free surface that comes apart and meets again, keep the
# last digits from Newton's method: from these iterations on so much of loads and inertia will do. Without
# inertia there may be no equilibrium, which as much as the second one would hide.
LATE, LATE_AT_REST = {10: 1e-4, 20: 1e-2}, {10: 1e-4}
# A linear system that is solved loosely, in an iteration which would be the last one if it were solved well:
# to so much of the residual where Newton's method stops, but no more exactly than this.
SHARE, FINEST = 0.3, 1e-5


def stops_at(snes: PETSc.SNES) -> float:
    """The norm [N] at which the ``snes`` stops, which is at its first residual."""
    rtol, atol, *_ = snes.getTolerances()
    return float(max(atol, rtol * snes.getFunctionNorm()))


class Kind(NamedTuple):
    """Of residuals. ``late``: iteration → how much of loads and inertia will do from there on, of one that is
    piecewise linear, see ``searches``, otherwise empty; ``flows``: it is that of soil which moves, see
    ``problem.Problem``."""

    late: Dict[int, float] = {}
    flows: bool = False


class Norms(NamedTuple):
    """Of the forces in a step, over all nodes [N]: ``loads``, ``inertia``, and what ``round_off`` makes of
    them."""

    loads: float
    inertia: float
    round_off: float

    @property
    def forces(self) -> float:
        """The larger of loads and inertia, where it is more than round-off."""
        return max(self.loads, self.inertia, self.round_off / TO_FORCES)


@compiled
def squares(u, load, a, mass, alpha):
    """Sums of the squares of ``load`` [N], of mass times a, and of alpha times mass times u, over the nodes
    of u, shape (owned, D); of the others more may follow."""
    of_load = of_a = of_u = 0.0
    for n in range(len(u)):
        for i in range(u.shape[1]):
            of_load += load[n, i] ** 2
            of_a += (mass[n] * a[n, i]) ** 2
            of_u += (alpha * mass[n] * u[n, i]) ** 2
    return of_load, of_a, of_u


class Tolerance:
    """In each solve anew, of residuals of a ``kind``. What the user's options decide is left to them;
    -mpm_snes_rtol holds of loads and inertia, too, where it is smaller."""

    def __init__(self, kind: Kind) -> None:
        options = PETSc.Options(PREFIX)
        relative = options.getReal("snes_rtol", 1.0)
        self._to_loads = min(TO_FORCES, relative)
        self._to_inertia = min(TO_INERTIA_OF_SOIL if kind.flows else TO_FORCES, relative)
        self._by_user, self._linear_by_user = options.hasName("snes_atol"), options.hasName("ksp_rtol")
        self._late = {} if self._by_user or options.hasName("snes_rtol") else kind.late
        self._norms, self._goal, self._flows = Norms(0.0, 0.0, 0.0), 0.0, kind.flows
        self._preset = self._linear = 0.0  # of the linear solver, as its preset has it and now

    def begin(self, snes: PETSc.SNES, norms: Norms) -> None:
        """A solve in which the forces are of that size."""
        self._norms = norms
        if not self._by_user:
            snes.setTolerances(atol=max(self._to_loads * norms.loads, self._to_inertia * norms.inertia,
                                        norms.round_off))

    def loosen(self, snes: PETSc.SNES, iteration: int) -> None:
        """At the start of an iteration."""
        if iteration in self._late:
            snes.setTolerances(atol=max(snes.getTolerances()[1], self._late[iteration] * self._norms.forces))

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
        if self._flows and snes.getIterationNumber() == 0:
            asked = self._preset  # it is never the last one
        self._linear = min(self._preset, asked) if asked >= FINEST else self._preset
        if self._linear != now:
            ksp.setTolerances(rtol=self._linear)
