"""Impulses of other bodies and of the interface on the force cells of named bodies, step by step.

What bodies do to each other is no impulse on all of them together, and what acts on the interface is one sum
in ``impulses``; here both are told apart by the cell on which they act. Times, places and moments are those
of ``impulses``: with gravity, supports and whatever else there acts on a named body they sum to the change of
its momentum.
"""
from typing import Any, Dict

import numpy as np

from ..collective import total
from ..points.moments import moment
from ..terms import midpoint
from ..terms.force_cells import ForceCells, add_by_cell

BODIES, INTERFACE = "bodies", "interface"  # who acts


class OnBodies:
    """Sums since the start by who acts and by cell, shape (2, cells, numbers), rows as of ``Impulses``.
    cells: see ``ForceCells``; meets: whether bodies touch others; interface: whether there is one.
    Collective."""

    def __init__(self, comm: Any, origin: np.ndarray, cells: ForceCells, meets: bool,
                 interface: bool) -> None:
        self._comm, self._origin, self._cells, self._dim = comm, origin, cells, len(origin)
        self._acts = {BODIES: meets, INTERFACE: interface}
        self._active = bool(cells.names) and (meets or interface)
        shape = 2, len(cells.names), self._dim + (1 if self._dim == 2 else 3)
        self._sums, self._last = np.zeros(shape), np.zeros(shape)

    def sums(self) -> Dict[str, Dict[str, np.ndarray]]:
        """Name of the cell → who acts → row, about zero in the user's coordinates."""
        found: Dict[str, Dict[str, np.ndarray]] = {}
        for row, acts in zip(self._sums.copy(), self._acts):
            for name, one in zip(self._cells.names, row):
                one[self._dim:] += moment(self._origin[None], one[None, :self._dim])
                found.setdefault(name, {})
                if self._acts[acts]:
                    found[name][acts] = one
        return found

    # ---------------------------------------------------------------- who books, see ``Impulses``

    def jumped(self, grid: Any, load: Any) -> None:
        """A ``load`` has jumped at the start of a step, and with it the accelerations of the points."""
        if not self._active or grid.rule is midpoint or hasattr(load, "names"):
            return
        jump = np.zeros_like(self._last)
        self._add_interface(grid, load, grid.active_cells.places, load.change[0], jump)
        self._last += total(self._comm, jump)

    def step(self, grid: Any, problem: Any, found: Any, increment: Any) -> None:
        """A step is done. found: see ``impulses.Forces``."""
        if self._active:
            forces = self._forces(grid, problem, found)
            self._sums += grid.dt * (forces if grid.rule is midpoint else 0.5 * (self._last + forces))
            self._last = forces

    def settled(self, grid: Any, problem: Any, found: Any) -> None:
        """A load step without inertia is done."""
        if self._active:
            self._last = self._forces(grid, problem, found)

    def _forces(self, grid: Any, problem: Any, found: Any) -> np.ndarray:
        rows, load = np.zeros_like(self._last), problem.interface
        self._add_interface(grid, load, found.places, load.last_force(), rows)
        for term, answer in found.springs:
            if hasattr(term, "springs_now") and self._cells.touched(term):
                self._cells.add_contact(grid, term, answer, found.places, rows[0])
        return total(self._comm, rows)

    def _add_interface(self, grid: Any, load: Any, places: np.ndarray, force: np.ndarray,
                       rows: np.ndarray) -> None:
        """This rank's part."""
        if len(force) and force.any():
            add_by_cell(rows[1], load.force_cells(), load.wrenches(grid, places, force))

    # ---------------------------------------------------------------- state

    def get_state(self) -> Dict[str, np.ndarray]:
        """As name → array copy."""
        return {"on_bodies": np.stack([self._sums, self._last])}

    def set_state(self, state: Dict[str, np.ndarray]) -> None:
        """Go back to what ``get_state`` gave."""
        self._sums, self._last = np.array(state["on_bodies"])
