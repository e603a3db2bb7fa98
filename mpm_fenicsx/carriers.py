"""Boundary particles in one step: their loads and springs reach the nodes, their motion follows the nodes."""
import numpy as np

from .errors import MPMError
from .sets import any_rank


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
        """Add the loads [N], with the basis of eq. 14, to ``load``, shape (nodes, D), and their jumps to the
        accelerations; get the springs ready. force: on the interface's particles [N]. Returns its sum over nodes."""
        step = self._step
        self._riders = [(step.points, step.basis), *((p, N) for p, N, _ in self._loaded)]
        lost = [step.kernels.only_active(p.cell, step.cover.cells, step.active, N) for p, N, _ in self._loaded]
        lost += [held.locate(step) for held in step.penalties]
        self._riders += [(held.points, held.N) for held in step.penalties if held.follows]
        forces = [force, *(loads.forces(self._comm, time, step.dt, self._half_way(*rider))
                           for loads, rider in zip(step.loads, self._riders[2:]))]
        changed = [(f != p.force).any() for f, (p, *_) in zip(forces, self._loaded)]
        found = any_rank(self._comm, [max(lost) >= 0, *changed, *(f.any() for f in forces)])
        if found[0]:
            self._raise_lost(lost, time)
        n, sums = len(forces), []
        for (p, N, _), f, jumps, acts in zip(self._loaded, forces, found[1:n + 1], found[n + 1:]):
            if jumps:
                self._jump(self._spread(p, N, f - p.force))
                p.force[:] = f
            sums.append(self._add(self._spread(p, N, f), load) if acts else np.zeros(step.dim))
        for held in step.penalties:
            held.begin(step, time)
        return sums[0]

    def _half_way(self, points, N):
        """How far the nodes carry the points in half a step, at the velocity and acceleration of its start [m]."""
        step, ahead = self._step, np.zeros_like(points.x)
        motion = 0.5 * step.dt * step.v + 0.125 * step.dt**2 * step.a
        step.kernels.interpolate(points.cell, step.cover.cells, N, motion, ahead)
        return ahead

    def _raise_lost(self, lost, time):
        """Name the first particle none of whose nodes carries mass; lost: one of each set on this rank, or -1."""
        sets = [p for p, *_ in self._loaded] + [held.points for held in self._step.penalties]
        found = [(int(p.gid[k]), p.x[k].tolist()) for p, k in zip(sets, lost) if k >= 0]
        number, x = min(sum(self._comm.allgather(found), []))
        raise MPMError(f"boundary particle {number} at x = {x} m has no material point near it at t = {time:.6g} s: "
                       "move the interface into the body (shift) or seed more points")

    def _spread(self, points, N, force):
        """Eq. 13: forces of this rank's particles on its nodes [N], shape (nodes, D)."""
        nodal = np.zeros_like(self._step.v)
        self._step.kernels.spread(points.cell, self._step.cover.cells, N, force, nodal)
        return nodal

    def _add(self, nodal, load):
        """Add forces to ``load``; returns their sum over all nodes [N]."""
        cover = self._step.cover
        cover.accumulate(nodal)
        load += nodal
        return self._comm.allreduce(nodal[:cover.owned].sum(axis=0))

    def _jump(self, nodal):
        """A load that is constant over each step jumps between steps, and with it the acceleration of the nodes and of
        what moves with them: Newmark's method then does the work of the load and takes up its impulse, step by step.
        nodal: change of the forces [N] of which each rank has its share, shape (nodes, D)."""
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
