"""Between two windows: a solid that flows may give its interface other points, and the grains' wall follows."""
from dataclasses import replace

import numpy as np


def resample(solid, grains, mapping):
    """Let a solid that can do so renew its interface; the wall of the grains gets the same nodes and elements.

    Returns None when nothing has changed, else the change: ``interpolate(values)`` gives what belongs to the new points,
    shape (n, …), from what belonged to the old ones, ``redistribute(loads)`` does so for loads and keeps their sum. Costs
    nothing when the solid has no method ``resample``. ValueError unless wall nodes are interface points.
    """
    renew = getattr(solid, "resample", None)
    change = None if renew is None else renew()
    if change is None:
        return None
    if not mapping.is_copy:
        raise ValueError("the interface is resampled, but the wall has nodes of its own or forces are spread: give the "
                         "wall the nodes and elements of the interface, and spread nothing")
    wall = grains.scene.wall
    if not (change.keeps_numbers and np.array_equal(wall.elements, change.elements)):
        grains.replace_wall(replace(wall, nodes=change.x, elements=change.elements))
    return change
