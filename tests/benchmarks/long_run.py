"""Does anything grow in a long run with checkpoints: memory, open files, the time of a window?

    ./dev run python tests/benchmarks/long_run.py                    20,000 windows with 1,000 checkpoints
    ./dev run python tests/benchmarks/long_run.py windows=2000

A ball lies on a block, and each window is one step of the block and ten of the ball. Prints a line for every
twentieth of the run: memory now [MB], open files, median time of a window [ms].
"""
import os
import statistics
import sys
import time
from pathlib import Path

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))

from coupling import Output, Run, Scheme, case  # noqa: E402
from dem_liggghts import Material, Scene, Spheres, Wall  # noqa: E402
from mpm_fenicsx import MPM, Body, Box, Grid, Interface, Support, linear  # noqa: E402


class Growth:
    """Observer that looks at the process every so many windows."""

    def __init__(self, every):
        self._every, self._last, self._lengths = every, time.perf_counter(), []

    def __call__(self, window):
        now = time.perf_counter()
        self._lengths.append(now - self._last)
        self._last = now
        if window.number % self._every == 0:
            pages = int(Path("/proc/self/statm").read_text().split()[1])
            print(f"{window.number:6} windows: {pages * os.sysconf('SC_PAGE_SIZE') / 1e6:.2f} MB, "
                  f"{len(os.listdir('/proc/self/fd'))} files, "
                  f"{1e3 * statistics.median(self._lengths):.3f} ms", flush=True)
            self._lengths.clear()


@case
def main(
    windows: int = 20000,  # in all
    checkpoint: int = 20,  # windows from one to the next
    dem: str = "reference",  # back end
    out: Path = Path("out/long_run"),  # folder of the results
):
    """A long run of a small scene."""
    box, rubber, dt = Box((0.0, 0.0), (0.1, 0.1)), Material(E=1e6, nu=0.3), 1e-4
    block = Body(box, (4, 4), 2, linear(E=1e7, nu=0.3), rho=1000.0)
    top, bottom = Interface.top(box, (4,)), Support(lambda x: x[:, 1] < 1e-9, "xy")
    solid = MPM(Grid(Box((-0.05, 0.0), (0.15, 0.2)), (8, 8)), block, [bottom], top, gravity=(0.0, -9.81))
    ball = Spheres([[0.05, 0.11]], [[0.0, 0.0]], 0.01, 2500.0)
    scene = Scene(ball, Wall(top.x, top.elements), rubber, rubber, gravity=(0.0, -9.81))
    growth = Growth(max(windows // 20, 1))
    return Run("long_run", solid, scene, Scheme(dt=dt, t_end=windows * dt, substeps=10, dem=dem),
               Output(out, checkpoint=checkpoint), observe=lambda *sides: [growth])


if __name__ == "__main__":
    main.run()
