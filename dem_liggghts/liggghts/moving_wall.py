"""The walls of the LIGGGHTS back end, and how the moving one becomes another."""
from typing import Any, Tuple

import numpy as np

from ..common.booking import WallBooks
from ..common.contact_points import contact_points
from ..common.energy import select_shapes
from ..common.states import Kept
from ..common.wall_change import carried, check_was, new_numbers, redistribute, with_wall
from ..contact.law import Laws, laws_of
from ..scene.arrays import in_space
from ..scene.frame import to_true_positions, translated, with_wall_inside
from ..scene.scene import SceneData
from ..scene.tables import SphereTable, wall_table, with_moving
from ..scene.walls import Wall
from ..search.elements import at_rest
from .instance import Instance, pointer


class MovingWall(Kept):
    """The part of ``LiggghtsDEM`` that has to do with its walls."""

    scene: SceneData
    origin: np.ndarray
    _instance: Instance
    _inside: SceneData  # the scene in the frame
    _nodes: Any  # of the moving wall, there [m], (n, dim)
    _books: WallBooks
    _spheres: SphereTable
    _laws: Laws
    _surface: Any
    time: float

    def _own_particles(self) -> np.ndarray:
        raise NotImplementedError

    def _sum(self, array: np.ndarray) -> np.ndarray:
        """Over the ranks."""
        raise NotImplementedError

    @property
    def _shape(self) -> Tuple[int, int]:
        """Of an array for the nodes of all walls, those of the moving one last."""
        return self._books.fixed + len(self._nodes), self.scene.dim

    def _no_force(self) -> np.ndarray:
        """Room for forces on the nodes of all walls [N], and for the two last rows of shim/wall.h."""
        return np.zeros((self._shape[0] + 2, self._shape[1]))

    def _rows(self, rows: np.ndarray) -> np.ndarray:
        """Of the nodes of all walls and the two last rows of shim/wall.h three components of each: in a plane
        the first number of a moment is that about z."""
        out = in_space(rows)
        if self.scene.dim == 2:
            out[-2] = 0.0, 0.0, out[-2, 0]
        return out

    def _all_nodes(self, fixed: np.ndarray, own: np.ndarray) -> np.ndarray:
        """Values at the nodes of all walls, from those of others, shape (n, 3), and of the moving one."""
        return np.ascontiguousarray(np.concatenate([fixed[:, :self.scene.dim], own]))

    def _set_wall(self, keep: int, new: Any = None) -> None:
        """Hand over all walls of the scene; tangential springs go on when ``keep``. new: number that each
        disc of the wall before has now, -1 for none; None: springs go to the nearest element."""
        s, dim, new = self._surface, self.scene.dim, None if new is None else np.array(new, np.int32)
        data = np.zeros((len(s.elements), 3 + s.traits.shape[1]))
        data[:, :dim], data[:, 3:] = s.elements, s.traits
        data[:, dim:3] = s.elements[:, :3 - dim]  # a segment names its first node twice
        data[:, 3] += 1  # atom types count from 1
        x = s.x.copy()
        x[:self._books.fixed] = self._books.places(self.time, self.origin)
        self._instance.call("dem_set_wall", dim, len(x), len(s.elements), s.moving[1], pointer(data),
                            pointer(x), keep, None if new is None else pointer(new))

    def contact_points(self) -> np.ndarray:
        """See `protocol.DEM.contact_points`."""
        particles = self._own_particles()
        nodes = np.concatenate([self._books.places(self.time, self.origin), in_space(self._nodes)])
        shapes = select_shapes(self._spheres, in_space(particles["x"]), particles["id"] - 1)
        found = contact_points(shapes, particles["id"], at_rest(self._surface, nodes), self._laws)
        return to_true_positions(found, self.origin)

    def replace_wall(self, wall: Wall, was: Any = None) -> None:
        """See `protocol.DEM.replace_wall`."""
        scene, force, old = with_wall(self.scene, wall), self._no_force(), self._nodes
        known = None if was is None else check_was(was, wall, len(old))
        self._instance.call("dem_wall_force", scene.dim, pointer(force))
        force, fixed = self._sum(force), self._books.fixed
        self._replace(scene)
        if known is None:
            self._set_wall(keep=1)
            own = redistribute(old, force[fixed:-2], self._inside, self._surface)
        else:
            self._set_wall(1, new_numbers(known, len(old)))
            own = carried(known, old, force[fixed:-2], self._nodes)
        self._set_force(np.concatenate([force[:fixed], own, force[-2:]]))

    def _replace(self, scene: SceneData) -> None:
        """Take the moving wall of ``scene``, which is the present one besides, where it is."""
        if scene.wall.material != self.scene.wall.material or not self.scene.wall.may_touch:
            self._laws = laws_of(scene)
        self._inside = with_wall_inside(self._inside, scene.wall, -self.origin)
        self.scene, self._surface = scene, with_moving(self._surface, self._inside)
        self._nodes = self._inside.wall.nodes

    def _set_force(self, force: np.ndarray) -> None:
        """That of the last step on the nodes of all walls [N], shape (n + 2, dim), see `_no_force`."""
        force = np.ascontiguousarray(force if self.comm.rank == 0 else np.zeros_like(force))
        self._instance.call("dem_set_wall_force", self.scene.dim, pointer(force))

    def _change_wall(self, scene: SceneData, origin: np.ndarray) -> None:
        """Take the walls of ``scene`` in the frame with this ``origin``; no force on them."""
        if not np.array_equal(origin, self.origin):
            self.origin, self._inside = origin, translated(scene, -origin)
            self._surface = wall_table(self._inside)
        self._replace(scene)
        self._set_wall(keep=0)
        self._set_force(self._no_force())
