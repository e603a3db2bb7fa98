"""One implicit step on the active cells, the paper's phases I to III: to the nodes, solve, and back."""
import numpy as np

from ..collective import somewhere, total
from ..errors import MPMDivergedError
from ..grid.active_cells import ActiveCells
from ..terms.ghost import Ghost
from ..terms.grid_state import GridState, nodal_means
from ..terms.light_cells import LightCells
from ..terms.loads import raise_lost
from ..terms.penalty import walls_in_reach
from ..terms.scene_penalties import softest
from .clock import Clock
from .coarse_grids import Nodes
from .equations import Equations, Known
from .impulses import Forces
from .snes import Newton
from .tangents import Tangents
from .tolerance import LATE, Kind, Norms, squares


class Step:
    """Advances the points of a ``problem.Problem`` by one step, while they stay in the ``active_cells``.

    phases: seconds per phase, added to. doubt: see ``options``. facets: ``ghost.Facets`` for the ghost
    penalty on inertia, or None. After ``begin`` ``grid`` is the ``GridState`` of the step, after ``finish``
    ``finished`` are this and the ``Increment`` of its nodes (None before). Collective."""

    static = False  # whether it is a load step without inertia, see ``statics``
    equations_of, late = Equations, LATE  # late: see ``Tolerance``

    def __init__(self, background, kernels, filled, problem, phases, doubt, facets=None):
        """filled: numbers of this rank's cells that hold points."""
        self.comm, self.dim, self.background = background.comm, background.dim, background
        self.kernels, self.filled, self.problem = kernels, filled, problem
        self.clock, self.grid, self.finished = Clock(background.comm, phases), None, None
        penalties, symmetric, plastic = problem.penalties, problem.symmetric, problem.plastic
        self.active_cells = cells = ActiveCells(
            background, filled, problem.supports.fixed, symmetric,
            any(one.body.f_bar for one in problem.bodies), facets, walls_in_reach(penalties, background),
            [pair for penalty in penalties for pair in getattr(penalty, "pairs", ())])
        self._holder, n = problem.supports.holders(cells.node[:cells.owned]), len(cells.node)
        self.active = np.zeros(n, bool)
        self.full_mass = np.prod(background.h) * min(one.body.rho * one.thickness for one in problem.bodies)
        self.ghost = facets and self._make_ghost(facets, np.prod(background.h) ** (1.0 / self.dim))
        self.tangents = Tangents(self.dim, plastic, watched=bool(penalties), anew=self.static)
        self._light = LightCells(cells) if problem.light_cells and not self.static else None
        terms = [*problem.bodies, *penalties, *(term for term in (self.ghost, self._light) if term)]
        self.equations = self.equations_of(cells, terms, penalties, self.tangents, self.clock)
        nodes, kinks = Nodes(background, cells.node[:cells.owned]), any(one.kinks for one in penalties)
        kind = Kind(self.late if kinks else {}, problem.flows and not self.static)
        self.newton = Newton(cells, self.equations, self.tangents, nodes, doubt, kind, symmetric,
                             problem.solver)
        self.newton.linear.bears_any_sign &= self.static or (
            bool(facets) or background.basis.smooth or not problem.consistent)
        self._nodal = np.empty((n, 1 + 2 * self.dim))

    def _make_ghost(self, facets, h):
        per_volume = self.full_mass / h**self.dim, softest(self.problem.bodies)
        return Ghost(facets, self.active_cells, h, per_volume, self.problem.consistent)

    def attach(self):
        """Work arrays for the points now here; needed whenever their number on this rank changes."""
        for term in (*self.problem.bodies, self.problem.interface, *self.problem.loads):
            term.attach(self.active_cells)
        for body in self.problem.bodies:
            body.begin_motion(self.active_cells, self.background)

    # ---------------------------------------------------------------- phase I: from the points to the nodes

    def begin(self, dt, time, force, stiff=False):
        """State of the nodes, known displacements and loads in a step of ``dt`` from ``time`` [s] on. force:
        on this rank's particles of the interface [N], shape (n, D); stiff: with ghost stiffness."""
        self.grid = grid = self._to_grid(dt, time, force)
        if self.problem.losses.active:
            self.problem.losses.to_grid(grid)
        self._v = self.problem.impulses.begin(grid)
        self._check_located()
        if self.ghost and self.ghost.begin(grid, stiff=stiff):
            self.tangents.drop()
        lumped = self._lumped_mass()
        if self._light:
            self._light.begin(grid)
        known = self.problem.supports.displacement(self.active_cells.node, time, dt, grid.v, grid.a)
        fixed, massless = self.active_cells.fixed, ~self.active[:, None]
        # nodes without mass go with the points whose gradients they are in, as these lie on their cell's edge
        going = massless & ~fixed
        known[going] = (dt * grid.v + 0.5 * dt**2 * grid.a)[going]
        idle = (fixed | massless)[:self.active_cells.owned]
        self.equations.begin(grid, Known(self._loads(), known, idle, lumped))
        self.clock.lap("to grid")

    def _to_grid(self, dt, time, force):
        """Mass, velocity and acceleration of the nodes, those of the points by mass."""
        cells, nodal, maps = self.active_cells, self._nodal, self.background.maps
        for body in self.problem.bodies:
            body.locate(cells, self.background)
        self.clock.lap("search")
        nodal[:] = 0.0
        for body in self.problem.bodies:
            body.to_grid(nodal)
        cells.accumulate(nodal)
        return GridState(time, dt, cells, maps, self.kernels, self.problem.bodies, self.full_mass, force,
                         *nodal_means(nodal, self.full_mass), self.problem.rule,
                         self.background.basis.smooth)

    def _check_located(self):
        """Boundary particles find nodes with mass. A kept tangent goes where other nodes have it, as rows of
        nodes without are identity rows."""
        grid, problem = self.grid, self.problem
        on_boundary = (problem.interface, *problem.loads, *problem.penalties)
        lost = [term.locate(grid) for term in on_boundary]
        changed, grown, some_lost = somewhere(
            self.comm, not np.array_equal(grid.active, self.active), grid.smooth and self._outgrown(),
            max(lost) >= 0)
        if changed:
            problem.supports.check(grid.active, self.active_cells, grid.time)
            self.active = grid.active
        if changed or grown:
            self.tangents.drop()
        if some_lost:
            raise_lost(on_boundary, lost, grid, self.background.origin)

    def _outgrown(self):
        """Whether a node has more than twice or less than half the mass that it had in the kept tangent. With
        a smooth basis nodes at the rim come up from nothing, their stiffness with them."""
        now, then = self.grid.mass, self.equations.mass_then
        return bool(((now > 2.0 * then) | (now < 0.5 * then)).any())

    def _lumped_mass(self):
        """Nodal mass [kg] with lumped inertia, shape (nodes,), or None."""
        grid, smooth = self.grid, self.background.basis.smooth
        if not self.problem.consistent:
            return grid.mass
        if not self.ghost and not smooth:
            return None
        cells = ~self.ghost.consistent if self.ghost else None
        light = grid.light if smooth else None
        nodal = np.zeros((len(grid.mass), 1))
        for body in self.problem.bodies:
            body.lump(grid, cells, light, nodal)
        self.active_cells.accumulate(nodal)
        return nodal[:, 0]

    def _loads(self):
        """All loads [N], shape (nodes, D); their jumps go to the accelerations of nodes and points."""
        grid, (bodies, interface, loads, penalties, *_) = self.grid, self.problem
        load = np.zeros_like(grid.v)
        moving = (*bodies, interface, *loads, *(penalty for penalty in penalties if penalty.follows))
        forces = interface, *loads
        for force, jump in zip(forces, [term.begin(grid, load) for term in forces]):
            if jump is not None:
                grid.a[:] += jump
                for term in moving:
                    term.accelerate(grid, jump)
                self.problem.impulses.jumped(grid, force, self._holder)
                self.problem.on_bodies.jumped(grid, force)
        for penalty in penalties:
            penalty.begin(grid, load)
        load += grid.mass[:, None] * (self.problem.gravity + self.problem.base_pull(grid))
        self._body_force = self._body_load() if bodies[0].has_body_force else None
        return load if self._body_force is None else load + self._body_force

    def _body_load(self):
        """Body force [N], shape (nodes, D)."""
        load = np.zeros_like(self.grid.v)
        for body in self.problem.bodies:
            body.begin(self.grid, load)
        self.active_cells.accumulate(load)
        return load

    # ---------------------------------------------------------------- phase II: solve

    def solve(self, when):
        """The trial at the solution, see ``equations.Trial``, and the number of Newton iterations. when: see
        ``Newton.solve``."""
        grid, idle, n = self.grid, self.equations.known.idle, self.active_cells.owned
        guess = (grid.dt * grid.v + 0.5 * grid.dt**2 * grid.a)[:n]
        guess[idle] = self.equations.known.displacement[:n][idle]
        if self.tangents.start(grid.dt):
            self.newton.make_tangent(self.equations.first_trial(guess))
        try:
            trial, iterations = self.newton.solve(guess, np.where(idle, guess, 0.0), self._norms(guess), when)
        except MPMDivergedError as error:
            remains = ', or inertia="lumped"' if self.problem.consistent else ""
            raise MPMDivergedError(error.what, error.advice + remains) from None
        self.tangents.solved(iterations)
        self.clock.lap("solve")
        return trial, iterations

    def _norms(self, u):
        """Of loads and inertia, at the guess ``u`` [m], shape (owned, D). Round-off is an error of eps * h in
        the displacement times the stiffness, and of eps in the inertia."""
        grid, load, eps = self.grid, self.equations.known.load, np.finfo(float).eps
        loads, inertia, stopped, stiff = np.sqrt(total(self.comm, [
            *squares(u, load, grid.a, grid.mass, grid.rule.alpha(grid.dt)),
            self.tangents.now.stiffness2 * self.background.h.max() ** 2]))
        return Norms(loads, inertia, 4 * eps * np.hypot(stopped, stiff))

    # ---------------------------------------------------------------- phase III: back to the points

    def finish(self, trial):
        """The ``trial`` at the solution becomes the state of the points, which move with the grid; that goes
        back to rest."""
        forces = self._forces(trial, self.problem.rule.PLACE)
        trial.increment.a[~self.active] = 0.0
        self.finished, losses = (self.grid, trial.increment), self.problem.losses
        if losses.active:
            losses.solved(self.grid, trial.increment)
        for load in (self.problem.interface, *self.problem.loads):
            load.finish(self.grid, None, trial.increment)
        for term, of_term in zip(self.equations.terms, trial.of_terms):
            term.finish(self.grid, of_term, trial.increment)
        if losses.active:
            losses.to_points(self.grid)
        for books in (self.problem.impulses, self.problem.works, self.problem.on_bodies):
            books.step(self.grid, self.problem, forces, trial.increment)
        self.clock.lap("to points")

    def _forces(self, trial, place):
        """For ``impulses``; place: part of the step at which forces act."""
        springs = [(term, of_term) for term, of_term in zip(self.equations.terms, trial.of_terms)
                   if term in self.problem.penalties]
        return Forces(self.equations.imbalance(trial), self.active_cells.places + place * trial.increment.u,
                      self._v, self._body_force, springs, self._holder)

    # ---------------------------------------------------------------- state

    def get_state(self):
        """Active cells and nodes, and the kept tangent, as name → array copy."""
        state = dict(filled=self.filled.copy(), active=self.active.copy(),
                     mass_then=self.equations.mass_then.copy(), solver=np.array(self.newton.linear.preset),
                     **self.tangents.get_state(self.active_cells.get_values))
        if self.ghost:
            state.update(ghost=self.ghost.weight, ghost_stiffness=np.array([self.ghost.of_u]))
        return state

    def set_state(self, state):
        """Go back; the factorisation is made again only if the tangent has changed since."""
        self.active = state["active"].copy()
        self.equations.remember(state["mass_then"].copy())
        self.newton.linear.choose_again(str(state["solver"]))
        if self.tangents.set_state(state):
            self.active_cells.set_values(state["matrix"])
        if self.ghost:
            self.ghost.weight, self.ghost.of_u = state["ghost"], float(state["ghost_stiffness"][0])

    def window_mass(self):
        """See ``PointForces.window_mass``, of the interface's particles on this rank."""
        return self.problem.interface.window_mass(self.grid and self.grid._replace(active=self.active))

    def destroy(self):
        """Free matrix and solver."""
        self.newton.destroy()
        self.active_cells.destroy()
