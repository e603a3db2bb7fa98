"""Rotations as unit quaternions (w, x, y, z): plain functions on arrays of shape (4,) or (n, 4)."""
import numpy as np


def of_angle(angle):
    """Rotation by ``angle`` [rad] about the third axis."""
    return np.array([np.cos(angle / 2), 0.0, 0.0, np.sin(angle / 2)])


def angle(q):
    """Angle [rad] in (-2 pi, 2 pi] of rotations about the third axis, shape of q less its last axis; it goes
    on without a jump over one turn in either direction."""
    q = np.asarray(q)
    return 2.0 * np.arctan2(q[..., 3], q[..., 0])


def product(p, q):
    """The rotation q followed by the rotation p."""
    (a, b, c, d), (w, x, y, z) = np.moveaxis(np.asarray(p), -1, 0), np.moveaxis(np.asarray(q), -1, 0)
    return np.stack([a * w - b * x - c * y - d * z, a * x + b * w + c * z - d * y,
                     a * y - b * z + c * w + d * x, a * z + b * y - c * x + d * w], axis=-1)


def inverse(q):
    """The reverse rotation."""
    return np.asarray(q) * [1.0, -1.0, -1.0, -1.0]


def matrix(q):
    """Rotation matrix, shape (3, 3); its columns are the turned axes."""
    w, x, y, z = q
    return np.array([[w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
                     [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z]])


def of_matrix(R):
    """Quaternion of a rotation matrix: the eigenvector of the largest eigenvalue of Bar-Itzhack's matrix (J.
    Guid. Control Dyn. 23 (2000) 1085-1087), with w >= 0."""
    K = np.array([[R[0, 0] + R[1, 1] + R[2, 2], 0, 0, 0],
                  [R[2, 1] - R[1, 2], R[0, 0] - R[1, 1] - R[2, 2], 0, 0],
                  [R[0, 2] - R[2, 0], R[0, 1] + R[1, 0], R[1, 1] - R[0, 0] - R[2, 2], 0],
                  [R[1, 0] - R[0, 1], R[0, 2] + R[2, 0], R[1, 2] + R[2, 1], R[2, 2] - R[0, 0] - R[1, 1]]])
    q = np.linalg.eigh(K)[1][:, -1]
    return q if q[0] >= 0 else -q
