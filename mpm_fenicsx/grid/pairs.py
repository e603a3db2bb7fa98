"""Pairs of cells: the same cell in two fields of the grid, see ``background``. What acts between bodies in
different fields couples the nodes of both."""
from typing import NamedTuple

import numpy as np


class CellPairs(NamedTuple):
    """n pairs on this rank: ``nodes`` (n, 2K), numbers of the nodes of the active cells, those of one cell
    and then those of the other, which lie in the same places; ``row`` by pair of fields → (cells,), number of
    the pair whose first cell it is, -1 where there is none."""

    nodes: np.ndarray
    row: dict


def find_pairs(background, fields, cells, row):
    """``CellPairs`` of the pairs of ``fields``, of which points may be in both cells.

    cells: nodes of this rank's cells among the active ones, shape (m, K); row: (m,), -1 where points may not
    be, see ``active_cells``.
    """
    nodes, rows, count = [np.zeros((0, 2 * cells.shape[1]), np.int32)], {}, 0
    active, field = np.flatnonzero(row >= 0), background.field_of
    for one, other in fields:
        first = active[field[active] == one]
        second = background.in_field(first, other)
        both = row[second] >= 0
        first, second = first[both], second[both]
        nodes.append(np.column_stack([cells[first], cells[second]]))
        rows[one, other] = np.full(len(row), -1, np.int32)
        rows[one, other][first] = count + np.arange(len(first))
        count += len(first)
    return CellPairs(np.ascontiguousarray(np.concatenate(nodes), np.int32), rows)
