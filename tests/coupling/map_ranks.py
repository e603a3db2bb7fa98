"""Maps of points that are shared out among the ranks and change hands: maxima on this number of ranks."""
import sys
from pathlib import Path
from types import SimpleNamespace as Toy

import numpy as np
from mpi4py import MPI

from coupling import Gauge, Line, Maps
from coupling.hazard.watch import MapWatch

comm, out = MPI.COMM_WORLD, Path(sys.argv[1])
random = np.random.default_rng(5)
x, v = random.uniform(0.0, 1.0, (400, 3)), random.uniform(0.0, 2.0, (400, 3))
volume, step = random.uniform(1e-4, 1e-3, 400), 0


def matter():
    """Points of the cells of a chequer-board of strips that move across the ranks."""
    mine = (np.floor(7.0 * x[:, 0]).astype(int) + step) % comm.size == comm.rank
    return [Toy(x=x[mine], v=v[mine], mass=1500.0 * volume[mine], volume=1.1 * volume[mine],
                rest=volume[mine], thickness=1.0)]


terrain = Toy(lower=(0.0, 0.0), upper=(3.0, 2.0), height=lambda xy: 0.1 * xy[:, 1])
watch = MapWatch(Maps(terrain, 0.05, gauges=[Gauge("g", (1.0, 1.0), 0.3)],
                      lines=[Line("l", (1.2, 0.0), (1.0, 2.0))]), Toy(time=0.0, matter=matter), None)
for step in range(1, 60):
    x += 0.01 * v
    watch(Toy(time=0.01 * step, dt=0.01, number=step))
if comm.rank == 0:
    for name, write in watch.pictures().items():
        if name.endswith(".asc"):
            write(out / name)
    np.savetxt(out / "now", list(watch.places.now.values()), "%.17g")
    assert np.nanmax(watch.values("deposit")) > 0.0
