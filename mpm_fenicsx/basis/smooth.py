"""Smooth basis: the linear basis of a regular grid, averaged over the domain of each material point.

The fields of the grid stay what they are, linear between its nodes. A point does not take them at its place
but their mean over its domain, a box along the axes with half-widths l <= h/2 around it: with N the linear
basis function of a node at x = 0, in one direction,

    S(x) = 1/(2 l) integral of N from x - l to x + l,      S'(x) = (N(x + l) - N(x - l)) / (2 l),

and products of these in the plane and in space. This is the generalised interpolation of Bardenhagen & Kober
2004 (doi 10.3970/cmes.2004.005.477, GIMP); gradients are continuous, where those of the linear basis jump
when a point crosses into the next cell. With l = h/2 the functions are the quadratic B-splines (Steffen,
Kirby & Berzins 2008, doi 10.1002/nme.2360).

The functions that do not vanish at a point are those of the 3^D nodes around its nearest node: its stencil.
At the edge of the grid a domain is no wider than up to there: with the distance it goes to zero, and so does
the motion of a point toward an edge whose nodes are held.
"""
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

import mpm_dem_checks as check

from ..compiled import inlined
from ..scene.numerics import BASES

D = 2  # fixed by specialise
FOLLOWS = False  # whether domains follow the stretch
SHAPES = "quadrilateral", "hexahedron"


# A domain over the point's share of the body. Where the side of a body lies on a grid line, domains that end
# there reach nodes behind it when it moves by a hair. These come and go, the kept tangent is lost, and the
# step takes twice as long (measured on a beam that a sphere hits).
SHARE = 0.998


@dataclass(frozen=True)
class Basis:
    """Kind of basis at the material points, one of ``BASES``: "linear"; "gimp", domains follow the
    stretch; "ugimp" (uniform), they stay as they are at the start; "bspline", all are as wide as a cell.

    >>> Basis("gimp").smooth, Basis("linear").smooth
    (True, False)

    Raises ValueError for another name.
    """

    name: str = "linear"

    def __post_init__(self) -> None:
        check.choice("basis", self.name, BASES)

    @property
    def smooth(self) -> bool:
        """Whether points have domains."""
        return self.name != "linear"

    @property
    def follows(self) -> bool:
        """Whether these follow the stretch."""
        return self.name == "gimp"

    def nodes(self, dim: int, of_cell: int) -> int:
        """Number of nodes with functions at a point; of_cell: number of a cell's nodes."""
        return 3**dim if self.smooth else of_cell

    def domain(self, half: np.ndarray, h: np.ndarray) -> np.ndarray:
        """Half-widths of domains [m], shape (n, dim), from those of the points' shares of the body, ``half``,
        on cells of size h [m], shape (dim,)."""
        most = np.broadcast_to(0.5 * h, half.shape)
        return most.copy() if self.name == "bspline" else np.minimum(SHARE * half, most)

    def check_grid(self, grid: object, cell: str, regular: bool) -> None:
        """ValueError for a smooth basis on a grid that is not regular, or of other cells than ``SHAPES``."""
        if self.smooth and not (regular and cell in SHAPES):
            what = f"a Grid of {cell} cells" if regular else f"a Mesh ({cell} cells)"
            raise ValueError(f"basis={self.name} needs a regular Grid of quadrilaterals or hexahedra, this "
                             f"is {what}: take such a Grid, or basis=linear")


LINEAR = Basis()


class StencilGrid(NamedTuple):
    """What the functions need of a regular grid: its ``lower`` and ``upper`` corner [m] and the size ``h`` of
    a cell [m], shape (D,) each; ``corner`` (cells, 2^D, D), the vertices of this rank's cells [m], and
    ``nodes`` (cells, 2^D), their numbers among the active nodes."""

    lower: np.ndarray
    upper: np.ndarray
    h: np.ndarray
    corner: np.ndarray
    nodes: np.ndarray


@inlined
def averages(s, half, above, value, slope):
    """Functions of the node below, at and above s = 0 at the place s, |s| <= 1/2, averaged over s - half to
    s + half, half <= 1/2, in units of a cell: ``value`` (3,) and ``slope`` (3,). above: whether the place
    belongs to the cell above the node, which matters on its edges."""
    if half <= (s if above else -s) or half <= 0.0:  # all of the domain is in this cell
        near, side = (1.0, 2) if above else (-1.0, 0)
        value[0] = value[2] = slope[0] = slope[2] = 0.0
        value[side], value[1] = near * s, 1.0 - near * s
        slope[side], slope[1] = near, -near
    else:
        below, over = half - s, half + s
        value[0], value[2] = below * below / (4.0 * half), over * over / (4.0 * half)
        value[1] = 1.0 - value[0] - value[2]
        slope[0], slope[1], slope[2] = -below / (2.0 * half), -s / half, over / (2.0 * half)


@inlined
def half_width(p, i, x, domain, F, grid: StencilGrid, D, follows):
    """Half-width along axis i of the domain of point p [m], see ``shapes``; no wider than up to the edge of
    the grid, beyond which it is negative."""
    half = domain[p, i]
    if follows:
        square = 0.0
        for j in range(D):
            square += (F[p, i, j] * domain[p, j]) ** 2
        half = min(np.sqrt(square), 0.5 * grid.h[i])
    return min(half, x[p, i] - grid.lower[i], grid.upper[i] - x[p, i])


def shapes(cell, x, domain, F, grid: StencilGrid, element, N, G):
    """Stencil of each point, with values and gradients of its functions.

    cell: (n,) cell of each point; x: (n, D) positions [m]; domain: (n, D) half-widths at rest [m]; F: (n, D,
    D), by which they follow with FOLLOWS: a domain then has the second moments along the axes of the deformed
    one, l_i^2 = sum_j (F_ij l_j)^2, and at most h/2. Fills element: (n,) number of the nearest node; N: (n,
    3^D); G: (n, D, 3^D) [1/m].
    """
    h, corner, nodes = grid.h, grid.corner, grid.nodes
    value, slope = np.empty((D, 3)), np.empty((D, 3))
    for p in range(len(cell)):
        c, nearest = cell[p], 0
        for i in range(D):
            half = half_width(p, i, x, domain, F, grid, D, FOLLOWS)
            s = (x[p, i] - corner[c, 0, i]) / h[i]
            upper_node = s > 0.5
            if upper_node:
                nearest += 1 << i
                s -= 1.0
            averages(s, half / h[i], not upper_node, value[i], slope[i])
        element[p] = nodes[c, nearest]
        for a in range(3**D):
            first, second = a % 3, (a // 3) % 3
            v0, v1, v2 = value[0, first], value[1, second], 1.0
            if D == 3:
                v2 = value[D - 1, a // 9]
            N[p, a] = v0 * v1 * v2
            G[p, 0, a] = slope[0, first] * v1 * v2 / h[0]
            G[p, 1, a] = v0 * slope[1, second] * v2 / h[1]
            if D == 3:
                G[p, D - 1, a] = v0 * v1 * slope[D - 1, a // 9] / h[D - 1]
