"""What LIGGGHTS knows of its contacts, and how all that moves is stopped."""
import ctypes
from typing import Any

import numpy as np

from ..common.energy import select_shapes
from ..common.touching import lists_of, touching
from ..contact.law import Laws, count_springs
from ..scene.arrays import in_space
from ..scene.contacts import Contacts, contact_table
from ..scene.tables import SphereTable
from .buffers import SPRING, copied, gathered
from .instance import pointer
from .moving_wall import MovingWall


class Resting(MovingWall):
    """The part of ``LiggghtsDEM`` that has to do with rest."""

    _spheres: SphereTable
    _laws: Laws

    def _own_particles(self) -> np.ndarray:
        raise NotImplementedError

    def _report(self) -> None:
        raise NotImplementedError

    def contacts(self) -> Contacts:
        """See `protocol.DEM.contacts`."""
        particles, (at, count) = self._own_particles(), (ctypes.c_void_p(), ctypes.c_int())
        if self._instance.call("dem_get_springs", ctypes.byref(at), ctypes.byref(count)):
            self._report()
        rows = gathered(self.comm, copied(at, count.value).reshape(-1, SPRING))
        index = np.zeros(len(self._spheres.x) + 1, np.int64)  # of each tag among those that are there
        index[particles["id"]] = np.arange(len(particles))
        first, second = index[rows[:, 0].astype(int)], rows[:, 1].astype(int)
        between, at_walls = (second > 0) & (rows[:, 0] < second), second < 0
        partner = np.where(second > 0, index[np.maximum(second, 0)], -1 - second)
        pairs = np.column_stack([first, partner])
        known = Contacts(*(contact_table(pairs[some], np.zeros(some.sum()), rows[some, 2:])
                           for some in (between, at_walls)))
        springs = tuple(map(count_springs, self._laws))
        shapes = select_shapes(self._spheres, in_space(particles["x"]), particles["id"] - 1)
        found = touching(shapes, self._walls.now, lists_of(known, len(particles), springs),
                         springs)
        return found.renumbered(particles["id"] - 1)

    def _give_springs(self, contacts: Any) -> None:
        """Those of the ``contacts`` that the scene starts with, if any."""
        if contacts is None:
            return
        (pairs, _, springs), (at_walls, _, of_walls) = contacts
        rows = np.concatenate([np.column_stack([1 + pairs, springs]),
                               np.column_stack([1 + pairs[:, ::-1], -springs]),
                               np.column_stack([1 + at_walls[:, 0], -1 - at_walls[:, 1], of_walls])])
        if self._instance.call("dem_set_springs", len(rows), pointer(rows)):
            self._report()

    def halt(self) -> None:
        """See `protocol.DEM.halt`."""
        if self._instance.call("dem_halt"):
            self._report()
