"""Boundary particles in one step: their loads and springs reach the nodes, their motion follows the nodes."""
import numpy as np
from mpi4py import MPI

from .errors import MPMError


class Carriers:
    """The interface's particles and those of the scene's loads and penalties, in the cells of a step's cover.
    Collective."""

    def __init__(self, step, boundary):
        """step: with its points attached; boundary: the interface's particles."""
        self._step, self._comm = step, step.comm
        K, D = step.cover.cells.shape[1], step.dim
        particles = [boundary, *(loads.points for loads in step.loads)]
        self._loaded = [(p, np.empty((len(p), K)), np.empty((len(p), K, D))) for p in particles]

    def shapes(self):
        """Basis values at the particles that carry loads."""
        for p, N, G in self._loaded:
            self._step.shapes(p.cell, p.x, N, G)

    def begin(self, time, force, load):
        """Add the loads [N] to ``load``, shape (nodes, D), and their jumps to the accelerations; get the springs ready.
        force: on the interface's particles [N]. Returns its sum over the nodes [N]."""
        step = self._step
        self._riders = [(step.points, step.basis), *((p, N) for p, N, _ in self._loaded)]
        for p, N, _ in self._loaded:
            self._raise_if_lost(p, step.kernels.only_active(p.cell, step.cover.cells, step.active, N), time)
        for held in step.penalties:
            self._raise_if_lost(held.points, held.locate(step), time)
            self._riders += [(held.points, held.N)] if held.follows else []
        applied = self._carry(*self._loaded[0][:2], force, load)
        for loads, (p, N, _) in zip(step.loads, self._loaded[1:]):
            ahead, motion = np.zeros_like(p.x), 0.5 * step.dt * step.v + 0.125 * step.dt**2 * step.a
            step.kernels.interpolate(p.cell, step.cover.cells, N, motion, ahead)
            self._carry(p, N, loads.forces(self._comm, time, step.dt, ahead), load)
        for held in step.penalties:
            held.begin(step, time)
        return applied

    def _raise_if_lost(self, points, lost, time):
        """``lost``: a particle of this rank none of whose nodes carries mass, or -1."""
        if self._comm.allreduce(lost, MPI.MAX) >= 0:
            found = [] if lost < 0 else [(int(points.gid[lost]), points.x[lost].tolist())]
            number, x = min(sum(self._comm.allgather(found), []))
            raise MPMError(f"boundary particle {number} at x = {x} m has no material point near it at t = {time:.6g} s: "
                           "move the interface into the body (shift) or seed more points")

    def _carry(self, points, N, force, load):
        """Eq. 13 with the basis of eq. 14. A load that is constant over each step jumps between steps, and the
        acceleration with it: Newmark's method then does the work of the load and takes up its impulse, step by step."""
        step, change = self._step, force - points.force
        points.force[:] = force
        if self._comm.allreduce(int(change.any()), MPI.MAX):
            nodal = np.zeros_like(load)
            step.kernels.spread(points.cell, step.cover.cells, N, change, nodal)
            self._jump(nodal)
        if not self._comm.allreduce(int(force.any()), MPI.MAX):
            return np.zeros(step.dim)
        nodal = np.zeros_like(load)
        step.kernels.spread(points.cell, step.cover.cells, N, force, nodal)
        step.cover.accumulate(nodal)
        load += nodal
        return self._comm.allreduce(nodal[:step.cover.owned].sum(axis=0))

    def _jump(self, nodal):
        """Change the acceleration of the nodes, and of all that moves with them, by forces [N] of which each rank has its
        share, shape (nodes, D)."""
        step = self._step
        step.cover.accumulate(nodal)
        nodal[step.active] /= step.mass[step.active, None]
        nodal[step.cover.fixed] = 0.0
        step.a += nodal
        for p, N in self._riders:
            step.kernels.interpolate(p.cell, step.cover.cells, N, nodal, p.a)

    def finish(self, u, a):
        """Settle the springs and move the boundary particles; u: displacement over the step [m], a: acceleration at its
        end, both (nodes, D)."""
        step = self._step
        for held in step.penalties:
            held.finish(step, u)
        for p, N in self._riders[1:]:
            step.kernels.to_points(p.cell, step.cover.cells, N, u, a, step.dt, p.x, p.v, p.a)
