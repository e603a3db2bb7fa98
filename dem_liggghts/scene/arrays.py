"""Checks of the arrays that a scene is made of, in the words of a user."""
from typing import Any, FrozenSet, Set, Tuple

import numpy as np

import mpm_dem_checks as check

Array = Any  # what numpy makes an array of when it is given; an array, read-only, once the scene is made


def finite(value: Any, name: str, columns: Tuple[int, ...]) -> np.ndarray:
    """Float array of shape (n, columns), finite, read-only."""
    wanted = " or ".join(f"(n, {c})" for c in columns)
    array = _numbers(rows(value), name, f"give an array of shape {wanted}")
    if array.ndim != 2 or array.shape[1] not in columns:
        raise ValueError(f"{name} has shape {np.shape(value)}: give an array of shape {wanted}")
    if not np.isfinite(array).all():
        raise ValueError(f"{name} contains NaN or infinity: give finite numbers")
    if array.size and np.abs(array).max() > check.MOST:
        raise ValueError(f"{name} contains {np.abs(array).max():g}: give numbers of at most {check.MOST:g} "
                         "in size")
    array.flags.writeable = False
    return array


def per_sphere(value: Any, name: str, n: int) -> np.ndarray:
    """Float array of shape (n,) from a number or n of them, positive, read-only."""
    array = _numbers(value, name, f"give one number, or {n}")
    if array.shape not in ((), (1,), (n,)):
        raise ValueError(f"{name} has shape {array.shape}: give one number, or {n}")
    if not ((array >= check.LEAST) & (array <= check.MOST)).all():
        raise ValueError(f"{name} is {check.shown(value)}: it must be positive, from {check.LEAST:g} to "
                         f"{check.MOST:g}")
    array = np.array(np.broadcast_to(array, (n,)))
    array.flags.writeable = False
    return array


def rows(value: Any) -> Any:
    """As an array with two axes; rows of different lengths stay what they are, for a check to refuse."""
    try:
        return np.array(value, ndmin=2)
    except ValueError:
        return value


def _numbers(value: Any, name: str, rule: str) -> np.ndarray:
    try:
        array = np.array(value)
    except ValueError:  # lists of different lengths
        array = None
    if array is None or array.dtype.kind not in "iuf":  # texts, truth values and objects are no numbers
        check.refuse(name, value, rule)
    return array.astype(float)


def in_space(array: Any) -> np.ndarray:
    """Fresh array with three columns: a third one of zeros is added to a plane array."""
    out = np.zeros((len(array), 3))
    out[:, :np.shape(array)[1]] = array
    return out


def same_place(nodes: np.ndarray) -> np.ndarray:
    """For each of the ``nodes`` [m] of a surface the first one that lies in the same place, up to 1e-9 of its
    size: elements are neighbours where they meet, whether or not they name the same nodes there (as those of
    an STL file)."""
    if not len(nodes):
        return np.zeros(0, np.int64)
    # places are seldom multiples of it
    cell = 1.2345e-9 * max(np.ptp(nodes, axis=0).max(), np.finfo(float).tiny)
    _, first, number = np.unique(np.rint((nodes - nodes.min(axis=0)) / cell), axis=0, return_index=True,
                                 return_inverse=True)
    return first[number.ravel()]


def pair(key: Any, known: Set[str]) -> FrozenSet[str]:
    """A key of ``Scene.interactions``, two names of materials out of ``known`` or a set of them, as
    frozenset."""
    names: Any = key if isinstance(key, (tuple, frozenset)) else ()
    right = len(names) == 2 or (len(names) == 1 and isinstance(names, frozenset))
    if not right or not all(isinstance(name, str) for name in names):
        check.refuse("a key of interactions", key, "give a pair of names of materials, such as ('wood', "
                                                   "'spheres')")
    for name in sorted(set(names) - known):
        raise ValueError(f"interactions say how {' and '.join(sorted(names))} meet, and the scene has no "
                         f"material {name!r}: give names out of {', '.join(sorted(known))}")
    return frozenset(names)
