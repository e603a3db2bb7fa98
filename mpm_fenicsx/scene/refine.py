"""Surfaces of boundary particles made as fine as the grid: between particles farther apart than its cells
there are nodes that no spring holds, and soil flows through (measured: a patch with particles every 2 cells
lets 21 % pass)."""
from dataclasses import replace
from typing import Any, Callable, Tuple

import numpy as np

from .bodies import Grid
from .conditions import Penalty
from .interface import Interface

SPACING = 0.5  # of the particles over the size of a cell: none has passed a wall as fine as that


def as_fine_as_the_grid(penalty: Penalty, background: Any) -> Penalty:
    """The ``Penalty`` with its elements divided until its particles are half a cell apart; its own particles
    come first. Normals and motions between them are interpolated; one without elements stays as it is."""
    x, elements = np.asarray(penalty.surface.x, float), np.asarray(penalty.surface.elements)
    if not len(elements) or elements.shape[1] == 1:
        return penalty
    corners = x[elements]
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    # two triangles make half a square
    longest = SPACING * np.sqrt(x.shape[1] - 1) * _cell_sizes(background, corners)
    pieces = np.ceil(edges / longest - 1e-9).astype(int)
    if pieces.max() <= 1:
        return penalty
    parents, weights, divided = divide(elements, len(x), pieces)
    between = lambda values: np.einsum("nk,nk...->n...", weights, values[parents])  # noqa: E731
    normal, motion = penalty.normal, penalty.motion
    if normal is not None:
        normal = between(normal)
        flat = np.linalg.norm(normal, axis=1) < 1e-6  # between opposite ones
        normal[flat] = penalty.normal[parents[flat, 0]]

    return replace(penalty, surface=Interface(between(x), divided), normal=normal,
                   motion=motion and _of_parents(motion, x.shape, between))


def _of_parents(motion: Callable, shape: Tuple[int, ...], between: Callable) -> Callable[[float], np.ndarray]:
    """A ``motion`` of all particles from one given for those of the ``shape`` that are divided."""
    def moved(time: float) -> np.ndarray:
        shift = np.asarray(motion(time), float)
        return between(shift) if shift.shape == shape else shift

    return moved


def _cell_sizes(background: Any, corners: np.ndarray) -> np.ndarray:
    """Smallest size of the grid's cells near each element [m], shape (m,); corners: (m, K, D)."""
    if isinstance(background.grid, Grid):
        return background.h.min()
    from scipy.spatial import cKDTree  # takes time to import, and few scenes need it

    vertices, cells = background.whole
    sizes = np.ptp(vertices[cells], axis=1).min(axis=1)
    places = np.concatenate([corners, corners.mean(axis=1, keepdims=True)], axis=1)
    return sizes[cKDTree(vertices[cells].mean(axis=1)).query(places)[1]].min(axis=1)


def divide(elements: np.ndarray, count: int, pieces: np.ndarray) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Divide each side of element e, a segment or a triangle, into pieces[e] pieces.

    elements: (m, K) numbers of ``count`` particles. Returns parents, shape (n, K), and weights, shape (n, K),
    of the particles then there, the first ``count`` being the old ones, and the elements they form, shape (k,
    K).
    """
    K, parents, numerators, denominators, divided, n = elements.shape[1], [], [], [], [], 0
    for p in np.unique(pieces):
        places, parts = _lattice(K, p)
        chosen = elements[pieces == p]
        parents.append(np.repeat(chosen, len(places), axis=0))
        numerators.append(np.tile(places, (len(chosen), 1)))
        denominators.append(np.full(len(chosen) * len(places), p))
        divided.append((n + len(places) * np.arange(len(chosen))[:, None, None] + parts).reshape(-1, K))
        n += len(chosen) * len(places)
    parent, numerator, denominator = map(np.concatenate, (parents, numerators, denominators))
    parent[numerator == 0] = -1  # so that particles on a common side are alike in both elements
    order = np.argsort(parent, axis=1)
    parent, numerator = (np.take_along_axis(a, order, axis=1) for a in (parent, numerator))
    common = np.gcd.reduce(np.column_stack([numerator, denominator]), axis=1)[:, None]
    keys = np.column_stack([parent, numerator // common, denominator[:, None] // common])
    old = parent[:, -2] < 0
    new, number = np.unique(keys[~old], axis=0, return_inverse=True)
    place = np.empty(len(keys), int)
    place[old], place[~old] = parent[old, -1], count + number
    first = np.repeat(np.arange(count)[:, None], K, axis=1)
    weights = np.concatenate([np.eye(1, K).repeat(count, axis=0), new[:, K:2 * K] / new[:, 2 * K:]])
    return np.concatenate([first, np.maximum(new[:, :K], 0)]), weights, place[np.concatenate(divided)]


def _lattice(K: int, p: int) -> Tuple[np.ndarray, np.ndarray]:
    """Particles of a segment (K = 2) or triangle (K = 3) with sides in p pieces, as p times their barycentric
    coordinates, shape (n, K), and the parts they form, shape (p^(K-1), K), which turn as the whole does."""
    if K == 2:
        i = np.arange(p + 1)
        return np.column_stack([p - i, i]), np.column_stack([i[:-1], i[1:]])
    i, j = (a.ravel() for a in np.meshgrid(np.arange(p + 1), np.arange(p + 1), indexing="ij"))
    inside = i + j <= p
    number = np.full((p + 2, p + 2), -1)
    number[i[inside], j[inside]] = np.arange(inside.sum())
    i, j = i[inside], j[inside]
    up, down = i + j < p, i + j < p - 1
    ups = np.column_stack([number[i, j], number[i + 1, j], number[i, j + 1]])[up]
    downs = np.column_stack([number[i + 1, j], number[i + 1, j + 1], number[i, j + 1]])[down]
    return np.column_stack([p - i - j, i, j]), np.concatenate([ups, downs])
