"""What a step of the DEM costs with many spheres: a cubic lattice of them that is pressed together.

    ./dev run python tests/benchmarks/spheres.py [dem=liggghts] [count=100000]

Seconds are those of the processor, of steps in which each sphere touches its six neighbours.
"""
import sys
from time import process_time

import numpy as np

from dem_liggghts import Interaction, Material, Scene, Spheres

RADIUS, DT = 0.01, 2e-5
NOTHING = np.zeros((0, 3))  # there is no moving wall


def per_step(count, backend, steps=20):
    """Seconds of a step with about ``count`` spheres, and how many there are."""
    along = round(count ** (1 / 3))
    places = np.stack(np.meshgrid(*[np.arange(along)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    x = 2.0002 * RADIUS * (places + 0.5)
    lattice = Spheres(x=x, v=-20.0 * (x - x.mean(axis=0)), radius=np.full(len(x), RADIUS), rho=2600.0)
    met = Interaction(0.3, 0.5)
    dem = Scene(lattice, None, Material(1e7, 0.25), None, met, met, (0.0, 0.0, 0.0)).open(backend, DT)
    dem.advance(300, NOTHING, NOTHING)
    begun = process_time()
    dem.advance(steps, NOTHING, NOTHING)
    return (process_time() - begun) / steps, len(x)


def main(backend="reference", counts=(1_000, 10_000, 100_000)):
    """Print a line for each of the ``counts``."""
    for count in counts:
        seconds, n = per_step(count, backend)
        print(f"{backend}: {n} spheres, {1e3 * seconds:.2f} ms per step, {1e9 * seconds / n:.0f} ns for each")


if __name__ == "__main__":
    words = dict(word.split("=") for word in sys.argv[1:])
    main(words.get("dem", "reference"), *([(int(words["count"]),)] if "count" in words else []))
