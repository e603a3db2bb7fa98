"""Parts of a terrain with a friction and a force cell of their own."""
from typing import Any, Dict, List, Tuple

import numpy as np

import mpm_dem_checks as check

from .polygons import inside_area
from .raster import Raster


def frictions(middle: np.ndarray, friction: Any, regions: Dict[str, Tuple[Any, float]]) -> Tuple[Any, ...]:
    """Friction with the soil, force cell of each element, and names of the cells."""
    if isinstance(friction, Raster):
        friction = np.asarray(friction.at(middle)[0])
    elif callable(friction):
        friction = check.values("friction of the terrain", friction, (middle,), (len(middle),))
    if not regions:
        return friction, None, None
    values, cell = np.broadcast_to(friction, len(middle)).astype(float), np.full(len(middle), -1)
    names: List[str] = []
    for region, given in regions.items():
        try:
            where, rubs = given
        except (TypeError, ValueError):
            check.refuse(f"region {region}", given, "give (polygon, friction)")
        on = inside_area(where, middle) & (cell < 0)
        if not on.any():
            raise ValueError(f"region {region} holds no element of the terrain from {middle.min(axis=0)} to "
                             f"{middle.max(axis=0)} m: look at its coordinates, or leave it out")
        values[on], cell[on] = check.not_negative(f"friction of region {region}", rubs), len(names)
        names.append(region)
    if (cell < 0).any():
        cell[cell < 0] = len(names)
        names.append("rest")
    return values, cell, tuple(names)
