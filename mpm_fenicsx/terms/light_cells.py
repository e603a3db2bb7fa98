"""Inertia of nearly empty cells, where that of the nodes is lumped.

The last points of a body in a cell hang on nodes that hold hardly any mass, and yet are as stiff as others:
their stress has its full gradient there. Without inertia soil that flows has no equilibrium at such a node,
or several: its tangent is singular or of either sign, and where it comes apart and meets again Newton's
method goes to and fro. So the nodes of a cell with a light one exchange inertia. For their accelerations a
before and a' after the step

    f_I = w (a'_I - a_I - mean over the cell's nodes of (a' - a)),   w = RIM m_full - least mass of a node,

are forces that sum to zero over the cell, so that momentum is kept; they vanish where the cell changes its
acceleration as a whole, and with the step. The pattern of the matrix stays, which the ghost penalty on
inertia (``ghost``) makes larger. Cells whose nodes all have RIM of a full one's mass or more are left alone.
"""
from typing import Any

import numpy as np

from ..compiled import compiled
from ..grid.active_cells import ActiveCells
from .grid_state import RIM, GridState
from .newmark import Increment


@compiled
def add_residual(nodes, weight, change, R):
    """Add the forces [N] to R for changes of acceleration [m/s^2], both (nodes, D); nodes: (cells, K) of the
    cells, weight: (cells,) [kg]."""
    K = nodes.shape[1]
    for c in range(len(nodes)):
        for i in range(R.shape[1]):
            mean = 0.0
            for q in range(K):
                mean += change[nodes[c, q], i] / K
            for q in range(K):
                R[nodes[c, q], i] += weight[c] * (change[nodes[c, q], i] - mean)


@compiled
def add_tangent(row, weight, Ke):
    """Add their derivative to the element matrices Ke [N/m], see ``weakform.tangent``, of the cells in these
    rows; weight: that of a cell times d a' / du [N/m]."""
    K = Ke.shape[1]
    for c in range(len(row)):
        for p in range(K):
            for i in range(Ke.shape[2]):
                for q in range(K):
                    Ke[row[c], p, i, i, q] += weight[c] * ((1.0 if p == q else 0.0) - 1.0 / K)


class LightCells:
    """Of the active ``cells`` of this rank, as a term of a step, see ``grid_state``. ``number`` and
    ``weight`` [kg] are those of the cells with a light node, after ``begin``."""

    def __init__(self, cells: ActiveCells) -> None:
        self._all = np.flatnonzero(cells.point_row >= 0)
        self._nodes_of_all = cells.cells[self._all]

    def begin(self, grid: GridState) -> None:
        """Find them. There is no load."""
        of_all = self._nodes_of_all
        light = grid.active[of_all].all(axis=1) & grid.light[of_all].any(axis=1)
        self.number, self._nodes = self._all[light], of_all[light]
        self.weight = RIM * grid.full_mass - grid.mass[self._nodes].min(axis=1)

    def first_trial(self, grid: GridState, increment: Increment) -> Increment:
        """Nothing but the ``increment`` is needed for a tangent."""
        return increment

    def residual(self, grid: GridState, increment: Increment, R: np.ndarray) -> Increment:
        """Add the forces for the accelerations of the increment to R [N], shape (nodes, D)."""
        add_residual(self._nodes, self.weight, increment.a - grid.a, R)
        return increment

    def tangent(self, grid: GridState, increment: Increment) -> None:
        """Add their derivative to the matrix."""
        grid.active_cells.add_in_cells(self.number, lambda row, matrices: add_tangent(
            row[self.number], increment.alpha * self.weight, matrices))

    def finish(self, grid: GridState, increment: Increment, solution: Any) -> None:
        """There are no points."""
