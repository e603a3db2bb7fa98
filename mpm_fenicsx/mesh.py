"""Meshes as plain arrays: regular ones of a box, and files that meshio reads (Gmsh and others). No MPI in here."""
from dataclasses import dataclass, field
from itertools import permutations
from typing import Dict, Tuple

import numpy as np

CELLS = {2: ("quadrilateral", "triangle"), 3: ("hexahedron", "tetrahedron")}  # tensor product, simplex
NODES = {"quadrilateral": 4, "triangle": 3, "hexahedron": 8, "tetrahedron": 4}
MESHIO = {"quad": "quadrilateral", "triangle": "triangle", "hexahedron": "hexahedron", "tetra": "tetrahedron"}
# Facets of a cell as local vertices, outward by the right hand (left hand of a→b in the plane) for positive cells.
FACETS = {
    "triangle": [(1, 0), (2, 1), (0, 2)],
    "quadrilateral": [(1, 0), (3, 1), (2, 3), (0, 2)],
    "tetrahedron": [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)],
    "hexahedron": [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)],
}


def cell_of(dim, cell, what):
    """The kind of cell, the tensor-product one for None; ValueError when it does not fit the dimension."""
    if cell is None:
        return CELLS[dim][0]
    if cell not in CELLS[dim]:
        raise ValueError(f"cell of the {what} is {cell!r}: choose one of {', '.join(CELLS[dim])}")
    return cell


@dataclass(frozen=True)
class Box:
    """Axis-parallel box from ``lower`` to ``upper`` [m], tuples of 2 or 3 numbers."""

    lower: Tuple[float, ...]
    upper: Tuple[float, ...]

    def __post_init__(self):
        lower, upper = np.asarray(self.lower, float), np.asarray(self.upper, float)
        if lower.shape != upper.shape or lower.shape not in ((2,), (3,)):
            raise ValueError(f"box from {self.lower} to {self.upper}: give two corners with 2 or 3 coordinates each")
        if not (upper > lower).all():
            raise ValueError(f"box from {self.lower} to {self.upper}: every upper coordinate must exceed the lower one")

    @property
    def dim(self):
        return len(self.lower)

    @property
    def size(self):
        """Edge lengths [m], shape (dim,)."""
        return np.subtract(self.upper, self.lower)


@dataclass(frozen=True)
class Mesh:
    """A mesh: vertices [m], shape (n, dim), cells, shape (m, nodes per cell), all of one kind ``cell``, with their
    vertices in dolfinx's order (tensor order for quadrilaterals and hexahedra: x fastest).

    groups: named groups of cells, name → numbers of cells; surfaces: named groups of facets, name → vertices of the
    facets, shape (k, nodes per facet).

    Raises ValueError for arrays that do not fit, cells without volume and cells that are inside out.
    """

    vertices: np.ndarray
    cells: np.ndarray
    cell: str
    groups: Dict[str, np.ndarray] = field(default_factory=dict)
    surfaces: Dict[str, np.ndarray] = field(default_factory=dict)

    def __post_init__(self):
        vertices, cells = np.array(self.vertices, float), np.array(self.cells, np.int64)
        if vertices.ndim != 2 or vertices.shape[1] not in CELLS:
            raise ValueError(f"vertices of the mesh have shape {vertices.shape}: give (n, 2) or (n, 3)")
        cell_of(vertices.shape[1], self.cell, "mesh")
        if cells.ndim != 2 or cells.shape[1] != NODES[self.cell]:
            raise ValueError(f"{self.cell} cells have {NODES[self.cell]} vertices, the array has shape {cells.shape}")
        if not 0 <= cells.min() <= cells.max() < len(vertices):
            raise ValueError(f"the cells name vertices {cells.min()}..{cells.max()}, there are {len(vertices)}")
        volume = corner_volumes(vertices[cells], self.cell)
        tangled = np.flatnonzero((volume.min(axis=1) <= 0) & (volume.max(axis=1) >= 0))
        if len(tangled):
            raise ValueError(f"cell {tangled[0]} of the mesh at {vertices[cells[tangled[0]]].mean(axis=0)} m is flat or "
                             "inside out: repair the mesh")
        object.__setattr__(self, "vertices", vertices)
        object.__setattr__(self, "cells", cells)

    @property
    def dim(self):
        return self.vertices.shape[1]

    @property
    def box(self):
        """Smallest box around the mesh."""
        return Box(tuple(self.vertices.min(axis=0)), tuple(self.vertices.max(axis=0)))

    def part(self, group):
        """The cells of one named group as a mesh of the same vertices; ValueError lists the groups that exist."""
        if group not in self.groups:
            raise ValueError(f"the mesh has no group of cells {group!r}; it has {', '.join(sorted(self.groups)) or 'none'}")
        return Mesh(self.vertices, self.cells[self.groups[group]], self.cell, surfaces=self.surfaces)

    def on_surface(self, name):
        """Function from positions, shape (n, dim), to the mask of those that are vertices of the named surface: the
        ``where`` of a support. ValueError lists the surfaces that exist."""
        if name not in self.surfaces:
            raise ValueError(f"the mesh has no surface {name!r}; it has {', '.join(sorted(self.surfaces)) or 'none'}")
        from scipy.spatial import cKDTree

        places = self.vertices[np.unique(self.surfaces[name])]
        near = 1e-9 * np.ptp(self.vertices, axis=0).max()
        return lambda x: cKDTree(places).query(x, distance_upper_bound=near)[0] < np.inf

    def boundary(self):
        """Facets that belong to one cell only, outside on the left (of a→b) or seen counter-clockwise, shape (k, nodes
        per facet) in cyclic order; ValueError where more than two cells share a facet."""
        local = np.array(FACETS[self.cell])
        facets = self.cells[:, local]
        turned = corner_volumes(self.vertices[self.cells], self.cell)[:, 0] < 0
        facets[turned] = facets[turned][:, :, ::-1]
        facets = facets.reshape(-1, local.shape[1])
        _, first, count = np.unique(np.sort(facets, axis=1), axis=0, return_index=True, return_counts=True)
        if count.max() > 2:
            vertex = facets[first[np.argmax(count)]]
            raise ValueError(f"the mesh is not a manifold: {count.max()} cells share the facet at "
                             f"{self.vertices[vertex].mean(axis=0)} m: repair the mesh")
        return facets[np.sort(first[count == 1])]


def corner_volumes(x, cell):
    """Jacobian determinant at the vertices of each cell (one value for simplices), x: (m, nodes, dim); shape (m, k)."""
    dim = x.shape[2]
    if NODES[cell] == dim + 1:
        return np.linalg.det(x[:, 1:] - x[:, :1])[:, None]
    corners = []
    for a in range(2**dim):
        edges = [(x[:, a ^ (1 << d)] - x[:, a]) * (-1 if (a >> d) & 1 else 1) for d in range(dim)]
        corners.append(np.linalg.det(np.stack(edges, axis=1)))
    return np.stack(corners, axis=1)


def lattice(box, counts, cell):
    """Vertices, shape (n, D), and cells, shape (m, K), of a regular mesh; direction 0 runs fastest in both.

    Simplices: each box cell is cut into D! of them along its main diagonal (Kuhn), numbered by the permutation that sorts
    the local coordinates downwards.
    """
    D = box.dim
    axes = [np.linspace(lo, hi, n + 1) for lo, hi, n in zip(box.lower, box.upper, counts)]
    vertices = np.stack([a.ravel(order="F") for a in np.meshgrid(*axes, indexing="ij")], axis=1)
    strides = np.cumprod([1, *(n + 1 for n in counts[:-1])])
    corner = sum(s * i.ravel(order="F") for s, i in zip(strides, np.meshgrid(*map(np.arange, counts), indexing="ij")))
    if cell == CELLS[D][0]:
        offsets = [sum(strides[d] for d in range(D) if (a >> d) & 1) for a in range(2**D)]
        return vertices, corner[:, None] + np.array(offsets)
    paths = [np.cumsum([0, *(strides[d] for d in order)]) for order in permutations(range(D))]
    return vertices, (corner[:, None, None] + np.array(paths)).reshape(-1, D + 1)


def read_mesh(path, dim):
    """Mesh of ``dim`` dimensions from a file that meshio reads, with its named physical groups.

    Raises ValueError when the file holds no cells of that dimension, several kinds of them, or a mesh of another
    dimension.
    """
    import meshio

    try:
        data = meshio.read(path)
    except (OSError, meshio.ReadError, SystemExit) as error:
        raise ValueError(f"{path} cannot be read as a mesh ({error}): give a file that meshio knows") from None
    kinds = {MESHIO[block.type] for block in data.cells if MESHIO.get(block.type) in CELLS[dim]}
    if len(kinds) != 1:
        found = ", ".join(sorted(kinds)) or "no cells of that dimension"
        raise ValueError(f"{path} holds {found} ({', '.join(block.type for block in data.cells)}): a {dim}D mesh of one "
                         "kind of cell is needed")
    if dim == 2 and np.ptp(data.points[:, 2:], axis=0).any():
        raise ValueError(f"{path} is a surface in space: a mesh in the plane z = 0 is needed")
    cell = kinds.pop()
    names = {(int(number), int(d)): name for name, (number, d) in data.field_data.items()}
    tags = data.cell_data.get("gmsh:physical", [np.zeros(len(block.data), int) for block in data.cells])
    cells, groups, surfaces, count = [], {}, {}, 0
    for block, tag in zip(data.cells, tags):
        connectivity = np.asarray(block.data, np.int64)
        if MESHIO.get(block.type) == cell:
            cells.append(_tensor_order(connectivity, cell))
        for number in np.unique(tag):
            chosen = np.flatnonzero(np.asarray(tag) == number)
            if MESHIO.get(block.type) == cell and (number, dim) in names:
                groups.setdefault(names[number, dim], []).append(chosen + count)
            elif (number, dim - 1) in names:
                surfaces.setdefault(names[number, dim - 1], []).append(connectivity[chosen])
        count += len(connectivity) if MESHIO.get(block.type) == cell else 0
    used, cells = np.unique(np.concatenate(cells), return_inverse=True)
    new_number = np.full(len(data.points), -1)
    new_number[used] = np.arange(len(used))
    return Mesh(data.points[used, :dim], cells.reshape(-1, NODES[cell]), cell,
                {name: np.concatenate(parts) for name, parts in groups.items()},
                {name: new_number[np.concatenate(parts)] for name, parts in surfaces.items()})


def _tensor_order(cells, cell):
    """From around the cell (VTK, Gmsh) to tensor order."""
    order = {"quadrilateral": [0, 1, 3, 2], "hexahedron": [0, 1, 3, 2, 4, 5, 7, 6]}.get(cell)
    return cells if order is None else cells[:, order]
