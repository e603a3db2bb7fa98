"""Which rank has which spheres: recursive bisection of their centres."""
import numpy as np

from ..compiled import compiled


def bisected(x: np.ndarray, ranks: int) -> np.ndarray:
    """The rank of each of the points x [m], (n, 3): parts of about as many points, cut one after the other
    across the longest axis. It depends on the places alone, and points in one place have one rank.

    >>> bisected(np.array([[0.0, 0.0, 0.0], [0.0, 3.0, 0.0], [0.0, 2.0, 0.0], [0.0, 2.0, 0.0]]), 2)
    array([0, 1, 0, 0])
    """
    rank, parts = np.zeros(len(x), np.int64), [(np.arange(len(x)), 0, ranks)]
    while parts:
        rows, first, end = parts.pop()
        middle = (first + end) // 2
        if middle == first:
            rank[rows] = first
            continue
        some = x[rows]
        axis = np.argmax(np.ptp(some, axis=0)) if len(rows) else 0
        lower = _lowest(np.ascontiguousarray(some[:, axis]), len(rows) * (middle - first) // (end - first))
        parts += [(rows[lower], first, middle), (rows[~lower], middle, end)]
    return rank


def _lowest(values: np.ndarray, count: int) -> np.ndarray:
    """Which of the ``values`` are the ``count`` lowest, as nearly as equal ones stay together."""
    if not len(values):
        return np.zeros(0, np.bool_)
    cut = np.partition(values, count)[count]  # the value is unique, while an order of equal ones is not
    below, up_to = values < cut, values <= cut
    return below if count - np.count_nonzero(below) <= np.count_nonzero(up_to) - count else up_to


@compiled
def around(x, rank, own, reach):
    """Numbers, rising, of the points x [m], (n, 3), of other ranks than ``own`` no farther than ``reach`` [m]
    from the box around those of that one. rank: of each, (n,)."""
    low, high, out, count = np.full(3, np.inf), np.full(3, -np.inf), np.empty(len(x), np.int64), 0
    for i in range(len(x)):
        for k in range(3 if rank[i] == own else 0):
            if x[i, k] < low[k]:  # not min: NaN stays outside
                low[k] = x[i, k]
            if x[i, k] > high[k]:
                high[k] = x[i, k]
    for i in range(len(x)):
        near = rank[i] != own
        for k in range(3):
            near = near and low[k] - reach <= x[i, k] <= high[k] + reach
        if near:
            out[count] = i
            count += 1
    return out[:count].copy()
