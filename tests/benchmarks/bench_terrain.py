"""What a window of the particles costs on a large terrain, against the same terrain cut to where they are.

    ./dev run python tests/benchmarks/bench_terrain.py [heights=512] [windows=200]

A raster of 512 x 512 heights against 100 x 30 cells of it, with eight rocks that roll down on it;
milliseconds of processor time per window of 25 steps, the two in turn, for each back end, with what a coupled
run asks for besides.
"""
import sys
from time import process_time

import numpy as np

from dem_liggghts import Interaction, Material, Scene, Spheres, Wall
from mpm_fenicsx import Box, Terrain

CELL, RADIUS, STEPS, DT = 1.0, 0.4, 25, 2e-4


def heights(x, y):
    """Of a rough slope [m]."""
    return 0.4 * (600.0 - x) + 0.3 * np.sin(0.7 * x) * np.cos(0.9 * y)


def discs(count):
    """An interface far from the rocks."""
    return Wall.discs([[60.0, 10.0 + 0.05 * k, 300.0] for k in range(count)], 0.02)


def opened(cells, backend):
    """A back end with eight rocks on the terrain of so many ``cells``, (2,), around (50, 15) m."""
    lower = np.array([50.0, 15.0]) - np.array(cells) // 2
    terrain = Terrain.function(heights, Box(lower, lower + cells), cell=CELL)
    xy = np.stack(np.meshgrid(20.0 + 2.0 * np.arange(4), [14.0, 16.0], indexing="ij"), axis=-1).reshape(-1, 2)
    x = np.column_stack([xy, terrain.height(xy) + 1.5 * RADIUS])
    rocks = Spheres(x, np.zeros_like(x), RADIUS, rho=2600.0)
    stone, met = Material(1e8, 0.25), Interaction(0.5, 0.5)
    scene = Scene(rocks, discs(1), stone, stone, met, met, gravity=(0.0, 0.0, -9.81),
                  structures=[terrain.structure("terrain", friction=0.5)])
    return scene.open(backend, DT), len(terrain.elements)


def measured(dems, work, windows):
    """Milliseconds of ``work`` with each of the ``dems`` per window, in turns."""
    seconds = np.zeros(len(dems))
    for _ in range(windows):
        for k, dem in enumerate(dems):
            begun = process_time()
            work(dem)
            seconds[k] += process_time() - begun
    return 1e3 * seconds / windows


def advance(dem):
    """A window in which the interface is at rest."""
    x = np.array(dem.scene.wall.nodes)
    dem.advance(STEPS, x, np.zeros_like(x))


def renew(dem):
    """Another interface, of more or fewer discs."""
    dem.replace_wall(discs(200 - len(dem.scene.wall.nodes) // 2))


WORKS = {"a window": advance, "energies": lambda dem: dem.energy(),
         "what sets it back": lambda dem: getattr(dem, "remember", dem.get_state)(),
         "another interface": renew}


def main(side=512, windows=200):
    """Print a line for each back end and work."""
    for backend in ("reference", "liggghts"):
        begun, dems, counts = process_time(), [], []
        for cells in ((side - 1, side - 1), (100, 30)):
            dem, count = opened(cells, backend)
            print(f"{backend}: {count} triangles, opened in {process_time() - begun:.2f} s")
            begun = process_time()
            dems.append(dem)
            counts.append(count)
        for name, work in WORKS.items():
            measured(dems, work, 20)
            large, small = measured(dems, work, windows)
            print(f"{backend}: {name} {large:.2f} and {small:.2f} ms, {large / small:.2f} times as much")
        print("  farthest apart", abs(dems[0].particles()["x"] - dems[1].particles()["x"]).max(), "m")


if __name__ == "__main__":
    words = dict(word.split("=") for word in sys.argv[1:])
    main(int(words.get("heights", 512)), int(words.get("windows", 200)))
