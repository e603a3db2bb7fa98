"""Structures that stand between the eye and the soil, so that they are to be seen through."""
from typing import Sequence, Tuple

import numpy as np

from .clip import inside_box
from .perspective import Camera, Canvas, normals, radius_of_points
from .sights import Sight

PIXELS = 150  # of the small pictures that are compared, along their width
HIDDEN = 0.05  # part of the soil's pixels that a structure may hide
LOOKS = 5  # pictures of an animation that are looked at


def bodies(elements: np.ndarray, count: int) -> np.ndarray:
    """Which triangles hang together by their corners: numbers, shape (m,); count: of the places.

    >>> bodies(np.array([[0, 1, 2], [3, 4, 5], [2, 1, 6]]), 7).tolist()
    [0, 1, 0]
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    ends = elements[:, [0, 1]].ravel(), elements[:, [1, 2]].ravel()
    sides = coo_array((np.ones(len(ends[0])), ends), shape=(count, count))
    return connected_components(sides, directed=False)[1][elements[:, 0]]


def hiding(box: Tuple[np.ndarray, np.ndarray], camera: Camera, points: Sequence[np.ndarray],
           sights: Sequence[Sight]) -> np.ndarray:
    """Mask of the triangles of the structures, of those bodies that hide soil in one of the pictures by faces
    which are seen from outside. box: corners, shape (3,) each, outside which nothing is drawn; points: shape
    (n, 3) each."""
    if not sights or "structures" not in sights[0]:
        return np.zeros(0, bool)
    elements = sights[0]["structures"][1]
    body = bodies(elements, len(sights[0]["structures"][0]))
    found = np.zeros(body.max() + 1, bool)
    for k in np.unique(np.linspace(0, len(points) - 1, LOOKS).astype(int)):
        soil = Canvas(camera)
        soil.spheres(points[k], radius_of_points(points[k]), np.zeros(3))
        behind = soil.depths()
        for number in np.flatnonzero(~found):
            x, shown = inside_box(sights[k]["structures"][0], elements[body == number], *box)
            alone = Canvas(camera)
            alone.triangles(x, shown[from_outside(camera, x, shown)], np.zeros(3))
            hidden = np.isfinite(behind) & (alone.depths() < behind)
            found[number] = hidden.sum() > HIDDEN * np.isfinite(behind).sum()
    return found[body]


def from_outside(camera: Camera, x: np.ndarray, elements: np.ndarray) -> np.ndarray:
    """Mask of the triangles, shape (m, 3), whose outside the eye sees."""
    to_eye = camera.eye - x[elements].mean(axis=1)
    return np.einsum("ti,ti->t", normals(x, elements), to_eye) > 0.0
