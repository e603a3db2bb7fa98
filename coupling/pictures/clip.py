"""Triangles as far as they are inside a box."""
from typing import List, Tuple

import numpy as np


def inside_box(x: np.ndarray, elements: np.ndarray, low: np.ndarray,
               high: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """What is left of triangles, shape (m, 3), between the corners ``low`` and ``high``, shape (3,): places
    and triangles. Those at the rim are cut (Sutherland and Hodgman, Comm. ACM 17 (1974) 32-42).

    >>> x = np.array([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]])
    >>> inside_box(x, np.array([[0, 1, 2]]), np.zeros(3), np.ones(3))[1].tolist()
    [[3, 4, 5], [3, 5, 6]]
    """
    below, above = x < low, x > high
    outside = (below[elements].all(axis=1) | above[elements].all(axis=1)).any(axis=1)
    cut = ~outside & (below | above)[elements].any(axis=(1, 2))
    places, kept, first = [x], [elements[~outside & ~cut]], len(x)
    for corners in x[elements[cut]]:
        polygon = _cut(list(corners), low, high)
        if len(polygon) > 2:
            places.append(np.array(polygon))
            fan = np.arange(1, len(polygon) - 1)
            kept.append(first + np.column_stack([np.zeros_like(fan), fan, fan + 1]))
            first += len(polygon)
    return np.concatenate(places), np.concatenate(kept)


def _cut(polygon: List[np.ndarray], low: np.ndarray, high: np.ndarray) -> List[np.ndarray]:
    """A convex polygon cut at the six sides of the box."""
    for axis in range(3):
        for sign, level in ((1.0, low[axis]), (-1.0, high[axis])):
            left: List[np.ndarray] = []
            for a, b in zip(polygon, polygon[1:] + polygon[:1]):
                p, q = sign * (a[axis] - level), sign * (b[axis] - level)
                left += [a] if p >= 0.0 else []
                left += [a + p / (p - q) * (b - a)] if p * q < 0.0 else []
            polygon = left
    return polygon
