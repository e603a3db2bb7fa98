"""A tree of boxes around things in space: what a place is nearest to costs about as many looks as the tree is
high, however small the things are against the distance.

Things are sorted along a curve that fills space (Morton 1966) and grouped by ``LEAF``; each node of the
binary tree over these groups has the box around what is below it.
"""
from typing import NamedTuple

import numpy as np

from ..compiled import inlined

LEAF = 4  # things in the box of a leaf
BITS = 20  # of the curve, along each axis
ROOM = 64  # room for the nodes that a search has put off


class BoxTree(NamedTuple):
    """Of n things: node k has the children 2 k and 2 k + 1, the first is 1, and the last ``leaves`` are
    leaves; boxes from ``lower`` to ``upper`` [m], shape (2 leaves, D); leaf number k has the things
    order[LEAF * k:LEAF * (k + 1)]. ``shift``: the way that all have gone since [m], (D,)."""

    lower: np.ndarray
    upper: np.ndarray
    order: np.ndarray
    leaves: int
    shift: np.ndarray


def make_tree(lower, upper):
    """Of n > 0 things in boxes from ``lower`` to ``upper`` [m], shape (n, D) each."""
    order = np.argsort(_along_curve(0.5 * (lower + upper)), kind="stable")
    return BoxTree(*bounds(order, lower, upper), order, _leaves(order), np.zeros(lower.shape[1]))


def _leaves(order):
    return 1 << (-(-len(order) // LEAF) - 1).bit_length()


def bounds(order, lower, upper):
    """Least and greatest values below each node, see ``BoxTree``, of things whose own are ``lower`` and
    ``upper``, shape (n, D)."""
    (n, D), leaves, ends = lower.shape, _leaves(order), []
    groups = -(-n // LEAF)
    for values, beyond, end in ((lower, np.inf, np.minimum), (upper, -np.inf, np.maximum)):
        found, padded = np.full((2 * leaves, D), beyond), np.full((groups * LEAF, D), beyond)
        padded[:n] = values[order]
        found[leaves:leaves + groups] = end.reduce(padded.reshape(groups, LEAF, D), axis=1)
        first = leaves
        while first > 1:
            half = first // 2
            found[half:first] = end.reduce(found[first:2 * first].reshape(half, 2, D), axis=1)
            first = half
        ends.append(found)
    return tuple(ends)


def _along_curve(x):
    """Numbers that sort places x, (n, D), along the curve."""
    low, size = x.min(axis=0), np.ptp(x, axis=0).max()
    cell = ((x - low) * ((2**BITS - 1) / size if size > 0.0 else 0.0)).astype(np.uint64)
    key = np.zeros(len(x), np.uint64)
    for bit in range(BITS):
        for axis in range(x.shape[1]):
            key |= ((cell[:, axis] >> np.uint64(bit)) & np.uint64(1)) << np.uint64(bit * x.shape[1] + axis)
    return key


@inlined
def square_from(p, x, tree, node, D):
    """Distance squared of point p of x [m], (n, D), from the box of a ``node``."""
    square = 0.0
    for i in range(D):
        s = x[p, i] - tree.shift[i]
        away = max(max(tree.lower[node, i] - s, s - tree.upper[node, i]), 0.0)
        square += away * away
    return square


@inlined
def descend(p, x, tree, node, top, stack, D):
    """Put the children of a ``node`` on the ``stack``, (ROOM,), which has ``top`` nodes, the nearer one last.
    Returns how many it has then."""
    near, far = 2 * node, 2 * node + 1
    if square_from(p, x, tree, near, D) > square_from(p, x, tree, far, D):
        near, far = far, near
    stack[top], stack[top + 1] = far, near
    return top + 2
