"""Impulses: what has changed the momentum of the material points, step by step and by name.

Linear momentum follows from the discrete scheme, no part is what the others leave. By the partition of unity
Newmark's method, whose points add up accelerations, changes the momentum of the points by

    sum_p m_p (v'_p - v_p) = dt/2 (sum_p m_p a_p + sum_I m_I a'_I),

where m_p a_p, summed, is m_I a_I of the step before, with the jumps of loads and without what has left. The
midpoint rule gives the points the velocity of the nodes:

    sum_p m_p (v'_p - v_p) = sum_I m_I (v_I - v_I^0) + dt sum_I m_I a_I + (sum_I m_I v_I^0 - sum_p m_p v_p),

v_I^0 as it comes from the points, v_I with the velocity of supports. And with the residual R_I of the
equations of motion, loads in it, which is zero but for Newton's tolerance at free nodes,

    sum_I m_I a_I = sum of loads + sum of springs + sum_I R_I,

as inner forces and ghost penalties sum to zero, and consistent inertia to that of lumped masses. R_I at a
held unknown is the force of its support. At the others, nodes without mass among them, it is booked as
"numerical".

Angular momentum: moments of the same forces, about zero, at the places of the nodes where the rule of time
takes the forces: at the end of the step, or in its middle. Springs count at their particles, and so does the
interface. Its particles may hang on nodes that do not surround them (eq. 14): what these turn more than the
forces at the places of the particles is "arms". What else turns the points is "numerical": the way from
points to grid and back, consistent inertia, and with Newmark's method the rule of time, see ``midpoint``.
"""
from typing import Any, Dict, List, NamedTuple, Optional

import numpy as np

from ..collective import total
from ..points.moments import add_weight, add_wrenches, moment, wrench
from ..terms import midpoint

GRAVITY, BODY, INTERFACE, NUMERICAL = "gravity", "body force", "interface", "numerical"
BASE, INFLOW, OUTFLOW, ARMS = "base", "inflow", "outflow", "arms"


class Forces(NamedTuple):
    """What a step knows at its end: the ``imbalance`` of the equations, shape (owned, D) [N]; ``places`` of
    the nodes where forces act, shape (nodes, D) [m]; velocity ``v`` of the nodes as it came from the points,
    (nodes, D) [m/s]; the ``body`` force, (nodes, D) [N], or None; ``springs``, pairs of a term with its
    trial; ``holder``: number of the support of each unknown, (owned, D), -1 where there is none."""

    imbalance: np.ndarray
    places: np.ndarray
    v: np.ndarray
    body: Optional[np.ndarray]
    springs: list
    holder: np.ndarray


class Impulses:
    """Sums since the start by name, in rows of D linear [N s] and 1 or 3 angular numbers [N m s] about the
    origin of the frame. ``names``: of the rows; ``regions``: those of supports, walls and structures.
    Collective."""

    def __init__(self, comm: Any, origin: np.ndarray, names: List[str], supports: List[str]) -> None:
        """names: of what acts besides ``supports``, gravity and the scheme itself; supports: of each."""
        self._comm, self._origin, self._dim = comm, origin, len(origin)
        self.names = [*dict.fromkeys([GRAVITY, *names, *supports, NUMERICAL])]
        self.regions: List[str] = [*dict.fromkeys(supports)]
        self._row = {name: number for number, name in enumerate(self.names)}
        self._holder = np.array([self._row[name] for name in (*supports, NUMERICAL)], int)  # last: of none
        shape = len(self.names), self._dim + (1 if self._dim == 2 else 3)
        self._sums, self._last = np.zeros(shape), np.zeros(shape)
        self._before = np.zeros(shape[1])  # momentum of the points at the start of a step

    def sums(self) -> Dict[str, np.ndarray]:
        """Name → row, about zero in the user's coordinates."""
        rows = self._sums.copy()
        if self._origin.any():
            rows[:, self._dim:] += [moment(self._origin[None], row[None, :self._dim]) for row in rows]
        return dict(zip(self.names, rows))

    # ---------------------------------------------------------------- who books

    def start(self, bodies: list, gravity: np.ndarray, frame_pull: np.ndarray) -> None:
        """All points are at the start, with the accelerations of gravity, base and body force; or, under a
        stress that is given, at rest, or with those of a checkpoint: what holds them is not known yet, it is
        numerical. Collective."""
        for body in bodies:
            p, held = body.points, (body.body.stress or body.body.start) is not None
            pull = np.broadcast_to(gravity, p.x.shape)
            self._last[self._row[GRAVITY]] += wrench(p.x, p.mass[:, None] * pull)
            if BASE in self._row:
                base = np.broadcast_to(frame_pull, p.x.shape)
                self._last[self._row[BASE]] += wrench(p.x, p.mass[:, None] * base)
                pull = pull + base
            if held or BODY in self._row:
                row = self._row[NUMERICAL if held else BODY]
                self._last[row] += wrench(p.x, p.mass[:, None] * (p.a - pull))
        self._last = total(self._comm, self._last)

    def leave(self, body: Any, chosen: np.ndarray, gravity: np.ndarray) -> None:
        """The ``chosen`` points of a body leave, with their momentum and the forces that they carry on."""
        self._add_points(body, chosen, OUTFLOW, -1.0)

    def enter(self, body: Any, chosen: np.ndarray, gravity: np.ndarray) -> None:
        """The ``chosen`` points of a body have come, with theirs."""
        self._add_points(body, chosen, INFLOW, 1.0)

    def _add_points(self, body: Any, chosen: np.ndarray, name: str, sign: float) -> None:
        p, row = body.points, self._row[name]
        carried = wrench(p.x[chosen], p.mass[chosen, None] * p.a[chosen])
        given = total(self._comm, [body.momentum(chosen), carried])
        self._sums[row] += sign * given[0]
        self._last[row] += sign * given[1]

    def begin(self, grid: Any) -> np.ndarray:
        """The nodes have just got what the points have. Returns their velocity, before supports set it."""
        self._before = self._of_points(grid.bodies)
        return grid.v.copy()

    def jumped(self, grid: Any, load: Any, holder: np.ndarray) -> None:
        """A ``load`` has jumped at the start of a step, and with it the accelerations of the points: not
        those of held nodes, where the support takes it."""
        if grid.rule is midpoint:
            return
        change, nodal = load.change
        jump = np.zeros_like(self._last)
        self._add_load(grid, load, grid.active_cells.places, nodal, change, jump)
        self._add_supports(holder, grid.active_cells.places, -nodal, jump)
        self._last += total(self._comm, jump)
        if getattr(load, "names", None) is None:  # it may have other particles than those of its last forces
            whole = load.wrench_at_particles(grid, grid.active_cells.places, load.last_force())
            self._to_arms(self._last, total(self._comm, whole))

    def _to_arms(self, rows: np.ndarray, whole: np.ndarray) -> None:
        """Of what the interface turns by its nodes, what it does not by its particles, ``whole``."""
        turned = slice(self._dim, None)
        rest = rows[self._row[INTERFACE], turned] - whole[turned]
        rows[self._row[INTERFACE], turned] -= rest
        rows[self._row[ARMS], turned] += rest

    def step(self, grid: Any, problem: Any, found: Any, increment: Any) -> None:
        """A step is done, and all points have moved. found: what the step knows of it, a ``Forces``."""
        now = self._forces(grid, problem, found)
        now[-1] = self._of_points(grid.bodies) - self._before
        now = total(self._comm, now)
        forces, turned = now[:-1], now[-1, self._dim:]
        if grid.rule is midpoint:
            given = grid.dt * forces
            given += self._at_start(grid, found)
        else:
            given = 0.5 * grid.dt * (self._last + forces)
        given[self._row[NUMERICAL], self._dim:] += turned - given[:, self._dim:].sum(axis=0)
        self._sums += given
        self._last = forces

    def settled(self, grid: Any, problem: Any, found: Any, left: float) -> None:
        """A load step without inertia is done, ``left`` is the part of the loads in it; the points stand, and
        their accelerations are zero."""
        forces = total(self._comm, self._forces(grid, problem, found, left)[:-1])
        forces[self._row[NUMERICAL]] -= forces.sum(axis=0)
        self._last = forces

    def now(self, bodies: list) -> np.ndarray:
        """Momentum of the points, linear and about the origin, as a row."""
        return total(self._comm, self._of_points(bodies))

    def stop(self, momentum: np.ndarray) -> None:
        """The points have been brought to rest from this ``momentum``, not by a step in time."""
        self._sums[self._row[NUMERICAL]] -= momentum

    # ---------------------------------------------------------------- sums over this rank

    def _of_points(self, bodies: list) -> np.ndarray:
        """Momentum and angular momentum of this rank's points."""
        first, *others = [body.momentum() for body in bodies]
        return sum(others, first)

    def _forces(self, grid: Any, problem: Any, found: Any, part: float = 1.0) -> np.ndarray:
        """Rows by name: forces of the step and their moments at the ``places`` of the nodes, and one more,
        empty. part: of the dead loads."""
        n, places = grid.active_cells.owned, found.places
        rows = np.zeros((len(self.names) + 1, self._last.shape[1]))
        if problem.gravity.any():
            add_weight(grid.mass[:n], places, part * problem.gravity, rows[self._row[GRAVITY]])
        if BASE in self._row:
            pull = problem.base_pull(grid) * np.ones(self._dim)
            add_weight(grid.mass[:n], places, pull, rows[self._row[BASE]])
        if found.body is not None:
            rows[self._row[BODY]] += part * wrench(places[:n], found.body[:n])
        for load in (problem.interface, *problem.loads):
            if load.nodal is not None:
                self._add_load(grid, load, places, part * load.nodal, part * load.last_force(), rows)
        add_wrenches(places, found.imbalance, found.holder, self._holder, rows)
        for term, answer in found.springs:
            self._add_springs(grid, term, answer, places, rows)
        return rows

    def _add_load(self, grid: Any, load: Any, places: np.ndarray, nodal: np.ndarray, force: np.ndarray,
                  rows: np.ndarray) -> None:
        """nodal: what a ``load`` is on the nodes, whole at those of this rank, as its ``force`` is that on
        its particles here."""
        names, n = getattr(load, "names", None), grid.active_cells.owned
        if names is None:
            found = wrench(places[:n], nodal[:n])
            rows[self._row[INTERFACE]] += found
            self._to_arms(rows, load.wrench_at_particles(grid, places, force))
            return
        found, names = load.wrenches(grid, places, force), names[load.points.gid]
        for name in np.unique(names):
            rows[self._row[str(name)]] += found[names == name].sum(axis=0)

    def _add_supports(self, holder: np.ndarray, places: np.ndarray, force: np.ndarray,
                      rows: np.ndarray) -> None:
        """Of a ``force`` on the nodes what is at held unknowns of this rank goes to their holders."""
        n = len(holder)
        force = np.where(holder >= 0, force[:n], 0.0)
        if force.any():
            add_wrenches(places, force, holder, self._holder, rows)

    def _add_springs(self, grid: Any, term: Any, answer: Any, places: np.ndarray, rows: np.ndarray) -> None:
        """What they say themselves by name; the difference to what the nodes get is the scheme's."""
        nodal = np.zeros_like(grid.v)
        term.spread(grid, answer, nodal)
        rows[self._row[NUMERICAL]] -= wrench(places, nodal)
        for name, held in term.held().items():
            rows[self._row[name]] += held
            rows[self._row[NUMERICAL]] -= held

    def _at_start(self, grid: Any, found: Forces) -> np.ndarray:
        """With the midpoint rule: what setting the velocity of held nodes does, and the momentum that points
        get on their way to the nodes."""
        rows, v, n, linear = np.zeros_like(self._last), found.v, len(found.holder), slice(self._dim)
        kick = grid.mass[:n, None] * (grid.v[:n] - v[:n])
        self._add_supports(found.holder, grid.active_cells.places, kick, rows)
        rows[self._row[NUMERICAL], linear] += grid.mass[:n] @ v[:n] - self._before[linear]
        return total(self._comm, rows)

    # ---------------------------------------------------------------- state

    def get_state(self) -> Dict[str, np.ndarray]:
        """As name → array copy."""
        return {"impulses": np.stack([self._sums, self._last])}

    def set_state(self, state: Dict[str, np.ndarray]) -> None:
        """Go back to what ``get_state`` gave."""
        self._sums, self._last = np.array(state["impulses"])


def make_impulses(model: Any, scene: Any) -> Impulses:
    """Of a ``model`` of the ``scene`` at its start, for all that acts on it."""
    springs = [name for term in (*model.penalties, *model._contacts) for name in term.held()]
    names = [*springs, *(str(load.name) for load in scene.loads)]
    touched = scene.interface is not None
    there = {BODY: model._bodies[0].has_body_force, INTERFACE: touched, ARMS: touched,
             BASE: scene.base is not None, OUTFLOW: model._outflow.active, INFLOW: len(model._feeds) > 0}
    names += [name for name, some in there.items() if some]
    impulses = Impulses(model.comm, model.origin, names, model.supports.names)
    impulses.regions = [*dict.fromkeys([*springs, *impulses.regions])]
    impulses.start(model._bodies, model.gravity, scene.frame_pull(0.0))
    return impulses
