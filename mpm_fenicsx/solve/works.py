"""Work done on the bodies, and energy that friction takes, step by step.

A force does the work of its mean over the step along the displacement of what it acts on. That of gravity is
in the potential energy, which is linear. On the grid, with u = dt/2 (v + v'), the change of kinetic energy is
the work of all forces, inner ones too, so that

    work from outside - friction - change of (kinetic energy of the nodes + strain + potential + springs)

is what plastic flow has taken, up to the error of the stress in time. Kinetic energy that the transfers
between points and grid make or lose, and held nodes that are stopped, is in no part: it is the scheme's, and
what is left of the whole balance.
"""
from typing import Any, Dict

import numpy as np

from ..collective import total

KINDS = "loads", "body force", "base", "interface", "supports", "walls", "friction", "nodes", "left"


class Works:
    """Sums since the start [J] by kind: work of loads, body force, motion of the base and interface, of
    supports and walls that move, what friction has taken, the change of the nodes' kinetic energy over the
    steps, and strain and potential energy of what has left less that of what has come. Collective."""

    def __init__(self, comm: Any) -> None:
        self._comm, self._sums = comm, np.zeros(len(KINDS))

    def sums(self) -> Dict[str, float]:
        """Kind → [J]."""
        return dict(zip(KINDS, self._sums.tolist()))

    def leave(self, body: Any, chosen: np.ndarray, gravity: np.ndarray, sign: float = 1.0) -> None:
        """The ``chosen`` points of a body leave; gravity: [m/s^2], (D,); sign: -1 of those that enter."""
        self._sums[-1] += sign * total(self._comm, sum(body.energies(gravity, chosen)[1:]))

    def enter(self, body: Any, chosen: np.ndarray, gravity: np.ndarray) -> None:
        """The ``chosen`` points of a body have come."""
        self.leave(body, chosen, gravity, -1.0)

    def step(self, grid: Any, problem: Any, found: Any, increment: Any) -> None:
        """A step is done. found: see ``impulses.Forces``."""
        n, u = len(found.holder), increment.u
        mass, v = grid.mass[:n, None], grid.rule.velocity(grid, increment)[:n]
        held = np.where(found.holder >= 0, found.imbalance, 0.0)
        walls, friction = np.sum([term.spent for term, _ in found.springs] or [(0.0, 0.0)], axis=0)
        self._sums[:-1] += total(self._comm, [
            sum(load.work(grid, u) for load in problem.loads),
            0.0 if found.body is None else np.vdot(found.body[:n], u[:n]),
            0.0 if problem.frame_pull is None else mean_pull(grid, problem) @ (grid.mass[:n] @ u[:n]),
            problem.interface.work(grid, u), np.vdot(held, u[:n]), walls, friction,
            0.5 * np.vdot(mass * (v - grid.v[:n]), v + grid.v[:n])])

    @property
    def of_base(self) -> float:
        """That of the motion of the base [J]."""
        return float(self._sums[KINDS.index("base")])

    def get_state(self) -> Dict[str, np.ndarray]:
        """As name → array copy."""
        return {"works": self._sums.copy()}

    def set_state(self, state: Dict[str, np.ndarray]) -> None:
        """Go back to what ``get_state`` gave."""
        self._sums = np.array(state["works"])


def mean_pull(grid: Any, problem: Any) -> np.ndarray:
    """``frame_pull`` of the ``problem``, its mean over the step as the rule of time takes forces, (D,)."""
    ends = [1.0 - grid.rule.PLACE, grid.rule.PLACE]
    return np.mean([problem.frame_pull(grid.time + part * grid.dt) for part in ends], axis=0)
