"""A part of space in equal bins, each with the things that reach into it: what a material point is near to
costs one look-up, on any grid, and nothing where there is no wall."""
from typing import NamedTuple

import numpy as np

from ..compiled import inlined


class Bins(NamedTuple):
    """origin: lower corner [m], shape (D,); size: of a bin [m]; counts: bins along each axis, shape (D,); bin
    b has the things items[start[b]:start[b + 1]]. Bins are numbered with x fastest."""

    origin: np.ndarray
    size: float
    counts: np.ndarray
    start: np.ndarray
    items: np.ndarray


def make_bins(lower, upper, size):
    """Bins of ``size`` [m] for n > 0 things in boxes from ``lower`` to ``upper`` [m], shape (n, D) each."""
    origin = lower.min(axis=0)
    first, last = (np.floor((corner - origin) / size).astype(np.int64) for corner in (lower, upper))
    counts = last.max(axis=0) + 1
    span = last - first + 1
    share = span.prod(axis=1)
    item = np.repeat(np.arange(len(lower)), share)
    rest = np.arange(len(item)) - np.repeat(np.cumsum(share) - share, share)
    number, stride = np.zeros(len(item), np.int64), 1
    for axis in range(lower.shape[1]):
        rest, place = np.divmod(rest, span[item, axis])
        number += stride * (first[item, axis] + place)
        stride *= counts[axis]
    start = np.concatenate([[0], np.cumsum(np.bincount(number, minlength=stride))])
    return Bins(origin, float(size), counts, start, item[np.argsort(number, kind="stable")])


@inlined
def bin_of(p, x, bins, D):
    """Number of the bin that point p of x [m], shape (n, D), lies in; -1: in none."""
    origin, size, counts = bins.origin, bins.size, bins.counts
    number, stride = 0, 1
    for i in range(D):
        s = (x[p, i] - origin[i]) / size
        if not 0.0 <= s < counts[i]:  # also catches NaN
            return -1
        number += stride * int(s)
        stride *= counts[i]
    return number
