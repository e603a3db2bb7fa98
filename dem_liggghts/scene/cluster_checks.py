"""Checks of what turns, turns with, and holds a cluster."""
from typing import Any, Tuple

import numpy as np

import mpm_dem_checks as check

from .. import quaternion


def read_omega(value: Any, dim: int) -> np.ndarray:
    """Angular velocity [rad/s], shape (3,), from a number in a plane, three in space, or 0."""
    omega, name = np.zeros(3), "omega of the cluster"
    given = np.atleast_1d(check.array(name, value, (), (1,), (3,), unit="rad/s"))
    if dim == 2 and given.shape == (1,):
        omega[2] = check.finite(name, given[0], "rad/s")
    elif given.shape == (3,):
        omega[:] = check.numbers(name, given, 3, "rad/s")
    elif given.shape != (1,) or given[0] != 0:
        raise ValueError(f"{name} is {value}: give a number in a plane, three in space")
    if dim == 2 and omega[:2].any():
        raise ValueError(f"{name} is {omega} rad/s: a plane body spins about the third axis only")
    return omega


def read_orientation(value: Any, angle: Any, dim: int) -> np.ndarray:
    """Quaternion, shape (4,), from one in space, or from an angle [rad]."""
    if value is None:
        return quaternion.of_angle(check.finite("angle of the cluster", angle, "rad"))
    q = check.array("quaternion of the cluster", value, (4,))
    if dim == 2 or angle:
        raise ValueError("the cluster has a quaternion and lies in a plane or has an angle: give angle "
                         "in a plane, quaternion in space")
    if q.shape != (4,) or not abs(np.sqrt(q @ q) - 1.0) < 1e-6:
        raise ValueError(f"quaternion of the cluster is {value}: give four numbers (w, x, y, "
                         "z) of norm 1")
    return q / np.sqrt(q @ q)


def read_inertia(value: Any, dim: int) -> np.ndarray:
    """Tensor of inertia [kg m^2], shape (3, 3), from a number in a plane, a tensor or its diagonal in
    space."""
    inertia = check.array("inertia of the cluster", value, (), (1,), (3,), (3, 3), unit="kg m^2")
    if dim == 2 and inertia.size != 1 or dim == 3 and inertia.shape not in ((3,), (3, 3)):
        raise ValueError(f"inertia of the cluster has shape {inertia.shape}: give a number in a plane, "
                         "(3, 3) or (3,) in space")
    tensor = np.diag(inertia) if inertia.ndim == 1 else inertia
    tensor = inertia.item() * np.eye(3) if dim == 2 else tensor
    if not (np.isfinite(tensor).all() and np.array_equal(tensor, tensor.T) and
            np.linalg.eigvalsh(tensor).min() >= check.LEAST):
        raise ValueError(f"inertia of the cluster is {value}: it must be symmetric and positive")
    return tensor


def read_freedom(free: Any, dim: int) -> Tuple[bool, ...]:
    """One truth value for each degree of freedom, three in a plane and six in space."""
    count = 3 if dim == 2 else 6
    given = (free,) * count if np.ndim(free) == 0 else tuple(free)
    if len(given) != count or any(f not in (0, 1) for f in given):
        raise ValueError(f"free of the cluster is {free}: give one truth value, or {count}")
    return tuple(map(bool, given))
