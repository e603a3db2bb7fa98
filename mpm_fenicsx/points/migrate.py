"""Points travel between ranks: to neighbours in one sparse exchange, further only when somebody has to."""
import numpy as np
from mpi4py import MPI


class Router:
    """Sends records to other ranks. neighbours: ranks expected as destinations. ``traffic``: [messages,
    bytes] sent so far. Collective."""

    def __init__(self, comm, neighbours):
        self.comm, self.traffic = comm, [0, 0]
        self._neighbours = np.asarray(neighbours, np.int32)
        self._graph = comm.Create_dist_graph_adjacent(self._neighbours, self._neighbours)

    def exchange(self, records, rank):
        """Send each record (structured array) to its ``rank``, shape (n,); returns arrivals by ``gid``."""
        order = np.lexsort((records["gid"], rank))
        records, rank = records[order], rank[order]
        near = bool(np.isin(rank, self._neighbours).all())
        graph = self._graph if self.comm.allreduce(near, MPI.LAND) else self.comm
        receivers = self._neighbours if graph is self._graph else np.arange(self.comm.size)
        send = np.array([np.count_nonzero(rank == r) for r in receivers], np.int32)
        receive = np.empty_like(send)
        record = MPI.BYTE.Create_contiguous(records.dtype.itemsize).Commit()
        if graph is self._graph:
            graph.Neighbor_alltoall(send, receive)
        else:
            graph.Alltoall(send, receive)
        arrived = np.empty(int(receive.sum()), records.dtype)
        message = [records, (send, _starts(send)), record], [arrived, (receive, _starts(receive)), record]
        if graph is self._graph:
            graph.Neighbor_alltoallv(*message)
        else:
            graph.Alltoallv(*message)
        record.Free()
        self.traffic[0] += 2 * len(receivers)
        self.traffic[1] += records.nbytes + send.nbytes
        return arrived[np.argsort(arrived["gid"], kind="stable")]

    def free(self):
        """Free the communicator of the neighbours."""
        self._graph.Free()


def _starts(counts):
    return np.concatenate([[0], np.cumsum(counts)[:-1]]).astype(np.int32) if len(counts) else counts
