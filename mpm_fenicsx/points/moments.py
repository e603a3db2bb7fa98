"""Angular momentum of points and nodes, forces with their moments."""
import numpy as np

from ..compiled import compiled

SHORT = 128  # points in a sum of ``momentum``

def moment(x, f):
    """Sum of the moments x × f about the origin, shape (1,) in a plane, about z, else (3,); x, f: (n, D)."""
    if x.shape[1] == 2:
        return np.array([x[:, 0] @ f[:, 1] - x[:, 1] @ f[:, 0]])
    (x, y, z), (a, b, c) = x.T, f.T
    return np.array([y @ c - z @ b, z @ a - x @ c, x @ b - y @ a])


def wrenches(x, f):
    """Forces f with their moments x × f about the origin, shape (n, D + 1) in a plane, (n, 6) in space; x, f:
    (n, D)."""
    if x.shape[1] == 2:
        return np.column_stack([f, x[:, 0] * f[:, 1] - x[:, 1] * f[:, 0]])
    (x, y, z), (a, b, c) = x.T, f.T
    return np.column_stack([f, y * c - z * b, z * a - x * c, x * b - y * a])


@compiled
def add_wrenches(x, f, kind, row_of, rows):
    """Add each component of the forces f, with its moment about the origin, to one of the ``rows`` of
    ``wrenches``: of the ``kind`` k that with the number row_of[k]; f, kind: (n, D); x: more may follow."""
    D = x.shape[1]
    for p in range(len(f)):
        for i in range(D):
            value = f[p, i]
            if value == 0.0:
                continue
            to = row_of[kind[p, i]]
            rows[to, i] += value
            if D == 2:
                rows[to, 2] += x[p, 0] * value if i == 1 else -x[p, 1] * value
            else:
                after, before = (i + 1) % 3, (i + 2) % 3
                rows[to, 3 + after] += x[p, before] * value
                rows[to, 3 + before] -= x[p, after] * value


@compiled
def wrench(x, f):
    """Sum of the forces f, and that of their moments about the origin, a row of ``wrenches``; x, f: (n,
    D)."""
    if x.shape[1] == 2:
        row = np.zeros(3)
        for p in range(len(x)):
            row[0] += f[p, 0]
            row[1] += f[p, 1]
            row[2] += x[p, 0] * f[p, 1] - x[p, 1] * f[p, 0]
        return row
    row = np.zeros(6)
    for p in range(len(x)):
        for i in range(3):
            after, before = (i + 1) % 3, (i + 2) % 3
            row[i] += f[p, i]
            row[3 + i] += x[p, after] * f[p, before] - x[p, before] * f[p, after]
    return row


@compiled
def add_weight(mass, x, g, row):
    """Add to the ``row`` the weight of masses (k,), at the first of the places x, (n, D), in gravity g."""
    D = x.shape[1]
    for p in range(len(mass)):
        for i in range(D):
            row[i] += mass[p] * g[i]
        if D == 2:
            row[2] += mass[p] * (x[p, 0] * g[1] - x[p, 1] * g[0])
        else:
            for i in range(3):
                after, before = (i + 1) % 3, (i + 2) % 3
                row[3 + i] += mass[p] * (x[p, after] * g[before] - x[p, before] * g[after])


@compiled
def momentum(mass, x, v):
    """Of points [kg m/s], followed by their angular momentum about the origin [kg m^2/s], a row of
    ``wrenches``; mass (n,), x and v (n, D). Sums of short sums: their round-off stays small."""
    D, n = x.shape[1], len(mass)
    row, part = np.zeros(3 if D == 2 else 6), np.empty(3 if D == 2 else 6)
    for first in range(0, n, SHORT):
        part[:] = 0.0
        for p in range(first, min(first + SHORT, n)):
            if D == 2:
                a, b = mass[p] * v[p, 0], mass[p] * v[p, 1]
                part[0] += a
                part[1] += b
                part[2] += x[p, 0] * b - x[p, 1] * a
            else:
                a, b, c = mass[p] * v[p, 0], mass[p] * v[p, 1], mass[p] * v[p, 2]
                part[0] += a
                part[1] += b
                part[2] += c
                part[3] += x[p, 1] * c - x[p, 2] * b
                part[4] += x[p, 2] * a - x[p, 0] * c
                part[5] += x[p, 0] * b - x[p, 1] * a
        row += part
    return row


def skew(B):
    """Axial vector of a sum of f x^T, the moment x × f, as ``moment``; B: (D, D)."""
    if len(B) == 2:
        return np.array([B[1, 0] - B[0, 1]])
    return np.array([B[2, 1] - B[1, 2], B[0, 2] - B[2, 0], B[1, 0] - B[0, 1]])
