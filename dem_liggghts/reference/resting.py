"""What the built-in DEM knows of its contacts, and how all that moves is stopped."""
import numpy as np

from ..common.energy import select_shapes
from ..common.touching import touching
from ..contact.law import Laws
from ..scene.contacts import Contacts
from ..scene.tables import SphereTable
from .forces import SphereState
from .moving_wall import WallOfNow
from .rigid import ClusterState


class Resting(WallOfNow):
    """The part of ``ReferenceDEM`` that has to do with rest."""

    _ids: np.ndarray
    _all_spheres: SphereTable
    _spheres: SphereState
    _clusters: ClusterState
    _laws: Laws
    _springs: tuple

    def _begin(self) -> None:
        raise NotImplementedError

    def contacts(self) -> Contacts:
        """See `protocol.DEM.contacts`."""
        self._need_open()
        shapes = select_shapes(self._all_spheres, self._spheres.x, self._ids - 1)
        found = touching(shapes, self._walls.now, self._part.whole_lists()[:2], self._springs)
        return found.renumbered(self._ids - 1)

    def halt(self) -> None:
        """See `protocol.DEM.halt`."""
        self._need_open()
        for array in (self._spheres.v, self._spheres.omega):
            array[:] = 0.0
        if self._clusters is not None:
            for array in (self._clusters.v, self._clusters.omega, self._clusters.spin):
                array[:] = 0.0
        self._begin()
