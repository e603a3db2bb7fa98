"""What the transfers between points and grid lose, booked step by step: momentum, angular momentum and
kinetic energy before and after each."""
from typing import Any, Callable, Dict, Tuple

import numpy as np

from ..collective import total
from ..points.moments import moment

WAYS = "to_grid", "solve", "to_points"
AXES = {2: "z", 3: "xyz"}  # of moments


class Losses:
    """Sums since the start, each of what is there after less what was there before: "to_grid", from points to
    nodes; "solve", on the grid, by loads, supports and the rule of time; "to_points", back to the
    points.

    Nodes count with their lumped masses, at the end of a step at their places then. What the transfers make
    is the sum of "to_grid" and "to_points": points that only add up accelerations (``transfer="newmark"``)
    keep motion that the grid does not see, which goes in one and comes back in the other. Collective."""

    def __init__(self, comm: Any, origin: np.ndarray, active: bool) -> None:
        """origin: of the coordinates in the user's [m], shape (D,), see ``frame``; active: books them."""
        self.active, self._comm, self._origin, self._dim = active, comm, origin, len(origin)
        self._sums = np.zeros((len(WAYS), self._dim + len(AXES[self._dim]) + 1))
        self._last = self._sums[0]

    def to_grid(self, grid: Any) -> None:
        """The nodes have just got what the points have."""
        before, self._last = self._of_points(grid), self._of_nodes(grid, 0.0, grid.v)
        self._sums[0] += total(self._comm, self._last - before)

    def solved(self, grid: Any, increment: Any) -> None:
        """The nodes have moved, the points have not."""
        v = grid.rule.velocity(grid, increment)
        before, self._last = self._last, self._of_nodes(grid, increment.u, v)
        self._sums[1] += total(self._comm, self._last - before)

    def to_points(self, grid: Any) -> None:
        """The points have moved with the nodes."""
        self._sums[2] += total(self._comm, self._of_points(grid) - self._last)

    def _of_points(self, grid: Any) -> np.ndarray:
        """Momentum, angular momentum and kinetic energy of this rank's points in one array."""
        still = np.zeros(self._dim)
        return sum(np.append(body.momentum(), body.energies(still)[0]) for body in grid.bodies)

    def _of_nodes(self, grid: Any, u: Any, v: np.ndarray) -> np.ndarray:
        """The same of its nodes."""
        cells = grid.active_cells
        mass, v, x = (values[:cells.owned] for values in (grid.mass, v, cells.places + u))
        return np.concatenate([mass @ v, moment(x, mass[:, None] * v), [0.5 * mass @ (v * v).sum(axis=1)]])

    def sums(self) -> Dict[str, Dict[str, Any]]:
        """By way: ``momentum`` [kg m/s], shape (D,), ``angular_momentum`` about zero [kg m^2/s], a number in
        a plane scene, else shape (3,), and ``kinetic_energy`` [J]."""
        found, D = {}, self._dim
        for way, row in zip(WAYS, self._sums):
            turned = row[D:-1] + moment(self._origin[None], row[None, :D])
            found[way] = {"momentum": row[:D].copy(), "kinetic_energy": float(row[-1]),
                          "angular_momentum": float(turned[0]) if D == 2 else turned}
        return found

    def columns(self) -> Dict[str, Tuple[str, str, Callable[[], float]]]:
        """For the history, see ``MPM.columns``."""
        found: Dict[str, Tuple[str, str, Callable[[], float]]] = {}
        for way, text in (("to_grid", "from points to grid"), ("to_points", "back to the points")):
            for k, axis in enumerate(AXES[self._dim]):
                found[f"angular_{way}_{axis}"] = (
                    "N m s", f"angular momentum about {axis} made by transfers {text} since the start",
                    lambda way=way, k=k: float(np.ravel(self.sums()[way]["angular_momentum"])[k]))
            found[f"kinetic_{way}"] = ("J", f"kinetic energy made by transfers {text} since the start",
                                       lambda way=way: self.sums()[way]["kinetic_energy"])
        return found

    def get_state(self) -> Dict[str, np.ndarray]:
        """As name → array copy."""
        return {"losses": self._sums.copy()} if self.active else {}

    def set_state(self, state: Dict[str, np.ndarray]) -> None:
        """Go back to what ``get_state`` gave; a run that has booked nothing so far starts at zero."""
        if self.active:
            self._sums = state["losses"].copy() if "losses" in state else np.zeros_like(self._sums)
