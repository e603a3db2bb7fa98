"""Laws that depend on the size of the background cells, on the grid of their scene."""
from dataclasses import replace
from typing import Union

import numpy as np

from .bodies import Body, Grid
from .column_grid import Columns
from .mesh import Mesh

NEAR = 1.1  # of a size: what counts as the same


def cell_sizes(grid: Union[Grid, Mesh], body: Body) -> np.ndarray:
    """Sizes of the cells along the axes [m], shape (dim,): of a mesh the means of those with a middle in the
    box around the body, or of all where there are none."""
    if isinstance(grid, (Grid, Columns)):
        return grid.cell_size
    corners = grid.vertices[grid.cells]
    middle, box = corners.mean(axis=1), body.box
    corners = corners[((middle >= box.lower) & (middle <= box.upper)).all(axis=1)]
    return np.ptp(corners, axis=1).mean(axis=0) if len(corners) else grid.cell_size


def on_grid(body: Body, grid: Union[Grid, Mesh], number: int) -> Body:
    """The ``body``, of that ``number``, with its law for the cells of the ``grid``. ValueError where the law
    is made for cells of another size."""
    if body.law.by_cell is None:
        return body
    sizes, cell = cell_sizes(grid, body), body.law.cell
    if cell is None:
        return replace(body, law=body.law.by_cell(float(np.prod(sizes) ** (1.0 / len(sizes)))))
    if not sizes.min() / NEAR <= cell <= sizes.max() * NEAR:
        of_grid = " x ".join(f"{size:.6g}" for size in sizes)
        raise ValueError(f"the law {body.law.name} of body {number} is made for cells of {cell:.6g} m, and "
                         f"those of the grid are {of_grid} m: leave cell= out, so that it takes them, or "
                         "give their size")
    return body
