"""The MPM step on several ranks: time, messages and bytes per phase, imbalance, memory.

    python tests/benchmarks/bench_ranks.py [ranks=1,2] [points=15360,153600] [dim=2] [steps=60] [-mpm_…
    options]

A steel beam under a load that pushes it down, in the background grid of the paper, refined until the number
of points is reached; with dim=3 the paper's beam in space, 76 800 points; elastic, tangent kept, and once
more with a new tangent in every step. Messages and bytes are those that PETSc sends for one rank, per step,
largest over the ranks; what MUMPS sends is its own affair and not counted. Prints Markdown tables; nothing
passes or fails here.
"""
import json
import os
import resource
import subprocess
import sys

import numpy as np

MPIRUN = ["mpirun"]  # ./dev run sets what Open MPI wants to know of root and of more ranks than cores


def scene(points):
    """Body and background grid with about ``points`` points; the beam of the paper at 15 360."""
    from mpm_fenicsx import MPM, Body, Box, Grid, Interface, Support, linear

    fine = np.sqrt(points / 15360)
    counts = lambda *n: tuple(round(fine * k) for k in n)  # noqa: E731
    beam = Body(Box((-0.07675, -0.01), (0.07675, 0.0)), counts(120, 8), 4, linear(215.82e9, 0.289), 7960.0,
                "plane_stress", 0.01)
    grid = Grid(Box((-0.07935, -0.02), (0.07935, 0.01)), counts(62, 13))
    ends = [Support.column("x", x, grid, "y") for x in (-0.07675, 0.07675)]
    return MPM(grid, beam, ends, Interface.top(beam.box, 60))


def scene_in_space():
    """The paper's beam in space: 62 x 13 x 7 hexahedra, 120 x 8 x 10 body cells of 8 points, wall of 77 x 10
    cells."""
    from mpm_fenicsx import MPM, Body, Box, Grid, Interface, Support, linear

    beam = Body(Box((-0.07675, -0.01, -0.005), (0.07675, 0.0, 0.005)), (120, 8, 10), 2,
                linear(215.82e9, 0.289), 7960.0)
    grid = Grid(Box((-0.07935, -0.02, -0.0076), (0.07935, 0.01, 0.0076)), (62, 13, 7))
    ends = [Support.column("x", x, grid, "y") for x in (-0.07675, 0.07675)]
    return MPM(grid, beam, ends, Interface.top(beam.box, (77, 10)))


def measure(points, steps, dim):
    """One run on the ranks that are there; rank 0 prints a line of JSON."""
    from time import perf_counter

    from mpi4py import MPI

    comm, solid = MPI.COMM_WORLD, scene(points) if dim == 2 else scene_in_space()
    x, dt = solid.surface()[0], 5e-8 * (np.sqrt(15360 / points) if dim == 2 else 1.0)
    force = np.zeros_like(x)
    middle = np.abs(x[:, 0]) < 0.014
    force[middle, 1] = -5.0 / np.count_nonzero(middle)
    for _ in range(3):
        solid.advance(dt, force)
    for name in solid.phases:
        solid.phases[name] = 0.0
        solid.step.clock.traffic[name][:] = 0.0
    seconds = []
    for _ in range(steps):
        comm.Barrier()
        start = perf_counter()
        solid.advance(dt, force)
        seconds.append(perf_counter() - start)
    median = comm.allreduce(float(np.median(seconds)), MPI.MAX)
    phases = {name: comm.allreduce(s / steps, MPI.MAX) for name, s in solid.phases.items()}
    traffic = {name: np.max(comm.allgather(sent / steps), axis=0).tolist()
               for name, sent in solid.step.clock.traffic.items()}
    memory = comm.allgather(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
    imbalance = solid.imbalance()
    if comm.rank == 0:
        print(json.dumps({"points": solid.count, "ms": 1e3 * median,
                          "phases": {k: 1e3 * v for k, v in phases.items()}, "traffic": traffic,
                          "imbalance": imbalance, "memory": max(memory),
                          "solver": solid.step.newton.describe()}))


def run(ranks, points, steps, dim, options):
    answer = subprocess.run([*MPIRUN, "-n", str(ranks), sys.executable, __file__, f"measure={points}",
                             f"steps={steps}", f"dim={dim}", *options], check=True, capture_output=True,
                            text=True, env={**os.environ, "OMP_NUM_THREADS": "1"})
    return json.loads([line for line in answer.stdout.splitlines() if line.startswith("{")][-1])


def report(ranks, points, steps, dim, options):
    for kept, extra in (("kept", []), ("new in every iteration", ["-mpm_snes_lag_jacobian", "1"])):
        rows = {n: run(n, points, steps, dim, [*options, *extra]) for n in ranks}
        first = rows[ranks[0]]
        names = list(first["phases"])
        print(f"\n{first['points']} points, tangent {kept}, {first['solver']}\n")
        print("| ranks | step [ms] | faster | " + " | ".join(names) + " | imbalance | MB per rank |")
        print("|" + " --- |" * (len(names) + 5))
        for n, r in rows.items():
            print(f"| {n} | {r['ms']:.2f} | {first['ms'] / r['ms']:.2f} | "
                  + " | ".join(f"{r['phases'][p]:.2f}" for p in names) + f" | {r['imbalance']:.3f} | "
                  f"{r['memory']:.0f} |")
        for n, r in rows.items():
            if n > 1:
                sent = ", ".join(f"{p} {m:.1f} / {b:.0f}" for p, (m, b) in r["traffic"].items() if m)
                print(f"\nmessages / bytes per step and rank on {n} ranks: {sent}", flush=True)


if __name__ == "__main__":
    given = dict(word.split("=", 1) for word in sys.argv[1:] if "=" in word and not word.startswith("-"))
    passed_on = [word for word in sys.argv[1:] if "=" not in word]
    step_count, dimension = int(given.get("steps", 60)), int(given.get("dim", 2))
    if "measure" in given:
        measure(int(given["measure"]), step_count, dimension)
    else:
        for size in map(int, given.get("points", "15360,153600" if dimension == 2 else "76800").split(",")):
            report([int(n) for n in given.get("ranks", "1,2").split(",")], size, step_count, dimension,
                   passed_on)
