"""One step of the MPM, and what is tried where it fails."""
from typing import Optional, Tuple

import numpy as np

import mpm_dem_checks as check

from .collective import somewhere
from .errors import MPMDivergedError
from .output.states import while_open
from .settling import Settling


class Stepped(Settling):
    """A model that is advanced in time. What a step stands on is made by ``MPM``. Collective."""

    @while_open
    def advance(self, dt: float, force: Optional[np.ndarray] = None) -> Tuple[np.ndarray, np.ndarray]:
        """Advance by ``dt`` [s] under point loads ``force`` on the boundary particles [N], shape (n, dim),
        constant meanwhile, the same on every rank. Returns ``surface()``. That is one step; where Newton's
        method fails in it the rungs of ``ladder`` are tried. MPMDivergedError when none helps; all points are
        then as they were."""
        dt = check.positive("dt", dt, "s", "it must be positive")
        self._ladder.advance(self, dt, force)
        self._ladder.succeeded(self.time, self.step.newton.helped)
        return self.surface()

    @while_open
    def attempt(self, dt: float, force: Optional[np.ndarray] = None) -> Tuple[np.ndarray, np.ndarray]:
        """``advance`` without the ladder, for loops that call ``fall_back`` and take shorter steps
        themselves, as that of ``coupling`` does."""
        self.attempt_once(check.positive("dt", dt, "s", "it must be positive"), force)
        self._ladder.succeeded(self.time, self.step.newton.helped)
        return self.surface()

    def attempt_once(self, dt: float, force: Optional[np.ndarray]) -> None:
        """One step of ``dt`` [s]; for the ladder."""
        force = self._surface.checked(force, self.time)
        self.step.clock.restart()
        self._ladder.means = None
        if self.comm.size > 1 and self.steps and self.steps % self.rebalance_every == 0:
            if self._outflow.active:
                self._locate()  # so that what has left is not looked for on the new distribution
            self._rebalance()
        gone = self._outlets(self._bodies, self.time)
        self._enter_cells(self._feeds(self.background, self.time) or gone)
        booked = self._losses.get_state()
        self.step.begin(dt, self.time, self._surface.share(force), self._ladder.stiff)
        try:
            trial, self.iterations = self.step.solve(f"step {self.steps + 1}, t = {self.time + dt:.6g} s")
        except MPMDivergedError:
            self._losses.set_state(booked)
            raise
        self.step.finish(trial)
        self.time, self.steps = self.time + dt, self.steps + 1
        self.move_walls()
        if self._behind:
            self._behind(self.time)

    def move_walls(self) -> None:
        """Take walls in space to their places of now."""
        for penalty in self.penalties:
            penalty.move(self.time)

    @while_open
    def fall_back(self) -> str:
        """After an ``attempt`` that failed: the next rung of the ladder that changes the equations. Returns
        what it has changed, or ""."""
        grid = self.step.grid
        light = somewhere(self.comm, grid is not None and bool(grid.light.any()))[0]
        changed = self._ladder.fall_back(self.time, light)
        if changed:
            self._renew_step(self.step.filled)
        return changed
