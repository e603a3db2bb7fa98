"""The only file with names of dolfinx, and with those of PETSc that differ between versions; what laws need
of UFL and the form compiler is in ``laws.compat``.

Run with dolfinx 0.5, 0.9 and 0.11, which come with petsc4py 3.18, 3.22 and 3.25; the branches between them
follow the changes of dolfinx' interface.
"""
import ctypes
from typing import NamedTuple

import dolfinx
import numpy as np
import ufl
from dolfinx import geometry
from dolfinx import mesh as dmesh
from dolfinx.cpp.graph import AdjacencyList_int32
from petsc4py import PETSc

_petsc = ctypes.CDLL(PETSc.__file__)  # petsc4py 3.18 does not wrap the functions below, the library has them
_handle, _int, _pointer = ctypes.c_void_p, np.ctypeslib.as_ctypes_type(PETSc.IntType), ctypes.c_void_p
_petsc.MatSetPreallocationCOO.argtypes = [_handle, ctypes.c_ssize_t, _pointer, _pointer]
_petsc.MatSetValuesCOO.argtypes = [_handle, _pointer, ctypes.c_int]
_petsc.SNESSetLagJacobian.argtypes = [_handle, _int]
_petsc.SNESGetLineSearch.argtypes = [_handle, ctypes.POINTER(_handle)]
_petsc.SNESLineSearchSetType.argtypes = [_handle, ctypes.c_char_p]
_petsc.SNESLineSearchSetTolerances.argtypes = [_handle, *[ctypes.c_double] * 5, _int]
_petsc.MatSolverTypeGet.argtypes = [ctypes.c_char_p, ctypes.c_char_p, ctypes.c_int, *[_pointer] * 3]
_petsc.PetscOptionsUsed.argtypes = [_handle, ctypes.c_char_p, ctypes.POINTER(ctypes.c_int)]
_INSERT = 1  # INSERT_VALUES
_FACTORS = {"lu": 1, "cholesky": 2}  # MatFactorType
_VERSION = tuple(int(number) for number in dolfinx.__version__.split(".")[:2])
_messages = [ctypes.c_double.in_dll(_petsc, f"petsc_{kind}_ct") for kind in ("send", "isend")]
_bytes = [ctypes.c_double.in_dll(_petsc, f"petsc_{kind}_len") for kind in ("send", "isend")]


def _check(code):
    if code:
        raise PETSc.Error(code)


def set_coo_pattern(A, rows, columns):
    """Give the matrix its pattern: entry k goes to (rows[k], columns[k]), none to a negative index. PETSc may
    overwrite both."""
    i, j = (np.ascontiguousarray(indices, PETSc.IntType) for indices in (rows, columns))
    _check(_petsc.MatSetPreallocationCOO(A.handle, i.size, i.ctypes.data, j.ctypes.data))


def set_coo_values(A, values):
    """Fill the matrix, values in the order of the pattern; repeated pairs add up. Collective."""
    _check(_petsc.MatSetValuesCOO(A.handle, values.ctypes.data, _INSERT))


def set_lag_jacobian(snes, lag):
    """How often the SNES itself makes the tangent anew (-1: never)."""
    _check(_petsc.SNESSetLagJacobian(snes.handle, lag))


def set_line_search(snes, kind, most=None, rtol=None):
    """Line search of the SNES: "bt", "basic", …, its largest number of iterations, and what of the slope
    along the line is small enough to end it (None: the defaults of PETSc)."""
    search = _handle()
    _check(_petsc.SNESGetLineSearch(snes.handle, ctypes.byref(search)))
    _check(_petsc.SNESLineSearchSetType(search, kind.encode()))
    if most is not None:
        default = float(PETSc.DEFAULT)
        _check(_petsc.SNESLineSearchSetTolerances(search, default, default, rtol, default, default, most))


def read_line_search_options(snes):
    """What the user's options say of the line search of the SNES."""
    search = _handle()
    _check(_petsc.SNESGetLineSearch(snes.handle, ctypes.byref(search)))
    _check(_petsc.SNESLineSearchSetFromOptions(search))


def option_used(name):
    """Whether anybody asked for the option ``name`` (with its prefix, without the dash)."""
    used = ctypes.c_int()
    _check(_petsc.PetscOptionsUsed(None, name.encode(), ctypes.byref(used)))
    return bool(used.value)


def factorises(package, kind, matrix_type="seqaij"):
    """Whether PETSc was built with the ``package`` for the factorisation ``kind``, "lu" or "cholesky"."""
    found, fits, make = ctypes.c_int(), ctypes.c_int(), _handle()
    _check(_petsc.MatSolverTypeGet(package.encode(), matrix_type.encode(), _FACTORS[kind],
                                   ctypes.byref(found), ctypes.byref(fits), ctypes.byref(make)))
    return bool(make.value)


def sent():
    """Messages and bytes that PETSc itself has sent from this rank so far (external solvers do not count)."""
    return sum(c.value for c in _messages), sum(c.value for c in _bytes)


def create_mesh(comm, cells, x, cell, owners):
    """Distributed mesh of this rank's slice of ``cells`` (global vertex numbers, shape (n, K)) and of the
    vertices ``x`` (shape (m, D)). ``owners``: for each cell of the slice the ranks that get it, the owner
    first, ghosts after. Collective."""
    offsets = np.cumsum([0] + [len(o) for o in owners]).astype(np.int32)
    data = np.fromiter((r for o in owners for r in o), np.int32, offsets[-1])

    def partitioner(*_):
        return AdjacencyList_int32(data, offsets)

    if _VERSION < (0, 7):
        domain = ufl.Mesh(ufl.VectorElement("Lagrange", cell, 1, dim=x.shape[1]))
        return dmesh.create_mesh(comm, cells, x, domain, dmesh.GhostMode.shared_facet, partitioner)
    from basix.ufl import element  # not in the basix of dolfinx 0.5

    domain = ufl.Mesh(element("Lagrange", cell, 1, shape=(x.shape[1],)))
    name = "domain" if _VERSION < (0, 8) else "e"  # by names, as from 0.10 on the domain comes before x
    return dmesh.create_mesh(comm, cells, x=x, partitioner=partitioner, **{name: domain})


class Numbering(NamedTuple):
    """Numbers of a rank's cells or nodes, the owned ones first, then the ghosts: ``owned`` of them are its
    own, which have the numbers from ``first`` on in the whole mesh; ghosts: (k,) numbers of the others there;
    owners: (k,) their ranks."""

    owned: int
    first: int
    ghosts: np.ndarray
    owners: np.ndarray

    @property
    def in_whole(self):
        """Numbers in the whole mesh of all cells or nodes, shape (owned + k,)."""
        return np.concatenate([np.arange(self.first, self.first + self.owned), self.ghosts])


def _numbering(index_map):
    return Numbering(index_map.size_local, index_map.local_range[0], np.asarray(index_map.ghosts),
                     np.asarray(index_map.owners))


def cell_numbering(mesh):
    """``Numbering`` of the cells."""
    return _numbering(mesh.topology.index_map(mesh.topology.dim))


def node_numbering(mesh):
    """``Numbering`` of the nodes."""
    return _numbering(mesh.geometry.index_map())


def node_positions(mesh):
    """Positions of owned and ghost nodes [m], shape (n, D)."""
    return np.ascontiguousarray(mesh.geometry.x[:, :mesh.geometry.dim])


def nodes_of_cells(mesh, nodes_per_cell):
    """Node numbers of owned and ghost cells, shape (n, nodes_per_cell)."""
    if _VERSION >= (0, 11):
        dofmap = mesh.geometry.dofmaps[0]
    else:
        dofmap = mesh.geometry.dofmap
    return np.asarray(getattr(dofmap, "array", dofmap), np.int32).reshape(-1, nodes_per_cell)


def original_cells(mesh):
    """Numbers of owned and ghost cells among those that the mesh was made of, shape (n,)."""
    return np.asarray(mesh.topology.original_cell_index)


def cells_behind_facets(mesh, cell_count):
    """Cell behind each facet of owned and ghost cells, shape (cells, facets); -1: none on this rank."""
    topology, dim = mesh.topology, mesh.topology.dim
    topology.create_connectivity(dim, dim - 1)
    topology.create_connectivity(dim - 1, dim)
    facets = topology.connectivity(dim, dim - 1)
    cells = topology.connectivity(dim - 1, dim)
    of_cell = facets.array.reshape(cell_count, -1) if cell_count else np.zeros((0, dim + 1), np.int32)
    first, count = cells.offsets[:-1], np.diff(cells.offsets)
    pair = np.full((len(count), 2), -1, np.int32)
    pair[:, 0] = cells.array[first]
    two = count == 2
    pair[two, 1] = cells.array[first[two] + 1]
    one, other = pair[of_cell].transpose(2, 0, 1)
    return np.where(one == np.arange(cell_count)[:, None], other, one).astype(np.int32)


def cell_tree(mesh, cells, padding):
    """Bounding-box tree over the local ``cells`` of the mesh, with boxes larger by ``padding`` [m]."""
    make = geometry.BoundingBoxTree if _VERSION < (0, 7) else geometry.bb_tree
    return make(mesh, mesh.topology.dim, entities=np.asarray(cells, np.int32), padding=padding)


def candidates(tree, x):
    """Pairs (point, cell) whose boxes meet, two arrays; x: points [m], shape (n, D)."""
    collide = geometry.compute_collisions if _VERSION < (0, 7) else geometry.compute_collisions_points
    found = collide(tree, np.column_stack([x, np.zeros((len(x), 3 - x.shape[1]))]))
    return np.repeat(np.arange(len(x)), np.diff(found.offsets)), found.array


def is_mesh(thing):
    """Whether it is a mesh of dolfinx."""
    return isinstance(thing, dmesh.Mesh)


def kinds_of_cells(mesh):
    """Names of the kinds of cells that the mesh has, and the degree of their geometry."""
    topology, geometry_ = mesh.topology, mesh.geometry
    kinds = topology.entity_types[topology.dim] if hasattr(topology, "entity_types") else [topology.cell_type]
    map_ = geometry_.cmaps[0] if _VERSION >= (0, 11) else geometry_.cmap
    return [kind.name for kind in kinds], map_.degree


def original_nodes(mesh):
    """Numbers of owned and ghost nodes among those that the mesh was made of, shape (n,)."""
    return np.asarray(mesh.geometry.input_global_indices)


def cells_at_facets(mesh, facets, per_cell):
    """A cell of this rank at each of the ``facets``, of which a cell has ``per_cell``, and the place of the
    facet in it, shape (n,) each."""
    topology, dim = mesh.topology, mesh.topology.dim
    topology.create_connectivity(dim, dim - 1)
    topology.create_connectivity(dim - 1, dim)
    cells = topology.connectivity(dim - 1, dim)
    cell = cells.array[cells.offsets[facets]]
    of_cell = topology.connectivity(dim, dim - 1).array.reshape(-1, per_cell)[cell]
    return cell, np.argmax(of_cell == facets[:, None], axis=1)


def entities_owned(mesh, dim):
    """Number of the entities of that dimension that this rank owns: the first of them. Collective."""
    mesh.topology.create_entities(dim)
    return mesh.topology.index_map(dim).size_local


def linear_space(mesh, shape):
    """Space of continuous linear (P1, Q1) functions with values of the ``shape``, () or (D,). Collective."""
    from dolfinx import fem  # brings the form compiler, which few runs need

    if _VERSION < (0, 7):
        make = fem.VectorFunctionSpace if shape else fem.FunctionSpace
        return make(mesh, ("Lagrange", 1), *shape)
    return fem.functionspace(mesh, ("Lagrange", 1, shape) if shape else ("Lagrange", 1))


def function_of(space, name, nodes, values):
    """``dolfinx.fem.Function`` of a linear space with ``values`` at the nodes, shape (n, …), of which those
    of owned nodes count; nodes: of the cells, shape (m, K). Collective."""
    from dolfinx import fem

    function = fem.Function(space, name=name)
    dofs = space.dofmap.list
    dofs = np.asarray(getattr(dofs, "array", dofs)).reshape(nodes.shape)
    function.x.array.reshape(-1, *values.shape[1:])[dofs] = values[nodes]
    function.x.scatter_forward()
    return function
