"""What a rank holds while a scene is set up: a block of material points in space on 1, 2, 4, 8 ranks.

    mpirun --oversubscribe -n 4 .venv/bin/python tests/benchmarks/start_memory.py [points=1000000]

Megabytes of the rank that has most: of the arrays of points when they are seeded and when each is on the rank
of its cell, counted; of the process, the largest so far less what it had before. Counted numbers are exact
however many ranks share a processor.
"""
import resource
import sys

import numpy as np
from mpi4py import MPI

from mpm_fenicsx import MPM, Body, Box, Grid, linear
from mpm_fenicsx.terms import bodies

SIDE, PER_CELL = 0.02, 3  # [m], points per direction of a body cell


def megabytes(points):
    """Of the arrays of ``points``."""
    return sum(getattr(points, name).nbytes for name in points.names) / 1e6


def peak():
    """Of the process so far [MB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3


def made(points):
    """An ``MPM`` with about so many points, and megabytes of their arrays when they were seeded."""
    n, seeded = max(1, round((points / PER_CELL**3) ** (1 / 3))), []
    size = n * SIDE
    body = Body(Box((0.0, 0.0, 0.0), (size,) * 3), (n,) * 3, PER_CELL, linear(1e6, 0.3), 1000.0)
    grid = Grid(Box((-2 * SIDE,) * 3, (size + 2 * SIDE,) * 3), (n + 4,) * 3)
    original = bodies.BodyTerm.__init__

    def counted(self, *arguments, **more):
        original(self, *arguments, **more)
        seeded.append(megabytes(self.points))

    bodies.BodyTerm.__init__ = counted
    solid = MPM(grid, body, gravity=(0.0, 0.0, -9.81))
    bodies.BodyTerm.__init__ = original
    return solid, max(seeded)


def main(points=1_000_000):
    """Print one line."""
    comm = MPI.COMM_WORLD
    made(1000)[0].close()  # all that has to be loaded and compiled
    before = peak()
    solid, seeded = made(points)
    mine = np.array([seeded, megabytes(solid.points), peak() - before])
    most, count = comm.allreduce(mine, lambda a, b: np.maximum(a, b)), solid.count
    if comm.rank == 0:
        print(f"{comm.size} ranks, {count} points: arrays of points {most[0]:.1f} MB seeded, "
              f"{most[1]:.1f} MB in their cells; process {most[2]:.0f} MB more than before", flush=True)
    solid.close()


if __name__ == "__main__":
    words = dict(word.split("=") for word in sys.argv[1:])
    main(int(float(words.get("points", 1_000_000))))
