"""What acts on the nodes of the walls in a window: of those at rest, which may be many, only nodes near
particles are looked at."""
from typing import Any, Tuple

import numpy as np

from mpm_dem_direct import direct

from ..common.booking import Hits
from ..common.walls import Walls, sparse, with_tail
from ..search.squares import nodes_near
from .forces import WallForce
from .gathering import rows_of_all


class Loads:
    """Impulses and forces on the nodes of the ``walls``.

    now: as kernels take them. All rows are zero but those of the interface, the two last ones, and of others
    those in ``_used``.
    """

    now: WallForce

    def __init__(self, walls: Walls) -> None:
        self._walls, self._fixed, self._nodes_near = walls, walls.fixed, direct(nodes_near)
        self._arrays = [np.zeros((len(walls.now.x) + 2, 3)) for _ in WallForce._fields]
        self._near = self._used = np.zeros(0, np.int64)
        self.now = WallForce(*self._arrays)

    @property
    def own(self) -> np.ndarray:
        """Forces on the interface [N], (n, 3), to be written to."""
        return self.now.force[self._fixed:-2]

    def replace(self) -> None:
        """The interface is another one: no force on it."""
        tail = np.zeros((len(self._walls.now.x) + 2 - self._fixed, 3))
        whole = self.now.force[-2:].copy()
        self._arrays = [with_tail(array, self._fixed, tail) for array in self._arrays]
        self.now = WallForce(*(array[:self._fixed + len(tail)] for array in self._arrays))
        self.now.force[-2:] = whole

    def listed(self, partner: np.ndarray) -> None:
        """From now on particles may touch the elements ``partner``."""
        self._near = self._nodes_near(self._walls.now, partner, self._fixed, self._walls.marks)
        self._used = np.union1d(self._used, self._near)

    def begin(self, half: float) -> None:
        """A window begins: the force of now acts for half a step [s]."""
        impulse, force, used = *self.now, self._used
        for rows in (used, slice(self._fixed, None)):
            impulse[rows] = half * force[rows]
            force[rows] = 0.0
        if len(used):  # else there is nothing near either
            self._used = np.union1d(sparse(used, impulse[used])[0], self._near)

    def clear(self) -> None:
        """No force."""
        for rows in (self._used, slice(self._fixed, None)):
            self.now.force[rows] = 0.0

    def sum_over(self, comm: Any) -> None:
        """What each rank of ``comm`` has counted, its ranks added in their order. Collective."""
        rows = np.concatenate([self._used, np.arange(self._fixed, len(self.now.force))])
        values = np.column_stack([self.now.impulse[rows], self.now.force[rows]])
        rows, values = sparse(rows, values)
        found = rows_of_all(np.column_stack([rows, values]), comm)
        all_rows = found[:, 0].astype(np.int64)  # exact in a float
        self._used = np.union1d(self._used, all_rows[all_rows < self._fixed])
        for array, own in zip(self.now, np.hsplit(found[:, 1:], 2)):
            array[rows] = 0.0
            np.add.at(array, all_rows, own)

    def hits(self, middle: float) -> Hits:
        """Of the window, whose ``middle`` is at this time [s]."""
        own = np.arange(self._fixed, len(self._walls.now.x))
        node, impulse = sparse(*self._rows(self.now.impulse[:-2], own))
        return Hits(node, self._walls.at(node, middle), impulse, self.now.impulse[-2:])

    def _rows(self, values: np.ndarray, own: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
        rows = np.concatenate([self._used, own])
        return rows, values[rows]

    def get(self) -> Tuple[np.ndarray, np.ndarray]:
        """Numbers of the rows with a force, of the interface and of the two last ones; the forces."""
        used = sparse(self._used, self.now.force[self._used])[0]
        rows = np.concatenate([used, np.arange(self._fixed, len(self.now.force))])
        return rows, self.now.force[rows]

    def set(self, rows: np.ndarray, force: np.ndarray) -> None:
        """Go back to what ``get`` gave; then ``listed``."""
        self.clear()
        self.now.force[rows] = force
        self._used = np.union1d(self._used, rows[rows < self._fixed])
