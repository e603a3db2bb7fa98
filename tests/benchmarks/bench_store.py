"""Time, size and memory of a state on disk (``mpm_dem_store``), on one rank and on several.

    python tests/benchmarks/bench_store.py [points=1000000] [ranks=1,2] [out=out/store]

Material points in space with 400 bytes each, in random order and dealt out to the ranks at random. Whether
rank 0 writes for all or each rank for itself depends on how h5py is built. Memory is what the worst rank took
beyond what it had before, as a multiple of its own rows. The time to write includes that until all is on the
disk. Prints a Markdown table; nothing passes or fails here.
"""
import json
import os
import resource
import subprocess
import sys
from pathlib import Path
from time import perf_counter

import numpy as np

MPIRUN = ["mpirun"]  # ./dev run sets what Open MPI wants to know of root and of more ranks than cores
SHAPES = {"x": (3,), "v": (3,), "a": (3,), "u": (3,), "F": (3, 3), "affine": (3, 3), "stress": (6,),
          "back_stress": (6,), "plastic": (), "volume": (), "mass": (), "density": (), "pressure": (),
          "damage": ()}  # each of 8 bytes; two of 4 bytes, and the number, come with them


def state(points, comm):
    """This rank's part of so many points."""
    from mpm_dem_store import Table

    number = np.random.default_rng(0).permutation(points)[comm.rank::comm.size]
    fields = {name: np.full((len(number), *shape), 1.0) for name, shape in SHAPES.items()}
    fields["x"][:, 0] = number
    whole = {name: number.astype(np.int32) for name in ("cell", "body")}
    return {"points": Table({**fields, **whole}, number)}


def peak():
    """Most memory that this process has had [bytes]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


def measure(what, points, path):
    """Write or read on the ranks that are there; rank 0 prints a line of JSON."""
    import h5py
    from mpi4py import MPI

    import mpm_dem_store

    comm = MPI.COMM_WORLD
    tree = state(points, comm) if what == "write" else None
    before, start = peak(), perf_counter()
    size = mpm_dem_store.write(path, tree, {}) if tree else os.path.getsize(path)
    tree = tree or mpm_dem_store.read(path)
    seconds, table = perf_counter() - start, tree["points"]
    assert (table.fields["x"][:, 0] == table.number).all()
    own = sum(rows.nbytes for rows in table.fields.values()) + table.number.nbytes
    more = comm.gather((peak() - before) / own)
    if comm.rank == 0:
        print(json.dumps({"s": seconds, "bytes": size / points, "more": max(more),
                          "each": comm.size > 1 and h5py.get_config().mpi}))


def main(points=1_000_000, ranks="1,2", out="out/store"):
    """The table, one row per number of ranks."""
    path = Path(out) / "state.h5"
    path.parent.mkdir(parents=True, exist_ok=True)
    print(f"{points} points\n\n| ranks | rows are written by | bytes per point | write [s] | read [s] | "
          "memory to write | to read |\n|" + " --- |" * 7)
    for n in map(int, ranks.split(",")):
        start = [*MPIRUN, "-n", str(n)] if n > 1 else []
        write, read = (json.loads(subprocess.run(
            [*start, sys.executable, __file__, what, str(points), path], check=True, stdout=subprocess.PIPE,
            text=True).stdout) for what in ("write", "read"))
        print(f"| {n} | {'each rank' if write['each'] else 'rank 0'} | {write['bytes']:.1f} | "
              f"{write['s']:.2f} | {read['s']:.2f} | {write['more']:.2f} | {read['more']:.2f} |", flush=True)
    path.unlink()


if __name__ == "__main__":
    if sys.argv[1:2] in (["write"], ["read"]):
        measure(sys.argv[1], int(sys.argv[2]), sys.argv[3])
    else:
        keys = dict(word.split("=") for word in sys.argv[1:])
        main(int(keys.pop("points", 1_000_000)), **keys)
