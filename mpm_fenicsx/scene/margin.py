"""Margin beyond the edge of a regular grid for material that presses on a wall there.

The springs of a wall give, by some 1e-4 of a cell under soil at rest. Where the grid ends at the wall, what
has sunk in by that is still in the outermost cell, whose basis goes on linearly, and has not left the grid.
"""
from typing import Optional, Sequence, Union

import numpy as np

from .bodies import Grid
from .conditions import GridWall, Penalty
from .lattice import lattice
from .mesh import Mesh

MARGIN = 0.1  # of a cell; a wall as near as that to the edge needs it too


def margins_at_walls(grid: Union[Grid, Mesh],
                     penalties: Sequence[Union[Penalty, GridWall]]) -> Optional[np.ndarray]:
    """Margin below and above the grid along each axis [cells], shape (D, 2): 0, and ``MARGIN`` where a wall
    of the ``Penalty`` and ``GridWall`` records lies. None for a ``Mesh``, which has no sides: give it a layer
    of cells behind a wall that gives."""
    if not isinstance(grid, Grid):
        return None
    margin, h = np.zeros((grid.dim, 2)), grid.cell_size
    for condition in penalties:
        if isinstance(condition, GridWall):
            condition = condition.penalty(lattice(grid.box, grid.cells, grid.cell)[0])
        x = np.asarray(condition.surface.x, float)
        if condition.follows or x.shape[1] != grid.dim:
            continue
        for d in range(grid.dim):
            for side, (edge, inward) in enumerate(((grid.box.lower[d], 1.0), (grid.box.upper[d], -1.0))):
                on = np.abs(x[:, d] - edge) < MARGIN * h[d]
                if condition.normal is not None:
                    on &= inward * condition.normal[:, d] > 0.5
                if np.count_nonzero(on) >= grid.dim:  # fewer span no piece of that side
                    margin[d, side] = MARGIN
    return margin
