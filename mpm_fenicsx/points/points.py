"""Material points and boundary particles as arrays, one array per field, and their seeding."""
import math
from typing import Optional, Tuple

import basix
import numpy as np

import mpm_dem_checks as check

from ..basis.shape import basis as shape_functions
from ..basis.smooth import Basis
from ..collective import WHOLE, Part
from ..scene.bodies import Body, Cloud, Mesh
from ..scene.interface import Interface
from ..scene.lattice import cell_count, lattice_corners
from ..scene.mesh import Box


def gauss_rule(cell: Optional[str], points: Optional[int]) -> Tuple[np.ndarray, np.ndarray]:
    """Points (n, D) and weights (n,) on the reference cell: tensor Gauss rule with ``points`` per direction,
    or the symmetric simplex rule of basix with that many points."""
    if cell in ("quadrilateral", "hexahedron"):
        D = 2 if cell == "quadrilateral" else 3
        g, w = np.polynomial.legendre.leggauss(points)
        x = np.stack(np.meshgrid(*[(g + 1) / 2] * D, indexing="ij"), -1).reshape(-1, D)
        return x, np.prod(np.stack(np.meshgrid(*[w / 2] * D, indexing="ij"), -1), axis=-1).ravel()
    for degree in range(9, 0, -1):  # the best of the rules with that many points
        x, w = basix.make_quadrature(getattr(basix.CellType, cell), degree)
        if len(w) == points and w.min() > 0:
            return x, w
    raise ValueError(f"points is {points}: no symmetric rule of that size on a {cell}")


def even_rule(cell: Optional[str], points: Optional[int]) -> Tuple[np.ndarray, np.ndarray]:
    """Points (n, D) and weights (n,) on the reference quadrilateral or hexahedron: the middles of equal
    parts, ``points`` per direction."""
    D = 2 if cell == "quadrilateral" else 3
    places = (np.arange(points or 1) + 0.5) / (points or 1)
    x = np.stack(np.meshgrid(*[places] * D, indexing="ij"), -1).reshape(-1, D)
    return x, np.full(len(x), 1.0 / len(x))


def _rule(body: Body, even: bool) -> Tuple[np.ndarray, np.ndarray]:
    """Points and weights on a body cell."""
    return (even_rule if even and body.cell in ("quadrilateral", "hexahedron") else gauss_rule)(
        body.cell, body.points)


def numbers(body: Body, part: Part = WHOLE) -> Tuple[int, slice]:
    """How many material points the body has, and which of them, in their order, are those of a ``part``: that
    of whole body cells."""
    if isinstance(body.shape, Cloud):
        count, each = len(body.shape.x), 1
    elif isinstance(body.shape, Mesh):
        count, each = len(body.shape.cells), len(_rule(body, False)[1])
    else:
        count = math.prod(body.cells)
        each = len(_rule(body, False)[1]) * cell_count((1,) * body.dim, body.cell)
    own = part.of(count)
    return count * each, slice(own.start * each, own.stop * each)


def _corners(body: Body, part: Part) -> np.ndarray:
    """Of the ``part`` of the body's cells [m], shape (cells, K, D)."""
    if isinstance(body.shape, Mesh):
        return body.shape.vertices[body.shape.cells[part.of(len(body.shape.cells))]]
    return lattice_corners(body.shape, body.cells, body.cell, part.of(math.prod(body.cells)))


def seed(body: Body, even: bool = False, part: Part = WHOLE) -> Tuple[np.ndarray, np.ndarray]:
    """Positions [m], shape (n, D), and volumes [m^3], shape (n,), of the body's material points, or of a
    ``part``, see ``numbers``. even: put those of quadrilaterals and hexahedra in the middles of equal parts,
    not at Gauss points.

    >>> from mpm_fenicsx import Box, linear
    >>> x, volume = seed(Body(Box((0.0, 0.0), (1.0, 0.5)), (2, 1), 1, linear(1e6, 0.3), 1000.0))
    >>> x.tolist(), volume.tolist()
    ([[0.25, 0.25], [0.75, 0.25]], [0.25, 0.25])
    """
    thickness = body.thickness if body.dim == 2 else 1.0
    if isinstance(body.shape, Cloud):
        own = part.of(len(body.shape.x))
        return body.shape.x[own].copy(), body.shape.volume[own] * thickness
    corner, (xi, w) = _corners(body, part), _rule(body, even)
    K, D = corner.shape[1:]
    N, dN = np.empty((len(xi), K)), np.empty((len(xi), K, D))
    for q in range(len(xi)):
        shape_functions.py_func(xi[q], D, K, N[q], dN[q])
    jacobian = np.einsum("cai,qaj->cqij", corner, dN)
    volume = np.abs(np.linalg.det(jacobian)) * w * thickness
    return np.einsum("cai,qa->cqi", corner, N).reshape(-1, D), volume.ravel()


def half_widths(body: Body, volume: np.ndarray, part: Part = WHOLE) -> np.ndarray:
    """Of the boxes that evenly seeded points, of the ``part`` of the body and with ``volume`` [m^3], shape
    (n,), stand for [m], shape (n, D): in a Box of quadrilaterals or hexahedra its equal parts, of a Cloud
    those given, else squares and cubes."""
    D = body.dim
    if isinstance(body.shape, Cloud) and body.shape.half is not None:
        return body.shape.half[part.of(len(body.shape.half))].copy()
    if isinstance(body.shape, Box) and body.cell in ("quadrilateral", "hexahedron"):
        half = 0.5 * body.shape.size / np.multiply(body.cells, body.points)
        return np.tile(half, (len(volume), 1))
    thickness = body.thickness if D == 2 else 1.0
    return np.tile(0.5 * (volume / thickness) ** (1.0 / D), (D, 1)).T.copy()


def surface_shares(V0, thickness, D):
    """Area that each point has on a surface of its body [m^2], shape (n,), from volumes V0 [m^3]: the side of
    a cube, in the plane of a square times the ``thickness`` [m]."""
    return (V0 / thickness) ** ((D - 1) / D) * thickness


def surface_distances(body: Body, volume: np.ndarray, even: bool = False, part: Part = WHOLE) -> np.ndarray:
    """Of the body's outermost points from its surface, and of all others from the sides of their body cells,
    along the axes [m], shape (n, D); volume: of the points of the ``part`` [m^3], shape (n,); even: see
    ``seed``. Points of a Cloud have half their widths.

    >>> from mpm_fenicsx import Box, linear
    >>> block = Body(Box((0.0, 0.0), (1.0, 0.5)), (2, 1), 1, linear(1e6, 0.3), 1000.0)
    >>> surface_distances(block, np.full(2, 0.25)).tolist()
    [[0.25, 0.25], [0.25, 0.25]]
    """
    D, tensor = body.dim, body.cell in ("quadrilateral", "hexahedron")
    if isinstance(body.shape, Cloud):
        return half_widths(body, volume, part)
    xi = _rule(body, even)[0]
    if isinstance(body.shape, Box):
        return np.tile(xi.min() * body.shape.size / np.asarray(body.cells), (len(volume), 1))
    thickness = body.thickness if D == 2 else 1.0
    of_cell = np.repeat(volume.reshape(-1, len(xi)).sum(axis=1) / thickness, len(xi))
    side = ((1.0 if tensor else math.factorial(D)) * of_cell) ** (1.0 / D)
    return np.tile(xi.min() * side, (D, 1)).T.copy()


def of_points(body: Body, basis: str = "linear") -> Interface:
    """The body's material points as its interface: particles that coincide with them, in their order, and
    stay so. basis: of the ``MPM``, as smooth ones seed evenly.

    >>> from mpm_fenicsx import Box, linear
    >>> of_points(Body(Box((0.0, 0.0), (1.0, 0.5)), (2, 1), 1, linear(1e6, 0.3), 1000.0)).elements.tolist()
    [[0], [1]]
    """
    x = seed(check.record("body", body, Body), Basis(basis).smooth)[0]
    return Interface(x, np.arange(len(x))[:, None])


class Points:
    """Fields of points on this rank, each an array of its own (kernels over strided records take twice as
    long); a record is packed only to travel or to be stored. Fields: ``gid`` number in the whole run,
    ``cell``, ``x``, and whatever else is given. ``field``: of the grid, in which all of them or, as a field
    of their own, each of them are, see ``background``."""

    field = 0

    def __init__(self, **fields):
        self.names = tuple(fields)
        self.__dict__.update({name: np.ascontiguousarray(value) for name, value in fields.items()})

    def __len__(self):
        return len(self.x)

    def add(self, **fields):
        """Give every point more fields."""
        self.names += tuple(fields)
        self.__dict__.update(fields)

    def append(self, others):
        """Add points with higher numbers; fields that they do not have are zero."""
        for name in self.names:
            mine = getattr(self, name)
            new = getattr(others, name, None)
            new = np.zeros((len(others), *mine.shape[1:]), mine.dtype) if new is None else new
            setattr(self, name, np.concatenate([mine, new]))

    def copy(self):
        """Fields as a dict of copies: the state."""
        return {name: getattr(self, name).copy() for name in self.names}

    def restore(self, state):
        """Go back to the fields of ``copy``."""
        self.__dict__.update({name: state[name].copy() for name in self.names})

    def take(self, index):
        """Keep the points of ``index``, a mask or numbers, alone."""
        self.__dict__.update({name: np.ascontiguousarray(getattr(self, name)[index]) for name in self.names})

    def record(self):
        """dtype of one point with all its fields, and ``number``, the cell it travels to."""
        arrays = [(name, getattr(self, name)) for name in self.names]
        return np.dtype([("number", np.int64)] + [(name, a.dtype, a.shape[1:]) for name, a in arrays])

    def migrate(self, router, rank, number):
        """Send points to their ``rank``, with the ``number`` of their cell, shape (n,) both; the order by gid
        stays. Returns the numbers of the cells of all points then here. Collective."""
        staying = rank == router.comm.rank
        packed = np.empty(np.count_nonzero(~staying), self.record())
        packed["number"] = number[~staying]
        for name in self.names:
            packed[name] = getattr(self, name)[~staying]
        arrived = router.exchange(packed, rank[~staying])
        place = np.searchsorted(self.gid[staying], arrived["gid"])
        for name in self.names:
            setattr(self, name, np.insert(getattr(self, name)[staying], place, arrived[name], axis=0))
        return np.insert(number[staying], place, arrived["number"])
