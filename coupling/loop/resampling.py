"""Between two windows: a solid may give its interface other points, as its outline flows or as other points
of it come near particles, and the grains' wall follows."""
from dataclasses import replace
from typing import Any, Optional, Tuple

import numpy as np

from ..maps.mapping import Mapping
from ..protocols import InterfaceChange


def resample_interface(solid: Any, grains: Any, mapping: Mapping,
                       near: Tuple[np.ndarray, float]) -> Optional[InterfaceChange]:
    """Let a solid that can do so renew its interface, or choose the points ``near`` these particles, which it
    has for a window of that length [s]; the wall of the grains gets the same nodes and elements.

    Returns None when nothing has changed. Costs nothing when the solid has neither ``resample`` nor
    ``select``. ValueError unless wall nodes are interface points.
    """
    resample, select = getattr(solid, "resample", None), getattr(solid, "select", None)
    change = None if resample is None else resample()
    if change is None and select is not None:
        change = select(*near)
    if change is None:
        return None
    if not mapping.is_copy:
        raise ValueError("the interface is resampled, but the wall has nodes of its own or forces are "
                         "spread: give the wall the nodes and elements of the interface, and spread nothing")
    wall, was = grains.scene.wall, getattr(change, "was", None)
    if was is not None:
        _check_discs(wall, solid.ball_radius)
        grains.replace_wall(replace(wall, nodes=change.x, elements=change.elements), was)
    elif not (change.keeps_numbers and np.array_equal(wall.elements, change.elements)):
        grains.replace_wall(replace(wall, nodes=change.x, elements=change.elements))
    return change


def _check_discs(wall: Any, radius: float) -> None:
    """ValueError unless the ``wall`` has discs of that ``radius`` [m]."""
    if wall.radius != radius:
        raise ValueError(f"the interface has balls of radius {radius} m, the wall of the grains discs of "
                         f"{wall.radius} m: leave the wall out of the scene of a Run, or give Wall.discs of "
                         "no points with that radius")
