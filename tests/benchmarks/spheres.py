"""What a step of the DEM costs with many spheres: a cubic lattice of them that is pressed together.

    ./dev run python tests/benchmarks/spheres.py [dem=liggghts] [count=100000]
    ./dev run mpirun -n 2 python tests/benchmarks/spheres.py [dem=liggghts] [count=100000]

Each sphere touches its six neighbours; there are new neighbour lists in about every tenth step, and the
books at the end of each window of 20 steps count, too. On one rank seconds are those of the processor. On
several they are those on the wall: of one rank while the others sleep, and of all, which take turns with the
same window again and again, the shortest of each; then what each rank sends others in a step, the one sum
over all ranks aside.
"""
import sys
from time import perf_counter, process_time, sleep

import numpy as np
from mpi4py import MPI

from dem_liggghts import Interaction, Material, Scene, Spheres

RADIUS, DT, STEPS = 0.01, 2e-5, 20
NOTHING = np.zeros((0, 3))  # there is no moving wall


def opened(count, backend, comm):
    """The DEM with about ``count`` spheres on the ranks of ``comm``, in contact."""
    along = round(count ** (1 / 3))
    places = np.stack(np.meshgrid(*[np.arange(along)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    x = 2.0002 * RADIUS * (places + 0.5)
    lattice = Spheres(x=x, v=-20.0 * (x - x.mean(axis=0)), radius=np.full(len(x), RADIUS), rho=2600.0)
    met = Interaction(0.3, 0.5)
    dem = Scene(lattice, None, Material(1e7, 0.25), None, met, met, (0.0, 0.0, 0.0)).open(backend, DT, comm)
    dem.advance(300, NOTHING, NOTHING)
    return dem


def per_step(dem, clock):
    """Seconds of a step by this ``clock``."""
    begun = clock()
    dem.advance(STEPS, NOTHING, NOTHING)
    return (clock() - begun) / STEPS


def asleep(comm):
    """Wait for all ranks, and leave the core to others."""
    request = comm.Ibarrier()
    while not request.Test():
        sleep(1e-3)


def against_one(count, backend, comm):
    """Seconds of a step on one rank and on all of ``comm``, and how many spheres there are; prints what ranks
    send."""
    alone = opened(count, backend, MPI.COMM_SELF) if comm.rank == 0 else None
    asleep(comm)
    shared, seconds = opened(count, backend, comm), []
    first, start = alone and alone.get_state(), shared.get_state()
    for _ in range(max(5, min(60, 300_000 // count))):
        one = per_step(alone, perf_counter) if alone else 0.0
        asleep(comm)
        seconds.append((one, per_step(shared, perf_counter)))
        shared.set_state(start)
        if alone:
            alone.set_state(first)
    traffic = getattr(getattr(shared, "_part", None), "traffic", None)  # LIGGGHTS does not count it
    if traffic is not None:
        sent = np.max(comm.allgather(traffic[1:] / traffic[0]), axis=0)
        if comm.rank == 0:
            print(f"a rank sends {sent[0]:.1f} messages, {sent[1]:.0f} bytes in a step")
    return (*np.min(comm.bcast(seconds), axis=0), len(shared.particles()))


def main(backend="reference", counts=(1_000, 10_000, 100_000), comm=MPI.COMM_WORLD):
    """Print a line for each of the ``counts``."""
    for count in counts:
        if comm.size > 1:
            one, seconds, n = against_one(count, backend, comm)
            more = f" on {comm.size} ranks, {1e9 * one / n:.0f} ns on one: {one / seconds:.2f} times as fast"
        else:
            dem = opened(count, backend, comm)
            seconds, n, more = per_step(dem, process_time), len(dem.particles()), ""
        if comm.rank == 0:
            print(f"{backend}: {n} spheres, {1e3 * seconds:.2f} ms per step, {1e9 * seconds / n:.0f} ns for "
                  f"each{more}", flush=True)


if __name__ == "__main__":
    words = dict(word.split("=") for word in sys.argv[1:])
    main(words.get("dem", "reference"), *([(int(words["count"]),)] if "count" in words else []))
