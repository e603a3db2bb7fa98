"""Load steps of an ``MPM`` without inertia, from no load to that of now, and what is done where one fails."""
import warnings
from typing import Callable, NamedTuple, Optional, Tuple

import numpy as np

import mpm_dem_checks as check

from .errors import MPMDivergedError
from .model import Model
from .output.states import while_open
from .solve.statics import LoadStep, StaticStep
from .solve.step import Step

SHORTEST = 32  # the shortest load step is this part of one
# Steps at full load at most: at rest again, the grid sees the forces of points that have moved a little
# otherwise, friction knows the normal force of the step before, and a ghost penalty lets go.
CLOSING = 5
# Part of the work of the loads in all steps that may fall to the last of them: with the ghost penalty a body
# that cannot carry its loads creeps.
CREEP = 1e-3


class Settled(NamedTuple):
    """How loads were raised: in so many ``steps``, with ``iterations`` of Newton's method in all, the
    ``shortest`` as part of an equal step, and whether the ``ghost`` penalty on stiffness was needed.

    >>> from mpm_fenicsx import MPM, Body, Box, Grid, Support, linear
    >>> block = Body(Box((0.0, 0.0), (1.0, 2.0)), (4, 8), 2, linear(E=1e6, nu=0.0), rho=1000.0)
    >>> floor = Support(lambda x: x[:, 1] < 1e-9, "xy")
    >>> solid = MPM(Grid(Box((-1.0, 0.0), (2.0, 3.0)), (12, 12)), block, [floor], gravity=(0.0, -10.0))
    >>> solid.settle(2).steps
    2
    >>> solid.cauchy_stress()[:, 1, 1].min().round(-2)  # of the weight, in the lowest points [Pa]
    -19100.0
    >>> solid.close()
    """

    steps: int
    iterations: int
    shortest: float
    ghost: bool


class Settling(Model):
    """A model whose loads can be raised without inertia: the part of ``MPM`` that does it."""

    _settling: Optional["LoadSteps"] = None  # while it does

    @while_open
    def settle(self, load_steps: int, force: Optional[np.ndarray] = None,
               on_step: Optional[Callable] = None) -> Settled:
        """Raise gravity, body force, loads and the ``force`` on the interface, see ``advance``, from zero to
        what they are at the present time, in ``load_steps`` equal steps to equilibrium without inertia, see
        ``statics``. Then all is at rest, time and supports are where they were, and ``advance`` goes on from
        there. Stress that the body has already gives way to that of the loads.

        on_step: called after each step with the load factor [-]. A step that fails is tried again with a
        ghost penalty on stiffness, which a smooth basis has from the start, kept from then on, then as two
        halves, to a 32nd at most; a warning says it once. Collective. ValueError for a number that is none;
        MPMError where nothing holds a body, MPMDivergedError where no equilibrium is found: all is then as it
        was.
        """
        load_steps = check.count("load_steps", load_steps)
        start, self._settling = self.get_state(), LoadSteps(self, force)
        momentum = self._impulses.now(self._bodies)
        try:
            settled = self._settling.climb(load_steps, on_step or (lambda factor: None))
        except Exception:
            self._go_on()
            self.set_state(start)
            raise
        self._go_on()
        self._impulses.stop(momentum)
        self._works.settled(self.works()["springs"])
        if self.comm.rank == 0 and (settled.ghost or settled.shortest < 1.0):
            what = ["a ghost penalty on stiffness"] * settled.ghost
            what += [f"load steps down to {settled.shortest:.3g} of an equal one"] * (settled.shortest < 1.0)
            warnings.warn(f"settle needed {' and '.join(what)}", stacklevel=3)
        return settled

    def _enter_cells(self, fed: bool = False) -> None:
        """Points are in their cells, and about to move; fed: some have just come."""
        self._locate(fed)
        self._outflow.check_left(self._count + self._feeds.count, self.time)
        self._located = False

    def _go_on(self) -> None:
        """From now on steps in time."""
        self._settling = None
        self._renew_step(self._sets.filled())

    def _kind_of_step(self, ghost: bool) -> Tuple[type, bool]:
        """Of the next steps, and whether they need facets for a ghost penalty; ghost: steps in time do."""
        if self._settling is None:
            return Step, ghost
        return StaticStep, self._settling.ghost or self.background.basis.smooth


class LoadSteps:
    """Load steps of the model ``mpm`` under ``force`` on its interface, see ``Settling``. ``ghost``: whether
    with the penalty on stiffness."""

    def __init__(self, mpm: Settling, force: Optional[np.ndarray]) -> None:
        self._mpm, self._force = mpm, mpm._surface.checked(force, mpm.time)
        self.ghost, self._iterations, self._work, self._first = False, 0, [], True

    def climb(self, load_steps: int, on_step: Callable) -> Settled:
        """All of them, shorter ones where they fail, counted by the shortest."""
        done, size, shortest, steps, total = 0, SHORTEST, SHORTEST, 0, load_steps * SHORTEST
        mpm = self._mpm
        mpm._sets.stop()
        self._renew()
        while done < total:
            try:
                self._advance(LoadStep(done / total, (done + size) / total))
            except MPMDivergedError as error:
                if not self._add_ghost():
                    if size == 1:
                        raise _no_equilibrium(error, done / total) from None
                    size //= 2
                    shortest = min(size, shortest)
                continue
            done, steps = done + size, steps + 1
            on_step(done / total)
            if size < SHORTEST and done % (2 * size) == 0:
                size *= 2
        try:
            self._close()
        except MPMDivergedError as error:
            raise _no_equilibrium(error, 1.0) from None
        return Settled(steps, self._iterations, shortest / SHORTEST, self.ghost)

    def _close(self) -> None:
        """Steps at full load, until nothing moves any more."""
        for _ in range(CLOSING):
            if not self._advance(LoadStep(1.0, 1.0)):
                return
        if self._mpm.step.ghost and abs(self._work[-1]) > CREEP * sum(map(abs, self._work)):
            raise MPMDivergedError("with a ghost penalty on stiffness it creeps", "")

    def _advance(self, factors: LoadStep) -> int:
        """One step, to equilibrium at its second load factor. Returns the number of Newton iterations."""
        mpm = self._mpm
        mpm._enter_cells()
        mpm.step.begin_load(factors, mpm.time, mpm._surface.share(self._force))
        when = f"the load step to {factors.after:.4g} of the loads at t = {mpm.time:.6g} s"
        trial, iterations = mpm.step.solve(when, look=self._first)
        self._work.append(mpm.step.work(trial.increment))
        mpm.step.finish(trial)
        mpm._sets.stop()
        self._iterations, self._first = self._iterations + iterations, False
        return iterations

    def _add_ghost(self) -> bool:
        """From now on with the penalty; returns whether it is new."""
        new, self.ghost = not self.ghost, True
        if new:
            self._renew()
        return new

    def _renew(self) -> None:
        self._mpm._renew_step(self._mpm._sets.filled())


def _no_equilibrium(error: MPMDivergedError, factor: float) -> MPMDivergedError:
    where = "under the loads" if factor == 1.0 else f"beyond {factor:.1%} of the loads"
    return MPMDivergedError(f"there is no equilibrium without inertia {where}, or none was found "
                            f"({error.what})", "a body that yields or buckles goes on in "
                            "dynamic steps only, take more strength, less load or more load steps, or leave "
                            "out settle")
