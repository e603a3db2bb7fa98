"""The walls of the built-in DEM, and how the moving one becomes another."""
from typing import Any

import numpy as np

from ..common.booking import WallBooks
from ..common.contact_points import contact_points
from ..common.energy import select_shapes
from ..common.states import Kept
from ..common.wall_change import carried, check_was, new_numbers, redistribute, with_wall
from ..common.walls import Walls
from ..contact.law import Laws
from ..scene.arrays import in_space
from ..scene.frame import to_true_positions, translated, with_wall_inside
from ..scene.scene import SceneData
from ..scene.tables import SphereTable
from ..scene.walls import Wall
from ..search.history import by_number, on_new_wall
from ..search.neighbours import no_neighbours
from .forces import Scratch, SphereState, new_scratch
from .loads import Loads


class WallOfNow(Kept):
    """The part of ``ReferenceDEM`` that has to do with its walls."""

    scene: SceneData
    origin: np.ndarray
    _all_spheres: SphereTable
    _ids: np.ndarray
    _laws: Laws
    _spheres: SphereState
    _part: Any  # `Replicated` or `Shared`
    _books: WallBooks
    _walls: Walls
    _loads: Loads
    _scratch: Scratch
    time: float

    def _need_open(self) -> None:
        raise NotImplementedError

    def _build_lists(self, t: float) -> None:
        raise NotImplementedError

    def _use(self, scene: SceneData) -> None:
        """Take the walls of ``scene``, where they are; no force on them."""
        self.scene, self._inside = scene, translated(scene, -self.origin)
        self._walls = Walls(self._inside, self._books.moving, self._books.places(self.time, self.origin))
        self._loads = Loads(self._walls)

    def _replace(self, scene: SceneData) -> None:
        """Take the moving wall of ``scene``, which is the present one besides, where it is."""
        self.scene, self._inside = scene, with_wall_inside(self._inside, scene.wall, -self.origin)
        self._walls.replace(self._inside)
        self._loads.replace()

    def _listed(self) -> None:
        """Lists are new: room for what they say."""
        near = self._part.lists.elements
        self._loads.listed(near.partner)
        most = int(np.diff(near.start).max(initial=0))
        if most >= len(self._scratch.found):
            self._scratch = new_scratch(2 * most)

    def contact_points(self) -> np.ndarray:
        """See `protocol.DEM.contact_points`."""
        self._need_open()
        shapes = select_shapes(self._all_spheres, self._spheres.x, self._ids - 1)
        return to_true_positions(contact_points(shapes, self._ids, self._walls.now, self._laws), self.origin)

    def replace_wall(self, wall: Wall, was: Any = None) -> None:
        """See `protocol.DEM.replace_wall`."""
        self._need_open()
        scene, old, first = with_wall(self.scene, wall), self._walls.own(), self._walls.first
        old_x, force = old.x[:, :scene.dim], self._loads.own[:, :scene.dim].copy()
        known = None if was is None else check_was(was, wall, len(old_x))
        self._replace(scene)
        own = self._walls.own()
        self._loads.own[:] = in_space(redistribute(old_x, force, own) if known is None else
                                      carried(known, old_x, force, self._inside.wall.nodes))
        near = self._part.lists.elements
        if not len(near.shear):
            near = no_neighbours(len(near.start) - 1)
        elif known is None:
            near = near._replace(partner=on_new_wall(near, self._part.spheres.x, old, first, own))
        else:
            near = near._replace(partner=by_number(near, first, new_numbers(known, len(old_x))))
        self._part.lists = self._part.lists._replace(elements=near)
        self._build_lists(0.0)
