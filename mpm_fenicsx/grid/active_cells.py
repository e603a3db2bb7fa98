"""The part of the grid that the points need: filled cells and one spare layer, with nodes numbered on their
own.

Cost follows these active cells, not the grid. Nodes without mass inside it are identity rows, so that matrix
and pattern stay while points move from cell to cell; they are found anew when a point leaves them.
"""
import numpy as np
from petsc4py import PETSc

from . import compat


def ghosted_vector(numbering, comm):
    """New vector with one value for each cell or node of a ``compat.Numbering``, those of ghosts from the
    ranks that own them. Collective."""
    size = numbering.owned, PETSc.DETERMINE
    return PETSc.Vec().createGhost(numbering.ghosts.astype(PETSc.IntType), size, comm=comm)


class ActiveCells:
    """Numbering, vectors and matrix of the active cells.

    cells: (all local cells, K) nodes in their local numbering (owned first, then ghosts), -1 outside; row:
    (all local cells,) row of an owned cell in the element matrices, -1 else; point_row: the same for cells
    that points may be in; active: (all local cells,) mask of these; node: (n,) the grid node behind each
    local number; fixed: (n, D) mask of supported directions; element_matrices: (rows, K, D, D, K) [N/m],
    derivative by (node, direction) of (direction, node). Cells with walls that share a node with those for
    points have a row too, as that node may come to carry mass.

    For F-bar: patch: (all local cells,) row of an owned active cell's patch in patch_matrices, shape
    (patches, M, D, D, M), and in nodes_of_patch, shape (patches, M), -1 where it has fewer; place: (all local
    cells, K) places of its nodes among these. A quadrilateral or a hexahedron is its own patch, and these
    matrices are the element matrices. For ghost inertia: nodes_of_facets (facets, M) and facet_matrices,
    shape (facets, D, M, M), by direction, node and node. Collective.
    """

    def __init__(self, background, filled, fixed, symmetric=True, averaged=False, facets=None, walls=None):
        """filled: numbers of this rank's cells that hold points; fixed: (grid nodes, D) mask; symmetric: so
        is the matrix; averaged: whether a body needs the patches; facets: None, or ``ghost.Facets`` that need
        matrices; walls: None on all ranks, or a mask of the local cells that may hold particles of walls."""
        self.comm, self.dim = background.comm, background.dim
        self._vectors, self._symmetric = {}, symmetric
        grid_vec = ghosted_vector(background.node_numbering, self.comm)
        # nodes of filled cells, on any rank
        near = self._flags(grid_vec, background, background.cells[filled])
        self.active = near[background.cells].any(axis=1)
        chosen = np.flatnonzero(self.active[:background.cells_owned]).astype(np.int32)
        needed, rows_of_points = self._flags(grid_vec, background, background.cells[chosen]), len(chosen)
        if walls is not None:
            rim = walls & ~self.active & needed[background.cells].any(axis=1)
            chosen = np.append(chosen, np.flatnonzero(rim[:background.cells_owned]).astype(np.int32))
            needed = self._flags(grid_vec, background, background.cells[chosen])
        beside = np.zeros((0, 1), np.int32) if facets is None else facets.nodes[facets.within(self.active)]
        self._number(background, grid_vec, needed, chosen, beside)
        grid_vec.destroy()
        self.row = np.full(len(background.cells), -1, np.int32)
        self.row[chosen] = np.arange(len(chosen))
        self.point_row = np.where(self.row < rows_of_points, self.row, -1).astype(np.int32)
        self.fixed = fixed[self.node]
        self._make_patches(background, chosen, averaged)
        self._make_matrix(chosen)

    def _flags(self, vec, background, cells):
        """Grid nodes, owned and ghost, that belong to one of ``cells`` on any rank."""
        with vec.localForm() as local:
            local.set(0.0)
            local.array_w[np.unique(cells)] = 1.0
        self._sum_ghosts(vec)
        with vec.localForm() as local:
            return local.array_r > 0.0

    def _sum_ghosts(self, vec):
        vec.ghostUpdate(PETSc.InsertMode.ADD, PETSc.ScatterMode.REVERSE)
        vec.ghostUpdate(PETSc.InsertMode.INSERT, PETSc.ScatterMode.FORWARD)

    def _number(self, background, vec, needed, chosen, beside):
        own = np.flatnonzero(needed[:background.nodes_owned])
        first = self.comm.scan(len(own)) - len(own)
        with vec.localForm() as local:
            local.set(-1.0)
            local.array_w[own] = first + np.arange(len(own))
        vec.ghostUpdate(PETSc.InsertMode.INSERT, PETSc.ScatterMode.FORWARD)
        with vec.localForm() as local:
            number = local.array_r.astype(PETSc.IntType)
        mine = np.unique(np.append(background.cells[chosen], beside))
        ghosts = mine[mine >= background.nodes_owned]
        self.owned = len(own)
        self.node = np.concatenate([own, ghosts]).astype(np.int32)
        self.number = number[self.node]  # across ranks
        local_of = np.full(len(background.x), -1, np.int32)
        local_of[self.node] = np.arange(len(self.node))
        self.cells = np.full_like(background.cells, -1)
        self.cells[chosen] = local_of[background.cells[chosen]]
        self.nodes_of_facets = local_of[beside]

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

    def _make_patches(self, background, chosen, averaged):
        K = self.cells.shape[1]
        self.patch, self.place = self.row, np.zeros((0, K), np.int32)
        self.nodes_of_patch = self.cells[chosen]
        if not averaged:
            return
        self.place = np.tile(np.arange(K, dtype=np.int32), (len(self.cells), 1))
        if background.patch is None:
            return
        numbers, row = np.unique(background.patch[background.original_cell[chosen]], return_inverse=True)
        pairs, pair = np.unique(row[:, None] * len(self.node) + self.cells[chosen], return_inverse=True)
        row_of, node = np.divmod(pairs, len(self.node))
        place = np.arange(len(pairs)) - np.searchsorted(row_of, row_of)
        self.patch = np.full_like(self.row, -1)
        self.patch[chosen], self.place[chosen] = row, place[pair].reshape(-1, K)
        self.nodes_of_patch = np.full((len(numbers), place.max(initial=0) + 1), -1, np.int32)
        self.nodes_of_patch[row_of, place] = node

    def _make_matrix(self, chosen):
        D = self.dim
        dof = self.number[:, None] * D + np.arange(D, dtype=PETSc.IntType)
        diagonal = dof[:self.owned].flatten()
        dof[self.fixed] = -1  # rows and columns of supports stay out: their displacement is known
        blocks = [dof[self.cells[chosen]]]  # (cells, K, D)
        if self.patch is not self.row:
            blocks.append(np.append(dof, np.full((1, D), -1, dof.dtype), axis=0)[self.nodes_of_patch])
        shapes = [(*block.shape, *block.shape[:0:-1]) for block in blocks]
        rows = [np.broadcast_to(block.transpose(0, 2, 1)[:, None, None], shape).ravel()
                for block, shape in zip(blocks, shapes)]
        columns = [np.broadcast_to(block[:, :, :, None, None], shape).ravel() for block, shape in zip(blocks,
                                                                                                      shapes)]
        facet = dof[self.nodes_of_facets].transpose(0, 2, 1)  # (facets, D, M), each direction on its own
        shapes.append((*facet.shape, facet.shape[-1]))
        rows.append(np.broadcast_to(facet[..., None], shapes[-1]).ravel())
        columns.append(np.broadcast_to(facet[:, :, None], shapes[-1]).ravel())
        size = (self.owned * D, PETSc.DETERMINE)
        self.matrix = PETSc.Mat().create(self.comm)
        self.matrix.setSizes((size, size), bsize=D)
        self.matrix.setType(PETSc.Mat.Type.AIJ)
        compat.set_coo_pattern(self.matrix, np.concatenate([*rows, diagonal]),
                               np.concatenate([*columns, diagonal]))
        self.matrix.setOption(PETSc.Mat.Option.SYMMETRIC, self._symmetric)
        self.values = np.zeros(sum(map(len, rows)) + len(diagonal))
        matrices = [part.reshape(shape) for part, shape in
                    zip(np.split(self.values, np.cumsum([len(part) for part in rows])), shapes)]
        self.element_matrices, self.patch_matrices = matrices[0], matrices[len(blocks) - 1]
        self.facet_matrices = matrices[-1]

    def clear(self):
        """Set element and patch matrices to zero."""
        self.values[:] = 0.0

    def fill_matrix(self, diagonal):
        """Matrix from element and patch matrices and ``diagonal``, shape (owned, D), added on top."""
        self.values[len(self.values) - diagonal.size:] = diagonal.ravel()
        compat.set_coo_values(self.matrix, self.values)

    def set_values(self, values):
        """Matrix from ``values`` in the order of its pattern."""
        self.values[:] = values
        compat.set_coo_values(self.matrix, self.values)

    def destroy(self):
        """Free matrix and vectors."""
        for held in (self.matrix, *self._vectors.values()):
            held.destroy()
