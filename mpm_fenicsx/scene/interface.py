"""Surfaces of boundary particles: frozen data in SI units, checked when made."""
import math
from dataclasses import dataclass
from typing import Any, Optional, Sequence, Tuple, Union

import numpy as np

import mpm_dem_checks as check

from .bodies import BYTES_PER_POINT, Body
from .mesh import Box, Mesh

FINEST = 1e-3  # spacing of an outline in body cells
# clockwise; axis, and the way into the box
SIDES = {"x-": (0, 1.0), "y+": (1, -1.0), "x+": (0, -1.0), "y-": (1, 1.0)}


@dataclass(frozen=True)
class Resampling:
    """How an interface keeps up with a plane body that flows, see ``outline``.

    spacing: of the boundary particles [m]; longest, shortest: segment, as multiples of it, beyond which one
    is divided, or loses an end. feet: for the first and the last end of an open outline None, or the side,
    such as "y-", and the level [m] of the floor on which the body sticks and the end rests; reach: of a foot
    above its floor, a multiple of the spacing.

    >>> Resampling(0.01).longest
    2.0
    """

    spacing: float
    longest: float = 2.0
    shortest: float = 0.25
    feet: Tuple = (None, None)
    reach: float = 4.0

    def __post_init__(self) -> None:
        check.positive("the spacing of the outline", self.spacing, "m", "it must be positive")
        if not 0 <= check.not_negative("the outline's shortest segment",
                                       self.shortest) < 0.5 * check.positive("the outline's longest segment",
                                                                             self.longest):
            raise ValueError(f"the outline's shortest segment is {self.shortest} spacings and its longest "
                             f"{self.longest}: a longest one, divided, must stay longer than the shortest")
        check.not_negative("the reach of the outline's feet", self.reach)
        feet = self.feet if isinstance(self.feet, (tuple, list)) else ()
        if len(feet) != 2 or not all(foot is None or isinstance(foot, (tuple, list)) for foot in feet):
            check.refuse("feet of the outline", self.feet, "give two, each a side and a level, or None")
        for foot in feet:
            if foot is not None and (len(foot) != 2 or foot[0] not in SIDES):
                raise ValueError(f"a foot of the outline is {foot!r}: give its side, one of "
                                 f"{', '.join(SIDES)}, and its level")


@dataclass(frozen=True)
class Interface:
    """Boundary particles: positions x [m], shape (n, dim), and the elements they form, shape (m, dim):
    segments a→b with the outside on their left, or triangles that run counter-clockwise seen from outside;
    shape (m, 1): single particles. resampling: how it keeps up with a body that flows; None: the same
    particles all the time.

    >>> Interface([(0.0, 1.0), (0.5, 1.0), (1.0, 1.0)], [(0, 1), (1, 2)]).x.shape
    (3, 2)
    """

    x: np.ndarray
    elements: np.ndarray
    resampling: Optional[Resampling] = None

    def __post_init__(self) -> None:
        x = check.array("x of the interface", self.x, ("n", 2), ("n", 3), unit="m")
        elements = check.shaped("elements of the interface", self.elements, ("n", "nodes of each"))
        columns = (1, x.shape[1]) if elements.size else elements.shape[1:]
        object.__setattr__(self, "x", x)
        object.__setattr__(self, "elements", check.indices("elements of the interface", elements, len(x),
                                                           columns, "particles"))
        if self.resampling is not None:
            check.record("resampling of the interface", self.resampling, Resampling)

    @staticmethod
    def around(body: Body, spacing: Optional[float] = None, inset: float = 0.05,
               open_sides: Sequence[str] = (), floor: Optional[str] = None, **rule: Any) -> "Interface":
        """Outline of a plane body whose shape is a box, resampled as the body flows.

        spacing: of the boundary particles [m]; None: half a body cell. inset: how far inside the body they
        lie, in body cells (the paper's delta). open_sides: those without boundary particles ("x-", "x+",
        "y-", "y+"), where a wall or the floor is; floor: the one of them on which the body sticks. rule:
        further fields of ``Resampling``.

        >>> from mpm_fenicsx import mohr_coulomb
        >>> sand = mohr_coulomb(1e6, 0.3, friction_angle=30.0)
        >>> soil = Body(Box((0.0, 0.0), (0.2, 0.1)), (20, 10), 2, sand, 1600.0)
        >>> outline = Interface.around(soil, open_sides=("x-", "y-"), floor="y-")
        >>> len(outline.x), outline.resampling.feet[0]
        (61, None)
        """
        if check.record("body", body, Body).dim != 2 or not isinstance(body.shape, Box):
            raise ValueError("an outline goes around a plane body whose shape is a Box: give other "
                             "interfaces their particles, elements and Resampling")
        cell = min(body.box.size / body.cells)
        spacing = 0.5 * cell if spacing is None else check.positive("spacing", spacing, "m")
        check.between("inset", inset, 0, 0.5 * min(body.box.size) / cell, "body cells",
                      "it must lie between 0 and half the body", "[)")
        n = 2 * sum(body.box.size) / spacing
        what = f"{n:.3g} boundary particles of the outline (spacing={spacing:g} m)"
        check.check_memory(what, n * BYTES_PER_POINT[2], "take a larger spacing")
        check.between("spacing", spacing, FINEST * cell, check.MOST, "m", "boundary particles move with the "
                      "grid, more of them show nothing more below a thousandth of a body cell, "
                      f"{FINEST * cell:.3g} m: take that")
        check.record("open_sides", open_sides, tuple, list)
        corner, ends = _corners(body.box, inset * cell, tuple(open_sides), floor)
        resampling = Resampling(spacing, feet=ends, **rule)
        pieces = [np.linspace(a, b, max(1, round(np.hypot(*(b - a)) / spacing)), endpoint=False)
                  for a, b in zip(corner, corner[1:])]
        if open_sides:
            pieces.append(corner[-1:])
        x = np.concatenate(pieces)
        i = np.arange(len(x) - bool(open_sides))
        return Interface(x, np.column_stack([i, (i + 1) % len(x)]), resampling)

    @staticmethod
    def of_mesh(mesh: Mesh, surface: Optional[str] = None) -> "Interface":
        """The surface of a body mesh, or the named one of its surfaces, as segments or triangles; its
        vertices become the boundary particles. Raises ValueError as ``Mesh.boundary``.

        >>> Interface.of_mesh(Mesh([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)], [(0, 1, 2)], "triangle")).elements
        array([[1, 0],
               [2, 1],
               [0, 2]])
        """
        facets = mesh.boundary(surface)
        if facets.shape[1] == 4:
            facets = np.concatenate([facets[:, [0, 1, 2]], facets[:, [0, 2, 3]]])
        vertices, elements = np.unique(facets, return_inverse=True)
        return Interface(mesh.vertices[vertices], elements.reshape(facets.shape))

    @staticmethod
    def top(box: Box, segments: Union[int, Sequence[int]], shift: float = 0.0) -> "Interface":
        """Upper side of a box, moved into the body by ``shift`` [m] (the paper's delta). segments: of the
        upper edge of a plane box, one number; of the upper face of a box in space two, along x and z, each
        rectangle being two triangles.

        >>> Interface.top(Box((0.0, 0.0), (1.0, 0.1)), segments=2).x
        array([[0. , 0.1],
               [0.5, 0.1],
               [1. , 0.1]])
        """
        across = [d for d in range(check.record("box", box, Box).dim) if d != 1]
        several = isinstance(segments, (tuple, list, np.ndarray))
        counts = check.counts("segments", segments if several else (segments,), len(across))
        check.between("shift", shift, 0, box.size[1], "m",
                      f"it must lie between 0 and the height of the body, {box.size[1]} m", "[)")
        _check_size(counts, "segments", box.dim)
        axes = [np.linspace(box.lower[d], box.upper[d], n + 1) for d, n in zip(across, counts)]
        x = np.stack([a.ravel(order="F") for a in np.meshgrid(*axes, indexing="ij")], axis=1)
        x = np.insert(x, 1, box.upper[1] - shift, axis=1)
        nodes = np.arange(len(x)).reshape(*(n + 1 for n in counts), order="F")
        if box.dim == 2:
            # rightwards: the outside is on the left hand
            return Interface(x, np.column_stack([nodes[:-1], nodes[1:]]))
        a, b, c, d = (part.ravel(order="F") for part in (nodes[:-1, :-1], nodes[1:, :-1], nodes[:-1, 1:],
                                                         nodes[1:, 1:]))
        return Interface(x, np.concatenate([np.column_stack([a, c, d]), np.column_stack([a, d, b])]))

    @staticmethod
    def line(a: Sequence[float], b: Sequence[float], segments: int) -> "Interface":
        """Segments of equal length from a to b [m] in the plane; their outside is on the left of the way.

        >>> Interface.line((0.0, 0.0), (1.0, 0.0), 2).elements
        array([[0, 1],
               [1, 2]])
        """
        segments, a, b = check.count("segments", segments), *(
            check.numbers(f"{name} of the line", end, 2, "m") for name, end in (("a", a), ("b", b)))
        _check_size((segments,), "segments", 2)
        i = np.arange(segments)
        return Interface(np.linspace(a, b, segments + 1), np.column_stack([i, i + 1]))

    @staticmethod
    def patch(corner: Sequence[float], first: Sequence[float], second: Sequence[float],
              counts: Sequence[int]) -> "Interface":
        """Parallelogram in space from ``corner`` along the edges ``first`` and ``second`` [m], in counts[0] x
        counts[1] pieces of two triangles each; its outside is that of first x second.

        >>> Interface.patch((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (1, 1)).elements
        array([[0, 2, 3],
               [0, 3, 1]])
        """
        n, m = check.counts("counts (pieces of the patch)", counts, 2)
        _check_size((n, m), "counts", 3)
        corner, first, second = (check.numbers(f"{name} of the patch", value, 3, "m") for name, value in
                                 (("corner", corner), ("first edge", first), ("second edge", second)))
        s, t = (a.ravel() for a in np.meshgrid(np.arange(n + 1), np.arange(m + 1), indexing="ij"))
        x = np.asarray(corner, float) + np.outer(s / n, first) + np.outer(t / m, second)
        corners = (np.arange(n)[:, None] * (m + 1) + np.arange(m)).ravel()
        along, across = corners + m + 1, corners + 1
        return Interface(x, np.concatenate([np.column_stack([corners, along, along + 1]),
                                            np.column_stack([corners, along + 1, across])]))


def _check_size(counts: Sequence[int], name: str, dim: int) -> None:
    """ValueError for more pieces than fit into the memory."""
    n = math.prod(counts)
    check.check_memory(f"{n:.3g} pieces of the interface ({name}={','.join(map(str, counts))})",
                       n * BYTES_PER_POINT[dim], f"take fewer {name}")


def _corners(box: Box, inset: float, open_sides: Sequence[str],
             floor: Optional[str]) -> Tuple[np.ndarray, Tuple]:
    """Corners of an outline in clockwise order, the first once more at the end when it is closed, and its
    feet; see ``Interface.around``."""
    for side in (*open_sides, *([] if floor is None else [floor])):
        check.choice("side of the outline", side, tuple(SIDES))
    if floor is not None and floor not in open_sides:
        raise ValueError(f"the floor is side {floor!r}, which has boundary particles: name it among the open "
                         "sides")
    (left, bottom), (right, top) = np.add(box.lower, inset), np.subtract(box.upper, inset)
    names, corner = list(SIDES), np.array([(left, bottom), (left, top), (right, top), (right, bottom)])
    starts = [k for k in range(4) if names[k] not in open_sides and names[k - 1] in open_sides]
    if open_sides and len(starts) != 1:
        raise ValueError(f"the open sides are {', '.join(open_sides)}: the others must hang together")
    start = starts[0] if open_sides else 0
    way = np.arange(start, start + 5 - len(set(open_sides))) % 4
    levels = {"x-": left, "x+": right, "y-": bottom, "y+": top}
    foot = lambda side: (side, float(levels[side])) if open_sides and side == floor else None  # noqa: E731
    return corner[way], (foot(names[start - 1]), foot(names[way[-1]]))
