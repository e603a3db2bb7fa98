"""A body that stands in the corner of a grid and flows away from it: room for the flow, and its floor."""
import math
from typing import List, Optional, Sequence, Tuple, Union

import numpy as np

import mpm_dem_checks as check

from .bodies import AXES, Grid
from .conditions import GridWall
from .mesh import Box
from .supports import Support

HIGHER = 1.25  # the room over the height of the body


def fall_room(size: Sequence[float], gravity: float, time: float, ways: str = "x") -> Tuple[float, ...]:
    """Room [m], shape (dim,), for a body of ``size`` [m] that collapses: along the axes of ``ways`` as far as
    free fall from its top throws in ``time`` [s] under ``gravity`` [m/s^2], and a quarter higher than the
    body.

    >>> fall_room((0.1, 0.2), gravity=10.0, time=0.5)
    (1.1, 0.25)
    """
    far = math.sqrt(2 * gravity * size[1]) * time
    return tuple(HIGHER * length if axis == "y" else length + far * (axis in ways)
                 for axis, length in zip(AXES, size))


def flow_grid(size: Sequence[float], h: float, room: Sequence[float], ways: str = "x",
              cell: Optional[str] = None) -> Grid:
    """Background grid of ``room`` [m], whose cells of about ``h`` [m] fit a body of ``size`` [m] in its
    corner at the origin. Along the axes of ``ways`` and upwards it has at least one cell more than the body:
    the flow needs a way out, and the body must not touch the top. cell: see ``Grid``. ValueError for a room
    that does not hold the body.

    >>> flow_grid((0.1, 0.2), 0.05, room=(0.3, 0.2)).cells
    (6, 5)
    """
    counts = Grid.counts(size, h)
    room = check.numbers("box", room, len(size), "m", check.positive)
    if any(length < (1 - 1e-9) * least for length, least in zip(room, size)):
        shown = (",".join(f"{length:.12g}" for length in lengths) for lengths in (room, size))
        raise ValueError("box is {} m: it must hold the body of {} m".format(*shown))
    fitted = np.asarray(size) / counts
    cells = [max(math.ceil(length / each - 1e-9), n) for length, each, n in zip(room, fitted, counts)]
    for d, axis in enumerate(AXES[:len(size)]):
        cells[d] += cells[d] == counts[d] and (axis == "y" or axis in ways)
    return Grid(Box((0.0,) * len(size), tuple(np.array(cells) * fitted)), tuple(cells), cell)


def level_floor(kind: Union[str, float], h: float, dim: int) -> Tuple[List[Support], List[GridWall]]:
    """Supports and walls of a floor at y = 0 under a grid with cells of ``h`` [m]: kind "stick", "slip", or a
    coefficient of friction.

    >>> supports, walls = level_floor("stick", 0.1, dim=2)
    >>> supports[0].fix, walls
    ('xy', [])
    """
    if isinstance(kind, str):
        check.choice("floor", kind, ("stick", "slip"))
        fixed = AXES[:dim] if kind == "stick" else "y"
        return [Support(lambda x: x[:, 1] < 0.25 * h, fixed, name="the floor")], []
    check.not_negative("floor", kind, rule="give stick, slip or a coefficient of friction of at least 0")
    return [], [GridWall(lambda x: np.abs(x[:, 1]) < 0.25 * h, "+y", kind, name="the floor")]
