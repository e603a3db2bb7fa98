"""Loads on boundary particles that follow the body: force, traction on the deformed area, pressure along its normal.

A load is constant over each step and explicit: its geometry is that of the middle of the step, predicted from velocity
and acceleration of the grid at its start. It has no part in the tangent, which stays symmetric. The stiffness that a
following load would have is p/h per length, small against the inertia rho h / dt^2 in all but near-static runs with a
large step.
"""
import numpy as np

from ..points.points import Points
from ..points.surface import everywhere, normal_areas, to_particles


class SurfaceLoads:
    """The ``Load`` records of a scene. ``points``: their particles on this rank, with ``force``, the last load [N].

    Raises ValueError for a surface of another dimension.
    """

    def __init__(self, loads, dim, start):
        """start: the bodies, see ``parts.Start``."""
        self._loads, self._thickness, self._parts, n = tuple(loads), start.thickness, [], 0
        for load in loads:
            if np.shape(load.surface.x)[1] != dim:
                raise ValueError(f"the surface of {load.name} has {np.shape(load.surface.x)[1]} dimensions, the scene "
                                 f"{dim}: give both the same")
            self._parts.append(slice(n, n + len(load.surface.x)))
            n += len(load.surface.x)
        x = np.concatenate([np.asarray(load.surface.x, float) for load in loads])
        self.count, self._needs_geometry = n, any(load.kind != "force" for load in loads)
        self.names = np.repeat([load.name for load in loads], [len(load.surface.x) for load in loads])
        self.points = Points(gid=np.arange(n), cell=np.zeros(n, np.int32), x=x, v=start.velocity(x),
                             a=start.acceleration(x), force=np.zeros((n, dim)))

    def forces(self, comm, time, dt, ahead):
        """Force on this rank's particles over the step from ``time`` [s] on [N], shape (n, D); ahead: how far they will
        have moved in the middle of the step [m], shape (n, D). Collective."""
        p, middle = self.points, time + 0.5 * dt
        whole = np.empty((self.count, p.x.shape[1]))
        if self._needs_geometry:
            x = everywhere(comm, p.gid, p.x + ahead, self.count)
        for load, part in zip(self._loads, self._parts):
            value = load.at(middle)
            if load.kind == "force":
                whole[part] = value
                continue
            elements = np.asarray(load.surface.elements)
            area = normal_areas(x[part], elements)
            if load.kind == "traction":
                area = np.linalg.norm(area, axis=1)[:, None]
            share = to_particles(area, elements, part.stop - part.start) * self._thickness
            whole[part] = share * (value if load.kind == "traction" else -value)
        return whole[p.gid]
