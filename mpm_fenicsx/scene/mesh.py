"""Meshes as plain arrays, checked when made. No MPI in here."""
from dataclasses import dataclass, field
from typing import Callable, Dict, List, Optional, Tuple

import numpy as np

import mpm_dem_checks as check

from .facets import alike, corner_volumes, runs_up

CELLS = {2: ("quadrilateral", "triangle"), 3: ("hexahedron", "tetrahedron")}  # tensor product, simplex
NODES = {"quadrilateral": 4, "triangle": 3, "hexahedron": 8, "tetrahedron": 4}
BYTES_PER_CELL = {2: 600, 3: 1300}  # of a grid, on each rank, measured
FLAT = 1e-12  # volume of a cell over the cube (in the plane: square) of its longest edge
# Facets of a cell as local vertices, outward by the right hand (left hand of a→b in the plane) for positive
# cells.
FACETS: Dict[str, List[Tuple[int, ...]]] = {
    "triangle": [(1, 0), (2, 1), (0, 2)],
    "quadrilateral": [(1, 0), (3, 1), (2, 3), (0, 2)],
    "tetrahedron": [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)],
    "hexahedron": [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)],
}


def cell_of(dim: int, cell: Optional[str], what: str) -> str:
    """The kind of cell, the tensor-product one for None; ValueError when it does not fit the dimension."""
    if cell is None:
        return CELLS[dim][0]
    return check.choice(f"cell of the {what}", cell, CELLS[dim])


@dataclass(frozen=True)
class Box:
    """Axis-parallel box from ``lower`` to ``upper`` [m], tuples of 2 or 3 numbers.

    >>> Box((0.0, 0.0), (2.0, 1.0)).size
    array([2., 1.])
    """

    lower: Tuple[float, ...]
    upper: Tuple[float, ...]

    def __post_init__(self) -> None:
        lower, upper = (tuple(end) if np.ndim(end) == 1 else () for end in (self.lower, self.upper))
        if len(lower) != len(upper) or len(lower) not in CELLS:
            raise ValueError(f"box from {self.lower} to {self.upper}: give two corners with 2 or 3 "
                             "coordinates each")
        for name in ("lower", "upper"):
            corner = check.numbers(f"{name} corner of the box", getattr(self, name), len(lower), "m")
            object.__setattr__(self, name, corner)
        if not all(high > low for low, high in zip(self.lower, self.upper)):
            raise ValueError(f"box from {self.lower} to {self.upper}: every upper coordinate must exceed the "
                             "lower one")

    @property
    def dim(self) -> int:
        """Number of dimensions."""
        return len(self.lower)

    @property
    def size(self) -> np.ndarray:
        """Edge lengths [m], shape (dim,)."""
        return np.subtract(self.upper, self.lower)


@dataclass(frozen=True)
class Mesh:
    """A mesh: vertices [m], shape (n, dim), cells, shape (m, nodes per cell), all of one kind ``cell``, with
    their vertices in dolfinx's order (tensor order for quadrilaterals and hexahedra: x fastest).

    groups: named groups of cells, name → numbers of cells; surfaces: named groups of facets, name → vertices
    of the facets, shape (k, nodes per facet).

    Raises ValueError for an empty mesh, arrays that do not fit, cells that are flat, inside out or folded
    over their neighbours, and facets shared by more than two cells.

    >>> corners = np.array([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)])
    >>> square = Mesh(corners, [(0, 1, 2), (1, 3, 2)], "triangle", surfaces={"left": [(0, 2)]})
    >>> square.on_surface("left")(corners)
    array([ True, False,  True, False])
    """

    vertices: np.ndarray
    cells: np.ndarray
    cell: str
    groups: Dict[str, np.ndarray] = field(default_factory=dict)
    surfaces: Dict[str, np.ndarray] = field(default_factory=dict)

    def __post_init__(self) -> None:
        vertices = check.array("vertices of the mesh", self.vertices, ("n", 2), ("n", 3), unit="m")
        check.choice("cell of the mesh", self.cell, CELLS[vertices.shape[1]])
        name = f"the {self.cell} cells of the mesh"
        cells = check.indices(name, self.cells, len(vertices), (NODES[self.cell],), "vertices")
        if not len(cells):
            raise ValueError("the mesh has no cells: give at least one")
        object.__setattr__(self, "vertices", vertices)
        object.__setattr__(self, "cells", cells)
        self._check_names()
        self._check_cells()

    def _check_names(self) -> None:
        facet = (len(FACETS[self.cell][0]),)
        self._check_named("group of cells", self.groups, len(self.cells), None, "cells")
        self._check_named("surface", self.surfaces, len(self.vertices), facet, "vertices")

    @staticmethod
    def _check_named(kind: str, named: Dict[str, np.ndarray], end: int, columns: Optional[Tuple[int]],
                     of: str) -> None:
        for name, numbers in check.record(f"{kind} of the mesh", named, dict).items():
            if not np.size(numbers):
                raise ValueError(f"the {kind} {name!r} of the mesh is empty: leave it out")
            rows = numbers if columns else np.reshape(numbers, (-1, 1))
            check.indices(f"the {kind} {name!r} of the mesh", rows, end, columns or (1,), of)

    def _check_cells(self) -> None:
        x = self.vertices[self.cells]
        volume = corner_volumes(x)
        least = FLAT * np.ptp(x, axis=1).max(axis=1) ** self.dim
        flat = (volume.min(axis=1) <= least) & (volume.max(axis=1) >= -least)
        if flat.any():
            raise ValueError(f"{self._place(int(np.argmax(flat)))} is flat or inside out: repair the mesh")
        facets = self._facets()
        order, first, count = alike(facets)
        if count.max() > 2:
            place = self.vertices[facets[order[first[np.argmax(count)]]]].mean(axis=0)
            raise ValueError(f"the mesh is not a manifold: {count.max()} cells share the facet at {place} m: "
                             "repair the mesh")
        pair = np.stack([order[first[count == 2]], order[first[count == 2] + 1]])
        same = runs_up(facets[pair[0]]) == runs_up(facets[pair[1]])
        if same.any():
            one, other = pair[:, np.argmax(same)] // len(FACETS[self.cell])
            raise ValueError(f"{self._place(one)} and cell {other} lie on the same side of their common "
                             "facet: one is inside out or there twice, repair the mesh")

    def _place(self, cell: int) -> str:
        return f"cell {cell} of the mesh at {self.vertices[self.cells[cell]].mean(axis=0)} m"

    @property
    def dim(self) -> int:
        """Number of dimensions."""
        return self.vertices.shape[1]

    @property
    def box(self) -> Box:
        """Smallest box around the mesh."""
        return Box(tuple(self.vertices.min(axis=0)), tuple(self.vertices.max(axis=0)))

    @property
    def count(self) -> int:
        """Number of cells."""
        return len(self.cells)

    @property
    def cell_size(self) -> np.ndarray:
        """Mean extent of the cells along the axes [m], shape (dim,)."""
        return np.asarray(np.ptp(self.vertices[self.cells], axis=1).mean(axis=0))

    def part(self, group: str) -> "Mesh":
        """The cells of one named group as a mesh of its own, with what it has of the surfaces; ValueError
        lists the groups that exist."""
        if group not in self.groups:
            raise ValueError(f"the mesh has no group of cells {group!r}; it has "
                             f"{', '.join(sorted(self.groups)) or 'none'}: look at the name")
        used, cells = np.unique(self.cells[self.groups[group]], return_inverse=True)
        number = np.full(len(self.vertices), -1)
        number[used] = np.arange(len(used))
        surfaces = {name: number[facets][(number[facets] >= 0).all(axis=1)]
                    for name, facets in self.surfaces.items()}
        return Mesh(self.vertices[used], cells.reshape(-1, NODES[self.cell]), self.cell,
                    surfaces={name: facets for name, facets in surfaces.items() if len(facets)})

    def _surface(self, name: str) -> np.ndarray:
        if name not in self.surfaces:
            raise ValueError(f"the mesh has no surface {name!r}; it has "
                             f"{', '.join(sorted(self.surfaces)) or 'none'}: look at the name")
        return np.asarray(self.surfaces[name])

    def on_surface(self, name: str) -> Callable[[np.ndarray], np.ndarray]:
        """Function from positions, shape (n, dim), to the mask of those that are vertices of the named
        surface: the ``where`` of a support. ValueError lists the surfaces that exist."""
        from scipy.spatial import cKDTree  # takes time to import, and few scenes need it

        places = self.vertices[np.unique(self._surface(name))]
        near = 1e-9 * np.ptp(self.vertices, axis=0).max()
        return lambda x: cKDTree(places).query(x, distance_upper_bound=near)[0] < np.inf

    def _facets(self) -> np.ndarray:
        """Facets of all cells, cell by cell, outside on the left (of a→b) or seen counter-clockwise, shape (m
        * facets per cell, nodes per facet) in cyclic order."""
        local = np.array(FACETS[self.cell])
        facets = self.cells[:, local]
        turned = corner_volumes(self.vertices[self.cells])[:, 0] < 0
        facets[turned] = facets[turned][:, :, ::-1]
        return facets.reshape(-1, local.shape[1])

    def boundary(self, surface: Optional[str] = None) -> np.ndarray:
        """Facets that belong to one cell only, outside on the left (of a→b) or seen counter-clockwise, shape
        (k, nodes per facet) in cyclic order; with ``surface`` those of the named one.

        Raises ValueError where pieces of the surface meet in an edge (in the plane: a vertex) of more than
        two facets, and for a named surface that is not on the boundary.
        """
        facets = self._facets()
        order, first, count = alike(facets)
        facets = facets[np.sort(order[first[count == 1]])]
        if surface is not None:
            wanted = {tuple(facet) for facet in np.sort(self._surface(surface), axis=1).tolist()}
            facets = facets[[tuple(facet) in wanted for facet in np.sort(facets, axis=1).tolist()]]
            if len(facets) < len(wanted):
                raise ValueError(f"{len(wanted) - len(facets)} of {len(wanted)} facets of the surface "
                                 f"{surface!r} are not on the boundary of the mesh: take the part of the "
                                 "mesh on one side of them")
        around = np.stack([facets, np.roll(facets, -1, axis=1)], axis=2).reshape(-1, 2)
        edges = around if self.dim == 3 else facets.reshape(-1, 1)
        order, first, count = alike(edges)
        if count.max() > 2:
            place = self.vertices[edges[order[first[np.argmax(count)]]]].mean(axis=0)
            raise ValueError(f"the surface of the mesh is not a manifold: {count.max()} facets meet at "
                             f"{place} m: repair the mesh, or take its parts one by one")
        return facets
