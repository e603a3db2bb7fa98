"""Work done on the bodies, and energy that friction takes, step by step.

A force does the work of its mean over the step along the displacement of what it acts on. That of gravity is
in the potential energy, which is linear. On the grid, with u = dt/2 (v + v'), the change of kinetic energy is
the work of all forces, inner ones too, so that

    work from outside - friction - hits
        - change of (kinetic energy of the nodes + strain + potential + springs)

is what plastic flow has taken, up to the error of the stress in time and of F-bar's mean. What the laws say
that it has taken (``plastic_work`` of their states) is known apart from that. Kinetic energy that the
transfers between points and grid make or lose, and held nodes that are stopped, is in no part: it is the
scheme's, and what is left of the whole balance.
"""
from typing import Any, Dict

import numpy as np

from ..collective import total
from ..compiled import compiled

KINDS = ("loads", "body force", "base", "interface", "supports", "walls", "friction", "hits", "nodes",
         "left", "plastic")


@compiled
def work_of_nodes(force, holder, u, mass, before, after):
    """Work of the ``force`` on held unknowns, those with a ``holder`` that is not negative, along u, (n, D)
    each, and change of the kinetic energy of the same nodes from velocity ``before`` to ``after`` [J]; of
    mass, before and after more may follow."""
    held = nodes = 0.0
    for p in range(len(u)):
        for i in range(u.shape[1]):
            if holder[p, i] >= 0:
                held += force[p, i] * u[p, i]
            a, b = before[p, i], after[p, i]
            nodes += 0.5 * mass[p] * (b - a) * (b + a)
    return held, nodes


class Works:
    """Sums since the start [J] by kind: work of loads, body force, motion of the base and interface, of
    supports and walls that move, what friction and hits have taken (see ``springs.spend``), the change of the
    nodes' kinetic energy over the steps, strain and potential energy of what has left less that of what has
    come, and what plastic flow had taken from it. Collective."""

    def __init__(self, comm: Any) -> None:
        self._comm, self._sums = comm, np.zeros(len(KINDS))

    def sums(self) -> Dict[str, float]:
        """Kind → [J]."""
        return dict(zip(KINDS, self._sums.tolist()))

    def leave(self, body: Any, chosen: np.ndarray, gravity: np.ndarray, sign: float = 1.0) -> None:
        """The ``chosen`` points of a body leave; gravity: [m/s^2], (D,); sign: -1 of those that enter."""
        gone = [sum(body.energies(gravity, chosen)[1:]), body.plastic_work(chosen)]
        self._sums[-2:] += sign * total(self._comm, gone)

    def enter(self, body: Any, chosen: np.ndarray, gravity: np.ndarray) -> None:
        """The ``chosen`` points of a body have come."""
        self.leave(body, chosen, gravity, -1.0)

    def step(self, grid: Any, problem: Any, found: Any, increment: Any) -> None:
        """A step is done. found: see ``impulses.Forces``."""
        u, v = increment.u[:len(found.holder)], grid.rule.velocity(grid, increment)
        held, nodes = work_of_nodes(found.imbalance, found.holder, u, grid.mass, grid.v, v)
        of_springs = map(sum, zip((0.0, 0.0, 0.0), *(term.spent for term, _ in found.springs)))
        self._sums[:-2] += total(self._comm, [
            sum(load.work(u) for load in problem.loads),
            0.0 if found.body is None else np.vdot(found.body[:len(u)], u),
            0.0 if problem.frame_pull is None else mean_pull(grid, problem) @ (grid.mass[:len(u)] @ u),
            problem.interface.work(u), held, *of_springs, nodes])

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
