"""Columns of cells and of material points on a terrain: layers that follow its surface."""
from typing import Any, List, Sequence, Tuple

import numpy as np

import mpm_dem_checks as check

from .bodies import BYTES_PER_POINT, Cloud
from .column_grid import REMEDY, Columns, around
from .polygons import bounds, inside_area, shares
from .raster import EDGE, Raster

BYTES_PER_COLUMN = 200  # until the grid is made, measured
LITTLE = 0.05  # of the usual volume of a point: less goes to the nearest one


def plan_axes(terrain: Any, step: float, where: Any, beyond: bool) -> List[np.ndarray]:
    """Lines ``step`` [m] apart along each axis of the plan, counted from the terrain's lower corner, around
    the area ``where``; beyond: let the last squares reach over the upper edge of the terrain."""
    least, most = (np.asarray(end) for end in (terrain.lower, terrain.upper))
    found = bounds(where, terrain.dim)
    low, high = found if found else (least, most)
    if (low < least - EDGE * step).any() or (high > most + EDGE * step).any():
        raise ValueError(f"where reaches from {_shown(low)} to {_shown(high)} m, the terrain from "
                         f"{_shown(least)} to {_shown(most)} m: give an area on the terrain")
    axes = []
    for a, b, start, end in zip(low, high, least, most):
        whole = (end - start) / step
        last = int(np.ceil(whole - EDGE) if beyond else np.floor(whole + EDGE))
        first = int(np.clip(np.floor((a - start) / step + EDGE), 0, last))
        stop = int(np.clip(np.ceil((b - start) / step - EDGE), 0, last))
        if stop <= first:
            raise ValueError(f"h is {step} m: no column of that width fits on the terrain from "
                             f"{_shown(least)} to {_shown(most)} m, take a smaller one")
        axes.append(start + step * np.arange(first, stop + 1))
    return axes


def _shown(corner: np.ndarray) -> str:
    return str(tuple(float(f"{v:.12g}") for v in corner))


def _places(axes: Sequence[np.ndarray]) -> np.ndarray:
    return np.stack([a.ravel() for a in np.meshgrid(*axes, indexing="ij")], axis=1)


def _middles(axes: Sequence[np.ndarray]) -> List[np.ndarray]:
    return [0.5 * (a[1:] + a[:-1]) for a in axes]


def given_at(name: str, given: Any, places: np.ndarray) -> np.ndarray:
    """A number, or the values of a function of ``places`` [m], shape (n, D - 1), as array, (n,)."""
    if callable(given):
        return np.broadcast_to(check.values(name, given, (places,), (len(places),), (), unit="m"),
                               len(places))
    return np.full(len(places), check.finite(name, given, "m"))


def column_grid(terrain: Any, h: float, above: Any, where: Any, below: float) -> Columns:
    """See ``Terrain.grid``."""
    check.positive("h", h, "m")
    check.positive("below", below, "m")
    axes = plan_axes(terrain, h, where, beyond=False)
    shape = tuple(len(a) - 1 for a in axes)
    check.check_memory(f"{np.prod(shape, dtype=float):.3g} columns on the terrain",
                       np.prod(shape, dtype=float) * BYTES_PER_COLUMN, REMEDY)
    nodes = _places(axes)
    z = terrain.height(nodes).reshape([n + 1 for n in shape])
    high = given_at("above", above, nodes).reshape(z.shape)
    if not (high > 0.0).all():
        check.refuse("above", float(high.min()), "the cells must reach over the terrain", "m")
    held = inside_area(where, nodes).reshape(z.shape)
    kept = inside_area(where, _places(_middles(axes))).reshape(shape) | around(held)
    if not kept.any():
        raise ValueError(f"where holds for none of the {kept.size} columns of {h} m: give an area on the "
                         "terrain, or a smaller h")
    if not np.isfinite(around(z)[kept]).all():
        raise ValueError("the terrain has no height somewhere under the columns: give an area on it as where")
    sunk, risen = _roughness(terrain, axes, z)
    down = np.ceil((below + sunk) / h - EDGE).astype(np.int64)
    up = np.ceil((around(high) + risen) / h - EDGE).astype(np.int64)
    return Columns(axes, z, h, np.where(kept, down, 0), np.where(kept, up, 0))


def _roughness(terrain: Any, axes: Sequence[np.ndarray], z: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """How far vertices of the terrain are below and above the layer through the heights z at the corners of
    each column [m], at least 0: finer than h it is rough."""
    flat, D = terrain.x[:, :-1], terrain.dim
    shape = [len(a) - 1 for a in axes]
    s = np.column_stack([(flat[:, d] - a[0]) / (a[1] - a[0]) for d, a in enumerate(axes)])
    on = ((s >= 0.0) & (s <= shape)).all(axis=1)
    place = np.floor(s[on]).astype(np.int64)
    i = np.minimum(place, np.array(shape) - 1)
    t = s[on] - i
    layer = np.zeros(len(t))
    for corner in range(2 ** (D - 1)):
        bits = np.array([(corner >> d) & 1 for d in range(D - 1)])
        layer += np.prod(np.where(bits, t, 1.0 - t), axis=1) * z[tuple((i + bits).T)]
    over = terrain.x[on, -1] - layer
    sunk, risen = np.zeros(shape), np.zeros(shape)
    np.maximum.at(sunk, tuple(i.T), -over)
    np.maximum.at(risen, tuple(i.T), over)
    return sunk, risen


def column_cloud(terrain: Any, depth: Any, where: Any, h: float) -> Cloud:
    """See ``Terrain.release``."""
    s = 0.5 * check.positive("h", h, "m")
    axes = plan_axes(terrain, s, where, beyond=True)
    volume = _volumes(terrain, depth, where, axes) * s ** (terrain.dim - 1)
    held = volume > 0.0
    if not held.any():
        raise ValueError("the release is empty: the depth is 0 everywhere in the area, look at depth and "
                         "where")
    places, v = _places(_middles(axes))[held.ravel()], volume[held]
    area = (shares(where, axes) * s ** (terrain.dim - 1))[held]
    places, v, area = _gathered(places, v, area)
    tall = v / area
    count = np.maximum(np.rint(tall / s), 1.0).astype(np.int64)
    check.check_memory(f"{count.sum():.3g} material points of the release",
                       float(count.sum()) * BYTES_PER_POINT[terrain.dim], "take a larger h")
    column = np.repeat(np.arange(len(v)), count)
    layer = np.arange(len(column)) - np.repeat(np.cumsum(count) - count, count)
    thick = tall / count
    ground = terrain.height(np.clip(places, terrain.lower, terrain.upper))
    x = np.column_stack([places[column], ground[column] + (layer + 0.5) * thick[column]])
    half = np.full(x.shape, 0.5 * s)
    half[:, -1] = 0.5 * thick[column]
    return Cloud(x, (v / count)[column], half)


def _volumes(terrain: Any, depth: Any, where: Any, axes: Sequence[np.ndarray]) -> np.ndarray:
    """Mean depth over each square times its share in the area [m]."""
    share = shares(where, axes)
    if isinstance(depth, Raster):
        means, whole = _means(depth, axes, terrain), np.nansum(depth.z) * np.prod(depth.cell)
        left = 1.0 - means.sum() * np.prod([a[1] - a[0] for a in axes]) / whole if where is None else 0.0
        if left > EDGE:
            raise ValueError(f"{100.0 * left:.3g} % of the volume of the depths lie beyond the terrain: give "
                             "a larger terrain, or the area as where")
        return means * share
    middles = np.clip(_places(_middles(axes)), terrain.lower, terrain.upper)
    found = given_at("depth", depth, middles)
    if (found[share.ravel() > 0.0] < 0.0).any():
        check.refuse("depth", float(found[share.ravel() > 0.0].min()), "it must not be negative", "m")
    if where is None:
        share = shares(where_of(terrain), axes)
    return np.where(share > 0.0, found.reshape(share.shape), 0.0) * share


def where_of(terrain: Any) -> Any:
    """The extent of a terrain as an area."""
    (a, *c), (b, *d) = terrain.lower, terrain.upper
    return (a, b) if terrain.dim == 2 else [(a, c[0]), (b, c[0]), (b, d[0]), (a, d[0])]


def _means(depth: Raster, axes: Sequence[np.ndarray], terrain: Any) -> np.ndarray:
    """Means over squares of depths that hold over a cell of their raster each."""
    z = np.nan_to_num(depth.z)
    if (z < 0.0).any():
        check.refuse("depth", float(z.min()), "it must not be negative", "m")
    edges = [np.append(a - 0.5 * h, a[-1] + 0.5 * h) for a, h in zip(depth.axes(), depth.cell)]
    for axis, (lines, edge, h) in enumerate(zip(axes, edges, depth.cell)):
        if lines[-1] <= edge[0] or lines[0] >= edge[-1]:
            raise ValueError(f"the depths are from {edge[0]} to {edge[-1]} m along {'xy'[axis]}, away from "
                             f"the area of the release on a terrain from {_shown(terrain.lower)} to "
                             f"{_shown(terrain.upper)} m: look at the coordinates of the raster")
        sums = np.cumsum(np.insert(np.moveaxis(z, axis, 0), 0, 0.0, axis=0), axis=0) * h
        at = np.clip((lines - edge[0]) / h, 0.0, len(edge) - 1.0)
        i = np.minimum(at.astype(np.int64), len(edge) - 2)
        t = (at - i).reshape(-1, *[1] * (z.ndim - 1))
        sums = (1.0 - t) * sums[i] + t * sums[i + 1]
        z = np.moveaxis(np.diff(sums, axis=0) / (lines[1] - lines[0]), 0, axis)
    return z


def _gathered(places: np.ndarray, v: np.ndarray, area: np.ndarray) -> Tuple[np.ndarray, ...]:
    """Columns with too little volume for a point give it to the nearest one that has enough."""
    from scipy.spatial import cKDTree  # takes time to import, and few scenes need it

    little = v < LITTLE * np.median(v)
    if little.any():
        to = cKDTree(places[~little]).query(places[little])[1]
        for values in (v, area):
            np.add.at(values, np.flatnonzero(~little)[to], values[little])
        places, v, area = places[~little], v[~little], area[~little]
    return places, v, area


