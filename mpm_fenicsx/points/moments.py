"""Angular momentum of points and nodes, forces with their moments."""
import numpy as np

from ..compiled import compiled


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
def add_wrenches(x, f, row, rows):
    """Add each component of the forces f, with its moment about the origin, to one of the ``rows`` of
    ``wrenches``: that with the number ``row``; x, f, row: (n, D)."""
    D = x.shape[1]
    for p in range(len(x)):
        for i in range(D):
            value, to = f[p, i], row[p, i]
            if value == 0.0:
                continue
            rows[to, i] += value
            if D == 2:
                rows[to, 2] += x[p, 0] * value if i == 1 else -x[p, 1] * value
            else:
                after, before = (i + 1) % 3, (i + 2) % 3
                rows[to, 3 + after] += x[p, before] * value
                rows[to, 3 + before] -= x[p, after] * value


@compiled
def angular_momentum(mass, x, v):
    """Of points about the origin [kg m^2/s], shape (1,) in a plane, about z, else (3,); mass (n,), x and v
    (n, D)."""
    if x.shape[1] == 2:
        found = np.zeros(1)
        for p in range(len(mass)):
            found[0] += mass[p] * (x[p, 0] * v[p, 1] - x[p, 1] * v[p, 0])
        return found
    found = np.zeros(3)
    for p in range(len(mass)):
        found[0] += mass[p] * (x[p, 1] * v[p, 2] - x[p, 2] * v[p, 1])
        found[1] += mass[p] * (x[p, 2] * v[p, 0] - x[p, 0] * v[p, 2])
        found[2] += mass[p] * (x[p, 0] * v[p, 1] - x[p, 1] * v[p, 0])
    return found


def skew(B):
    """Axial vector of a sum of f x^T, the moment x × f, as ``moment``; B: (D, D)."""
    if len(B) == 2:
        return np.array([B[1, 0] - B[0, 1]])
    return np.array([B[2, 1] - B[1, 2], B[0, 2] - B[2, 0], B[1, 0] - B[0, 1]])
