"""Meshes and points from files that meshio reads: Gmsh, VTK, Abaqus and others."""
import contextlib
import io
import sys
from pathlib import Path
from typing import Any, Dict, Iterator, List, Optional, Tuple, Union

import numpy as np

import mpm_dem_checks as check

from .bodies import Cloud
from .gmsh import Groups, read_groups
from .mesh import CELLS, NODES, Mesh

MESHIO = {"quad": "quadrilateral", "triangle": "triangle", "hexahedron": "hexahedron", "tetra": "tetrahedron"}
FACET = {"quadrilateral": "line", "triangle": "line", "hexahedron": "quad", "tetrahedron": "triangle"}
# from around the cell (VTK, Gmsh)
TENSOR = {"quadrilateral": [0, 1, 3, 2], "hexahedron": [0, 1, 3, 2, 4, 5, 7, 6]}


def read_mesh(path: Union[str, Path], dim: int) -> Mesh:
    """Mesh of ``dim`` dimensions from a file, with its named physical groups: those of cells become
    ``groups`` (see ``Mesh.part``), those of facets ``surfaces`` (see ``Mesh.on_surface`` and
    ``Interface.of_mesh``).

    Raises ValueError for a file that cannot be read, holds no cells of that dimension, several kinds of them,
    or a mesh of another dimension, and for what ``Mesh`` refuses.

    >>> import meshio, tempfile
    >>> file = Path(tempfile.mkdtemp()) / "one_triangle.vtk"
    >>> x = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)]
    >>> meshio.write_points_cells(file, x, [("triangle", [(0, 1, 2)])])
    >>> read_mesh(file, dim=2).box
    Box(lower=(0.0, 0.0), upper=(1.0, 1.0))
    """
    check.choice("dim", dim, tuple(CELLS))
    data, path = _read(path)
    cell = _kind(data, path, dim)
    for block in (block for block in data.cells if block.type in (*MESHIO, *FACET.values())):
        check.indices(f"{block.type} cells of {path}", block.data, len(data.points), (block.data.shape[-1],),
                      "points")
    blocks = [b for b, block in enumerate(data.cells) if MESHIO.get(block.type) == cell]
    first = dict(zip(blocks, np.cumsum([0, *(len(data.cells[b].data) for b in blocks)])))
    cells = np.concatenate([np.asarray(data.cells[b].data, np.int64) for b in blocks])
    named = read_groups(path)
    cells, place = _once(cells) if named is not None and named.entities is None else (cells,
                                                                                      np.arange(len(cells)))
    used, cells = np.unique(cells[:, TENSOR.get(cell, range(NODES[cell]))], return_inverse=True)
    number = np.full(len(data.points), -1)
    number[used] = np.arange(len(used))
    groups: Dict[str, List[np.ndarray]] = {}
    facets_of: Dict[str, List[np.ndarray]] = {}
    for name, b, chosen in _named(data, named):
        if b in first:
            groups.setdefault(name, []).append(place[chosen + first[b]])
        elif data.cells[b].type == FACET[cell]:
            facets_of.setdefault(name, []).append(number[np.asarray(data.cells[b].data, np.int64)[chosen]])
    surfaces = {name: np.concatenate(facets) for name, facets in facets_of.items()}
    for name, facets in surfaces.items():
        if facets.min() < 0:
            raise ValueError(f"the surface {name!r} of {path} has vertices that belong to no cell: give "
                             "cells to them, or leave it out")
    return Mesh(data.points[used, :dim], cells.reshape(-1, NODES[cell]), cell,
                {name: np.concatenate(lots) for name, lots in groups.items()}, surfaces)


def read_cloud(path: Union[str, Path], dim: int) -> Cloud:
    """Material points from a file: its points, and their point data "volume" [m^3]. Raises ValueError when
    the file cannot be read or has no volumes, and for what ``Cloud`` refuses.

    >>> import meshio, tempfile
    >>> file, x = Path(tempfile.mkdtemp()) / "two_points.vtk", [(0.0, 0.0, 0.0), (0.1, 0.0, 0.0)]
    >>> meshio.write_points_cells(file, x, [("vertex", [(0,), (1,)])], point_data={"volume": [0.01, 0.02]})
    >>> read_cloud(file, dim=2).volume
    array([0.01, 0.02])
    """
    check.choice("dim", dim, tuple(CELLS))
    data, path = _read(path)
    if "volume" not in data.point_data:
        raise ValueError(
            f"{path} has no point data \"volume\" but {', '.join(sorted(data.point_data)) or 'none'}: add "
            "the volume of each point in m^3")
    _check_plane(data.points, path, dim)
    return Cloud(data.points[:, :dim], np.ravel(data.point_data["volume"]))


def read_triangles(path: Union[str, Path]) -> Tuple[np.ndarray, np.ndarray]:
    """Vertices [m], shape (n, 3), and triangles, shape (m, 3), of a file, as STL, OBJ or PLY; quadrilaterals
    are divided. ValueError for a file that has none."""
    data, path = _read(path)
    found = [np.asarray(block.data) for block in data.cells if block.type == "triangle"]
    for quads in (np.asarray(block.data) for block in data.cells if block.type == "quad"):
        found += [quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]
    if not found:
        kinds = sorted({block.type for block in data.cells})
        raise ValueError(f"{path} holds {', '.join(kinds) or 'no cells'}: give a surface of triangles")
    return np.asarray(data.points, float), np.concatenate(found).astype(np.int64)


def _read(given: Union[str, Path]) -> Tuple[Any, Path]:
    import meshio  # slow to import, and few scenes read files

    path = check.file("path of the mesh", given)
    said = io.StringIO()  # of its readers, which print what is wrong, and leave Python without a reason
    try:
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            data = meshio.read(path)
    except (Exception, SystemExit) as error:  # meshio's readers fail in many ways, some by leaving Python
        if "gmsh:physical" in str(error):
            raise ValueError(f"in {path} some elements belong to a physical group and others to none, which "
                             "meshio cannot read: let Gmsh save the elements of groups alone "
                             "(Mesh.SaveAll = 0)") from None
        raise ValueError(f"{path} cannot be read as a mesh ({_reason(error, said.getvalue())}): give a file "
                         "that meshio knows") from None
    print(said.getvalue(), end="", file=sys.stderr)
    return data, path


def _reason(error: BaseException, said: str) -> str:
    """Why a reader of meshio failed with the ``error``, after it had printed the text ``said``."""
    if not isinstance(error, SystemExit):
        return f"{type(error).__name__}: {error}"
    lines = [line for line in said.splitlines() if line.strip()
             and not line.startswith("Error: Couldn't read")]
    return check.shown(lines[0], plain=True) if lines else "it is not of the format that its ending says"


def _kind(data: Any, path: Path, dim: int) -> str:
    """The only kind of cell of that dimension."""
    found = sorted({block.type for block in data.cells if len(block.data)})
    kinds = sorted({block.type for block in data.cells if block.dim == dim and len(block.data)})
    higher = sorted({block.type for block in data.cells if block.dim > dim and len(block.data)})
    if higher or not kinds:
        raise ValueError(f"{path} holds {', '.join(higher or found) or 'no cells'}: for a {dim}D scene give "
                         f"a {dim}D mesh")
    if len(kinds) > 1 or MESHIO.get(kinds[0]) not in CELLS[dim]:
        known = " or ".join(name for name, cell in MESHIO.items() if cell in CELLS[dim])
        raise ValueError(
            f"{path} holds cells of kind {', '.join(kinds)}: a {dim}D mesh has one kind, {known}")
    _check_plane(data.points, path, dim)
    return MESHIO[kinds[0]]


def _check_plane(points: np.ndarray, path: Path, dim: int) -> None:
    if points.shape[1] < dim:
        raise ValueError(f"the points of {path} have {points.shape[1]} coordinates: for a {dim}D scene give "
                         f"{dim}")
    if len(points) and np.ptp(points[:, dim:], axis=0).any():
        raise ValueError(f"{path} is not plane, z goes from {points[:, 2].min()} to {points[:, 2].max()} m: "
                         "for a 2D scene give points with one z")


def _once(cells: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Cells, shape (m, K), each once: a Gmsh file of version 2 repeats an element for each of its physical
    groups. Returns also the place of each given cell among them, shape (m,)."""
    _, first, inverse = np.unique(np.sort(cells, axis=1), axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    place = np.empty(len(order), int)
    place[order] = np.arange(len(order))
    return cells[first[order]], place[inverse]


def _named(data: Any, groups: Optional[Groups]) -> Iterator[Tuple[str, int, np.ndarray]]:
    """(name, block, numbers in the block) of every named group; groups: of a Gmsh file, else None."""
    if groups is None and "gmsh:physical" not in data.cell_data:
        for name, sets in data.cell_sets.items():
            yield from ((name, b, np.asarray(chosen, int)) for b, chosen in enumerate(sets)
                        if chosen is not None and len(chosen))
        return
    if groups is None:  # Gmsh's tags in another format
        groups = Groups({(int(dim), int(number)): name for name, (number, dim) in data.field_data.items()},
                        None)
    kind = "gmsh:physical" if groups.entities is None else "gmsh:geometrical"
    for b, (block, tags) in enumerate(zip(data.cells, data.cell_data.get(kind, ()))):
        for tag in np.unique(tags).tolist():
            numbers = [abs(tag)] if groups.entities is None else groups.entities.get((block.dim, tag), ())
            for name in (groups.names[block.dim, n] for n in numbers if (block.dim, n) in groups.names):
                yield name, b, np.flatnonzero(tags == tag)
