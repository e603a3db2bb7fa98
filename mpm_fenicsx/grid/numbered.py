"""What lies on the cells, nodes and in the matrix of a distributed grid, by numbers of the whole grid: so it
does not depend on the number of ranks, and any rank can send it to the one where it belongs."""
import numpy as np
from mpi4py import MPI

from mpm_dem_store import Table

from ..collective import somewhere


class Numbered:
    """Numbers of the whole grid for one distribution, ``background``, of it. ``router``: of points between
    its ranks. All methods that begin with ``take`` are collective, and ``making`` is, too."""

    def __init__(self, background, router):
        self._background = b = background
        self._router = router
        self._cell = np.full(len(b.owner), -1, np.int32)
        self._cell[b.original_cell[:b.cells_owned]] = np.arange(b.cells_owned)
        self._rank_of_node = np.full(len(b.copies[0]), -1, np.int32)
        self._rank_of_node[b.vertex_of[:b.nodes_owned]] = b.comm.rank
        b.comm.Allreduce(MPI.IN_PLACE, self._rank_of_node, MPI.MAX)

    def send(self, number, rank, fields):
        """Send each row of the ``fields``, name → array, to its ``rank``, (n,). Returns number and fields of
        those that have come, in the order of their ``number``."""
        kinds = [(name, values.dtype, values.shape[1:]) for name, values in fields.items()]
        packed = np.empty(len(number), np.dtype([("gid", np.int64), *kinds]))
        packed["gid"] = number
        for name, values in fields.items():
            packed[name] = values
        arrived = self._router.exchange(packed, np.asarray(rank))
        return arrived["gid"].copy(), {name: np.ascontiguousarray(arrived[name]) for name in fields}

    # ---------------------------------------------------------------- points and cells

    def points(self, fields):
        """Table of points with these ``fields``, whose cells are this rank's."""
        return Table({**fields, "cell": self._background.original_cell[fields["cell"]].astype(np.int64)},
                     fields["gid"])

    def take_points(self, table):
        """Fields of the points that are in this rank's cells."""
        others = {name: values for name, values in table.fields.items() if name != "gid"}
        rank = self._background.owner[table.fields["cell"]]
        number, fields = self.send(table.fields["gid"], rank, others)
        return {**fields, "gid": number, "cell": self._cell[fields["cell"]]}

    def cells(self, cells):
        """Table of some of this rank's own cells."""
        number = np.sort(self._background.original_cell[cells].astype(np.int64))
        return Table({"cell": number}, number)

    def take_cells(self, table):
        """Those that are this rank's, in the order of their numbers here."""
        number = table.fields["cell"]
        return np.sort(self._cell[self.send(number, self._background.owner[number], {})[0]])

    def facets(self, pairs, **fields):
        """Table of facets between the cells of the ``pairs``, (n, 2), each on the rank that has the cell with
        the lower number in the whole grid."""
        first, second = np.sort(self._background.original_cell[pairs].astype(np.int64), axis=1).T
        return Table({"cell": first, "other": second, **fields}, first * len(self._cell) + second)

    def take_facets(self, pairs, table):
        """Fields of the facets between the cells of the ``pairs``."""
        wanted = self.facets(pairs).number
        number = table.fields["cell"] * len(self._cell) + table.fields["other"]
        rank = self._background.owner[table.fields["cell"]]
        return self._in_order(wanted, *self.send(number, rank, table.fields))

    # ---------------------------------------------------------------- nodes and the matrix

    def nodes(self, active_cells, **fields):
        """Table of the owned nodes of the ``active_cells``; fields: of all nodes there, (nodes, …)."""
        number = self._background.vertex_of[active_cells.node[:active_cells.owned]]
        own = {name: values[:active_cells.owned] for name, values in fields.items()}
        return Table({"node": number, **own}, number)

    def take_nodes(self, active_cells, table):
        """Fields, float of shape (nodes, 1), of all nodes of the ``active_cells``."""
        number = table.fields["node"]
        owned = self._background.vertex_of[active_cells.node[:active_cells.owned]]
        fields = self._in_order(owned, *self.send(number, self._rank_of_node[number], table.fields))
        return {name: active_cells.with_ghosts(np.array(values, float).reshape(active_cells.owned, -1))
                for name, values in fields.items()}

    def _unknowns(self, active_cells):
        """Number in the whole grid, node times D plus direction, of every row of the matrix; all ranks'. Of
        half the size where that will do: matrices are most of a checkpoint."""
        owned = self._background.vertex_of[active_cells.node[:active_cells.owned]]
        nodes, D = np.concatenate(self._background.comm.allgather(owned)), active_cells.dim
        small = len(self._rank_of_node) * D < np.iinfo(np.int32).max
        return (nodes[:, None] * D + np.arange(D)).ravel().astype(np.int32 if small else np.int64)

    def matrix(self, active_cells):
        """Table of the entries of its own rows of the matrix that are not zero. Collective."""
        unknown, matrix = self._unknowns(active_cells), active_cells.matrix
        start, columns, values = matrix.getValuesCSR()
        first = matrix.getOwnershipRange()[0]
        rows = np.repeat(np.arange(first, first + len(start) - 1), np.diff(start))
        kept = np.flatnonzero(values.view(np.int64))  # a zero with a sign is kept
        return Table({"row": unknown[rows[kept]], "column": unknown[columns[kept]], "value": values[kept]})

    def take_matrix(self, active_cells, table):
        """Fill the matrix of the ``active_cells``."""
        unknown, matrix, D = self._unknowns(active_cells), active_cells.matrix, active_cells.dim
        whole = len(self._rank_of_node) * D
        row, column, value = (table.fields[name] for name in ("row", "column", "value"))
        rank = self._rank_of_node[row // D]
        number, fields = self.send(row.astype(np.int64) * whole + column, rank, {"value": value})
        place = np.full(whole, -1, np.int64)
        place[unknown] = np.arange(len(unknown))
        first, last = matrix.getOwnershipRange()
        rows, columns = place[number // whole] - first, place[number % whole]
        order = np.lexsort((columns, rows))
        start = np.searchsorted(rows[order], np.arange(last - first + 1))
        fits = active_cells.set_entries(start, columns[order], fields["value"][order])
        self._raise_if(not fits, "other nodes are held in")


    def _in_order(self, wanted, number, fields):
        """Fields of the ``wanted`` numbers, which must be those that have come, ``number``."""
        order = np.argsort(wanted)
        self._raise_if(not np.array_equal(wanted[order], number), "other cells and nodes take part in")
        place = np.argsort(order)
        return {name: values[place] for name, values in fields.items()}

    def _raise_if(self, wrong, what):
        """ValueError on all ranks when it is so on any."""
        if somewhere(self._background.comm, wrong)[0]:
            raise ValueError(f"{what} the step of this checkpoint than here: give one of the same scene, "
                             "with the same supports and walls")
