"""What the exchange between soil and boulders costs: a bed in space whose points are balls, with five
boulders on it and without; and, on several ranks, bytes of the interface that travel in a window, against
those of an interface of all points. Soil that is pressed yields, and Newton's method needs more iterations;
law=elastic leaves that out.

    ./dev run python tests/benchmarks/exchange.py [points=1e5] [windows=8] [dem=reference] [law=elastic]
        [speed=0.1]
    ./dev run mpirun -n 4 python tests/benchmarks/exchange.py
"""
import sys
import warnings
from time import perf_counter, process_time

import numpy as np
from mpi4py import MPI

WORDS = dict(word.split("=") for word in sys.argv[1:])
del sys.argv[1:]  # no words for PETSc

import dem_liggghts as dem  # noqa: E402
from coupling import Scheme, couple, march, same  # noqa: E402
from coupling.scheme import Steps  # noqa: E402
from mpm_fenicsx import MPM, Balls, Body, Box, Grid, Support, linear, mohr_coulomb  # noqa: E402

H, DT, SUBSTEPS, BOULDER = 0.1, 1e-3, 20, 0.3
HIGH = 5  # cells of the bed
SPEED = float(WORDS.get("speed", 0.1))  # of the boulders [m/s]
LAWS = {"soil": mohr_coulomb(1e7, 0.3, friction_angle=35.0), "elastic": linear(1e7, 0.3)}


def bed(points):
    """A square bed of so many points, eight to a cell."""
    n = round((points / 8 / HIGH)**0.5)
    side = n * H
    body = Body(Box((0.0, 0.0, 0.0), (side, HIGH * H, side)), (n, HIGH, n), 2,
                LAWS[WORDS.get("law", "soil")], 1800.0, cell="hexahedron")
    grid = Grid(Box((0.0, 0.0, 0.0), (side, 2 * HIGH * H, side)), (n, 2 * HIGH, n), cell="hexahedron")
    walls = [Support(lambda x, k=k: (x[:, k] < 1e-9) | (x[:, k] > side - 1e-9), "xyz"[k]) for k in (0, 2)]
    floor = Support(lambda x: x[:, 1] < 1e-9, "xyz")
    return MPM(grid, body, [floor, *walls], Balls(0.25 * H), gravity=(0.0, -9.81, 0.0),
               inertia="lumped"), side


def boulders(side, backend):
    """Five of 27 spheres each, that are about to touch the bed."""
    radius = BOULDER / 3
    place = np.stack(np.meshgrid(*3 * [np.linspace(-1.0, 1.0, 3)], indexing="ij"), -1).reshape(-1, 3) * radius
    stone = dem.Material(E=1e7, nu=0.3)
    height = HIGH * H + 2.0 * radius + 0.04 * H
    v = 0.2 * SPEED, -SPEED, 0.1 * SPEED
    clusters = [dem.Cluster.of_spheres(place, np.full(27, radius), 2600.0, v=v,
                                       x=(side * (0.2 + 0.15 * k), height, side * (0.3 + 0.1 * k)))
                for k in range(5)]
    wall = dem.Wall.discs(np.zeros((0, 3)), 0.25 * H)
    scene = dem.Scene(clusters=clusters, wall=wall, material=stone, wall_material=stone,
                      at_wall=dem.Interaction(0.3, 0.5), gravity=(0.0, -9.81, 0.0))
    return scene.open(backend, DT / SUBSTEPS)


def timed(windows):
    """Observer, and the list of the seconds and processor seconds from window to window that it fills."""
    clock = lambda: np.array([perf_counter(), process_time()])  # noqa: E731
    seconds, last = [], [clock()]

    def look(window):
        MPI.COMM_WORLD.Barrier()
        seconds.append(clock() - last[0])
        last[0] = clock()
        windows.append(window)

    return look, seconds


def main(points=1e5, windows=8, backends=("reference", "liggghts")):
    """Print the medians."""
    warnings.simplefilter("ignore")
    comm, medians = MPI.COMM_WORLD, {}
    for backend in [one for each in backends for one in (None, each)]:  # the machine changes its pace
        solid, side = bed(points)
        seen = []
        look, seconds = timed(seen)
        iterations = []
        observers = [look, lambda _, solid=solid, found=iterations: found.append(solid.iterations)]
        end = windows * DT
        if backend is None:
            march(solid, Steps(DT, end, adapt=None), observers)
        else:
            couple(solid, boulders(side, backend), same(),
                   Scheme(DT, end, substeps=SUBSTEPS, adapt=None),
                   observers)
        medians[backend] = np.median(seconds[2:], axis=0)
        sent, whole = comm.allreduce(solid.exchanged) / windows, solid.count * 6 * 8 * (comm.size - 1)
        if comm.rank == 0:
            chosen, push = len(seen[-1].x), np.abs(seen[-1].force.sum(axis=0)).max()
            print(f"{comm.size} rank(s), {solid.count} points, {backend or 'no boulders'}: "
                  "{:.1f} ms a window, {:.1f} of the processor".format(*1e3 * medians[backend]),
                  "({:.3f}, {:.3f}), ".format(*medians[backend] / medians[None]) +
                  f"{chosen} balls, {push:.3g} N, {sent / 1e3:.1f} kB travel in a window, "
                  f"whole interface {whole / 1e3:.0f} kB", flush=True)
            parts = {name: 1e3 * np.median([w.seconds.get(name, 0.0) for w in seen[2:]])
                     for name in ("DEM", "mapping", "MPM")}
            parts["the rest"] = 1e3 * medians[backend][0] - sum(parts.values())
            print("   ", ", ".join(f"{name} {value:.1f} ms" for name, value in parts.items()) +
                  f", {np.mean(iterations[2:]):.2f} iterations of Newton's method", flush=True)
        solid.close()


if __name__ == "__main__":
    main(float(WORDS.get("points", 1e5)), int(WORDS.get("windows", 8)),
         WORDS["dem"].split(",") if "dem" in WORDS else ("reference", "liggghts"))
