"""Spheres that fill a body: in rows in a box, inscribed one by one in a solid of any shape."""
from itertools import product
from typing import NamedTuple, Optional, Tuple

import numpy as np

import mpm_dem_checks as check

from .arrays import Array
from .covering import choose
from .depths import blocks, depths, windings
from .sizes import check_size
from .surface import Solid

POINTS = 64000  # about so many of the grid in the box around a solid,
ACROSS = 400  # and in a row, when it is thin
USUAL, MOST = 20, 1000  # spheres when nothing is said, and when only a coverage is
LOT = 2048  # triangles whose points are looked at together
FINEST = 40  # most parts into which an edge is divided to look for the largest gap


class Filling(NamedTuple):
    """How well the spheres of a cluster fill the solid inside its surface."""

    spheres: int  # number of them
    covered: float  # part of the points of the grid inside the solid that lie in a sphere, from 0 to 1
    gap: float  # largest distance from a point of the surface to the nearest sphere [m]
    spacing: float  # of the grid [m]: finer than that nothing is seen


def inscribed(solid: Solid, spheres: Optional[int] = None, coverage: Optional[float] = None,
              smallest: Optional[float] = None) -> Tuple[np.ndarray, np.ndarray, Filling]:
    """Centres [m], shape (n, 3), and radii [m], shape (n,), of spheres inside the ``solid``, and how well
    they fill it: the rule of `Cluster.from_surface`. Raises ValueError."""
    most = check.count("spheres", (USUAL if coverage is None else MOST) if spheres is None else spheres)
    check_size(most, f"spheres={most} in a cluster")
    wanted = 1.0 if coverage is None else check.between("coverage", coverage, 0.0, 1.0, ends="(]")
    bare, index, x, spacing = _inside(solid)
    depth = depths(x, *blocks(solid.x[solid.triangles]))
    least = spacing if smallest is None else check.positive("smallest", smallest, "m")
    able = np.flatnonzero(depth >= least)
    if not len(able):
        raise ValueError(f"no sphere of smallest={least:.3g} m fits into the surface, the largest has "
                         f"{depth.max(initial=0.0):.3g} m: give a lower smallest")
    chosen = able[choose(bare, index[able], depth[able] / spacing, most, wanted)]
    covered = 1.0 - float(bare.sum() / len(x))
    if coverage is not None and covered < wanted:
        remedy = f"more spheres than {most}" if len(chosen) == most else "a lower smallest"
        raise ValueError(f"{len(chosen)} spheres of at least {least:.3g} m cover {covered:.4g} of the volume "
                         f"inside the surface, and coverage is {wanted}: give {remedy}, or less coverage")
    centres, radii = x[chosen], depth[chosen]
    return centres, radii, Filling(len(chosen), covered, _gap(solid, spacing, centres, radii), spacing)


def _inside(solid: Solid) -> Tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Which points of a grid lie inside the ``solid``, bool, (k, l, m); their indices, (n, 3), and places
    [m], (n, 3); and the spacing [m]. The grid is symmetric about the centre of the box around the solid, and
    has a point there."""
    low, high = solid.x.min(axis=0), solid.x.max(axis=0)
    spacing = max(((high - low).prod() / POINTS)**(1.0 / 3.0), (high - low).max() / ACROSS)
    half = np.ceil((high - low) / (2.0 * spacing) - 0.5).astype(int)
    middle = 0.5 * (low + high)
    check.check_work(f"{len(solid.triangles)} triangles of a surface to fill",
                     float(len(solid.triangles)) * POINTS, "give a coarser surface")
    around = windings((solid.x[solid.triangles] - middle) / spacing + half, 2 * half + 1)
    if around.min() < 0 or around.max() > 1:
        raise ValueError("the surface crosses itself, or parts of it lie in each other or are inside out: "
                         "give the outer surface of one body")
    index = np.argwhere(around)
    return around == 1, index, middle + spacing * (index - half), spacing


def _gap(solid: Solid, spacing: float, centres: np.ndarray, radii: np.ndarray) -> float:
    """Largest distance from the surface to the nearest sphere [m], seen at the vertices and at points between
    them a ``spacing`` apart, or at most ``FINEST`` along an edge."""
    corners = solid.x[solid.triangles]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    parts = np.minimum(np.ceil(longest / spacing), FINEST).astype(int)
    largest = 0.0
    for n in np.unique(parts):
        i, j = (a.ravel() for a in np.meshgrid(np.arange(n + 1), np.arange(n + 1), indexing="ij"))
        weights = np.column_stack([i, j, n - i - j])[i + j <= n] / n
        some = corners[parts == n]
        for start in range(0, len(some), LOT):
            points = (weights @ some[start:start + LOT]).reshape(-1, 3)
            nearest = np.full(len(points), np.inf)
            for centre, radius in zip(centres, radii):
                np.minimum(nearest, np.linalg.norm(points - centre, axis=1) - radius, out=nearest)
            largest = max(largest, float(nearest.max()))
    return largest


def check_box(size: Array, n: Array) -> Tuple[np.ndarray, np.ndarray]:
    """Size [m] and numbers of spheres along each side of a box, (dim,) each. Raises ValueError."""
    size = check.array("size of the cluster", size, (2,), (3,), unit="m")
    n = check.array("n of the cluster", n, (2,), (3,))
    if size.shape not in ((2,), (3,)) or n.shape != size.shape or not ((n >= 2) & (n % 1 == 0)).all() or \
            not ((size > 0) & (size < np.inf)).all():
        raise ValueError(f"a box of size {size} m with {n} spheres: give 2 or 3 positive lengths and at "
                         "least two spheres along each")
    check_size(float(n.prod()), f"{check.shown(n)} in a cluster")
    return size, n.astype(int)


def lattice(size: np.ndarray, n: np.ndarray, radius: float, rim: bool) -> np.ndarray:
    """Centres [m] of n spheres along each side of a box around zero; with ``rim`` only those at its faces."""
    axes = [np.linspace(radius - s / 2, s / 2 - radius, k) for s, k in zip(size, n)]
    index = np.array(list(product(*(range(k) for k in n))))
    if rim:
        index = index[((index == 0) | (index == n - 1)).any(axis=1)]
    return np.column_stack([axis[i] for axis, i in zip(axes, index.T)])
