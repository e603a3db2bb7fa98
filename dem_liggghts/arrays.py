"""Checks of the arrays that a scene is made of."""
import numpy as np


def finite(value, name, columns):
    """Float array of shape (n, columns), finite, read-only."""
    array = np.array(value, dtype=float, ndmin=2)
    if array.ndim != 2 or array.shape[1] not in columns:
        wanted = " or ".join(f"(n, {c})" for c in columns)
        raise ValueError(f"{name} has shape {np.shape(value)}: give an array of shape {wanted}")
    if not np.isfinite(array).all():
        raise ValueError(f"{name} contains NaN or infinity: give finite numbers")
    array.flags.writeable = False
    return array


def per_sphere(value, name, n):
    """Float array of shape (n,) from a number or n of them, positive, read-only."""
    array = np.array(np.broadcast_to(np.asarray(value, dtype=float), (n,)))
    if not (np.isfinite(array).all() and (array > 0).all()):
        raise ValueError(f"{name} is {value}: it must be positive")
    array.flags.writeable = False
    return array


def in_space(array):
    """Fresh array with three columns: a third one of zeros is added to a plane array."""
    out = np.zeros((len(array), 3))
    out[:, :np.shape(array)[1]] = array
    return out
