"""Balls that cover as many points of a grid as a given number of them can: greedy maximum coverage."""
import heapq
from typing import List

import numpy as np

from ..compiled import compiled


def choose(bare: np.ndarray, index: np.ndarray, radius: np.ndarray, most: int, wanted: float) -> List[int]:
    """Numbers of the chosen balls, the one with the largest gain first; ``bare`` is then true where none is.

    bare: which points of the grid are to be covered, (k, l, m); index: points in the middle of the balls,
    (n, 3), and their radii in spacings, (n,). Each time the ball is taken that covers most points that are
    still bare, of equal ones the larger, then the first; until there are ``most``, the part ``wanted`` is
    covered, or no ball gains a point. So many balls never cover less than 1 - 1/e of what the best choice
    does (Nemhauser, Wolsey and Fisher, Math. Programming 14 (1978) 265-294). Gains only fall, and those in
    the queue are bounds, at first all points of the ball: only a ball that comes first is counted (Minoux
    1978).
    """
    queue = [(-bound, -r, n, -1) for n, (bound, r) in enumerate(zip(_bounds(radius), radius.tolist()))]
    heapq.heapify(queue)
    chosen: List[int] = []
    whole, covered = int(bare.sum()), 0
    while queue and len(chosen) < most and covered < wanted * whole:
        gain, r, n, known = queue[0]
        if known < len(chosen):
            heapq.heapreplace(queue, (-_visit(bare, index[n], radius[n], False), r, n, len(chosen)))
        elif not gain:
            break
        else:
            heapq.heappop(queue)
            covered += _visit(bare, index[n], radius[n], True)
            chosen.append(n)
    return chosen


def _bounds(radius: np.ndarray) -> List[int]:
    """Of the number of points of a grid in balls of these radii in spacings about a point of it."""
    reach = int(radius.max(initial=0.0))
    axis = np.arange(-reach, reach + 1) ** 2
    square = np.sort((axis[:, None, None] + axis[:, None] + axis).ravel())
    rounded = 1.0 + 1e-9  # where a point lies on the sphere
    return np.searchsorted(square, rounded * radius**2, side="right").tolist()


@compiled
def _visit(bare: np.ndarray, middle: np.ndarray, radius: float, cover: bool) -> int:
    """Number of the bare points in a ball; with ``cover`` they are bare no more."""
    reach, count = int(radius), 0
    for i in range(max(0, middle[0] - reach), min(bare.shape[0], middle[0] + reach + 1)):
        for j in range(max(0, middle[1] - reach), min(bare.shape[1], middle[1] + reach + 1)):
            rest = radius**2 - (i - middle[0])**2 - (j - middle[1])**2
            if rest < 0.0:
                continue
            half = int(np.sqrt(rest))
            for k in range(max(0, middle[2] - half), min(bare.shape[2], middle[2] + half + 1)):
                if bare[i, j, k]:
                    count += 1
                    bare[i, j, k] = not cover
    return count
