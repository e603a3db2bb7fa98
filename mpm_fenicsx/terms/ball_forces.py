"""Forces on material points: they reach the nodes by the points' own basis, whichever it is."""
import numpy as np

from ..points.ball_surface import BallSurface
from ..points.moments import wrenches
from .loads import PointForces


def make_forces(surface, bodies, outflow):
    """The forces on the interface of a scene of ``bodies``, see ``PointForces``."""
    if isinstance(surface, BallSurface):
        return BallForces(surface, bodies)
    return PointForces(surface.points, outflow)


class BallForces(PointForces):
    """The forces on a ``BallSurface`` as a term of a step, see ``grid_state``. Its points are those of
    ``bodies``, which move by themselves."""

    def __init__(self, surface, bodies):
        super().__init__(surface.points)
        self._surface, self._bodies = surface, bodies

    def attach(self, active_cells):
        """There are no work arrays."""

    def locate(self, grid):
        """None is lost: a material point has nodes of its own mass."""
        return -1

    def last_force(self):
        """See ``PointForces``."""
        return self._surface.own_force

    def _keep(self, force):
        self._surface.begin()

    def _spread(self, grid, force):
        nodal, first = np.zeros_like(grid.v), 0
        for body, (rows, at) in zip(self._bodies, self._surface.own):
            if len(rows):
                body.spread(at, np.ascontiguousarray(force[first:first + len(rows)]), nodal)
            first += len(rows)
        return nodal

    def accelerate(self, grid, jump):
        """The material points have had their share."""

    def finish(self, grid, trial, increment):
        """The material points move by themselves."""

    def wrenches(self, grid, places, force):
        """See ``PointForces``."""
        found = [body.interpolate(at, places) for body, (_, at) in zip(self._bodies, self._surface.own)]
        x, shares = (np.concatenate(parts) for parts in zip(*found))
        rows = wrenches(x, force)
        rows[:, :force.shape[1]] *= shares[:, None]
        return rows

    def _own(self, grid, ahead):
        found = [(body.points.x[at], *body.interpolate(at, ahead))
                 for body, (_, at) in zip(self._bodies, self._surface.own)]
        x, carried, share = (np.concatenate(parts) for parts in zip(*found))
        return x - carried, share

    def force_cells(self):
        """See ``PointForces``."""
        return np.concatenate([body.points.force_cell[at] for body, (_, at) in
                               zip(self._bodies, self._surface.own)])

    def window_mass(self, grid):
        """See ``PointForces.window_mass``, of the material points with the linear basis."""
        own = [(body.points, at) for body, (_, at) in zip(self._bodies, self._surface.own)]
        cell = np.concatenate([points.cell[at] for points, at in own])
        return self._mass_at(grid, cell, np.concatenate([points.x[at] for points, at in own]))
