"""Small reductions over all ranks, as arrays: several in one call, none on a single rank."""
import numpy as np
from mpi4py import MPI


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
