"""Boundary particles in one step: their loads and springs reach the nodes, their motion follows the nodes."""
import numpy as np

from ..collective import somewhere, total
from ..errors import MPMError
from . import newmark

NEIGHBOURS = 0.5  # of the stiffness of a node whose neighbours are held, that of one whose neighbours give way


class Carriers:
    """The interface's particles and those of the scene's loads and penalties, in the active cells of a step.
    Collective."""

    def __init__(self, step, boundary):
        """step: with its points attached; boundary: the interface's particles."""
        self._step, self._comm = step, step.comm
        K, D = step.active_cells.cells.shape[1], step.dim
        particles = [boundary, *(loads.points for loads in step.loads)]
        self._loaded = [(p, np.empty((len(p), K)), np.empty((len(p), K, D))) for p in particles]

    def shapes(self):
        """Basis values at the particles that carry loads."""
        for p, N, G in self._loaded:
            self._step.shapes(p.cell, p.x, N, G)

    def take_stock(self, active, force):
        """The basis of eq. 14 on the ``active`` nodes, shape (nodes,), and what there is to do under the ``force`` on
        the interface's particles [N]; returns whether other nodes are active than before."""
        step, boundary = self._step, self._loaded[0][0]
        self._riders = [(p, N) for p, N, _ in self._loaded]
        self._lost = [step.kernels.only_active(p.cell, step.active_cells.cells, active, N) for p, N, _ in self._loaded]
        if step.outflow is not None and step.outflow.active:
            self._lost = [step.outflow.first_lost(p, N) if hasattr(p, "off") else k
                          for (p, N), k in zip(self._riders, self._lost)]
        self._lost += [held.locate(step) for held in step.penalties]
        self._riders += [(held.points, held.N) for held in step.penalties if held.follows]
        changed, self._some_lost, self._jumps, self._acts = somewhere(
            self._comm, not np.array_equal(active, step.active), max(self._lost) >= 0, (force != boundary.force).any(),
            force.any())
        return changed

    def begin(self, time, force, load):
        """Add the loads [N] to ``load``, shape (nodes, D), and their jumps to the accelerations; get the springs ready.
        force: on the interface's particles [N]. Returns its sum over the nodes [N]."""
        step = self._step
        if self._some_lost:
            self._raise_lost(time)
        forces = [loads.forces(self._comm, time, step.dt, self._half_way(*rider))
                  for loads, rider in zip(step.loads, self._riders[1:])]
        applied = self._carry(*self._riders[0], force, load, self._jumps, self._acts)
        for rider, f in zip(self._riders[1:], forces):
            jumps, acts = somewhere(self._comm, (f != rider[0].force).any(), f.any())
            self._carry(*rider, f, load, jumps, acts)
        for held in step.penalties:
            held.begin(step, time)
        return applied

    def _carry(self, points, N, force, load, jumps, acts):
        """Eq. 13; jumps: the force has changed somewhere; acts: there is one. Returns the sum over the nodes [N]."""
        active_cells = self._step.active_cells
        if jumps:
            self._jump(self._spread(points, N, force - points.force))
            points.force[:] = force
        if not acts:
            return np.zeros(self._step.dim)
        nodal = self._spread(points, N, force)
        active_cells.accumulate(nodal)
        load += nodal
        return total(self._comm, nodal[:active_cells.owned].sum(axis=0))

    def _half_way(self, points, N):
        """How far the nodes carry the points in half a step, at the velocity and acceleration of its start [m]."""
        step, ahead = self._step, np.zeros_like(points.x)
        motion = 0.5 * step.dt * step.v + 0.125 * step.dt**2 * step.a
        step.kernels.interpolate(points.cell, step.active_cells.cells, N, motion, ahead)
        return ahead

    def _raise_lost(self, time):
        """Name the first particle none of whose nodes carries mass."""
        sets = [p for p, *_ in self._loaded] + [held.points for held in self._step.penalties]
        origin = self._step.background.origin
        found = [(int(p.gid[k]), (p.x[k] + origin).tolist()) for p, k in zip(sets, self._lost) if k >= 0]
        number, x = min(sum(self._comm.allgather(found), []))
        raise MPMError(f"boundary particle {number} at x = {x} m has no material point near it at t = {time:.6g} s: "
                       "move the interface into the body (shift) or seed more points")

    def _spread(self, points, N, force):
        """Eq. 13: forces of this rank's particles on its nodes [N], shape (nodes, D)."""
        nodal = np.zeros_like(self._step.v)
        self._step.kernels.spread(points.cell, self._step.active_cells.cells, N, force, nodal)
        return nodal

    def _jump(self, nodal):
        """A load that is constant over each step jumps between steps, and with it the acceleration of the nodes and of
        what moves with them: Newmark's method then does the work of the load and takes up its impulse, step by step.
        nodal: change of the forces [N] of which each rank has its share, shape (nodes, D)."""
        step = self._step
        step.active_cells.accumulate(nodal)
        nodal[step.active] /= step.mass[step.active, None]
        nodal[step.active_cells.fixed] = 0.0
        step.a += nodal
        for p, N in [*((part.points, part.basis) for part in step.parts), *self._riders]:
            step.kernels.interpolate(p.cell, step.active_cells.cells, N, nodal, p.a)

    def window_mass(self):
        """Of each of the interface's particles on this rank, the mass [kg] of a free body that a force would move as
        far over a step like the last one, shape (n,): that of the nodes, and dt^2/4 times their stiffness. An estimate
        from the diagonal of the tangent, within a factor of two. Infinite where held, and before the first step."""
        step, (particles, N, _) = self._step, self._loaded[0]
        if step.mass is None:
            return np.full(len(particles), np.inf)
        self.shapes()
        active_cells, nodes = step.active_cells, step.active_cells.cells[particles.cell]
        N = np.where(step.active[nodes], N, 0.0)
        N /= np.maximum(N.sum(axis=1, keepdims=True), 1e-300)
        diagonal = active_cells.matrix.getDiagonal().array.reshape(active_cells.owned, step.dim) / newmark.alpha(step.dt)
        mass = step.mass[:, None] + NEIGHBOURS * np.maximum(active_cells.with_ghosts(diagonal) - step.mass[:, None], 0.0)
        with np.errstate(divide="ignore"):
            give = np.where(step.active[:, None] & ~active_cells.fixed, 1.0 / mass, 0.0)
            return 1.0 / np.einsum("nk,nkd->nd", N**2, give[nodes]).max(axis=1, initial=0.0)

    def finish(self, u, a):
        """Settle the springs and move the boundary particles; u: displacement over the step [m], a: acceleration at its
        end, both (nodes, D)."""
        step = self._step
        increment = newmark.Increment(step.dt, newmark.alpha(step.dt), u, a)
        for held in step.penalties:
            held.finish(step, u)
        for p, N in self._riders:
            step.kernels.to_points(p.cell, step.active_cells.cells, N, increment, p.x, p.v, p.a)
