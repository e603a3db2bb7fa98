"""Angular momentum of points and nodes."""
import numpy as np


def moment(x, f):
    """Sum of the moments x × f about the origin, shape (1,) in a plane, about z, else (3,); x, f: (n, D)."""
    if x.shape[1] == 2:
        return np.array([x[:, 0] @ f[:, 1] - x[:, 1] @ f[:, 0]])
    (x, y, z), (a, b, c) = x.T, f.T
    return np.array([y @ c - z @ b, z @ a - x @ c, x @ b - y @ a])


def skew(B):
    """Axial vector of a sum of f x^T, the moment x × f, as ``moment``; B: (D, D)."""
    if len(B) == 2:
        return np.array([B[1, 0] - B[0, 1]])
    return np.array([B[2, 1] - B[1, 2], B[0, 2] - B[2, 0], B[1, 0] - B[0, 1]])
