"""Surfaces of simple shapes as vertices and elements, see ``Structure``; their outside."""
from itertools import combinations, product
from typing import List, Sequence, Tuple, Union

import numpy as np

import mpm_dem_checks as check

from .bodies import AXES
from .facets import alike, normal_areas, same_places
from .mesh import Box

Surface = Tuple[np.ndarray, np.ndarray]
SAME = 1e-9  # of the size of a surface: vertices as near as that are one


def unit_normal(name: str, normal: Union[str, Sequence[float]], dim: int) -> np.ndarray:
    """The ``normal`` of that ``name``, "+y" or a vector of any length, as unit vector, shape (dim,)."""
    if isinstance(normal, str):
        check.choice(f"the normal of {name}", normal, tuple(s + axis for s in "+-" for axis in AXES[:dim]))
        vector = np.zeros(dim)
        vector[AXES.index(normal[1])] = float(normal[0] + "1")
        return vector
    vector = np.array(check.numbers(f"the normal of {name}", normal, dim))
    if not vector.any():
        check.refuse(f"the normal of {name}", normal, "give a direction that is not zero")
    return vector / np.linalg.norm(vector)


def plane_surface(name: str, at: Sequence[float], normal: Union[str, Sequence[float]], box: Box) -> Surface:
    """The part of a plane inside a box, see ``Structure.plane``."""
    point, n = np.array(check.numbers(f"a point of {name}", at, box.dim, "m")), unit_normal(name, normal,
                                                                                           box.dim)
    corners = np.array(list(product(*zip(box.lower, box.upper))))
    height, found = (corners - point) @ n, []
    height[np.abs(height) < SAME * box.size.max()] = 0.0
    for b, a in combinations(range(len(corners)), 2):
        if np.count_nonzero(corners[a] != corners[b]) == 1 and height[a] * height[b] <= 0.0 and (
                height[a] or height[b]):
            found.append(corners[a] + (corners[b] - corners[a]) * height[a] / (height[a] - height[b]))
    found += [corner for corner, h in zip(corners, height) if h == 0.0]
    x = _once(np.array(found).reshape(-1, box.dim), box.size.max())
    if len(x) < box.dim:
        raise ValueError(f"{name}, the plane through {point.tolist()} m, misses the box from {box.lower} to "
                         f"{box.upper} m: move it, or give another box")
    if box.dim == 2:  # the outside on the left of the way
        along = np.array([n[1], -n[0]])
        return x[np.argsort(x @ along)][[0, -1]], np.array([[0, 1]])
    first = x[0] - x.mean(axis=0)
    e = first / np.linalg.norm(first)
    arm = x - x.mean(axis=0)
    x = x[np.argsort(np.arctan2(arm @ np.cross(n, e), arm @ e))]
    k = np.arange(1, len(x) - 1)
    return x, np.column_stack([0 * k, k, k + 1])


def _once(x: np.ndarray, size: float) -> np.ndarray:
    _, first = np.unique(np.round(x / (SAME * size)), axis=0, return_index=True)
    return x[np.sort(first)]


def box_surface(box: Box, counts: Sequence[int]) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Surface of a box whose sides are cut into ``counts`` pieces along each axis, and the force cell of each
    element: pieces at one place of the cut box belong together."""
    D = box.dim
    axes = [np.linspace(a, b, n + 1) for a, b, n in zip(box.lower, box.upper, counts)]
    x = np.stack([a.ravel(order="F") for a in np.meshgrid(*axes, indexing="ij")], axis=1)
    node = np.arange(len(x)).reshape([n + 1 for n in counts], order="F")
    elements: List[Sequence[int]] = []
    cell: List[int] = []
    number = np.arange(int(np.prod(counts))).reshape(counts, order="F")
    for d, side in product(range(D), (0, 1)):
        others = [(d + 1) % D, (d + 2) % D][:D - 1]
        for place in product(*(range(counts[o]) for o in others)):
            at = [side * counts[d]] * D
            for o, k in zip(others, place):
                at[o] = k
            corners = [at]
            for o in others:
                corners += [[k + (i == o) for i, k in enumerate(corner)] for corner in corners]
            p = [int(node[tuple(corner)]) for corner in corners]
            if D == 2:  # towards +y the outside on the left is that to -x, towards +x that to +y
                elements.append((p[0], p[1]) if side == d else (p[1], p[0]))
            else:  # in the order of the axes counter-clockwise about +d
                a, b, c, e = p
                elements += [(a, b, e), (a, e, c)] if side else [(a, e, b), (a, c, e)]
            owner = list(at)
            owner[d] -= side
            cell += [int(number[tuple(owner)])] * (D - 1)
    used, renumbered = np.unique(np.array(elements), return_inverse=True)
    return x[used], renumbered.reshape(-1, D), np.unique(cell, return_inverse=True)[1]


def circle_surface(name: str, centre: Sequence[float], radius: float, sides: int) -> Surface:
    """A polygon with the area of a circle."""
    middle, x = np.array(check.numbers(f"centre of {name}", centre, 2, "m")), _polygon(radius, sides)
    k = np.arange(sides)
    return middle + x, np.column_stack([(k + 1) % sides, k])  # clockwise: the outside is on the left


def _polygon(radius: float, sides: int) -> np.ndarray:
    phi = 2.0 * np.pi * np.arange(sides) / sides
    radius *= np.sqrt(2.0 * np.pi / (sides * np.sin(2.0 * np.pi / sides)))
    return radius * np.column_stack([np.cos(phi), np.sin(phi)])


def cylinder_surface(name: str, start: Sequence[float], end: Sequence[float], radius: float,
                     sides: int) -> Surface:
    """A prism with the volume of a cylinder."""
    a = np.array(check.numbers(f"start of {name}", start, 3, "m"))
    b = np.array(check.numbers(f"end of {name}", end, 3, "m"))
    if np.array_equal(a, b):
        raise ValueError(f"{name} starts and ends at {a.tolist()} m: give two points on its axis")
    axis = (b - a) / np.linalg.norm(b - a)
    e = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    e /= np.linalg.norm(e)
    ring = _polygon(radius, sides) @ np.array([e, np.cross(axis, e)])
    x = np.concatenate([a + ring, b + ring, [a, b]])
    k = np.arange(sides)
    after = (k + 1) % sides
    first, last = np.full(sides, 2 * sides), np.full(sides, 2 * sides + 1)
    return x, np.concatenate([np.column_stack(three) for three in (
        (k, after, sides + after), (k, sides + after, sides + k), (first, after, k),
        (last, sides + k, sides + after))])


def outwards(x: np.ndarray, elements: np.ndarray, name: str) -> Tuple[np.ndarray, bool]:
    """The elements with their outside outside, and whether the surface is closed. ValueError for elements
    without extent, and where those of a closed surface disagree."""
    size, D = np.ptp(x, axis=0).max(), x.shape[1]
    corners = same_places(x, SAME * max(size, 1e-300))[elements]
    if any((corners[:, a] == corners[:, b]).any() for a in range(D) for b in range(a)):
        raise ValueError(f"{name} has elements without extent, two of whose corners are in one place: leave "
                         "them out")
    if D == 2:  # a segment has two ends, one at its start
        facets, sign = corners.T.reshape(-1, 1), np.repeat([1, -1], len(elements))
    else:  # a triangle has three edges, each run through in one direction
        facets = np.concatenate([corners[:, [a, (a + 1) % 3]] for a in range(3)])
        sign = np.where(facets[:, 0] < facets[:, 1], 1, -1)
    order, first, count = alike(facets)
    if (count % 2 == 1).any():
        return elements, False
    if np.add.reduceat(sign[order], first).any():
        raise ValueError(f"{name} is closed, but its elements do not agree on which side is outside: let all "
                         f"{'have it on the left' if D == 2 else 'run counter-clockwise seen from outside'}")
    arm = x[elements] - x.mean(axis=0)
    volume = np.linalg.det(arm).sum() * (-1.0 if D == 2 else 1.0)
    return (elements if volume >= 0.0 else np.ascontiguousarray(elements[:, ::-1])), True


def width(x: np.ndarray, elements: np.ndarray) -> float:
    """The least extent along the normal of an element [m]."""
    n = normal_areas(x, elements)
    n = np.unique(np.round(n / np.linalg.norm(n, axis=1)[:, None], 9), axis=0)
    return float(np.ptp(x @ n.T, axis=0).min())
