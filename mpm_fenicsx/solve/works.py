"""Work done on the bodies, and energy that friction and the scheme take, step by step.

A force does the work of its mean over the step along the displacement of what it acts on. That of gravity is
in the potential energy, which is linear. On the grid, with u = dt/2 (v + v'), the change of kinetic energy is
the work of the forces that have acted. With the inner forces f of the stresses at both ends of the step, each
on the grid of the step (``terms.stress_work``),

    work from outside - friction - hits - change of (kinetic energy of the nodes + potential + springs)
        = inner + carried + inertia + iterations,        inner = 1/2 (f + f') . u,

exactly, and each part is computed on its own. Inner work is what strain gains and plastic flow takes, up to
the error of the mean stress along a finite step.

Newmark's method is the mean of both ends where the accelerations a and a' are those of the forces there. But
points carry accelerations from the grid of one step to that of the next, where loads L, springs S and inner
forces of the same points are others; and consistent inertia and ghost penalties are not the lumped masses M
by which energy counts. With the residual R' that is left at the end, at free unknowns by Newton's tolerance,

    carried = 1/2 (L + S - f - M a) . u,      inertia = 1/2 (L' + S' + R' - f' - M a') . u,
    iterations = -1/2 R' . u;

the force R' of supports counts at both ends. The midpoint rule has one force, with the stress in the middle:

    carried = (1/2 (S - S') + f_middle - 1/2 (f + f')) . u,      inertia and iterations are twice these.
"""
from typing import Any, Dict

import numpy as np

from ..collective import total
from ..compiled import compiled
from ..terms import midpoint
from ..terms.springs import NOTHING_SPENT, Spent

OF_STEPS = ("loads", "body force", "base", "interface", "supports", "walls", "friction", "hits", "springs",
            "nodes", "iterations", "inner", "carried", "inertia")
OF_POINTS = "left", "strain left", "plastic"
KINDS = *OF_STEPS, *OF_POINTS
BOOKED = "inner", "carried", "inertia"  # only where they are asked for


@compiled
def work_of_nodes(force, holder, u, mass, before, after):
    """Work of the ``force`` on held unknowns, those with a ``holder`` that is not negative, and on the others
    along u, (n, D) each, and change of the kinetic energy of the same nodes from velocity ``before`` to
    ``after`` [J]; of mass, before and after more may follow."""
    held = free = nodes = 0.0
    for p in range(len(u)):
        for i in range(u.shape[1]):
            if holder[p, i] >= 0:
                held += force[p, i] * u[p, i]
            else:
                free += force[p, i] * u[p, i]
            a, b = before[p, i], after[p, i]
            nodes += 0.5 * mass[p] * (b - a) * (b + a)
    return held, free, nodes


class Works:
    """Sums since the start [J] by kind: work of loads, body force, motion of the base and interface, of
    supports and walls that move, what friction and hits have taken (see ``springs.spend``) and springs have
    stored, the change of the nodes' kinetic energy over the steps, what iterations have left, the parts
    ``BOOKED`` where the works are ``booked``, zero elsewhere; strain and potential energy of what has left
    less that of what has come, strain energy alone, and what plastic flow had taken from it. Collective."""

    def __init__(self, comm: Any) -> None:
        self._comm, self._sums, self.booked = comm, np.zeros(len(KINDS)), False

    def sums(self) -> Dict[str, float]:
        """Kind → [J]."""
        return dict(zip(KINDS, self._sums.tolist()))

    def leave(self, body: Any, chosen: np.ndarray, gravity: np.ndarray, sign: float = 1.0) -> None:
        """The ``chosen`` points of a body leave; gravity: [m/s^2], (D,); sign: -1 of those that enter."""
        _, strain, potential = body.energies(gravity, chosen)
        gone = [strain + potential, strain, body.plastic_work(chosen)]
        self._sums[-len(OF_POINTS):] += sign * total(self._comm, gone)

    def enter(self, body: Any, chosen: np.ndarray, gravity: np.ndarray) -> None:
        """The ``chosen`` points of a body have come."""
        self.leave(body, chosen, gravity, -1.0)

    def settled(self, stored: float) -> None:
        """Loads have been raised without inertia, and springs store that much now."""
        self._sums[KINDS.index("springs")] = stored

    def step(self, grid: Any, problem: Any, found: Any, increment: Any) -> None:
        """A step is done. found: see ``impulses.Forces``."""
        u, v = increment.u[:len(found.holder)], grid.rule.velocity(grid, increment)
        held, free, nodes = work_of_nodes(found.imbalance, found.holder, u, grid.mass, grid.v, v)
        springs = Spent(*map(sum, zip(NOTHING_SPENT, *(term.spent for term, _ in found.springs))))
        moved = grid.mass[:len(u)] @ u
        base = 0.0 if problem.frame_pull is None else pulls(grid, problem) @ moved
        given = np.array([
            sum(load.work(u) for load in problem.loads),
            0.0 if found.body is None else np.vdot(found.body[:len(u)], u),
            np.mean(base), problem.interface.work(u), held, springs.walls])
        of_scheme = [0.0, 0.0, 0.0]
        if self.booked:
            same = given.sum() - np.mean(base) - springs.friction - springs.hits - springs.stored
            same += problem.gravity @ moved
            forces = same - springs.uneven, same + springs.uneven + free
            of_scheme = split(grid, problem, increment, forces + base * np.ones(2), springs.uneven)
        share = 1.0 if grid.rule is midpoint else 0.5
        self._sums[:len(OF_STEPS)] += total(self._comm, [
            *given, springs.friction, springs.hits, springs.stored, nodes, -share * free, *of_scheme])

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


def split(grid: Any, problem: Any, increment: Any, outer: np.ndarray, uneven: float) -> np.ndarray:
    """Parts ``BOOKED`` of this rank's share of a step [J]. outer: work of all but inner forces and inertia at
    the start and at the end of it, in this order; uneven: see ``springs.Spent``."""
    first, last, *middle = np.sum([body.worked for body in problem.bodies], axis=0)
    n, u = grid.active_cells.owned, increment.u
    of_inertia = [float(grid.mass[:n] @ np.einsum("ni,ni->n", a[:n], u[:n])) for a in (grid.a, increment.a)]
    inner = 0.5 * (first + last)
    if middle:
        return np.array([inner, middle[0] - inner - uneven, outer[1] - middle[0] - of_inertia[1]])
    carried, inertia = 0.5 * (outer - (first, last) - of_inertia)
    return np.array([inner, carried, inertia])


def pulls(grid: Any, problem: Any) -> np.ndarray:
    """``frame_pull`` of the ``problem`` as the rule of time takes forces at both ends of the step, (2, D)."""
    ends = [1.0 - grid.rule.PLACE, grid.rule.PLACE]
    return np.array([problem.frame_pull(grid.time + part * grid.dt) for part in ends])
