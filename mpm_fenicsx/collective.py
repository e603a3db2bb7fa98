"""Small reductions over all ranks, as arrays: several in one call, none on a single rank; what is shared out
in order, and errors of one rank that are raised on all."""
import zlib
from typing import NamedTuple

import numpy as np
from mpi4py import MPI


class Part(NamedTuple):
    """The part of the rank ``rank`` of what is shared out over ``ranks`` in order."""

    rank: int = 0
    ranks: int = 1

    def of(self, count):
        """Its slice of ``count`` things."""
        return slice(count * self.rank // self.ranks, count * (self.rank + 1) // self.ranks)


WHOLE = Part()


def total(comm, values):
    """Sums of ``values`` over the ranks, a float array. Collective."""
    values = np.array(values, float)
    if comm.size > 1:
        comm.Allreduce(MPI.IN_PLACE, values, MPI.SUM)
    return values


def somewhere(comm, *flags):
    """For each flag, whether it is set on any rank. Collective."""
    flags = np.array(flags, np.int32)
    if comm.size > 1:
        comm.Allreduce(MPI.IN_PLACE, flags, MPI.MAX)
    return flags.astype(bool)


def together(comm, work):
    """What ``work()`` returns. Where it raises an Exception on some ranks, that of the first of these is
    raised on all. Collective; there is nothing collective in ``work``."""
    if comm.size == 1:
        return work()
    result = failure = None
    try:
        result = work()
    except Exception as error:  # noqa: BLE001 - whatever a user's function raises ends all ranks
        failure = error
    failed = comm.allgather(failure is not None)
    if any(failed):
        first = failed.index(True)
        told = comm.bcast((type(failure).__name__, str(failure)), first)
        if failure is not None and comm.rank == first:
            raise failure
        kind = {"ValueError": ValueError, "MemoryError": MemoryError}.get(told[0], RuntimeError)
        raise kind(told[1]) from failure
    return result


def checksum(comm, arrays, before=0):
    """CRC-32 of the bytes of ``arrays``, of each of which the ranks have parts in their order: that of the
    whole ones, whatever the number of ranks. before: of what comes first. Collective."""
    for array in arrays:
        mine = np.ascontiguousarray(array)
        if comm.size == 1:
            before = zlib.crc32(mine, before)
            continue
        if comm.rank:
            before = comm.recv(source=comm.rank - 1)
        before = zlib.crc32(mine, before)
        if comm.rank + 1 < comm.size:
            comm.send(before, comm.rank + 1)
        before = comm.bcast(before, comm.size - 1)
    return before
