"""Material points around rocks: what is left of a body where rocks are cut out of it."""
from itertools import product
from typing import Any, List, NamedTuple, Sequence, Tuple

import numpy as np

import mpm_dem_checks as check

from .lattice import cell_count

SAMPLES = {2: 10, 3: 5}  # of the box that a point stands for, per direction
LOT = 20000  # points that are sampled together
PUSHES = 8  # out of one rock after the other, at most


class Parts(NamedTuple):
    """Points x [m], shape (n, D), with ``volume`` [m^D], (n,), in boxes of ``half`` their widths [m], (n,
    D)."""

    x: np.ndarray
    volume: np.ndarray
    half: np.ndarray


def even_parts(lower: np.ndarray, size: np.ndarray, counts: Sequence[int]) -> Parts:
    """The box from ``lower`` of ``size`` [m] in equal boxes, ``counts`` of them per direction."""
    axes = [low + length * (np.arange(n) + 0.5) / n for low, length, n in zip(lower, size, counts)]
    x = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, len(counts))
    half = np.tile(0.5 * np.asarray(size) / counts, (len(x), 1))
    return Parts(x, np.prod(2.0 * half, axis=1), half)


def read_rocks(rocks: Any, dim: int) -> Tuple[np.ndarray, np.ndarray]:
    """Centres [m], shape (n, dim), and radii [m], (n,), of all spheres of ``rocks``: things with ``x`` and
    ``radius`` (`Spheres`) or ``places`` and ``radii`` (`Cluster`) of `dem_liggghts`, or lists of them."""
    centres: List[np.ndarray] = [np.zeros((0, dim))]
    radii: List[np.ndarray] = [np.zeros(0)]
    for rock in rocks if isinstance(rocks, (list, tuple)) else (rocks,):
        if isinstance(rock, (list, tuple)):
            x, r = read_rocks(rock, dim)
        elif hasattr(rock, "places") and hasattr(rock, "radii"):
            x, r = np.asarray(rock.places)[:, :rock.dim], rock.radii
        elif hasattr(rock, "x") and hasattr(rock, "radius"):
            x, r = np.asarray(rock.x), rock.radius
        else:
            raise ValueError(f"rocks are {check.shown(rock)}: give Spheres, a Cluster, or a list of them")
        if x.shape[1] != dim:
            raise ValueError(f"rocks have {x.shape[1]} coordinates and the body has {dim}: give both in a "
                             "plane, or both in space")
        centres.append(x)
        radii.append(np.broadcast_to(r, len(x)))
    return np.concatenate(centres), np.concatenate(radii)


def distances(x: np.ndarray, rocks: Tuple[np.ndarray, np.ndarray],
              reach: float) -> Tuple[np.ndarray, np.ndarray]:
    """Distance [m] of points x [m], shape (n, D), from the nearest of the spheres ``rocks``, negative inside,
    infinite beyond ``reach`` [m], shape (n,), and the number of that sphere."""
    from scipy.spatial import cKDTree  # takes time to import, and few scenes need it

    nearest, number = np.full(len(x), np.inf), np.zeros(len(x), int)
    tree = cKDTree(x) if len(x) else None
    for k, (centre, radius) in enumerate(zip(*rocks)):
        around = np.array(tree.query_ball_point(centre, radius + reach), int) if tree else number[:0]
        d = np.linalg.norm(x[around] - centre, axis=1) - radius
        closer = d < nearest[around]
        nearest[around[closer]], number[around[closer]] = d[closer], k
    return nearest, number


def without_rocks(body: Any, rocks: Any, gap: float) -> Parts:
    """Points of ``body``, of a Box or a Cloud, outside ``rocks``, see ``around_rocks``."""
    shape, D = body.shape, body.dim
    if body.cells is None:
        half = np.tile(0.5 * shape.volume ** (1.0 / D), (D, 1)).T if shape.half is None else shape.half
        parts = Parts(shape.x, shape.volume, half)
    else:
        tensor = body.cell in ("quadrilateral", "hexahedron")
        simplices = cell_count((1,) * D, body.cell)  # in each cell of the box
        per = body.points if tensor else max(1, round((body.points * simplices) ** (1.0 / D)))
        parts = even_parts(np.array(shape.lower), shape.size, per * np.array(body.cells))
    return around_rocks(parts, read_rocks(rocks, D), gap)


def around_rocks(parts: Parts, rocks: Tuple[np.ndarray, np.ndarray], gap: float) -> Parts:
    """What is left of ``parts`` outside the spheres ``rocks``.

    A point whose centre lies in a rock is left out. The box of each point that a rock cuts is sampled, and
    each sample outside all rocks is a piece of volume that belongs to its point, or where that is left out,
    to the nearest one that is kept: so volume and centre of mass are those of the body without the rocks, but
    for the sampling. A point that is cut lies at the centre of its pieces, and from there at least ``gap``
    [m] from any rock, pushed away from it; where there is no room for that between rocks and the faces of the
    body, it is left out, too, and the nearest one has its volume. The box that a point stands for is as much
    smaller or larger as its volume. Raises ValueError when nothing is left.
    """
    x, volume, half = parts
    d, _ = distances(x, rocks, float(np.linalg.norm(half, axis=1).max()))
    cut, kept = d < np.linalg.norm(half, axis=1), d >= 0.0
    _check_left(kept)
    new_volume, moment = np.where(kept & ~cut, volume, 0.0), np.where((kept & ~cut)[:, None], x, 0.0)
    moment *= volume[:, None]
    for lot in np.array_split(np.flatnonzero(cut), np.count_nonzero(cut) // LOT + 1):
        pieces, of = _pieces(parts, rocks, lot)
        piece = (volume / SAMPLES[x.shape[1]] ** x.shape[1])[of]
        owner = of.copy()
        owner[~kept[of]] = _nearest(x, kept, pieces[~kept[of]])
        new_volume += np.bincount(owner, piece, len(x))
        moment += np.column_stack([np.bincount(owner, piece * p, len(x)) for p in pieces.T])
    kept &= new_volume > 0.0
    changed = kept & (np.abs(new_volume - volume) > 1e-9 * volume)
    places = x.copy()
    places[changed] = moment[changed] / new_volume[changed, None]
    lower, upper = (x - half).min(axis=0), (x + half).max(axis=0)
    places, fits = _pushed(places, rocks, gap, lower, upper)
    _check_left(kept & fits)
    lost = np.flatnonzero(kept & ~fits)
    kept &= fits
    new_volume += np.bincount(_nearest(places, kept, places[lost]), new_volume[lost], len(x))
    factor = (new_volume / volume) ** (1.0 / x.shape[1])
    return Parts(places[kept], new_volume[kept], (half * factor[:, None])[kept])


def _check_left(kept: np.ndarray) -> None:
    if not kept.any():
        raise ValueError(f"the rocks leave none of the {len(kept)} material points of the body: give fewer "
                         "or smaller rocks, a smaller gap, or more points")


def _pieces(parts: Parts, rocks: Tuple[np.ndarray, np.ndarray],
            lot: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Samples [m], (m, D), outside all rocks, of the points ``lot``, and the numbers of these, (m,)."""
    D = parts.x.shape[1]
    places = (2.0 * np.arange(SAMPLES[D]) + 1.0) / SAMPLES[D] - 1.0
    offsets = np.array(list(product(places, repeat=D)))
    x = (parts.x[lot][:, None] + offsets * parts.half[lot][:, None]).reshape(-1, D)
    free = distances(x, rocks, 0.0)[0] >= 0.0
    return x[free], np.repeat(lot, len(offsets))[free]


def _nearest(x: np.ndarray, kept: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Number of the point x [m] among those ``kept`` that is nearest to each of ``places`` [m]."""
    from scipy.spatial import cKDTree

    if not len(places):
        return np.zeros(0, int)
    return np.flatnonzero(kept)[cKDTree(x[kept]).query(places)[1]]


def _pushed(x: np.ndarray, rocks: Tuple[np.ndarray, np.ndarray], gap: float, lower: np.ndarray,
            upper: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Points [m] at least ``gap`` [m] from any rock, and whether they are so, within the box of the body."""
    centres, radii = rocks
    for _ in range(PUSHES * (len(radii) > 0 and gap > 0.0)):
        d, sphere = distances(x, rocks, gap)
        near = np.flatnonzero(d < gap * (1.0 - 1e-9))
        if not len(near):
            break
        way = x[near] - centres[sphere[near]]
        length = np.maximum(np.linalg.norm(way, axis=1), 1e-12 * radii[sphere[near]])
        x[near] += way * ((gap - d[near]) / length)[:, None]
    inside = ((x > lower) & (x < upper)).all(axis=1)
    return x, inside & (distances(x, rocks, gap)[0] >= gap * (1.0 - 1e-6))
