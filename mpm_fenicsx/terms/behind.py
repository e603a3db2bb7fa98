"""Material points that have gone through a wall: they are counted, and named in a warning.

Every point near a wall remembers on which side of it it is. One that was in front and is more than ``DEEP``
cells behind has gone through, until it comes back to the front; one that came around the wall's rim has not.
The springs of a wall give by pressure / k, so that a point just behind it means nothing.
"""
import warnings

import numpy as np

from mpm_dem_direct import direct

from ..collective import somewhere
from ..compiled import specialise
from ..points.box_tree import BoxTree
from .wall_elements import WallElements, make_room, nearest
from .wall_surfaces import WallSurfaces, find_surfaces

D = 2  # fixed by specialise
BEHIND, UNKNOWN, FRONT, THROUGH = -1, 0, 1, 2  # sides; THROUGH plus the number of the wall
DEEP, FAR = 0.5, 2.0  # cells behind a wall, and from it


def look(x, tree: BoxTree, elements: WallElements, deep, far, side):
    """Bring the ``side`` of each point, shape (n,), up to date; returns how many have just gone through a
    wall.

    x: (n, D) [m]; tree: of the elements; deep, far: [m].
    """
    wall = elements.wall
    room, weight = make_room(D), np.empty(D)
    gone = 0
    for p in range(len(x)):
        element, _, along, on_rim = nearest(p, x, tree, elements, far, weight, room)
        if element < 0 or on_rim:
            side[p] = side[p] if side[p] >= THROUGH else UNKNOWN
        elif along >= 0.0:
            side[p] = FRONT
        elif side[p] == FRONT and along < -deep:
            side[p] = THROUGH + wall[element]
            gone += 1
        elif side[p] == UNKNOWN:
            side[p] = BEHIND
    return gone


class Behind:
    """Keeps the ``side`` of the points of ``bodies`` and counts those that have gone through a wall.

    surfaces: a ``wall_surfaces.Surface`` of each wall. Collective.
    """

    def __init__(self, surfaces, h, box, bodies, comm):
        """h: size of a cell [m]; box: of the grid."""
        self._bodies, self._comm, self._h, self._told = bodies, comm, h, set()
        self._surfaces = WallSurfaces(surfaces, h, FAR * h, box, self._places())
        self.names = self._surfaces.names
        D = self._surfaces.walls.normal.shape[1]
        self._look = direct(specialise(look, D=D, nearest=specialise(nearest, D=D)))
        for body in bodies:
            body.points.add(side=np.zeros(len(body.points), np.int16))
        self._update()  # where they are at the start

    def _places(self):
        return [body.points.x for body in self._bodies]

    def _update(self):
        self._surfaces.follow(self._places())
        return sum(self._look(body.points.x, self._surfaces.tree, self._surfaces.walls, DEEP * self._h,
                              FAR * self._h, body.points.side) for body in self._bodies)

    def __call__(self, time):
        """After a step that ends at ``time`` [s]: warn of every wall through which the first points have
        gone."""
        if self._surfaces.moves:
            self._surfaces.place(time)
        if somewhere(self._comm, self._update() > 0)[0]:
            self._tell(time)

    def _tell(self, time):
        for wall, count in enumerate(self.counts()):
            if count and wall not in self._told:
                self._told.add(wall)
                if self._comm.rank == 0:
                    warnings.warn(f"{count} material point{'s have' if count > 1 else ' has'} gone through "
                                  f"{self.names[wall]}, more than {DEEP} cells deep, at t = {time:.6g} s: "
                                  "take a smaller dt, smaller cells or a stiffer wall", stacklevel=2)

    def counts(self):
        """Points now behind each wall."""
        side = np.concatenate([body.points.side for body in self._bodies])
        mine = np.bincount(side[side >= THROUGH] - THROUGH, minlength=len(self.names))
        return self._comm.allreduce(mine) if self._comm.size > 1 else mine


def watch(scene, background, bodies):
    """``Behind`` of a scene's ``Penalty`` and ``GridWall`` records: of those in space with a front side; None
    when there are none."""
    surfaces = find_surfaces(scene, background)
    if not surfaces:
        return None
    return Behind(surfaces, background.h.max(), background.grid.box, bodies, background.comm)
