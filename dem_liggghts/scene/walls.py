"""Surfaces that the spheres of a DEM scene meet: frozen data in SI units, checked when made."""
from dataclasses import dataclass
from typing import Optional

import numpy as np

import mpm_dem_checks as check

from .arrays import Array, finite, rows
from .materials import WALL


@dataclass(frozen=True)
class Wall:
    """A surface that spheres meet: nodes [m], shape (n, dim), and elements, shape (m, dim): segments in a
    plane scene, triangles in space. Seen from outside the body, a segment a→b has the outside on its left and
    a triangle runs counter-clockwise. Or discs (in space balls) of one ``radius`` [m] around the nodes:
    elements, shape (m, 1).

    Elements whose nodes lie in the same place hang together, whether or not they name the same ones (as in an
    STL file), and so do walls that meet: a sphere has one contact there, whose friction goes on. Each force
    acts on the nodes of the element that is touched.

    depth [m]: none, and both sides push; a number, and the wall pushes outwards only: a sphere whose centre
    is up to that far below the surface is pushed out, one that is deeper is left alone. material: its name.

    >>> floor = Wall(nodes=[[-1.0, 0.0], [1.0, 0.0]], elements=[[0, 1]], material="floor")  # outside: above
    >>> floor.dim, Wall.discs([[0.0, 0.0], [0.1, 0.0]], radius=0.05).elements.shape
    (2, (2, 1))
    """

    nodes: Array
    elements: Array
    depth: Optional[float] = None
    material: str = WALL
    radius: Optional[float] = None

    def __post_init__(self) -> None:
        nodes = finite(self.nodes, "nodes of the wall", (2, 3))
        elements = check.indices("wall elements", rows(self.elements), len(nodes), (1, 2, 3), "nodes")
        elements = elements.astype(np.int32)
        if elements.shape[1] != (nodes.shape[1] if self.radius is None else 1):
            raise ValueError(f"wall elements have {elements.shape[1]} nodes in {nodes.shape[1]} dimensions: "
                             "give segments (2 nodes) in a plane, triangles (3 nodes), or discs (1 node) "
                             "with a radius")
        if self.radius is not None:
            check.positive("radius of the discs of the wall", self.radius, "m", "it must be positive")
        if self.depth is not None and self.radius is not None:
            raise ValueError("the wall has discs and a depth: a depth is for segments and triangles, which "
                             "have sides")
        if self.depth is not None:
            check.not_negative("depth of the wall", self.depth, "m",
                               "give none, or how far below the surface a centre is still pushed out")
        elements.flags.writeable = False
        object.__setattr__(self, "nodes", nodes)
        object.__setattr__(self, "elements", elements)

    @classmethod
    def discs(cls, x: Array, radius: float, material: str = WALL) -> "Wall":
        """Discs, in space balls, of ``radius`` [m] around x [m], shape (n, dim); none as long as n is 0,
        where others replace the wall later."""
        x = finite(x, "nodes of the wall", (2, 3))
        return cls(x, np.arange(len(x))[:, None], material=material, radius=radius)

    @classmethod
    def none(cls, dim: int) -> "Wall":
        """No wall: no nodes, no elements."""
        return cls(np.zeros((0, dim)), np.zeros((0, dim)))

    @property
    def may_touch(self) -> bool:
        """Whether spheres may meet it: it has elements, or may get discs later, of which it has the
        radius."""
        return len(self.elements) > 0 or self.radius is not None

    @property
    def dim(self) -> int:
        """2 in a plane scene, 3 in space."""
        return self.nodes.shape[1]
