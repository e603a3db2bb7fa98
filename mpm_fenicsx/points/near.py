"""Which material points are near particles: each rank looks at its own, once in a window."""
from typing import NamedTuple

import numpy as np

from ..compiled import compiled
from .bins import make_bins

# A point must take part when the gap between its ball and a particle is less than MUST of its radius and
# MUST_WAYS times what both go in a window at their speeds of now, and does so when it is less than SKIN and
# SKIN_WAYS: between the two the choice stays as it is. What is new comes in windows before it touches.
MUST, SKIN = 0.25, 1.0
MUST_WAYS, SKIN_WAYS = 4.0, 8.0
MOST_BINS = 64.0  # along an axis
FAR, NEAR, TOUCHABLE = 0, 1, 2


class Particles(NamedTuple):
    """Centres x [m], shape (n, D), ``radius`` [m] and ``speed`` [m/s], shape (n,)."""

    x: np.ndarray
    radius: np.ndarray
    speed: np.ndarray


class Reach(NamedTuple):
    """radius: of the balls [m]; dt: the window [s]."""

    radius: float
    dt: float


def find_near(x, v, particles, reach):
    """For each material point, x [m] and v [m/s] of shape (n, D), ``FAR``, ``NEAR`` or ``TOUCHABLE``, shape
    (n,)."""
    mark = np.zeros(len(x), np.int8)
    if len(x) and len(particles.x):
        fastest = np.sqrt((v**2).sum(axis=1).max())
        way = SKIN_WAYS * reach.dt * (particles.speed + fastest)
        half = (particles.radius + (1.0 + SKIN) * reach.radius + way)[:, None]
        lower, upper = particles.x - half, particles.x + half
        size = max(2.0 * half.max(), (upper.max(axis=0) - lower.min(axis=0)).max() / MOST_BINS)
        _mark(x, v, particles, reach, make_bins(lower, upper, size), mark)
    return mark


@compiled
def _bin_of(x, p, bins):
    """Number of the bin of point p, or -1; see `bins.bin_of`, for any dimension."""
    number, stride = 0, 1
    for i in range(x.shape[1]):
        s = (x[p, i] - bins.origin[i]) / bins.size
        if not 0.0 <= s < bins.counts[i]:
            return -1
        number += stride * int(s)
        stride *= bins.counts[i]
    return number


@compiled
def _mark(x, v, particles, reach, bins, mark):
    for p in range(len(x)):
        number = _bin_of(x, p, bins)
        if number < 0:
            continue
        speed = 0.0
        for i in range(x.shape[1]):
            speed += v[p, i] * v[p, i]
        speed = np.sqrt(speed)
        for q in range(bins.start[number], bins.start[number + 1]):
            s = bins.items[q]
            gap = 0.0
            for i in range(x.shape[1]):
                gap += (x[p, i] - particles.x[s, i]) ** 2
            gap = np.sqrt(gap) - particles.radius[s] - reach.radius
            way = reach.dt * (speed + particles.speed[s])
            if gap < MUST * reach.radius + MUST_WAYS * way:
                mark[p] = TOUCHABLE
                break
            if gap < SKIN * reach.radius + SKIN_WAYS * way:
                mark[p] = NEAR
