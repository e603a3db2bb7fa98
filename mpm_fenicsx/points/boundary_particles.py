"""Boundary particles of the interface: shared out over the ranks, gathered, renewed where it flows."""
from dataclasses import replace

import numpy as np

import mpm_dem_checks as check

from ..collective import somewhere
from ..errors import MPMError
from . import outline, surface
from .points import Points


class BoundaryParticles:
    """Those of ``interface``, an ``Interface`` or None, which is the one of now: ``x`` are the places of its
    particles at the start, or what their parents make of them. ``points``: on this rank; at first all of
    them. Collective.

    Raises ValueError for an interface of another dimension.
    """

    def __init__(self, comm, dim, interface, start):
        """start: the bodies, see ``bodies.Start``."""
        x = np.zeros((0, dim)) if interface is None else np.array(interface.x, float)
        if x.shape[1] != dim:
            raise ValueError(f"the interface has {x.shape[1]} dimensions, the grid {dim}: give both the same")
        self._comm, self._dim, self.interface, n = comm, dim, interface, len(x)
        self.exchanged = 0  # bytes of the interface that this rank has got from others since the start
        self.points = Points(gid=np.arange(n), cell=np.zeros(n, np.int32), x=x, v=start.velocity(x),
                             a=start.acceleration(x), force=np.zeros((n, dim)), **start.field(x))
        self._fields = set(np.unique(self.points.field).tolist())

    def of(self, bodies):
        """Those of the ``bodies``, terms, in whose fields of the grid they are."""
        return [body for body in bodies if body.field in self._fields]

    @property
    def count(self):
        """Particles on all ranks."""
        return 0 if self.interface is None else len(self.interface.x)

    def checked(self, force, time):
        """The ``force`` on them at ``time`` [s] as array [N], shape (n, dim), of which None has none."""
        shape = self.count, self._dim
        if force is None:
            return np.zeros(shape)
        force = check.shaped("force", force, shape)
        if not np.isfinite(force).all():
            bad = np.argwhere(~np.isfinite(force))[0][0]
            raise MPMError(f"the force on boundary particle {bad} is not a number at t = {time:.6g} s: look "
                           "at the grains that sent it")
        return force

    def names(self):
        """What it is, for the fingerprint of the scene, besides its particles."""
        return []

    def share(self, force):
        """Of the ``force`` on all particles, shape (n, dim), that on those of this rank."""
        return force[self.points.gid]

    def _count_bytes(self, whole, mine):
        self.exchanged += whole - mine

    @property
    def resampled(self):
        """Whether there is a rule by which they are renewed."""
        return self.interface is not None and self.interface.resampling is not None

    def attach(self):
        """The order in which they are put together; needed whenever their number on a rank changes."""
        if self._comm.size > 1:
            numbers = self._comm.allgather(self.points.gid)
            self._number, self._counts = np.concatenate(numbers), np.array([len(part) for part in numbers])

    def gather(self, *names):
        """Fields of shape (n, dim) of all particles in the order of the interface, the same on every rank."""
        if self._comm.size == 1:
            return [getattr(self.points, name).copy() for name in names]
        mine = np.hstack([getattr(self.points, name) for name in names])
        parts, ordered = np.empty((2, self.count, mine.shape[1]))
        self._comm.Allgatherv(mine, [parts, self._counts * mine.shape[1]])
        self._count_bytes(parts.nbytes, mine.nbytes)
        ordered[self._number] = parts
        return [ordered[:, k:k + self._dim].copy() for k in range(0, mine.shape[1], self._dim)]

    def gather_values(self, values):
        """Values of this rank's particles in the order of the interface, of all on every rank."""
        return surface.everywhere(self._comm, self.points.gid, values, self.count)

    def stay_inside(self, box):
        """Put particles that left the box of the grid back on its side; returns whether there are any."""
        inside = np.clip(self.points.x, box.lower, box.upper)
        left = somewhere(self._comm, (inside != self.points.x).any())[0]
        self.points.x[:] = inside
        return left

    def renew(self, has_mass, time, changed):
        """Renew the particles by the rule, see ``outline.find_change``; if that changes anything, ``points``
        are all of them on every rank again. Returns the ``OutlineChange``, or None."""
        x, v, a, force = self.gather("x", "v", "a", "force")
        old, fields = self.interface, {}
        for name in sorted({"field", "force_cell"} & set(self.points.names)):
            fields[name] = self.gather_values(getattr(self.points, name))
        change = outline.find_change(x, old.elements, old.resampling, force.any(axis=1), has_mass, changed)
        if change is not None:
            if not len(change.x):
                raise MPMError(f"nothing is left of the outline at t = {time:.6g} s: no boundary particle "
                               "has a material point near it; give it a smaller spacing, or more inset")
            n, x0 = len(change.x), change.interpolate(np.asarray(old.x, float))
            self.interface = replace(old, x=x0, elements=change.elements)
            self.points.restore(dict(gid=np.arange(n), cell=np.zeros(n, np.int32), x=change.x,
                                     v=change.interpolate(v),
                                     a=change.interpolate(a), force=change.redistribute(force),
                                     **{name: of[change.parents[:, 0]].astype(np.int64) for name, of in
                                        fields.items()}))
        return change

    def get_state(self):
        """What the rule changes besides the points, as name → array copy."""
        if not self.resampled:
            return {}
        return {"interface.x": np.array(self.interface.x),
                "interface.elements": np.array(self.interface.elements)}

    def set_state(self, state):
        """Go back to what ``get_state`` gave."""
        if self.resampled:
            self.interface = replace(self.interface, x=state["interface.x"].copy(),
                                     elements=state["interface.elements"].copy())


REACHES = 1e-3  # share of a particle's basis on nodes with mass from which on it belongs to the body


def near_mass(background, active_cells, bodies, kernels):
    """Function from places [m], shape (n, D), to the mask of those whose basis reaches nodes with mass of the
    ``bodies``, alike on every rank. Their points are in their cells, and these among the ``active_cells``."""
    comm, search, flags = background.comm, background.search, np.zeros((len(active_cells.node), 1))
    for body in bodies:
        flags[active_cells.cells[np.unique(body.points.cell)], 0] = 1.0
    active_cells.accumulate(flags)
    active = (active_cells.row >= 0)[:, None] & (flags[active_cells.cells, 0] > 0.0)

    def has_mass(x):
        found = np.zeros(len(x), np.int32)
        for field in sorted({body.field for body in bodies}):
            rank, number = search.assign(x, field)
            mine = rank == comm.rank
            cell = np.ascontiguousarray(search.local(number[mine]), np.int32)
            at = np.ascontiguousarray(x[mine])
            (n, D), K = at.shape, active.shape[1]
            N, G = np.empty((n, K)), np.empty((n, D, K))
            kernels.shapes(cell, at, background.maps, N, G)
            found[mine] |= (N * active[cell]).sum(axis=1) > REACHES
        return somewhere(comm, *found)

    return has_mass
