"""Distribution of the background grid: which rank has which cell, by recursive bisection."""
import numpy as np

EMPTY_CELL = 0.02  # weight of a cell without points; a point weighs 1


def bisect(centres, weights, ranks, patch=None):
    """Recursive coordinate bisection: the rank of each cell, shape (n,), so that every rank gets about the
    same sum of ``weights``. Ties are broken by the cell's number, so the answer does not depend on who asks.
    patch: (n,) numbers of groups of cells that must not be cut, or None."""
    if patch is not None:
        size = np.bincount(patch)
        middle = np.stack([np.bincount(patch, x) / size for x in centres.T], axis=1)
        return bisect(middle, np.bincount(patch, weights), ranks)[patch]
    owner = np.zeros(len(centres), np.int32)

    def split(members, first, count):
        if count == 1:
            owner[members] = first
            return
        heavy = members[weights[members] > weights.min()]
        spread = np.ptp(centres[heavy if len(heavy) else members], axis=0) if len(members) else np.zeros(1)
        axis = int(np.argmax(spread))
        order = members[np.lexsort((members, np.round(centres[members, axis], 12)))]
        filling = np.cumsum(weights[order])
        half = count // 2
        cut = np.searchsorted(filling, filling[-1] * half / count) + 1 if len(order) else 0
        split(order[:cut], first, half)
        split(order[cut:], first + half, count - half)

    split(np.arange(len(centres)), 0, ranks)
    return owner


def ghosts(cells, vertex_count, owner, ranks, mine):
    """For each cell of the slice ``mine``: its owner, then all other ranks with a cell at its vertices."""
    at_vertex = np.zeros((vertex_count, ranks), bool)
    at_vertex[cells.ravel(), np.repeat(owner, cells.shape[1])] = True
    sharing = at_vertex[cells[mine]].any(axis=1)
    single = sharing.sum(axis=1) == 1
    return [[o] if alone else [o, *(r for r in np.flatnonzero(row) if r != o)]
            for o, alone, row in zip(owner[mine].tolist(), single, sharing)]
