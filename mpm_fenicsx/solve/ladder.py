"""What is tried by itself where Newton's method fails in a step, one rung after the other.

    1. attempts and solvers inside Newton's method, see ``snes``           for this step
    2. the ghost penalty on inertia, where that is consistent              from now on
    3. the inertia of nearly empty cells, of bodies that yield, lumped     from now on
    4. the ghost penalty on stiffness, where all bodies are elastic        held for GOOD steps
    5. shorter steps: 2, 4 or 8 in place of the one                        held for GOOD steps

The order is that of cost, and what was measured stands in docs/running.md. What helped is told once, in a
warning, and counted for the report. A run that never fails pays nothing."""
import warnings
from typing import Any, Dict, List, NamedTuple, Optional

import numpy as np

from ..errors import MPMDivergedError
from ..terms.scene_penalties import names_of

INERTIA, STIFFNESS = "the ghost penalty on inertia", "the ghost penalty on stiffness"
LIGHT_CELLS = "the inertia of nearly empty cells"
PARTS = 1, 1, 2, 4, 8  # steps in place of one at each level; all but the first with ghost stiffness
GOOD = 4  # steps without a failure at one level, before that below is tried
SHORTER = "2, 4 or 8 shorter steps in its place"


class Means(NamedTuple):
    """Over the shorter steps in place of one: the force ``applied`` to the interface [N], and the reaction of
    each penalty by name [N]."""

    applied: np.ndarray
    reactions: Dict[str, np.ndarray]


class Ladder:
    """The rungs of one MPM. ``ghost_since``, ``light_since`` and ``stiff_since``: when ghost inertia, that
    of nearly empty cells (``terms.light_cells``) and ghost stiffness were first needed [s], or None;
    ``helped``: what → [time of the first step [s], number of steps]; ``means``: of the last step, where it
    was done in parts."""

    def __init__(self, comm: Any, inertia: str, elastic: bool, smooth: bool) -> None:
        """inertia: "consistent", "lumped" or "ghost"; elastic: all bodies are; smooth: so is the basis."""
        self._rank, self._inertia, self._elastic = comm.rank, inertia, elastic
        self._may_be_light = inertia == "lumped" and not elastic and not smooth
        self.ghost_since: Optional[float] = None
        self.light_since: Optional[float] = None
        self.stiff_since: Optional[float] = None
        self.means: Optional[Means] = None
        self.helped: Dict[str, List[float]] = {}
        self._level = self._good = 0
        self._news: List[str] = []

    @property
    def stiff(self) -> bool:
        """Whether the next step has ghost stiffness."""
        return self._elastic and self._level > 0

    @property
    def needs_facets(self) -> bool:
        """Whether a ghost penalty has a part in the equations, or may get one again."""
        return self._inertia == "ghost" or self.ghost_since is not None or self.stiff_since is not None

    def applied(self, last: np.ndarray) -> np.ndarray:
        """Force on the interface over the last step [N], where ``last`` is that of its last part."""
        return self.means.applied if self.means else last

    def reaction(self, name: str, last: np.ndarray) -> np.ndarray:
        """The same of the penalties of that name."""
        return self.means.reactions[name] if self.means else last

    # ---------------------------------------------------------------- up and down

    def fall_back(self, time: float, light: bool) -> str:
        """After a step from ``time`` [s] that failed: the next rung that changes the equations; light:
        whether a node has hardly any mass. Returns what it is, or "" where none is left."""
        if self._inertia == "consistent" and self.ghost_since is None:
            self.ghost_since = time
            self._news.append(INERTIA)
        elif light and self._may_be_light and self.light_since is None:
            self.light_since = time
            self._news.append(LIGHT_CELLS)
        elif self._elastic and self._level == 0:
            self._level, self._good = 1, 0
            self.stiff_since = time if self.stiff_since is None else self.stiff_since
            self._news.append(STIFFNESS)
        else:
            return ""
        return self._news[-1]

    def _shorten(self) -> bool:
        """Twice as many parts; False where there are as many as may be."""
        if self._level + 1 == len(PARTS):
            return False
        self._level, self._good = max(self._level, 1) + 1, 0
        return True

    def succeeded(self, time: float, more: List[str]) -> None:
        """A step that ends at ``time`` [s] is done, with ``more`` that helped inside Newton's method: tell
        what is new, count, and go down a level after GOOD such steps in a row."""
        helps = [*self._news, *more, *[STIFFNESS] * self.stiff]
        if PARTS[self._level] > 1:
            helps.append("shorter steps")
        new = [what for what in dict.fromkeys(helps) if what not in self.helped]
        for what in dict.fromkeys(helps):
            self.helped.setdefault(what, [time, 0])[1] += 1
        if new and self._rank == 0:
            warnings.warn(f"Newton's method failed in the step to t = {time:.6g} s as it stands; it succeeds "
                          f"with {', '.join(new)}. This is said once, see docs/running.md", stacklevel=4)
        self._news = []
        self._good += 1
        if self._level and self._good >= GOOD:
            self._level, self._good = self._level - 1, 0

    # ---------------------------------------------------------------- one step

    def advance(self, solid: Any, dt: float, force: np.ndarray) -> None:
        """Let the ``solid`` do a step of ``dt`` [s] under ``force`` [N], see ``MPM.advance``. Raises the
        first MPMDivergedError when all rungs fail; the solid is then where it was. Collective."""
        start, first, level, tried = None, None, self._level, []
        while True:
            if PARTS[self._level] > 1 and start is None:
                start = solid.get_state()
            try:
                return self._in_parts(solid, dt, force)
            except MPMDivergedError as failure:
                first = first or failure
            if start is not None:
                now, news = self._level, self._news
                solid.set_state(start)
                self._level, self._good, self._news = now, 0, news
            changed = solid.fall_back()
            if changed:
                tried.append(changed)
            elif not self._shorten():
                self._level = level
                raise MPMDivergedError(f"{first.what}; nor did {', '.join([*tried, SHORTER])}",
                                       first.advice) from None

    def _in_parts(self, solid, dt, force):
        parts, begin, iterations, seen, names = PARTS[self._level], solid.time, 0, [], ()
        if parts > 1:
            names = names_of(solid.step.problem.penalties)
        for _ in range(parts):
            solid.attempt_once(dt / parts, force)
            iterations += solid.iterations
            seen.append([solid.applied, *(solid.reaction(name) for name in names)])
        if parts > 1:
            applied, *reactions = [np.mean(values, axis=0) for values in zip(*seen)]
            self.means = Means(applied, dict(zip(names, reactions)))
            solid.time, solid.iterations = begin + dt, iterations
            solid.move_walls()

    # ---------------------------------------------------------------- state

    def get_checkpoint(self) -> Dict[str, Any]:
        """What ``get_state`` has, and what is told of the steps so far."""
        means = self.means and {"applied": self.means.applied, "names": tuple(self.means.reactions),
                                "reactions": np.array([*self.means.reactions.values()])}
        return {**self.get_state(), "helped": tuple(self.helped), "steps": np.array([*self.helped.values()]),
                "means": means}

    def set_checkpoint(self, tree: Dict[str, Any]) -> None:
        """Go back to what ``get_checkpoint`` gave."""
        self.set_state(tree)
        self.helped = {what: [time, int(count)] for what, (time, count) in zip(tree["helped"],
                                                                               tree["steps"].tolist())}
        means = tree["means"]
        self.means = means and Means(means["applied"], dict(zip(means["names"], means["reactions"])))

    def get_state(self) -> Dict[str, np.ndarray]:
        """As name → array."""
        ghost, stiff, light = (np.nan if time is None else time for time in (
            self.ghost_since, self.stiff_since, self.light_since))
        return {"ladder": np.array([ghost, stiff, self._level, self._good, light], float)}

    def set_state(self, state: Dict[str, np.ndarray]) -> bool:
        """Go back; returns whether the equations have other terms then."""
        before = self.needs_facets, self.light_since is None
        ghost, stiff, level, good, *light = state["ladder"].tolist()
        since = (None if np.isnan(time) else time for time in (ghost, stiff, *(light or [np.nan])))
        self.ghost_since, self.stiff_since, self.light_since = since  # older checkpoints have no third one
        self._level, self._good, self._news = int(level), int(good), []
        return before != (self.needs_facets, self.light_since is None)
