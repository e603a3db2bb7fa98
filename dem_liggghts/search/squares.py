"""Elements of walls at rest, sorted once into squares of a plane: of a large terrain only those near a sphere
are looked at.

Geometry only, no contact law.
"""
import numpy as np

from ..compiled import compiled
from ..scene.tables import DEPTH, RADIUS
from .elements import Squares, closest, corners_of, no_squares

MANY = 2000  # elements at rest, from which on they are sorted
WIDE = 16  # squares: an element that reaches into more of them is loose


@compiled
def box_of(wall, e, t, corner, box):
    """Lowest and highest corner of the element ``e`` at time t [s] into box [m], (2, 3); corner: room for
    its corners, (3, 3)."""
    corners_of(wall, e, t, corner)
    for k in range(3):
        box[0, k], box[1, k] = corner[0, k], corner[0, k]
        for a in range(1, wall.elements.shape[1]):
            box[0, k], box[1, k] = min(box[0, k], corner[a, k]), max(box[1, k], corner[a, k])


@compiled
def longest(low, high):
    """Axis along which the boxes reach farthest."""
    axis, most = 0, -1.0
    for k in range(3 if len(low) else 0):
        size = high[:, k].max() - low[:, k].min()
        if size > most:
            axis, most = k, size
    return axis


@compiled
def square(squares, value, which):
    """Number along one of the two axes of the square that holds ``value`` [m]; beyond the ends the last
    one."""
    return max(0, min(int((value - squares.frame[which]) / squares.frame[2]), squares.axes[2 + which] - 1))


def sorted_elements(wall, still):
    """`Squares` of ``wall``, whose elements ``still``, (m,) bool, do not move, where these are many."""
    loose, few = np.flatnonzero(~still), np.flatnonzero(still)
    if len(few) < MANY:
        return no_squares(np.arange(len(still)))
    nodes = wall.x[np.unique(wall.elements[few])]
    low, size = nodes.min(axis=0), np.ptp(nodes, axis=0)
    first, second = np.argsort(size, kind="stable")[:0:-1]
    side = max(2.0 * np.sqrt(size[first] * size[second] / len(few)), size[first] / len(few))
    shape = [max(1, int(size[axis] / side)) for axis in (first, second)]
    traits = wall.traits[few]
    frame = np.array([low[first], low[second], side, traits[:, DEPTH].max(), traits[:, RADIUS].max()])
    squares = Squares(np.zeros(shape[0] * shape[1] + 1, np.int64), np.zeros(0, np.int32),
                      np.array([first, second, *shape]), frame, loose)
    wide = _count(wall, squares, few)
    squares = squares._replace(element=np.zeros(squares.start[-1], np.int32),
                               loose=np.union1d(loose, few[wide]))
    _fill(wall, squares, few[~wide])
    return squares


@compiled
def _count(wall, squares, few):
    """Make ``squares.start`` of the elements ``few``; returns which of them are too wide, (m,) bool."""
    corner, box, wide = np.empty((3, 3)), np.empty((2, 3)), np.zeros(len(few), np.bool_)
    for i in range(len(few)):
        box_of(wall, few[i], 0.0, corner, box)
        a, b, c, d = _squares(squares, box)
        wide[i] = (c - a + 1) * (d - b + 1) > WIDE
        for s in range(a, c + 1 if not wide[i] else a):
            for r in range(b, d + 1):
                squares.start[s * squares.axes[3] + r + 1] += 1
    for s in range(1, len(squares.start)):
        squares.start[s] += squares.start[s - 1]
    return wide


@compiled
def _fill(wall, squares, few):
    """Put the elements ``few`` into their squares."""
    corner, box, end = np.empty((3, 3)), np.empty((2, 3)), squares.start[:-1].copy()
    for e in few:
        box_of(wall, e, 0.0, corner, box)
        a, b, c, d = _squares(squares, box)
        for s in range(a, c + 1):
            for r in range(b, d + 1):
                at = s * squares.axes[3] + r
                squares.element[end[at]] = e
                end[at] += 1


@compiled
def _squares(squares, box):
    """First and last squares that a box reaches into: along both axes the first, then the last."""
    k, o = squares.axes[0], squares.axes[1]
    return (square(squares, box[0, k], 0), square(squares, box[0, o], 1),
            square(squares, box[1, k], 0), square(squares, box[1, o], 1))


@compiled
def far(box, p, reach):
    """Whether a box is farther than ``reach`` [m] from p along an axis."""
    for k in range(3):  # noqa: SIM110 - a generator does not compile
        if box[0, k] > p[k] + reach or box[1, k] < p[k] - reach:
            return True
    return False


@compiled
def add_still(wall, p, radius, skin, partner, count):
    """Append the elements in squares that a sphere at p [m] may touch after a way of ``skin`` [m] to the
    first ``count`` of ``partner``; returns these, with more room where it needs it, and their number."""
    squares, corner, box, near = wall.squares, np.empty((3, 3)), np.empty((2, 3)), np.empty((2, 3))
    weight, point, most = np.empty(3), np.empty(3), max(radius, squares.frame[3]) + squares.frame[4] + skin
    for k in range(3):
        near[0, k], near[1, k] = p[k] - most, p[k] + most
    first, second, last, end = _squares(squares, near)
    for s in range(first, last + 1):
        for r in range(second, end + 1):
            at = s * squares.axes[3] + r
            for q in range(squares.start[at], squares.start[at + 1]):
                e = np.int64(squares.element[q])
                box_of(wall, e, 0.0, corner, box)
                a, b, _, _ = _squares(squares, box)
                if max(a, first) != s or max(b, second) != r:  # it is seen in another square
                    continue
                reach = max(radius, wall.traits[e, DEPTH]) + wall.traits[e, RADIUS] + skin
                if far(box, p, reach) or closest(corner, wall.elements.shape[1], p, weight, point)[0] > reach:
                    continue
                if count == len(partner):
                    partner = np.append(partner, partner)  # room for twice as many
                partner[count] = e
                count += 1
    return partner, count


@compiled
def nodes_near(wall, partner, end, marks):
    """Nodes, below the number ``end``, of the elements ``partner``, rising. marks: room, (n,) bool, all false
    before and after."""
    out, count = np.empty(min(len(partner) * wall.elements.shape[1], end), np.int64), 0
    for e in partner:
        for a in range(wall.elements.shape[1]):
            node = wall.elements[e, a]
            if node < end and not marks[node]:
                marks[node] = True
                out[count] = node
                count += 1
    for n in out[:count]:
        marks[n] = False
    return np.sort(out[:count])
