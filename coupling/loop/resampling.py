"""Between two windows: a solid that flows may give its interface other points, and the grains' wall
follows."""
from dataclasses import replace
from typing import Any, Optional

import numpy as np

from ..maps.mapping import Mapping
from ..protocols import InterfaceChange


def resample_interface(solid: Any, grains: Any, mapping: Mapping) -> Optional[InterfaceChange]:
    """Let a solid that can do so renew its interface; the wall of the grains gets the same nodes and
    elements.

    Returns None when nothing has changed. Costs nothing when the solid has no method ``resample``. ValueError
    unless wall nodes are interface points.
    """
    resample = getattr(solid, "resample", None)
    change = None if resample is None else resample()
    if change is None:
        return None
    if not mapping.is_copy:
        raise ValueError("the interface is resampled, but the wall has nodes of its own or forces are "
                         "spread: give the wall the nodes and elements of the interface, and spread nothing")
    wall = grains.scene.wall
    if not (change.keeps_numbers and np.array_equal(wall.elements, change.elements)):
        grains.replace_wall(replace(wall, nodes=change.x, elements=change.elements))
    return change
