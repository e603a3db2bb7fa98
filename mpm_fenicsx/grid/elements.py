"""Elements: the nodes on which a material point acts, and where its part of the matrix goes.

With the linear basis the element of a point is its cell, and points add to one matrix per cell. With a smooth
basis it is the stencil of the 3^D nodes around its nearest node, and elements have the numbers of these
nodes. They overlap so much that a matrix for each would hold many times what the whole matrix does; points
therefore add to the rows of the nodes, each with the blocks of the 5^D nodes around it.
"""
from typing import NamedTuple

import numpy as np


class PointElements(NamedTuple):
    """m elements with K nodes each, for a kernel: ``nodes`` (m, K); ``row`` (m,), of an element among the
    matrices; for F-bar ``patch`` (m,), row of an element's patch among the patches, and ``place`` (m, K) of
    its nodes among those of the patch. See ``active_cells``."""

    nodes: np.ndarray
    row: np.ndarray
    patch: np.ndarray
    place: np.ndarray


def reach(background, chosen):
    """Nodes of this rank on which points in the ``chosen`` cells of this rank can act."""
    nodes = background.cells[chosen]
    if not background.basis.smooth:
        return nodes.ravel()
    near = np.zeros(len(background.x), bool)
    near[nodes] = True
    return background.cells[near[background.cells].any(axis=1)].ravel()


def around(counts, number, width):
    """Of nodes or cells of a regular grid, ``counts`` (D,) of them along the axes, or of copies of it one
    after the other, those with the ``number``, shape (n,): the places among these of the width^D around each,
    first direction fastest, shape (n, width^D); -1 where there is none."""
    strides, D, count = np.cumprod([1, *counts[:-1]]), len(counts), np.prod(counts)
    place = np.full(count * (1 + number.max(initial=0) // count), -1, np.int32)
    place[number] = np.arange(len(number))
    steps = np.arange(width) - width // 2
    steps = np.stack(np.meshgrid(*[steps] * D, indexing="ij"), axis=-1).reshape(-1, D)[:, ::-1]
    found = np.full((len(number), len(steps)), -1, np.int32)
    index = number[:, None] // strides % counts
    for k, step in enumerate(steps):
        inside = ((index + step >= 0) & (index + step < counts)).all(axis=1)
        found[inside, k] = place[number[inside] + step @ strides]
    return found


def stencil_elements(neighbours):
    """``PointElements`` of a smooth basis, and the nodes of the patches of F-bar, shape (patches, K).

    neighbours: the nodes of the stencils, see ``around``. No point has a function at one that is missing: it
    is replaced by the node in the middle. A patch is what lies nearest to one node.
    """
    number = np.arange(len(neighbours), dtype=np.int32)
    nodes = np.ascontiguousarray(np.where(neighbours < 0, number[:, None], neighbours), np.int32)
    place = np.tile(np.arange(nodes.shape[1], dtype=np.int32), (len(nodes), 1))
    return PointElements(nodes, number, number, place), nodes


def cell_elements(background, cells, row, chosen, node_count):
    """``PointElements`` of the linear basis, and the nodes of the patches of F-bar, shape (patches, M), -1
    where a patch has fewer.

    cells: nodes of this rank's cells, shape (m, K), with numbers below ``node_count``; row: see
    ``active_cells``; chosen: the cells with a row. A quadrilateral or a hexahedron is its own patch.
    """
    K = cells.shape[1]
    place = np.tile(np.arange(K, dtype=np.int32), (len(cells), 1))
    if background.patch is None:
        return PointElements(cells, row, row, place), cells[chosen]
    numbers, own = np.unique(background.patch[background.original_cell[chosen]], return_inverse=True)
    pairs, pair = np.unique(own[:, None] * node_count + cells[chosen], return_inverse=True)
    row_of, node = np.divmod(pairs, node_count)
    of_pair = np.arange(len(pairs)) - np.searchsorted(row_of, row_of)
    patch = np.full_like(row, -1)
    patch[chosen], place[chosen] = own, of_pair[pair].reshape(-1, K)
    nodes = np.full((len(numbers), of_pair.max(initial=0) + 1), -1, np.int32)
    nodes[row_of, of_pair] = node
    return PointElements(cells, row, patch, place), nodes
