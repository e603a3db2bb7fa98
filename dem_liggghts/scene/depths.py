"""Where points lie to a closed surface of triangles: inside or outside, and how far from it. Compiled."""
from typing import Tuple

import numpy as np

from ..compiled import compiled

BLOCK = 32  # triangles near each other, that are left out together when they are too far
ASIDE = 1e-7  # of a spacing: so far beside a row of the grid its ray passes, that it meets no edge
SLANT = 0.6180339887498949


def windings(corners: np.ndarray, shape: np.ndarray) -> np.ndarray:
    """How often the surface runs around each point (i, j, k) of a grid of this ``shape``: 1 inside, 0
    outside, other numbers where it crosses itself or is inside out. corners: of the triangles in units of the
    grid, (m, 3, 3)."""
    around = np.zeros((*shape,), np.int64)
    _count_crossings(corners, around)
    return around


@compiled
def _count_crossings(corners: np.ndarray, around: np.ndarray) -> None:
    """A ray up from each point counts the triangles it leaves through less those it enters through."""
    for t in range(len(corners)):
        a, b, c = corners[t]
        area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        sign = 1 if area > 0.0 else -1
        if area == 0.0:
            continue
        low_i = max(0, int(np.floor(min(a[0], b[0], c[0]))))
        low_j = max(0, int(np.floor(min(a[1], b[1], c[1]))))
        for i in range(low_i, min(around.shape[0], int(max(a[0], b[0], c[0])) + 1)):
            x = i + ASIDE
            for j in range(low_j, min(around.shape[1], int(max(a[1], b[1], c[1])) + 1)):
                y = j + ASIDE * SLANT
                u = (c[0] - b[0]) * (y - b[1]) - (c[1] - b[1]) * (x - b[0])
                v = (a[0] - c[0]) * (y - c[1]) - (a[1] - c[1]) * (x - c[0])
                w = (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])
                if sign * u > 0.0 and sign * v > 0.0 and sign * w > 0.0:
                    z = (u * a[2] + v * b[2] + w * c[2]) / (u + v + w)
                    for k in range(min(around.shape[2], int(np.ceil(z)))):
                        around[i, j, k] += sign


def blocks(corners: np.ndarray) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The triangles with ``corners``, (m, 3, 3), sorted into blocks of ``BLOCK`` near each other: their
    corners, and the centre, (n, 3), and radius, (n,), of a sphere around each block."""
    middle = corners.mean(axis=1)
    low, size = middle.min(axis=0), np.ptp(middle, axis=0).max() or 1.0
    cell = ((middle - low) / size * 1023).astype(np.int64)
    code = np.zeros(len(corners), np.int64)  # the bits of the three in turn (Morton's order)
    for bit in range(10):
        for axis in range(3):
            code |= (cell[:, axis] >> bit & 1) << (3 * bit + axis)
    corners = np.ascontiguousarray(corners[np.argsort(code, kind="stable")])
    parts = [corners[k:k + BLOCK].reshape(-1, 3) for k in range(0, len(corners), BLOCK)]
    centres = np.array([0.5 * (part.min(axis=0) + part.max(axis=0)) for part in parts])
    radii = np.array([np.linalg.norm(part - c, axis=1).max() for part, c in zip(parts, centres)])
    return corners, centres, radii


@compiled
def depths(x: np.ndarray, corners: np.ndarray, centres: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """Distance from each of the points x [m], (n, 3), to the nearest triangle of ``blocks`` [m], (n,)."""
    out, middles, sizes = np.empty(len(x)), np.empty((len(corners), 3)), np.zeros(len(corners))
    for t in range(len(corners)):  # a sphere around each
        for k in range(3):
            middles[t, k] = (corners[t, 0, k] + corners[t, 1, k] + corners[t, 2, k]) / 3.0
        for m in range(3):
            away = 0.0
            for k in range(3):
                away += (corners[t, m, k] - middles[t, k])**2
            sizes[t] = max(sizes[t], np.sqrt(away))
    nearest = 0  # the triangle nearest to one point is a good guess for the next one: most others are further
    for n in range(len(x)):
        squared = squared_distance(x[n], corners[nearest])
        distance = np.sqrt(squared)
        for b in range(len(radii)):
            reach, away = distance + radii[b], 0.0
            for k in range(3):
                away += (x[n, k] - centres[b, k])**2
            if away > reach * reach:
                continue
            for t in range(b * BLOCK, min(len(corners), (b + 1) * BLOCK)):
                reach, away = distance + sizes[t], 0.0
                for k in range(3):
                    away += (x[n, k] - middles[t, k])**2
                if away > reach * reach:
                    continue
                found = squared_distance(x[n], corners[t])
                if found < squared:
                    squared, distance, nearest = found, np.sqrt(found), t
        out[n] = distance
    return out


@compiled
def squared_distance(p: np.ndarray, corners: np.ndarray) -> float:
    """Of the point p from a triangle, which may be flat: the nearest of its edges, or its plane where the
    point lies above it [m^2]."""
    ax, ay, az = corners[1, 0] - corners[0, 0], corners[1, 1] - corners[0, 1], corners[1, 2] - corners[0, 2]
    bx, by, bz = corners[2, 0] - corners[0, 0], corners[2, 1] - corners[0, 1], corners[2, 2] - corners[0, 2]
    nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    normal = nx * nx + ny * ny + nz * nz
    best, above = np.inf, normal > 0.0
    for k in range(3):
        m = (k + 1) % 3
        ex, ey = corners[m, 0] - corners[k, 0], corners[m, 1] - corners[k, 1]
        ez = corners[m, 2] - corners[k, 2]
        wx, wy, wz = p[0] - corners[k, 0], p[1] - corners[k, 1], p[2] - corners[k, 2]
        length = ex * ex + ey * ey + ez * ez
        s = min(1.0, max(0.0, (wx * ex + wy * ey + wz * ez) / length)) if length > 0.0 else 0.0
        best = min(best, (wx - s * ex)**2 + (wy - s * ey)**2 + (wz - s * ez)**2)
        side = (ey * wz - ez * wy) * nx + (ez * wx - ex * wz) * ny + (ex * wy - ey * wx) * nz
        above = above and side >= 0.0
    if above:
        best = min(best, (wx * nx + wy * ny + wz * nz)**2 / normal)
    return best
