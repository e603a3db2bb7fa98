"""The grid in one step: what its terms are told."""
from types import ModuleType
from typing import NamedTuple

import numpy as np

from ..basis.shape import CellMaps
from ..compiled import compiled
from ..grid.active_cells import ActiveCells
from .kernels import GridKernels

# Mass of a node over that of a full cell below which it is light. With a smooth basis a corner of a domain in
# the next cell gives its nodes more unknowns than a point can hold: points that reach a light node have
# lumped inertia.
RIM = 0.05


class GridState(NamedTuple):
    """State of the nodes of the active cells, n of them here, at the start of a step that takes ``dt`` from
    ``time`` [s] on.

    The same four methods make a term of the equations of a step: ``begin(grid, load)`` gets ready and adds
    loads [N] to load (n, D); ``residual(grid, increment, R)`` adds forces [N] to R (n, D) and returns a
    trial, all that it has computed; ``tangent(grid, trial)`` adds their derivative to the matrices of the
    active cells; ``finish(grid, trial, increment)`` makes the trial at the solution the state of the term's
    points and moves them. Those with points have a ``locate`` before ``begin``, for the basis at the points.
    A trial holds until the next one of its term. What a term has to say to others it returns: it changes
    neither the step nor the grid."""

    time: float
    dt: float
    active_cells: ActiveCells  # numbering of the nodes, and the matrices
    maps: CellMaps  # of this rank's cells
    kernels: GridKernels
    bodies: list  # of ``bodies.BodyTerm``, whose points have made the nodes' mass
    full_mass: float  # of a cell full of the lightest body [kg]
    force: np.ndarray  # given on this rank's particles of the interface, (particles, D) [N]
    mass: np.ndarray  # (n,) [kg]
    v: np.ndarray  # (n, D) [m/s]
    a: np.ndarray  # (n, D) [m/s^2], with the jumps of the loads once all terms have begun
    active: np.ndarray  # (n,) mask of the nodes with mass
    rule: ModuleType  # of time: ``newmark`` or ``midpoint``
    smooth: bool  # whether the basis at the material points is

    @property
    def light(self):
        """Mask (n,) of the nodes that domains of a smooth basis have only just reached."""
        return self.active & (self.mass < RIM * self.full_mass)

    @property
    def bearing(self):
        """Mask (n,) of the nodes on which boundary particles hang: those with mass, with a smooth basis only
        those that are not light. In a body that flies through the grid these come and go, with accelerations
        that a particle would add up: a block's end then swings by 0.8 and 0.3 of its vibration too much, on
        cells of 5 and 2.5 mm, where it is 0.1 and 0.06 without them."""
        return self.active & ~self.light if self.smooth else self.active

    def shapes(self, cell, x, N, G):
        """Basis values and gradients at positions x [m] in this rank's cells, see ``shape.shapes``."""
        self.kernels.shapes(cell, x, self.maps, N, G)


def nodal_means(nodal, full_mass):
    """Mass [kg], shape (n,), velocity and acceleration, (n, D), and mask of the active nodes from the sums
    over the points in ``nodal``, see ``transfer.to_grid``. Nodes that are in the element of a point, but have
    no part of its mass, are not active, and yet move as it does. full_mass: see ``GridState``."""
    n, D = len(nodal), nodal.shape[1] // 2
    found = np.zeros(n), np.zeros((n, D)), np.zeros((n, D)), np.zeros(n, bool)
    _divide(nodal, full_mass, *found)
    return found


@compiled
def _divide(nodal, full_mass, mass, v, a, active):
    """See ``nodal_means``."""
    for n in range(len(nodal)):
        m = nodal[n, 0]
        if m != 0.0:
            active[n] = m > 1e-14 * full_mass  # "numeric zero" of eq. 14
            mass[n] = 0.0 if abs(m) < 1e-30 * full_mass else m
            for i in range(v.shape[1]):
                v[n, i], a[n, i] = nodal[n, 1 + i] / m, nodal[n, 1 + v.shape[1] + i] / m
