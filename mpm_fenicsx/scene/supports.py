"""Supports of a scene: frozen data, checked when made."""
from dataclasses import dataclass
from typing import Callable, Optional

import numpy as np

import mpm_dem_checks as check

from .bodies import AXES, Grid


@dataclass(frozen=True)
class Support:
    """Grid nodes whose motion is given.

    where: function from node positions [m], shape (n, dim), to a mask, shape (n,). fix: the directions held,
    such as "y" or "xy". motion: displacement from the start [m] as a function of time [s], one number or one
    per direction of ``fix``; None holds still.

    >>> floor = Support(lambda x: x[:, 1] < 1e-6, fix="xy", name="floor")
    >>> floor.where(np.array([(0.0, 0.0), (0.0, 1.0)]))
    array([ True, False])
    """

    where: Callable
    fix: str
    motion: Optional[Callable] = None
    name: str = "support"

    def __post_init__(self) -> None:
        if not isinstance(self.fix, str) or not self.fix or set(self.fix) - set(AXES):
            raise ValueError(f"{self.name} fixes {check.shown(self.fix)}: give one or more of the letters x, "
                             "y, z")
        check.function(f"where of {self.name}", self.where)
        if self.motion is not None:
            check.function(f"motion of {self.name}", self.motion)

    @staticmethod
    def column(axis: str, at: float, grid: Grid, fix: str, motion: Optional[Callable] = None,
               name: str = "support") -> "Support":
        """Support on the grid nodes of the column (in space: plane) across ``axis`` that is nearest to ``at``
        [m].

        >>> from mpm_fenicsx import Box
        >>> grid = Grid(Box((0.0, 0.0), (1.0, 1.0)), (10, 10))
        >>> Support.column("x", 0.52, grid, "y").where(np.array([(0.5, 0.3), (0.6, 0.3)]))
        array([ True, False])
        """
        check.record("grid", grid, Grid)
        d = AXES.index(check.choice("axis", axis, tuple(AXES[:grid.dim])))
        at = check.finite("at", at, "m")
        h = grid.box.size[d] / grid.cells[d]
        nearest = grid.box.lower[d] + h * np.rint((at - grid.box.lower[d]) / h)
        return Support(lambda x: np.abs(x[:, d] - nearest) < 0.25 * h, fix, motion, name)
