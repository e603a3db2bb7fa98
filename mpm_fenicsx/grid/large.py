"""Which grids come in blocks, and which blocks of them are made."""
import numpy as np

from ..scene.column_grid import Columns
from .blocks import Blocks
from .column_blocks import ColumnBlocks


def come_in_blocks(scene, smooth):
    """Whether blocks of the grid of a ``SolidScene`` are enough: a large regular one, or one of columns, with
    the linear basis and without walls along its nodes, which look at all of it. ValueError for one that is
    too large otherwise. smooth: so is the basis."""
    if not getattr(scene.grid, "large", False):
        return False
    if smooth or scene.penalties:
        scene.grid.check_whole()
        return False
    return True


def make_blocks(grid, places, scene, numbers, comm):
    """``Blocks`` of the ``numbers``, or where they are None around the ``places`` [m], (n, D) each, of which
    each rank gives some, and what a ``SolidScene``, or None, has besides. Collective."""
    kind = ColumnBlocks if isinstance(grid, Columns) else Blocks
    if numbers is not None:
        return kind(grid, numbers)
    stated = [scene.interface, *(load.surface for load in scene.loads)] if scene else []
    more = [np.asarray(one.x, float) for one in stated if hasattr(one, "x")]
    return kind.around(grid, [*places, *(at for at in more if at.shape[1] == grid.dim)], comm)
