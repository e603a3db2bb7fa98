"""Areas in plan: which places are in them, and how much of each square of a lattice."""
from typing import Any, Optional, Sequence, Tuple

import numpy as np

import mpm_dem_checks as check

SAMPLES = 8  # along each side of a square, where a function tells what is in an area


def as_polygon(name: str, given: Any) -> np.ndarray:
    """Corners of a polygon [m], shape (k, 2), counter-clockwise; ValueError for one that encloses nothing."""
    x = check.array(name, given, ("k", 2), unit="m")
    if len(x) > 1 and np.array_equal(x[0], x[-1]):
        x = x[:-1]
    y = x - x.mean(axis=0)
    area = 0.5 * np.sum(y[:, 0] * np.roll(y[:, 1], -1) - np.roll(y[:, 0], -1) * y[:, 1])
    if len(x) < 3 or not abs(area) > 1e-12 * np.ptp(x, axis=0).max() ** 2:
        raise ValueError(f"{name} is a polygon of {len(x)} corners that encloses {abs(area):.3g} m^2: give "
                         "at least three corners, one after the other around the area")
    return x if area > 0.0 else x[::-1].copy()


def inside_polygon(polygon: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Which of ``places``, shape (n, 2), are inside, by the number of edges east of them."""
    inside = np.zeros(len(places), bool)
    x, y = places.T
    for (x0, y0), (x1, y1) in zip(polygon, np.roll(polygon, -1, axis=0)):
        if y0 != y1:
            crosses = (y0 <= y) != (y1 <= y)
            inside ^= crosses & (x < x0 + (y - y0) * (x1 - x0) / (y1 - y0))
    return inside


def inside_area(where: Any, places: np.ndarray) -> np.ndarray:
    """Which of ``places`` [m], shape (n, D - 1), ``where`` holds: a polygon (in the plane two ends), a
    function of places with a mask, or None for all."""
    if where is None:
        return np.ones(len(places), bool)
    if callable(where):
        return check.mask("where", where, places)
    if places.shape[1] == 1:
        a, b = as_interval("where", where)
        return (places[:, 0] >= a) & (places[:, 0] <= b)
    return inside_polygon(as_polygon("where", where), places)


def as_interval(name: str, given: Any) -> Tuple[float, float]:
    """Two ends [m], the lower one first."""
    a, b = check.numbers(name, given, 2, "m")
    if not a < b:
        raise ValueError(f"{name} goes from {a} to {b} m: give the lower end first")
    return a, b


def bounds(where: Any, dim: int) -> Optional[Tuple[np.ndarray, np.ndarray]]:
    """Lower and upper corner of the area ``where`` [m], shape (dim - 1,); None where it is not known."""
    if where is None or callable(where):
        return None
    if dim == 2:
        return tuple(np.array([end]) for end in as_interval("where", where))  # type: ignore[return-value]
    polygon = as_polygon("where", where)
    return polygon.min(axis=0), polygon.max(axis=0)


def shares(where: Any, axes: Sequence[np.ndarray]) -> np.ndarray:
    """How much of each square between the lines of ``axes`` [m] (equally far apart on each) is in the area
    ``where``, shape (nx, ny) or (nx,): exact for polygons and intervals, of samples for functions."""
    if where is None:
        return np.ones([len(a) - 1 for a in axes])
    if callable(where):
        return _sampled(where, axes)
    if len(axes) == 1:
        a, b = as_interval("where", where)
        return np.diff(np.clip(axes[0], a, b)) / np.diff(axes[0])
    return _covered(as_polygon("where", where), axes)


def _sampled(where: Any, axes: Sequence[np.ndarray]) -> np.ndarray:
    fine = [a[0] + (a[1] - a[0]) * (np.arange(SAMPLES * (len(a) - 1)) + 0.5) / SAMPLES for a in axes]
    places = np.stack([a.ravel() for a in np.meshgrid(*fine, indexing="ij")], axis=1)
    held = check.mask("where", where, places).astype(float)
    shape = [n for a in axes for n in (len(a) - 1, SAMPLES)]
    return held.reshape(shape).mean(axis=tuple(range(1, len(shape), 2)))


def _covered(polygon: np.ndarray, axes: Sequence[np.ndarray]) -> np.ndarray:
    """Share of each square in the polygon. Each edge, cut at the lines, adds the area between it and the east
    side of its square, and its height to all squares farther east, with the sign of its way down."""
    origin, step = np.array([a[0] for a in axes]), np.array([a[1] - a[0] for a in axes])
    nx, ny = (len(a) - 1 for a in axes)
    area, beyond = np.zeros((nx + 1, ny)), np.zeros((nx + 1, ny))
    corners = (polygon - origin) / step
    for p, q in zip(corners, np.roll(corners, -1, axis=0)):
        cuts = [np.array([0.0, 1.0])]
        for a, b in zip(p, q):
            if a != b:
                lines = np.arange(np.ceil(min(a, b)), np.floor(max(a, b)) + 1.0)
                cuts.append((lines - a) / (b - a))
        t = np.unique(np.clip(np.concatenate(cuts), 0.0, 1.0))
        ends = p + t[:, None] * (q - p)
        middle, rise = 0.5 * (ends[1:] + ends[:-1]), -np.diff(ends[:, 1])
        i, j = np.floor(middle).astype(np.int64).T
        kept = (j >= 0) & (j < ny) & (i < nx)
        i, j, rise, x = i[kept], j[kept], rise[kept], middle[kept, 0]
        west = i < 0
        i, x = np.where(west, 0, i), np.where(west, 0.0, x)
        np.add.at(area, (i, j), rise * (i + 1.0 - x))
        np.add.at(beyond, (i + 1, j), rise)
    return np.clip(area[:nx] + np.cumsum(beyond, axis=0)[:nx], 0.0, 1.0)
