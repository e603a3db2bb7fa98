"""The walls of a scene where they are now; for both back ends. What is at rest, such as a terrain, is written
once."""
from typing import Tuple

import numpy as np

from ..scene.arrays import in_space
from ..scene.scene import SceneData
from ..scene.tables import own_part, wall_table
from ..search.elements import MovingWall, Squares, at_rest, no_squares
from ..search.squares import sorted_elements


class Walls:
    """All walls of ``scene``, which is in the frame of a back end. moving: numbers of the nodes of structures
    that move, at x [m], shape (n, 3); the nodes of the interface, which come last, may move as well.

    now: the walls as kernels take them, whose velocities are zero but in a window; fixed, first: nodes and
    elements in front of those of the interface; marks: room for `nodes_near`.
    """

    now: MovingWall

    def __init__(self, scene: SceneData, moving: np.ndarray, x: np.ndarray) -> None:
        table, self._dim = wall_table(scene), scene.dim
        self.fixed, self.first = table.moving
        self._movers = moving
        self._arrays = [table.x, np.zeros_like(table.x), table.elements, table.traits]
        self.marks = np.zeros(self.fixed, np.bool_)
        still = np.ones(self.first, np.bool_)
        if len(moving):
            self.marks[moving] = True
            still = ~self.marks[table.elements[:self.first]].any(axis=1)
            self.marks[:] = False
        walls = at_rest(table, table.x)
        self._squares = sorted_elements(walls._replace(elements=walls.elements[:self.first]), still)
        self._show(len(table.x), len(table.elements))
        self.now.x[moving] = x

    def _show(self, nodes: int, elements: int) -> None:
        x, v, corners, traits = self._arrays
        moving = np.concatenate([self._movers, np.arange(self.fixed, nodes)])
        loose = np.concatenate([self._squares.loose, np.arange(self.first, elements)])
        squares = self._squares._replace(loose=loose)
        self.now = MovingWall(x[:nodes], v[:nodes], corners[:elements], traits[:elements], moving, squares)

    @property
    def fixed_squares(self) -> Squares:
        """Of all walls but the interface, whose elements are in none."""
        return self._squares

    def replace(self, scene: SceneData) -> None:
        """Take the interface of ``scene`` in the place of the one of now."""
        x, elements, traits = own_part(scene, self.fixed)
        starts = self.fixed, self.fixed, self.first, self.first
        self._arrays = [with_tail(array, start, tail) for array, start, tail
                        in zip(self._arrays, starts, (x, np.zeros_like(x), elements, traits))]
        self._show(self.fixed + len(x), self.first + len(elements))

    def own(self) -> MovingWall:
        """Copy of the interface alone, with nodes and elements numbered from zero."""
        now, elements = self.now, self.now.elements[self.first:] - self.fixed
        return MovingWall(now.x[self.fixed:].copy(), now.v[self.fixed:].copy(), elements,
                          now.traits[self.first:].copy(), np.arange(len(now.x) - self.fixed),
                          no_squares(np.arange(len(elements))))

    def both(self, movers: np.ndarray, own: np.ndarray) -> np.ndarray:
        """Values at the nodes that may move, from those of structures, (n, 3), and of the interface; with the
        components of the scene, contiguous."""
        return np.ascontiguousarray(np.concatenate([movers[:, :self._dim], own]))

    def place(self, x: np.ndarray, v: np.ndarray) -> None:
        """The nodes that may move are at x [m] and move with v [m/s], (n, dim) each, see ``both``."""
        self.now.x[self.now.moving], self.now.v[self.now.moving] = in_space(x), in_space(v)

    def stop(self, span: float) -> None:
        """They are where they come to in ``span`` [s]."""
        moving = self.now.moving
        self.now.x[moving] += self.now.v[moving] * span
        self.now.v[moving] = 0.0

    def at(self, node: np.ndarray, t: float) -> np.ndarray:
        """Places of nodes at time t [s] of the window [m], (n, 3)."""
        return self.now.x[node] + t * self.now.v[node]


def with_tail(array: np.ndarray, start: int, tail: np.ndarray) -> np.ndarray:
    """``array`` with ``tail`` from the row ``start`` on: the same, or a larger one where there is no room."""
    if start + len(tail) > len(array):
        larger = np.zeros((start + 2 * len(tail), *array.shape[1:]), array.dtype)
        larger[:start] = array[:start]
        array = larger
    array[start:start + len(tail)] = tail
    return array


def sparse(rows: np.ndarray, values: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Those of the ``rows`` whose ``values``, (n, k), are not all zero, and these."""
    hit = values.any(axis=1)
    return rows[hit], values[hit]
