"""Parts of a terrain with a friction and a force cell of their own."""
from typing import Any, Dict, List, Tuple

import numpy as np

import mpm_dem_checks as check

from .polygons import inside_area
from .raster import Raster


def _at(middle: np.ndarray, name: str, given: Any) -> Any:
    """A number, or of each element what a raster or a function gives."""
    if isinstance(given, Raster):
        return np.asarray(given.at(middle)[0])
    if callable(given):
        return check.values(f"{name} of the terrain", given, (middle,), (len(middle),))
    return given


def frictions(middle: np.ndarray, friction: Any, xi: Any, regions: Dict[str, Tuple]) -> Tuple[Any, ...]:
    """Friction with the soil, mu and xi, force cell of each element, and names of the cells."""
    friction, xi = _at(middle, "friction", friction), _at(middle, "xi", xi)
    if not regions:
        return friction, xi, None, None
    values, turbulent = (np.broadcast_to(given, len(middle)).astype(float) for given in (friction, xi))
    cell = np.full(len(middle), -1)
    names: List[str] = []
    for region, given in regions.items():
        try:
            where, rubs, *more = given
            (own_xi,) = more or [None]
        except (TypeError, ValueError):
            check.refuse(f"region {region}", given, "give (polygon, friction) or (polygon, friction, xi)")
        on = inside_area(where, middle) & (cell < 0)
        if not on.any():
            raise ValueError(f"region {region} holds no element of the terrain from {middle.min(axis=0)} to "
                             f"{middle.max(axis=0)} m: look at its coordinates, or leave it out")
        values[on], cell[on] = check.not_negative(f"friction of region {region}", rubs), len(names)
        if own_xi is not None:
            turbulent[on] = check.positive(f"xi of region {region}", own_xi, "m/s^2")
        names.append(region)
    if (cell < 0).any():
        cell[cell < 0] = len(names)
        names.append("rest")
    return values, turbulent, cell, tuple(names)
