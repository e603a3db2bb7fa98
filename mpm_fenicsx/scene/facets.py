"""Facets and corners of the cells of a mesh, as arrays."""
from typing import Tuple

import numpy as np


def alike(rows: np.ndarray) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rows that hold the same numbers: ``order`` puts them next to each other, ``first`` and ``count`` say
    where each lot begins in it and how many there are."""
    key = np.sort(rows, axis=1)
    order = np.lexsort(key.T) if key.shape[1] > 2 else np.argsort(_packed(key), kind="stable")
    change = (key[order[1:]] != key[order[:-1]]).any(axis=1)
    first = np.flatnonzero(np.append(True, change))
    return order, first, np.diff(np.append(first, len(rows)))


def _packed(key: np.ndarray) -> np.ndarray:
    """Rows of one or two numbers, not negative, as one number each: sorted in half the time."""
    return key[:, 0] if key.shape[1] == 1 else key[:, 1] * (key[:, 0].max(initial=0) + 1) + key[:, 0]


def same_places(x: np.ndarray, near: float) -> np.ndarray:
    """Of places x [m], shape (n, D), the number of the first in the same place, to ``near`` [m], shape
    (n,)."""
    key = np.round((x - x.min(axis=0)) / near).astype(np.int64)
    order = np.lexsort(key.T)
    new = np.append(True, (key[order[1:]] != key[order[:-1]]).any(axis=1))
    first = np.empty(len(x), np.int64)
    first[order] = order[np.flatnonzero(new)][np.cumsum(new) - 1]
    return first


def runs_up(facets: np.ndarray) -> np.ndarray:
    """Whether each facet goes from its lowest vertex to the lower one beside it: which way round."""
    if facets.shape[1] == 2:
        return facets[:, 0] < facets[:, 1]
    lowest, row = np.argmin(facets, axis=1), np.arange(len(facets))
    n = facets.shape[1]
    return facets[row, (lowest + 1) % n] < facets[row, (lowest - 1) % n]


def corner_volumes(x: np.ndarray) -> np.ndarray:
    """Jacobian determinant at the vertices of each cell, (m, k), k = 1 for simplices; x: (m, nodes, dim)."""
    dim = x.shape[2]
    if x.shape[1] == dim + 1:
        return np.linalg.det(x[:, 1:] - x[:, :1])[:, None]
    corners = []
    for a in range(2**dim):
        edges = [(x[:, a ^ (1 << d)] - x[:, a]) * (-1 if (a >> d) & 1 else 1) for d in range(dim)]
        corners.append(np.linalg.det(np.stack(edges, axis=1)))
    return np.stack(corners, axis=1)


def normal_areas(x: np.ndarray, elements: np.ndarray) -> np.ndarray:
    """Area times outward unit normal of each element [m^2; m in the plane], shape (m, D); x: (n, D) [m]."""
    first = x[elements[:, 0]]
    if x.shape[1] == 2:
        edge = x[elements[:, 1]] - first
        return np.column_stack([-edge[:, 1], edge[:, 0]])  # on the left
    return 0.5 * np.cross(x[elements[:, 1]] - first, x[elements[:, 2]] - first)
