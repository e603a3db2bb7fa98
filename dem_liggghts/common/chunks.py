"""A window is computed in chunks of steps: a signal, such as the one that ends the run, is heard only between
two calls."""
from time import perf_counter

import numpy as np
from mpi4py import MPI

SECONDS = 0.25  # that a chunk should take at most


class Chunks:
    """Lengths of the chunks in DEM steps, found by the clock. Where a window is cut changes nothing in it.
    comm: of the ranks that have to agree, or None."""

    def __init__(self, comm=None):
        self._comm, self.size, self._begin = comm, 16, 0.0

    def next(self, left):
        """Steps of the next chunk, of which ``left`` are left."""
        self._begin = perf_counter()
        return min(left, self.size)

    def done(self, steps, code=0):
        """The chunk of ``steps`` has been computed, with a return ``code`` on this rank; returns the largest
        one of all ranks. Collective."""
        took = perf_counter() - self._begin
        if self._comm is not None and self._comm.size > 1:
            largest = np.array([took, code], float)
            # numbers: with objects MAX would compare arrays
            self._comm.Allreduce(MPI.IN_PLACE, largest, MPI.MAX)
            took, code = largest
        if took > SECONDS:
            self.size = max(1, self.size // 2)
        elif steps == self.size and took < SECONDS / 4:
            self.size *= 2
        return int(code)

    def run(self, steps, call):
        """``call(begin, count)`` chunk after chunk until it returns a code other than 0; returns the last
        code."""
        begin = code = 0
        while begin < steps and not code:
            count = self.next(steps - begin)
            code = self.done(count, call(begin, count))
            begin += count
        return code
