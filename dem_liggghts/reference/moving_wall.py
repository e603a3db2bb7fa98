"""The walls of the built-in DEM, and how the moving one becomes another."""
from typing import Any

import numpy as np

from ..common.booking import WallBooks
from ..common.contact_points import contact_points
from ..common.energy import select_shapes
from ..common.states import Kept
from ..common.wall_change import carried, check_was, new_numbers, redistribute, with_wall
from ..contact.law import Laws
from ..scene.arrays import in_space
from ..scene.frame import to_true_positions, translated, with_wall_inside
from ..scene.scene import SceneData
from ..scene.tables import SphereTable, wall_table, with_moving
from ..scene.walls import Wall
from ..search.elements import MovingWall, at_rest
from ..search.history import by_number, on_new_wall
from ..search.neighbours import NeighbourLists, no_neighbours
from .forces import SphereState, WallForce, new_scratch


class WallOfNow(Kept):
    """The part of ``ReferenceDEM`` that has to do with its walls."""

    scene: SceneData
    origin: np.ndarray
    _spheres: SphereState
    _all_spheres: SphereTable
    _ids: np.ndarray
    _laws: Laws
    _lists: NeighbourLists
    _books: WallBooks
    time: float

    def _need_open(self) -> None:
        raise NotImplementedError

    def _build_lists(self, wall: MovingWall, t: float) -> None:
        raise NotImplementedError

    def _use(self, scene: SceneData) -> None:
        """Take the walls of ``scene``, where they are; no force on them."""
        self.scene, self._inside = scene, translated(scene, -self.origin)
        self._surface = wall_table(self._inside)
        self._begin_wall()

    def _replace(self, scene: SceneData) -> None:
        """Take the moving wall of ``scene``, which is the present one besides, where it is."""
        self._inside = with_wall_inside(self._inside, scene.wall, -self.origin)
        self.scene, self._surface = scene, with_moving(self._surface, self._inside)
        self._begin_wall()

    def _begin_wall(self) -> None:
        self._fixed = self._surface.moving[0]  # nodes of all walls but the moving one
        x = self._surface.x.copy()
        x[:self._fixed] = self._books.places(self.time, self.origin)
        self._wall = at_rest(self._surface, x)
        self._on_wall = WallForce(*np.zeros((2, len(x) + 2, 3)))
        self._scratch = new_scratch(len(self._wall.elements))

    def contact_points(self) -> np.ndarray:
        """See `protocol.DEM.contact_points`."""
        self._need_open()
        shapes = select_shapes(self._all_spheres, self._spheres.x, self._ids - 1)
        return to_true_positions(contact_points(shapes, self._ids, self._wall, self._laws), self.origin)

    def replace_wall(self, wall: Wall, was: Any = None) -> None:
        """See `protocol.DEM.replace_wall`."""
        self._need_open()
        scene, fixed, old = with_wall(self.scene, wall), self._fixed, self._wall
        old_x, force = old.x[fixed:, :scene.dim], self._on_wall.force[fixed:-2, :scene.dim]
        known = None if was is None else check_was(was, wall, len(old_x))
        on_others, whole = self._on_wall.force[:fixed], self._on_wall.force[-2:]
        self._replace(scene)
        force = redistribute(old_x, force, self._inside, self._surface) if known is None else \
            carried(known, old_x, force, self._inside.wall.nodes)
        self._on_wall.force[:] = np.concatenate([on_others, in_space(force), whole])
        near, first = self._lists.elements, self._surface.moving[1]
        if not len(near.shear):
            near = no_neighbours(len(self._spheres.x))
        elif known is None:
            near = near._replace(partner=on_new_wall(near, self._spheres.x, old, first, self._wall))
        else:
            near = near._replace(partner=by_number(near, first, new_numbers(known, len(old_x))))
        self._lists = self._lists._replace(elements=near)
        self._build_lists(self._wall, 0.0)
