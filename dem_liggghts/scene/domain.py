"""The domain of a DEM scene and what happens at its sides, as a user states them."""
from typing import Any, List

import numpy as np

import mpm_dem_checks as check

WAYS = ("stop", "hold", "remove")  # what happens to that which leaves: the words of the MPM's outflow


def sides_of(dim: int) -> List[str]:
    """Names of the sides of a domain: "-x", "+x", …, as in `mpm_fenicsx`."""
    return [sign + axis for axis in "xyz"[:dim] for sign in "-+"]


def read_domain(domain: Any, dim: int) -> np.ndarray:
    """Lower and upper corner [m], shape (2, dim), of a pair of them. Raises ValueError."""
    lower, upper = check.array("domain", domain, (2, dim), unit="m")
    if not (lower < upper).all():
        raise ValueError(f"domain is {lower} to {upper} m: give its lower and upper corner")
    return np.array([lower, upper])


def read_ways(outflow: Any, dim: int) -> List[str]:
    """Ways in the order of ``sides_of``, of a word for all sides or a dict by side, such as {"+x": "remove"},
    whose other sides stop. Raises ValueError for another word or side."""
    sides = sides_of(dim)
    given = outflow if isinstance(outflow, dict) else dict.fromkeys(sides, outflow)
    for side, way in given.items():
        if side not in sides:
            raise ValueError(f"outflow has a side {side!r}: choose from {', '.join(sides)}")
        check.choice(f"outflow at {side}" if given is outflow else "outflow", way, WAYS)
    return [given.get(side, "stop") for side in sides]
