"""When a tangent is made, kept and made anew: the one policy, which step and Newton's method ask.

A tangent and its factor cost several residuals, so an elastic body keeps its tangent as long as it holds.
docs/tangents.md tells what is decided and why, in the order in which it is asked here."""
from time import time_ns
from typing import NamedTuple

import numpy as np
from petsc4py import PETSc

from .options import PREFIX
from .tolerance import stops_at

KEEP = -1  # as -mpm_snes_lag_jacobian: never made anew by the SNES itself
SLOW = 4  # more Newton iterations in a step than this count against the kept tangent
# By dimension, as a tangent with its factor costs one or two iterations in the plane, in space three with
# incomplete factors and twenty and more with whole ones:
PATIENCE = {2: 0, 3: 20}  # so many of these iterations, then an elastic body gets a new tangent
ENOUGH = {2: 1, 3: 2}  # a plastic body keeps its tangent where that needs so many iterations until the end,
# and so many more where an iteration costs little beside a tangent: with whole factors (PETSc's method
# "preonly"), and where stiffness over inertia is at most SLIGHT, as linear systems cost next to nothing there
MORE, SLIGHT, FACTORS = {2: 0, 3: 1}, 0.05, "preonly"
USEFUL = {2: 0.0, 3: 0.1}  # and for the next step where the first iteration leaves so much of the residual


class Tangent(NamedTuple):
    """What is known of the tangent in the matrix: ``dt`` [s] of the step it was made for; ``idle_scale``
    [N/m], diagonal of rows whose displacement is known; ``stiffness2`` [(N/m)^2], squared norm of this rank's
    diagonal without inertia; ``stiffness_over_inertia``, of all ranks; ``excess``: iterations beyond SLOW
    that steps with it have taken. All are zero before the first one."""

    dt: float = 0.0
    idle_scale: float = 0.0
    stiffness2: float = 0.0
    stiffness_over_inertia: float = 0.0
    excess: float = 0.0


class Tangents:
    """The policy for the matrix of one set of active cells. ``now``: the ``Tangent`` in it; ``count``: those
    made so far; ``kept_one``: whether an iteration of this step has gone without a new one.

    plastic: the tangent changes with the load, so every iteration may get a new one, and with ``anew`` it
    does; watched: penalties may ask for a new one in any iteration. The user decides instead with
    -mpm_snes_lag_jacobian (1: new in every iteration, 2: in every second, …)."""

    def __init__(self, dim: int, plastic: bool, watched: bool, anew: bool = False) -> None:
        self.plastic, self._watched, self._anew = plastic or anew, watched, anew
        self._patience, self._useful = PATIENCE[dim], USEFUL[dim]
        self._enough, self._more = ENOUGH[dim], MORE[dim]
        self.by_user = PETSc.Options(PREFIX).hasName("snes_lag_jacobian")
        self.now, self.count = Tangent(), 0
        self.kept_one = True
        self._holds = False  # the matrix is a tangent of the equations as they are
        self._always = self._fresh = False  # fresh: the last iteration had a tangent of its own
        self._dt = self._goal = self._residual = self._first_left = 0.0
        self._stamp = self._copied = 0  # [ns], tells one tangent from another
        self._copy = np.zeros(0)

    # ---------------------------------------------------------------- before Newton's method starts

    def drop(self) -> None:
        """The equations are others: nodes came or went, or the facets of the ghost penalty did."""
        self._holds = False

    def start(self, dt: float) -> bool:
        """A step of ``dt`` [s] is to be solved; returns whether a tangent has to be made before the first
        iteration."""
        self._dt, self._first_left, self.kept_one = dt, 0.0, self.lag == KEEP
        first_iteration_makes_one = self.plastic and not self.by_user and self.now.dt > 0.0
        return not first_iteration_makes_one and (not self._holds or self.now.dt != dt)

    # ---------------------------------------------------------------- in each iteration

    @property
    def lag(self) -> int:
        """How often the SNES asks ``wanted``: 1, in every iteration, or KEEP."""
        return 1 if self.plastic or self._watched or self._always else KEEP

    def in_every_iteration(self, always: bool) -> None:
        """From now on a new one in every iteration, whatever the body, as after a failure; or as before
        that."""
        self._always = always

    def wanted(self, switched: bool, snes: PETSc.SNES) -> bool:
        """Whether this iteration of the ``snes`` makes a tangent. switched: a spring has taken another branch
        of its law than that in the tangent, on any rank."""
        will_do = self._will_do(snes)  # whatever is wanted: it keeps an eye on the residual
        wanted = self.by_user or self._always or switched or (self.plastic and not will_do)
        self._fresh, self._residual = wanted, snes.getFunctionNorm()
        self.kept_one |= not wanted
        return wanted

    def _will_do(self, snes: PETSc.SNES) -> bool:
        """Whether the tangent that there is brings the residual to where the ``snes`` stops in few
        iterations: if each leaves as much as the last one has. Where that one had a tangent of its own,
        Newton's method has converged quadratically, and the same tangent leaves twice as much."""
        number, residual = snes.getIterationNumber(), snes.getFunctionNorm()
        if number == 0:
            self._goal = stops_at(snes)
            return self._holds and self.now.dt == self._dt and not self._anew
        left = residual / (self._residual or residual)
        if number == 1:
            self._first_left = left
        left = min(2.0 * left if self._fresh else left, 1.0)
        cheap = self.now.stiffness_over_inertia <= SLIGHT or snes.getKSP().getType() == FACTORS
        enough = self._enough + (self._more if cheap else 0)
        return residual * left ** enough <= self._goal and not self._anew

    # ---------------------------------------------------------------- afterwards

    def made(self, tangent: Tangent) -> None:
        """``tangent`` is in the matrix now."""
        self.now, self._holds = tangent, True
        self.count += 1
        self._stamp = time_ns()

    def solved(self, iterations: int) -> None:
        """The step has taken that many ``iterations``."""
        self.now = self.now._replace(excess=self.now.excess + max(iterations - SLOW, 0))
        self._holds &= self.now.excess <= self._patience
        if self.plastic:
            self._holds &= self._first_left <= self._useful

    # ---------------------------------------------------------------- state

    def get_state(self, values):
        """The tangent in the matrix as name → array, with the matrix where it is kept; values: gives a copy
        of that. The copy is the same one until there is a new tangent: it may be most of the state."""
        state = {"tangent": np.array([self._stamp, self._holds]), "tangent_data": np.array(self.now)}
        if self._holds:
            if self._copied != self._stamp:
                self._copy, self._copied = values(), self._stamp
            state.update(matrix=self._copy)
        return state

    def set_state(self, state):
        """Go back. Returns whether the matrix must be filled with that of the state."""
        stamp, holds = int(state["tangent"][0]), bool(state["tangent"][1])
        self.now = Tangent(*map(float, state["tangent_data"]))
        other = holds and (stamp != self._stamp or not self._holds)
        self._stamp, self._holds = stamp, holds
        return other

    @property
    def holds(self):
        """Whether the tangent in the matrix is kept for the next step."""
        return self._holds

    def take(self, tangent: Tangent, holds: bool) -> None:
        """Go on with a ``tangent`` that comes from elsewhere, and is in the matrix if it ``holds``."""
        self.now, self._holds, self._stamp = tangent, holds, time_ns()
