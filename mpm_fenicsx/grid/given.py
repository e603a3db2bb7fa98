"""Meshes of dolfinx, with their tags, as those of a scene."""
from typing import Any, Callable, Dict, Optional, Tuple

import basix
import numpy as np

import mpm_dem_checks as check

from ..scene.mesh import NODES, Mesh
from . import compat


def from_dolfinx(domain: Any, cell_tags: Any = None, facet_tags: Any = None,
                 names: Optional[Dict[str, Tuple[int, int]]] = None) -> Mesh:
    """The ``dolfinx.mesh.Mesh`` as a ``Mesh``: a background grid, or the body cells of a body.

    The values of ``cell_tags`` (MeshTags) become ``groups`` (see ``Mesh.part``), those of ``facet_tags``
    ``surfaces`` (see ``Mesh.on_surface`` and ``Interface.of_mesh``), named by their value as text. names:
    name → (dimension, value), as in ``physical_groups`` of dolfinx's reader of Gmsh, gives others.

    Vertices and cells have the order in which the mesh was made, where it has kept that. The whole mesh comes
    to every rank: one exchange, and about 100 bytes per cell in the plane and 200 in space. The MPM then
    distributes it anew, by the points. Collective over the ranks of the mesh. Raises ValueError for meshes of
    curved or several kinds of cells, surfaces that are not plane, and names of tags that nothing has.

    >>> from dolfinx.mesh import create_unit_square, meshtags
    >>> from mpi4py import MPI
    >>> square = create_unit_square(MPI.COMM_WORLD, 2, 2)  # of 8 triangles
    >>> halves = meshtags(square, 2, np.arange(8, dtype=np.int32), np.repeat(np.int32([1, 5]), 4))
    >>> mesh = from_dolfinx(square, halves, names={"soil": (2, 5)})
    >>> mesh.box, sorted(mesh.groups), len(mesh.part("soil").cells)
    (Box(lower=(0.0, 0.0), upper=(1.0, 1.0)), ['1', 'soil'], 4)
    """
    if not compat.is_mesh(domain):
        raise ValueError(f"the mesh is {check.shown(domain)}: give a dolfinx.mesh.Mesh")
    cell, comm, dim = _kind(domain), domain.comm, domain.topology.dim
    nodes, numbering = compat.nodes_of_cells(domain, NODES[cell]), compat.node_numbering(domain)
    of_cells = compat.cell_numbering(domain)
    x = _gather(comm, compat.node_positions(domain)[:numbering.owned])
    place = _places(_gather(comm, compat.original_nodes(domain)[:numbering.owned]))
    row = _places(_gather(comm, _original(domain, of_cells.owned)))
    whole = place[numbering.in_whole]  # number in the whole mesh of each node here
    vertices, cells = np.empty_like(x), np.empty((len(row), NODES[cell]), np.int64)
    vertices[place], cells[row] = x, _gather(comm, whole[nodes[:of_cells.owned]])
    groups = _named(domain, dim, cell_tags, names, lambda own: row[of_cells.first + own])
    surfaces = _named(domain, dim - 1, facet_tags, names,
                      lambda own: whole[_facets(domain, cell, nodes, own)])
    return Mesh(_plane(vertices, dim), cells, cell, groups, surfaces)


def as_grid(grid: Any) -> Any:
    """A mesh of dolfinx as a ``Mesh``; what is none as it is."""
    return from_dolfinx(grid) if compat.is_mesh(grid) else grid


def _kind(domain: Any) -> str:
    """The only kind of its cells."""
    kinds, degree = compat.kinds_of_cells(domain)
    if len(kinds) > 1 or kinds[0] not in NODES or degree > 1:
        raise ValueError(f"the mesh of dolfinx has cells of kind {', '.join(kinds)} and degree {degree}: "
                         f"give one with cells of one kind, {' or '.join(NODES)}, and of degree 1")
    return kinds[0]


def _gather(comm: Any, values: np.ndarray) -> np.ndarray:
    """Those of all ranks, one rank after the other, on every rank."""
    return np.concatenate(comm.allgather(values)) if comm.size > 1 else values


def _original(domain: Any, owned: int) -> np.ndarray:
    """Numbers that this rank's own cells were made with, -1 where they are not known, as in parts of
    meshes."""
    found = compat.original_cells(domain)[:owned]
    return found if len(found) == owned else np.full(owned, -1)


def _places(numbers: np.ndarray) -> np.ndarray:
    """Places (n,) that put ``numbers`` in order; their own where a number is there twice."""
    order, place = np.argsort(numbers, kind="stable"), np.arange(len(numbers))
    if (np.diff(numbers[order]) > 0).all():
        place[order] = np.arange(len(numbers))
    return place


def _plane(vertices: np.ndarray, dim: int) -> np.ndarray:
    if np.ptp(vertices[:, dim:], axis=0).any():
        z = vertices[:, 2]
        raise ValueError(f"the mesh of dolfinx is not plane, z goes from {z.min()} to {z.max()} m: for a 2D "
                         "scene give vertices with one z")
    return np.ascontiguousarray(vertices[:, :dim], float)


def _named(domain: Any, dim: int, tags: Any, names: Optional[Dict[str, Tuple[int, int]]],
           numbers: Callable[[np.ndarray], np.ndarray]) -> Dict[str, np.ndarray]:
    """What the ``tags`` of that dimension name, name → ``numbers`` of this rank's own entities, of all
    ranks."""
    what = "cell_tags" if dim == domain.topology.dim else "facet_tags"
    if tags is None:
        return {}
    if getattr(tags, "dim", None) != dim:
        raise ValueError(f"{what} is {check.shown(tags)}: give MeshTags of dimension {dim}")
    indices, values = np.asarray(tags.indices), np.asarray(tags.values)
    own = indices < compat.entities_owned(domain, dim)
    values, found = (_gather(domain.comm, part) for part in (values[own], numbers(indices[own])))
    known = {int(value): str(value) for value in np.unique(values)}
    for name, (of, value) in (names or {}).items():
        if of == dim and value not in known:
            raise ValueError(f"name {name!r} stands for the value {value} in {what}; they have "
                             f"{', '.join(map(str, known)) or 'none'}: look at the value")
        if of == dim:
            known[value] = name
    return {name: found[values == value] for value, name in known.items()}


def _facets(domain: Any, cell: str, nodes: np.ndarray, facets: np.ndarray) -> np.ndarray:
    """Nodes of this rank's ``facets``, shape (n, nodes per facet)."""
    corners = np.array(basix.topology(getattr(basix.CellType, cell))[-2])
    cells, place = compat.cells_at_facets(domain, facets, len(corners))
    return nodes[cells[:, None], corners[place]]
