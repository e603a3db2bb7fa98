"""The part of the grid that the points need: filled cells and one spare layer, with nodes numbered on their own.

Cost follows this cover, not the grid. Nodes without mass inside it are identity rows, so that matrix and pattern stay
while points move from cell to cell; the cover is made anew when a point leaves it.
"""
import numpy as np
from petsc4py import PETSc

from . import compat


class Cover:
    """Numbering, vectors and matrix of the covered cells.

    cells: (all local cells, K) nodes in the cover's local numbering (owned first, then ghosts), -1 outside; slot: (all
    local cells,) row of an owned covered cell in the element matrices, -1 else; node: (n,) the grid node behind each
    local number; fixed: (n, D) mask of supported directions. Collective.
    """

    def __init__(self, background, filled, fixed, symmetric=True):
        """filled: numbers of this rank's cells that hold points; fixed: (grid nodes, D) mask; symmetric: so
        is the matrix."""
        self.comm, self.dim = background.comm, background.dim
        self._vectors, self._symmetric = {}, symmetric
        grid_vec = self._ghosted(background.node_map, background.nodes_owned, 1)
        near = self._flags(grid_vec, background, background.cells[filled])  # nodes of filled cells, on any rank
        owned_cells = background.cells[:background.cells_owned]
        covered = np.flatnonzero(near[owned_cells].any(axis=1)).astype(np.int32)
        needed = self._flags(grid_vec, background, background.cells[covered])
        self._number(background, grid_vec, needed, covered)
        grid_vec.destroy()
        self.slot = np.full(len(background.cells), -1, np.int32)
        self.slot[covered] = np.arange(len(covered))
        self.fixed = fixed[self.node]
        K, D = self.cells.shape[1], self.dim
        self.element_matrices = np.zeros((len(covered), K, D, D, K))  # derivative by (node, direction) of (direction, node)
        self._make_matrix(covered)

    def _ghosted(self, index_map, owned, block):
        ghosts = index_map.ghosts.astype(PETSc.IntType)
        return PETSc.Vec().createGhost(ghosts, (owned * block, PETSc.DETERMINE), bsize=block, comm=self.comm)

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

    def _number(self, background, vec, needed, covered):
        own = np.flatnonzero(needed[:background.nodes_owned])
        first = self.comm.scan(len(own)) - len(own)
        with vec.localForm() as local:
            local.set(-1.0)
            local.array_w[own] = first + np.arange(len(own))
        vec.ghostUpdate(PETSc.InsertMode.INSERT, PETSc.ScatterMode.FORWARD)
        with vec.localForm() as local:
            number = local.array_r.astype(PETSc.IntType)
        mine = np.unique(background.cells[covered])
        ghosts = mine[mine >= background.nodes_owned]
        self.owned = len(own)
        self.node = np.concatenate([own, ghosts]).astype(np.int32)
        self.number = number[self.node]  # across ranks
        local_of = np.full(len(background.x), -1, np.int32)
        local_of[self.node] = np.arange(len(self.node))
        self.cells = np.full_like(background.cells, -1)
        self.cells[covered] = local_of[background.cells[covered]]

    def vector(self, block):
        """New ghosted vector with ``block`` values per node."""
        return PETSc.Vec().createGhost(self.number[self.owned:], (self.owned * block, PETSc.DETERMINE), bsize=block,
                                       comm=self.comm)

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

    def _make_matrix(self, covered):
        D = self.dim
        dof = self.number[:, None] * D + np.arange(D, dtype=PETSc.IntType)
        diagonal = dof[:self.owned].flatten()
        dof[self.fixed] = -1  # rows and columns of supports stay out: their displacement is known
        by_cell = dof[self.cells[covered]]  # (cells, K, D)
        shape = self.element_matrices.shape
        rows = np.broadcast_to(by_cell.transpose(0, 2, 1)[:, None, None], shape).ravel()
        columns = np.broadcast_to(by_cell[:, :, :, None, None], shape).ravel()
        size = (self.owned * D, PETSc.DETERMINE)
        self.matrix = PETSc.Mat().create(self.comm)
        self.matrix.setSizes((size, size), bsize=D)
        self.matrix.setType(PETSc.Mat.Type.AIJ)
        compat.set_coo_pattern(self.matrix, np.append(rows, diagonal), np.append(columns, diagonal))
        self.matrix.setOption(PETSc.Mat.Option.SYMMETRIC, self._symmetric)
        self.values = np.empty(len(rows) + len(diagonal))

    def fill_matrix(self, diagonal):
        """Matrix from the element matrices and ``diagonal``, shape (owned, D), added on top."""
        self.values[:self.element_matrices.size] = self.element_matrices.ravel()
        self.values[self.element_matrices.size:] = diagonal.ravel()
        self.set_values(self.values)

    def set_values(self, values):
        """Matrix from ``values`` in the order of its pattern."""
        self.values[:] = values
        compat.set_coo_values(self.matrix, self.values)

    def destroy(self):
        for held in (self.matrix, *self._vectors.values()):
            held.destroy()
