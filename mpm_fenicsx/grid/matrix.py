"""The matrix of the active cells, which element matrices and the like add to."""
import numpy as np
from petsc4py import PETSc

from . import compat, entries
from .entries import Group, Neighbours, Rows


def _find_neighbours(groups, count):
    """``Neighbours`` of ``count`` nodes, each of which is its own."""
    own = np.arange(count)[:, None]
    groups = [Group(own, own), *groups]
    most = np.zeros(count, np.int64)
    for group in groups:
        entries.make_room(group.rows, group.columns, most)
    start, room = np.cumsum(most) - most, int(most.sum())
    found = Neighbours(start, np.zeros(count, np.int64), np.empty(room, np.int32), np.empty(room, np.int32))
    for group in groups:
        entries.collect(group.rows, group.columns, group.thin, found)
    return found


class CellMatrix:
    """Matrix of this rank's nodes with those that share a group with them.

    ``petsc``: the matrix of PETSc. On one rank it has its numbers where kernels add them, in ``rows``, see
    ``entries.Rows``, ``block`` being that of the first group. Several ranks sum up what they have, and PETSc
    adds that of all to its own. Collective."""

    def __init__(self, comm, number, owned, fixed, symmetric, groups):
        """number: of the nodes across ranks, (nodes,), the first ``owned`` of them this rank's; fixed: mask
        of the supported directions, (nodes, D); symmetric: so is the matrix; groups: list of ``Group``."""
        self._comm, self._dim, self._kept = comm, fixed.shape[1], []
        count, D = fixed.shape
        self._found = found = _find_neighbours(groups, count)
        length = np.empty(count, np.int64)
        width = D - np.count_nonzero(fixed, axis=1)
        entries.look_ahead(found, width, length)
        within = np.where(fixed, -1, np.cumsum(~fixed, axis=1) - 1).astype(np.int8)
        lengths = np.where(fixed, 0, length[:, None])
        lengths[:owned][fixed[:owned]] = 1  # an identity row
        place = np.cumsum(lengths).reshape(count, D) - lengths
        first = np.where(fixed, -1, place)
        unknown = number[:, None] * D + np.arange(D, dtype=PETSc.IntType)
        columns = np.empty(lengths.sum(), PETSc.IntType)
        entries.fill_columns(found, first, within, unknown, columns)
        columns[place[:owned][fixed[:owned]]] = unknown[:owned][fixed[:owned]]
        values = np.zeros(len(columns))
        own = np.arange(owned)[:, None]
        aside = np.where(fixed[:owned], 0, within[:owned] + self._block(own, own)[:, 0])
        self._diagonal = place[:owned] + aside
        self.rows = Rows(values, first, within, self._block(*groups[0][:2]))
        self._make(symmetric, owned, lengths, (unknown, columns))

    def _make(self, symmetric, owned, lengths, numbers):
        unknown, columns = numbers
        D = lengths.shape[1]
        size = owned * D, PETSc.DETERMINE
        self._shared = self._comm.size == 1
        if self._shared:
            start = np.append(0, np.cumsum(lengths)).astype(PETSc.IntType)
            self.petsc = PETSc.Mat().createAIJWithArrays(
                (size, size), (start, columns, self.rows.values), bsize=D, comm=self._comm)
        else:
            self.petsc = PETSc.Mat().create(self._comm)
            self.petsc.setSizes((size, size), bsize=D)
            self.petsc.setType(PETSc.Mat.Type.AIJ)
            compat.set_coo_pattern(self.petsc, np.repeat(unknown, lengths.ravel()), columns)
        self.petsc.setOption(PETSc.Mat.Option.SYMMETRIC, symmetric)

    def _block(self, rows, columns):
        """Of a group of this matrix, see ``Rows``."""
        block = np.empty((*rows.shape, columns.shape[1]), np.uint16)
        entries.find_blocks(rows, columns, self._found, block)
        return block

    def keep_elements(self, nodes):
        """Matrices (m, M, D, D, M) of elements with these ``nodes`` (m, M), a group of this matrix, which
        are part of it from when they are filled until it is cleared."""
        rows = self.rows._replace(block=self._block(nodes, nodes))
        return self._keep((*nodes.shape, self._dim, self._dim, nodes.shape[1]),
                          lambda kept: entries.add_elements(kept, nodes, rows))

    def keep_stencils(self, around):
        """The same for blocks (nodes, C, D, D) of the nodes ``around`` (nodes, C) each one."""
        rows = self.rows._replace(block=self._block(np.arange(len(around))[:, None], around))
        return self._keep((*around.shape, self._dim, self._dim),
                          lambda kept: entries.add_stencils(kept, around, rows))

    def keep_thin(self, nodes):
        """The same for matrices (m, D, M, M) by direction, node and node of a thin group."""
        shape = len(nodes), self._dim, *nodes.shape[1:] * 2
        places, (values, first, within, _) = np.empty(shape, np.int32), self.rows
        entries.find_thin(nodes, self._found, first, within, places)
        return self._keep(shape, lambda kept: entries.add_at(places.ravel(), kept.ravel(), values))

    def _keep(self, shape, add):
        self._kept.append((np.zeros(shape), add))
        return self._kept[-1][0]

    def complete(self):
        """Nothing more is to be kept: what only that needs goes."""
        del self._found

    def add_to_some(self, numbers, nodes, row, add):
        """Add what ``add(row, matrices)`` adds to matrices (m, K, D, D, K) of the elements with the
        ``numbers``, which may come again and again, ``row`` being that of an element among these. nodes, row:
        by the number of an element, (elements, K), and its place in the first group."""
        number, row_of = np.unique(numbers), np.empty(len(nodes), np.int32)
        row_of[number] = np.arange(len(number))
        matrices = np.zeros((len(number), nodes.shape[1], self._dim, self._dim, nodes.shape[1]))
        add(row_of, matrices)
        rows = self.rows._replace(block=self.rows.block[row[number]])
        entries.add_elements(matrices, nodes[number], rows)

    def clear(self):
        """Set it to zero, with all that is kept for it. Not collective."""
        self.rows.values[:] = 0.0
        for kept, _ in self._kept:
            kept[:] = 0.0

    def finish(self, diagonal):
        """Add what is kept for it and ``diagonal`` (owned, D); now PETSc has it."""
        for kept, add in self._kept:
            add(kept)
        self.rows.values[self._diagonal] += diagonal
        self._hand_over()

    def _hand_over(self):
        if self._shared:
            self.petsc.stateIncrease()
            self.petsc.assemble()
        else:
            compat.set_coo_values(self.petsc, self.rows.values)

    def get_values(self):
        """Copy of the values in this rank's rows of the matrix, row by row."""
        return self.rows.values.copy() if self._shared else self.petsc.getValuesCSR()[2]

    def set_values(self, values):
        """Matrix from ``values`` of ``get_values``."""
        if self._shared:
            self.rows.values[:] = values
            self._hand_over()
        else:
            self.clear()
            self._hand_over()
            start, columns, _ = self.petsc.getValuesCSR()
            self._set_entries(start, columns, values)

    def set_entries(self, start, columns, values):
        """Matrix from entries of this rank's rows: those of row k are ``start[k]`` to ``start[k + 1]``, the
        others are zero. Returns whether the matrix has room for all of this rank's."""
        self.clear()
        self._hand_over()
        try:
            self._set_entries(start, columns, values)
        except PETSc.Error:
            return False
        return True

    def _set_entries(self, start, columns, values):
        kind = PETSc.IntType
        try:
            self.petsc.setValuesCSR(start.astype(kind), columns.astype(kind), values)
        finally:
            self.petsc.assemble()
