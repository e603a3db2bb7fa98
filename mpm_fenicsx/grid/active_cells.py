"""The part of the grid that the points need: filled cells and one spare layer, with nodes numbered on their
own.

Cost follows these active cells, not the grid. Nodes without mass inside it are identity rows, so that matrix
and pattern stay while points move from cell to cell; they are found anew when a point leaves them.
"""
import numpy as np
from petsc4py import PETSc

from .elements import PointElements, around, cell_elements, reach, stencil_elements
from .entries import Group
from .matrix import CellMatrix
from .pairs import find_pairs


def ghosted_vector(numbering, comm):
    """New vector with one value for each cell or node of a ``compat.Numbering``, those of ghosts from the
    ranks that own them. Collective."""
    size = numbering.owned, PETSc.DETERMINE
    return PETSc.Vec().createGhost(numbering.ghosts.astype(PETSc.IntType), size, comm=comm)


class ActiveCells:
    """Numbering, vectors and matrix of the active cells.

    cells: (all local cells, K) nodes in their local numbering (owned first, then ghosts), -1 outside; row:
    (all local cells,) row of an owned cell among the elements of the matrix, -1 else; point_row: the same for
    cells that points may be in; active: (all local cells,) mask of these; node: (n,) the grid node behind
    each local number; places: (n, D) of these [m]; fixed: (n, D) mask of supported directions. Cells with
    walls that share a node with those for points have a row too, as that node may come to carry mass.

    elements: ``PointElements`` of the material points; nodes_of_patch: (patches, M) nodes of F-bar's patches,
    -1 where one has fewer; own_patches: the first so many are this rank's.

    matrix: that of PETSc; rows: ``entries.Rows``, to which the points add with the linear basis, patches
    being cells. Kept for it [N/m], None where there are none, are: node_rows, to which points add with a
    smooth basis, shape (n, 5^D, D, D): nodes around each one, direction of the force on it, direction of
    their displacement; patch_matrices, shape (patches, M, D, D, M), derivative by (node, direction) of
    (direction, node); facet_matrices, for ghost inertia, shape (facets, D, M, M), by direction, node and
    node, their nodes_of_facets (facets, M); pair_matrices of ``pairs``, see there, shape (pairs, 2K, D, D,
    2K). Collective.
    """

    def __init__(self, background, filled, fixed, symmetric=True, averaged=False, facets=None, walls=None,
                 meeting=()):
        """filled: numbers of this rank's cells that hold points; fixed: (grid nodes, D) mask; symmetric: so
        is the matrix; averaged: whether a body needs the patches; facets: None, or ``ghost.Facets`` that need
        matrices; walls: None on all ranks where there are no springs, else a mask of the local cells that may
        hold particles of walls; meeting: pairs of fields between which something acts."""
        self.comm, self.dim, self.origin = background.comm, background.dim, background.origin
        self._vectors, self._symmetric = {}, symmetric
        grid_vec = ghosted_vector(background.node_numbering, self.comm)
        # nodes of filled cells, on any rank
        near = self._flags(grid_vec, background.cells[filled])
        self.active = near[background.cells].any(axis=1)
        chosen = np.flatnonzero(self.active[:background.cells_owned]).astype(np.int32)
        reached, rows_of_points = reach(background, chosen), len(chosen)
        needed = self._flags(grid_vec, reached)
        if walls is not None:
            rim = walls & ~self.active & needed[background.cells].any(axis=1)
            chosen = np.append(chosen, np.flatnonzero(rim[:background.cells_owned]).astype(np.int32))
            reached = np.append(reached, background.cells[chosen])
            needed = self._flags(grid_vec, reached)
        beside = np.zeros((0, 1), np.int32) if facets is None else facets.nodes[facets.within(self.active)]
        local_of = self._number(background, grid_vec, needed, np.append(reached, beside))
        grid_vec.destroy()
        self.cells = np.full_like(background.cells, -1)
        self.cells[chosen], self.nodes_of_facets = local_of[background.cells[chosen]], local_of[beside]
        self.row = np.full(len(background.cells), -1, np.int32)
        self.row[chosen] = np.arange(len(chosen))
        self.point_row = np.where(self.row < rows_of_points, self.row, -1).astype(np.int32)
        self.fixed = fixed[self.node]
        self._make_elements(background, chosen, averaged)
        self.pairs = find_pairs(background, meeting, self.cells, self.point_row) if meeting else None
        self._make_matrix(background, chosen, walls is not None)

    def _flags(self, vec, nodes):
        """Mask of the grid nodes, owned and ghost, that are among the ``nodes`` of any rank."""
        with vec.localForm() as local:
            local.set(0.0)
            local.array_w[np.unique(nodes)] = 1.0
        self._sum_ghosts(vec)
        with vec.localForm() as local:
            return local.array_r > 0.0

    def _sum_ghosts(self, vec):
        vec.ghostUpdate(PETSc.InsertMode.ADD, PETSc.ScatterMode.REVERSE)
        vec.ghostUpdate(PETSc.InsertMode.INSERT, PETSc.ScatterMode.FORWARD)

    def _number(self, background, vec, needed, nodes):
        """Number the ``needed`` grid nodes, a mask, of which this rank wants its own and ``nodes``. Returns
        the local number of each grid node, -1 where it has none."""
        own = np.flatnonzero(needed[:background.nodes_owned])
        first = self.comm.scan(len(own)) - len(own)
        with vec.localForm() as local:
            local.set(-1.0)
            local.array_w[own] = first + np.arange(len(own))
        vec.ghostUpdate(PETSc.InsertMode.INSERT, PETSc.ScatterMode.FORWARD)
        with vec.localForm() as local:
            number = local.array_r.astype(PETSc.IntType)
        mine = np.unique(nodes)
        ghosts = mine[mine >= background.nodes_owned]
        self.owned = len(own)
        self.node = np.concatenate([own, ghosts]).astype(np.int32)
        self.places = background.x[self.node]
        self.number = number[self.node]  # across ranks
        local_of = np.full(len(background.x), -1, np.int32)
        local_of[self.node] = np.arange(len(self.node))
        return local_of

    def vector(self, block):
        """New ghosted vector with ``block`` values per node."""
        return PETSc.Vec().createGhost(self.number[self.owned:], (self.owned * block, PETSc.DETERMINE),
                                       bsize=block, comm=self.comm)

    def accumulate(self, values):
        """Add up, in place, what all ranks have at shared nodes; values: (local nodes, block)."""
        if self.comm.size > 1:
            vec = self._exchange(values.shape[1])
            with vec.localForm() as local:
                local.array_w[:] = values.ravel()
            self._sum_ghosts(vec)
            with vec.localForm() as local:
                values[:] = local.array_r.reshape(values.shape)

    def largest(self, values):
        """Take, in place, the largest of what all ranks have at shared nodes; values: (local nodes,
        block)."""
        if self.comm.size > 1:
            vec = self._exchange(values.shape[1])
            with vec.localForm() as local:
                local.array_w[:] = values.ravel()
            vec.ghostUpdate(PETSc.InsertMode.MAX_VALUES, PETSc.ScatterMode.REVERSE)
            vec.ghostUpdate(PETSc.InsertMode.INSERT, PETSc.ScatterMode.FORWARD)
            with vec.localForm() as local:
                values[:] = local.array_r.reshape(values.shape)

    def with_ghosts(self, owned):
        """Values at all local nodes from those at the owned ones, shape (owned, block)."""
        if self.comm.size == 1:
            return owned
        vec = self._exchange(owned.shape[1])
        vec.array_w[:] = owned.ravel()
        vec.ghostUpdate(PETSc.InsertMode.INSERT, PETSc.ScatterMode.FORWARD)
        with vec.localForm() as local:
            return local.array_r.reshape(-1, owned.shape[1]).copy()

    def _exchange(self, block):
        if block not in self._vectors:
            self._vectors[block] = self.vector(block)
        return self._vectors[block]

    def _around(self, background, width):
        """Active nodes around each of a regular grid, see ``elements.around``."""
        return around(np.asarray(background.grid.cells) + 1, background.vertex_of[self.node], width)

    def _make_elements(self, background, chosen, averaged):
        cells, row = self.cells, self.row
        self._shared_patches = background.basis.smooth
        if self._shared_patches:
            self.elements, self.nodes_of_patch = stencil_elements(self._around(background, 3))
        elif averaged:
            self.elements, self.nodes_of_patch = cell_elements(background, cells, row, chosen, len(self.node))
        else:
            self.elements, self.nodes_of_patch = PointElements(cells, row, row, np.zeros(
                (0, cells.shape[1]), np.int32)), cells[chosen]
        self.own_patches = self.owned if self._shared_patches else len(self.nodes_of_patch)

    def _make_matrix(self, background, chosen, springs):
        smooth, facets = background.basis.smooth, self.nodes_of_facets
        cells = self.cells[chosen if springs or not smooth else chosen[:0]]
        own_patches = not smooth and self.elements.patch is not self.row
        groups = [Group(cells, cells), Group(facets, facets, thin=True)]
        if smooth:
            around = self._around(background, 5)
            groups.append(Group(np.arange(len(around))[:, None], around))
        if own_patches:
            groups.append(Group(self.nodes_of_patch, self.nodes_of_patch))
        if self.pairs:
            groups.append(Group(self.pairs.nodes, self.pairs.nodes))
        self._sums = sums = CellMatrix(self.comm, self.number, self.owned, self.fixed, self._symmetric,
                                       groups)
        self.matrix, self.rows = sums.petsc, sums.rows
        self.facet_matrices = sums.keep_thin(facets)
        self.node_rows = sums.keep_stencils(around) if smooth else None
        self.patch_matrices = sums.keep_elements(self.nodes_of_patch) if own_patches else None
        self.pair_matrices = sums.keep_elements(self.pairs.nodes) if self.pairs else None
        sums.complete()

    def share(self, *sums):
        """Add up, in place, sums over the patches, shape (patches, …) each, that points of several ranks
        share."""
        if self._shared_patches and self.comm.size > 1:
            for values in sums:
                whole = values.reshape(len(values), int(np.prod(values.shape[1:]))).copy()
                self.accumulate(whole)
                values[:] = whole.reshape(values.shape)

    def add_in_cells(self, cells, add):
        """Add to the matrix what ``add(row, matrices)`` adds to element matrices of the linear basis in
        ``cells``; row: of a cell among the matrices."""
        self._sums.add_to_some(cells, self.cells, self.row, add)

    def add_for_points(self, elements, add):
        """The same for ``elements`` of material points; with a smooth basis to ``node_rows``."""
        if self.node_rows is None:
            self.add_in_cells(elements, add)
        else:
            add(self.elements.row, self.node_rows)

    def clear(self):
        """Set the matrix to zero, and those that are kept for it. Not collective."""
        self._sums.clear()

    def fill_matrix(self, diagonal):
        """Add the matrices that are kept, and ``diagonal``, shape (owned, D), and PETSc has the matrix."""
        self._sums.finish(diagonal)

    def get_values(self):
        """Copy of the values in this rank's rows of the matrix, row by row."""
        return self._sums.get_values()

    def set_values(self, values):
        """Matrix from ``values`` of ``get_values``. Collective."""
        self._sums.set_values(values)

    def set_entries(self, start, columns, values):
        """Matrix from entries of this rank's rows, see ``matrix``. Collective."""
        return self._sums.set_entries(start, columns, values)

    def destroy(self):
        """Free matrix and vectors."""
        for held in (self.matrix, *self._vectors.values()):
            held.destroy()
