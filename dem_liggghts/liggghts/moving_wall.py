"""The walls of the LIGGGHTS back end, and how the moving one becomes another."""
import ctypes
from typing import Any, Tuple

import numpy as np

from ..common.booking import WallBooks
from ..common.contact_points import contact_points
from ..common.energy import select_shapes
from ..common.states import Kept
from ..common.wall_change import carried, check_was, new_numbers, redistribute, with_wall
from ..common.walls import Walls
from ..contact.law import Laws, laws_of
from ..scene.arrays import in_space
from ..scene.frame import to_true_positions, translated, with_wall_inside
from ..scene.scene import SceneData
from ..scene.tables import SphereTable
from ..scene.walls import Wall
from .buffers import Load, copied, gathered
from .instance import Instance, pointer


class MovingWall(Kept):
    """The part of ``LiggghtsDEM`` that has to do with its walls."""

    scene: SceneData
    origin: np.ndarray
    _instance: Instance
    _inside: SceneData  # the scene in the frame
    _books: WallBooks
    _spheres: SphereTable
    _laws: Laws
    _walls: Walls
    time: float

    def _own_particles(self) -> np.ndarray:
        raise NotImplementedError

    @property
    def _nodes(self) -> np.ndarray:
        """Of the interface in the frame [m], shape (n, dim)."""
        return self._walls.now.x[self._walls.fixed:, :self.scene.dim]

    def _load_on_walls(self, impulse: int) -> Load:
        """Force of the last step, or ``impulse`` of the window, from the particles of all ranks."""
        dim, records, count = self.scene.dim, ctypes.c_void_p(), ctypes.c_int()
        self._instance.call("dem_wall_rows", dim, impulse, ctypes.byref(records), ctypes.byref(count))
        table = gathered(self.comm, copied(records, count.value).reshape(-1, 1 + dim))
        row, place = np.unique(table[:, 0].astype(int), return_inverse=True)
        values = np.zeros((len(row), dim))
        np.add.at(values, place, table[:, 1:])
        return Load(row, values)

    def _use(self, scene: SceneData) -> None:
        """Take the walls of ``scene``, which is in the frame; no springs and no force there."""
        walls = Walls(scene, self._books.moving, self._books.places(self.time, self.origin))
        self._walls = walls
        self._give(0, 0, (walls.fixed, walls.first), keep=0)
        of = walls.fixed_squares
        shape = np.concatenate([of.axes, of.frame])
        self._instance.call("dem_set_squares", len(of.loose), pointer(of.loose), pointer(of.start),
                            pointer(of.element), pointer(shape))
        self._give_own(keep=0)

    def _give(self, node: int, element: int, ends: Tuple[Any, Any], keep: int, new: Any = None) -> None:
        """Hand over nodes and elements from these numbers to the ``ends``."""
        now, dim = self._walls.now, self.scene.dim
        elements, traits, x = now.elements[element:ends[1]], now.traits[element:ends[1]], now.x[node:ends[0]]
        data = np.zeros((len(elements), 3 + traits.shape[1]))
        data[:, :dim], data[:, 3:] = elements, traits
        data[:, dim:3] = elements[:, :3 - dim]  # a segment names its first node twice
        data[:, 3] += 1  # atom types count from 1
        self._instance.call("dem_set_wall", dim, len(x), len(data), node, element, pointer(data), pointer(x),
                            keep, None if new is None else pointer(new))

    def _give_own(self, keep: int, new: Any = None) -> None:
        """Hand over the interface; tangential springs on it go on when ``keep``. new: number that each disc
        of the wall before has now, -1 for none; None: springs go to the nearest element."""
        walls, new = self._walls, None if new is None else np.array(new, np.int32)
        self._give(walls.fixed, walls.first, (None, None), keep, new)
        moving = walls.now.moving.astype(np.int32)
        x = np.ascontiguousarray(walls.now.x[moving])
        self._instance.call("dem_set_moving", len(moving), pointer(moving), 3, pointer(x))

    def contact_points(self) -> np.ndarray:
        """See `protocol.DEM.contact_points`."""
        particles = self._own_particles()
        shapes = select_shapes(self._spheres, in_space(particles["x"]), particles["id"] - 1)
        found = contact_points(shapes, particles["id"], self._walls.now, self._laws)
        return to_true_positions(found, self.origin)

    def replace_wall(self, wall: Wall, was: Any = None) -> None:
        """See `protocol.DEM.replace_wall`."""
        scene, old, walls = with_wall(self.scene, wall), self._nodes.copy(), self._walls
        known = None if was is None else check_was(was, wall, len(old))
        load = self._load_on_walls(impulse=0)
        force = load.dense(walls.fixed, len(old))
        self._replace(scene)
        if known is None:
            self._give_own(keep=1)
            own = redistribute(old, force, walls.own())
        else:
            self._give_own(1, new_numbers(known, len(old)))
            own = carried(known, old, force, self._nodes)
        self._set_force(load.with_others(walls.fixed, len(old), own))

    def _replace(self, scene: SceneData) -> None:
        """Take the moving wall of ``scene``, which is the present one besides, where it is."""
        if scene.wall.material != self.scene.wall.material or not self.scene.wall.may_touch:
            self._laws = laws_of(scene)
        self._inside = with_wall_inside(self._inside, scene.wall, -self.origin)
        self.scene = scene
        self._walls.replace(self._inside)

    def _set_force(self, load: Load) -> None:
        """That of the last step on the nodes of all walls [N]."""
        rows = load.table(self.comm.rank == 0)
        self._instance.call("dem_set_wall_force", self.scene.dim, len(rows), pointer(rows))

    def _change_wall(self, scene: SceneData, origin: np.ndarray) -> None:
        """Take the walls of ``scene`` in the frame with this ``origin``; no force on them."""
        if not np.array_equal(origin, self.origin):
            self.origin, self._inside, self.scene = origin, translated(scene, -origin), scene
            self._laws = laws_of(scene)
            self._use(self._inside)
        else:
            self._replace(scene)
            self._give_own(keep=0)
