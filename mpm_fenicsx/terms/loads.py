"""Forces on boundary particles that follow the body: those given to the interface, and the ``Load`` records
of a scene.

A load is constant over each step and explicit: its geometry is that of the middle of the step, predicted from
velocity and acceleration of the grid at its start. It has no part in the tangent, which stays symmetric. The
stiffness that a following load would have is p/h per length, small against the inertia rho h / dt^2 in all
but near-static runs with a large step."""
import numpy as np

from ..collective import somewhere, total
from ..errors import MPMError
from ..points.moments import wrench, wrenches
from ..points.points import Points
from ..points.surface import everywhere, normal_areas, to_particles

# Of the stiffness of a node whose neighbours hold still, that of one whose neighbours give way.
NEIGHBOURS = 0.5


class PointForces:
    """Forces on boundary particles as a term of a step, see ``grid_state``: they reach the nodes (eq. 13),
    and the particles follow the nodes. ``points``: the particles on this rank, with ``force``, the last one
    [N]; ``nodal``: what they have been on the nodes in the last step, shape (nodes, D), None where there were
    none; ``applied``: their sum [N], shape (D,). Collective."""

    nodal = None

    def __init__(self, points, outflow=None):
        """outflow: says which of them are at the edge of the grid for good, see ``outflow.Outflow``."""
        self.points, self._outflow = points, outflow

    def attach(self, active_cells):
        """Work arrays; needed whenever the number of particles on this rank changes."""
        n, K = len(self.points), active_cells.cells.shape[1]
        self._N, self._G = np.empty((n, K)), np.empty((n, active_cells.dim, K))

    def locate(self, grid):
        """Basis at the particles, on nodes that bear them only (eq. 14). Returns the first particle that has
        none near it, or -1."""
        p = self.points
        lost = self._put_on(grid, grid.bearing, self._N)
        if lost >= 0 and grid.smooth:  # on a drop none of whose nodes bears
            whole = np.empty_like(self._N)
            lost = self._put_on(grid, grid.active, whole)
            bare = ~self._N.any(axis=1)
            self._N[bare] = whole[bare]
        return self._outflow.first_lost(p, self._N) if hasattr(p, "off") else lost

    def _put_on(self, grid, nodes, N):
        """Basis at the particles on ``nodes``, a mask, into N; the first particle that has none, or -1."""
        p, cells = self.points, grid.active_cells.cells
        grid.shapes(p.cell, p.x, N, self._G)
        return grid.kernels.only_active(p.cell, cells, nodes, N)

    def forces(self, grid):
        """Over the step, on this rank's particles [N], shape (n, D): those that are given."""
        return grid.force

    def begin(self, grid, load):
        """Add the forces to ``load`` [N], shape (nodes, D); ``applied`` is their sum. Returns the jump of the
        nodes' acceleration [m/s^2], shape (nodes, D), or None.

        A load that is constant over each step jumps between steps, and with it the acceleration of the nodes
        and of what moves with them: Newmark's method then does the work of the load and takes up its impulse,
        step by step."""
        cells, force, jump = grid.active_cells, self.forces(grid), None
        last = self.last_force()
        jumps, acts = somewhere(cells.comm, (force != last).any(), force.any())
        self.change = None
        if jumps:
            jump = self._spread(grid, force - last)
            cells.accumulate(jump)
            self.change = force - last, jump.copy()
            jump[grid.active] /= grid.mass[grid.active, None]
            jump[cells.fixed] = 0.0
            self._keep(force)
        self.nodal, self.applied = None, np.zeros(cells.dim)
        if acts:
            self.nodal = nodal = self._spread(grid, force)
            cells.accumulate(nodal)
            load += nodal
            self.applied = total(cells.comm, nodal[:cells.owned].sum(axis=0))
        return jump

    def last_force(self):
        """Forces in the last step [N], shape (n, D)."""
        return self.points.force

    def _keep(self, force):
        """The last ones from now on."""
        self.points.force[:] = force

    def _spread(self, grid, force):
        """Eq. 13: forces of this rank's particles on its nodes [N], shape (nodes, D)."""
        nodal = np.zeros_like(grid.v)
        grid.kernels.spread(self.points.cell, grid.active_cells.cells, self._N, force, nodal)
        return nodal

    def wrenches(self, grid, places, force):
        """What a ``force`` on this rank's particles, shape (n, D) [N], does to the nodes at their ``places``
        [m], shape (nodes, D): rows as of ``moments.wrenches``."""
        rows = wrenches(self._carried(grid, places), force)
        rows[:, :force.shape[1]] *= self._N.sum(axis=1, keepdims=True)
        return rows

    def wrench_at_particles(self, grid, places, force):
        """The sum of ``wrenches`` if the ``force`` acted where this rank's particles are while the nodes are
        at their ``places`` in the step: before they have moved, or after."""
        ahead = (1.0 / grid.rule.PLACE - 1.0) * (places - grid.active_cells.places)
        x, share = self._own(grid, ahead)
        return wrench(x, share[:, None] * force)

    def _own(self, grid, ahead):
        """Places [m], shape (n, D), that the particles had while the nodes had to go ``ahead`` [m], (nodes,
        D), still, and the sum of their basis, (n,)."""
        return self.points.x - self._carried(grid, ahead), self._N.sum(axis=1)

    def _carried(self, grid, u):
        """What the nodes' u, shape (nodes, D), as displacement or place [m], is at the particles, (n, D)."""
        ahead = np.zeros_like(self.points.x)
        grid.kernels.interpolate(self.points.cell, grid.active_cells.cells, self._N, u, ahead)
        return ahead

    def work(self, u):
        """Of the forces on this rank's nodes [J] while these move by u [m], shape (owned, D)."""
        return 0.0 if self.nodal is None else np.vdot(self.nodal[:len(u)], u)

    def accelerate(self, grid, jump):
        """The particles' share in a ``jump`` of the nodes' acceleration [m/s^2], shape (nodes, D)."""
        grid.kernels.interpolate(self.points.cell, grid.active_cells.cells, self._N, jump, self.points.a)

    def finish(self, grid, trial, increment):
        """Move the particles with the nodes; there is no trial."""
        p = self.points
        grid.kernels.to_points(p.cell, grid.active_cells.cells, self._N, increment, p.x, p.v, p.a)

    def force_cells(self):
        """Number of the force cell of each particle on this rank, from 1 on, 0 for none, shape (n,)."""
        return self.points.force_cell

    def window_mass(self, grid):
        """Of each particle on this rank, the mass [kg] of a free body that a force would move as far over a
        step like the last one, shape (n,): that of the nodes, and dt^2/4 times their stiffness. An estimate
        from the diagonal of the tangent, within a factor of two. Infinite where supported, and before the
        first step (grid: None)."""
        return self._mass_at(grid, self.points.cell, self.points.x)

    def _mass_at(self, grid, cell, x):
        """The same at places x [m], shape (n, D), in the cells ``cell``, (n,)."""
        if grid is None:
            return np.full(len(x), np.inf)
        cells = grid.active_cells
        nodes = cells.cells[cell]
        (n, K), D = nodes.shape, cells.dim
        N, G = np.empty((n, K)), np.empty((n, D, K))
        grid.shapes(cell, np.ascontiguousarray(x), N, G)
        N = np.where(grid.active[nodes], N, 0.0)
        N /= np.maximum(N.sum(axis=1, keepdims=True), 1e-300)
        diagonal = cells.matrix.getDiagonal().array.reshape(cells.owned, cells.dim) / grid.rule.alpha(grid.dt)
        stiffness = np.maximum(cells.with_ghosts(diagonal) - grid.mass[:, None], 0.0)
        mass = grid.mass[:, None] + NEIGHBOURS * stiffness
        with np.errstate(divide="ignore"):
            give = np.where(grid.active[:, None] & ~cells.fixed, 1.0 / mass, 0.0)
            return 1.0 / np.einsum("nk,nkd->nd", N**2, give[nodes]).max(axis=1, initial=0.0)


class SurfaceLoads(PointForces):
    """The ``Load`` records of a scene, on particles of their own.

    Raises ValueError for a surface of another dimension.
    """

    def __init__(self, loads, dim, start, outflow=None):
        """start: the bodies at the start, see ``bodies.Start``."""
        self._loads, self._thickness, self._of_load, n = tuple(loads), start.thickness, [], 0
        for load in loads:
            if np.shape(load.surface.x)[1] != dim:
                raise ValueError(f"the surface of {load.name} has {np.shape(load.surface.x)[1]} dimensions, "
                                 f"the scene {dim}: give both the same")
            self._of_load.append(slice(n, n + len(load.surface.x)))
            n += len(load.surface.x)
        x = np.concatenate([np.asarray(load.surface.x, float) for load in loads])
        self.count, self.follows = n, any(load.kind != "force" for load in loads)
        self.names = np.repeat([load.name for load in loads], [len(load.surface.x) for load in loads])
        super().__init__(Points(gid=np.arange(n), cell=np.zeros(n, np.int32), x=x, v=start.velocity(x),
                                a=start.acceleration(x), force=np.zeros((n, dim)), **start.field(x)), outflow)

    def forces(self, grid):
        """Over the step, on this rank's particles [N], shape (n, D): those of the records in the middle of
        it."""
        return self.at(grid.active_cells.comm, grid.time + 0.5 * grid.dt, self._half_way(grid))

    def at(self, comm, time, ahead):
        """Forces of the records at ``time`` [s] on this rank's particles [N], shape (n, D), with the surfaces
        ``ahead`` [m], shape (n, D), of where they are. Collective."""
        p = self.points
        whole = np.empty((self.count, p.x.shape[1]))
        if self.follows:
            x = everywhere(comm, p.gid, p.x + ahead, self.count)
        for load, own in zip(self._loads, self._of_load):
            value = load.at(time)
            if load.kind == "force":
                whole[own] = value
                continue
            elements = np.asarray(load.surface.elements)
            area = normal_areas(x[own], elements)
            if load.kind == "traction":
                area = np.linalg.norm(area, axis=1)[:, None]
            share = to_particles(area, elements, own.stop - own.start) * self._thickness
            whole[own] = share * (value if load.kind == "traction" else -value)
        return whole[p.gid]

    def _half_way(self, grid):
        """How far the nodes carry the particles in half a step, at the velocity and acceleration of its start
        [m]."""
        return self._carried(grid, 0.5 * grid.dt * grid.v + 0.125 * grid.dt**2 * grid.a)

    def on_nodes(self, grid, u):
        """This rank's share of the loads at the grid's time [N], (nodes, D), where the nodes' displacement u
        [m], (nodes, D), has taken the particles; they become their ``force``. Collective."""
        self.points.force[:] = self.at(grid.active_cells.comm, grid.time, self._carried(grid, u))
        self.nodal = self._spread(grid, self.points.force)
        return self.nodal.copy()


def raise_lost(terms, lost, grid, origin):
    """MPMError that names the first particle none of whose nodes carries mass. lost: what ``locate`` of each
    term has returned; origin: of the coordinates in the user's [m], shape (D,). Collective."""
    found = [(int(term.points.gid[k]), (term.points.x[k] + origin).tolist())
             for term, k in zip(terms, lost) if k >= 0]
    number, x = min(sum(grid.active_cells.comm.allgather(found), []))
    raise MPMError(f"boundary particle {number} at x = {x} m has no material point near it at t = "
                   f"{grid.time:.6g} s: move the interface into the body (shift) or seed more points")
