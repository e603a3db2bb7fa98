"""Draws the picture of flows.md: fronts of dams that break beside the experiment's, on a smooth bed and with
the boundary layer of water on it, error against run time on three grids; some five minutes.

    ./dev run python docs/draw_dam.py                  docs/dam_break.png
"""
import sys
import time
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "cases"))

from coupling.pictures import figure  # noqa: E402
from references import dam  # noqa: E402 - of the cases
from studies.bed_layer import front  # noqa: E402

SCENES = {"as high as wide, smooth bed": (1, False), "as high as wide, boundary layer": (1, True),
          "twice as high, smooth bed": (2, False), "twice as high, boundary layer": (2, True)}
GRIDS = 8, 16, 32


def run(aspect, layer, cells):
    """T and Z of a run, the delay of the gate, the largest error of the front, and processor time [s]."""
    start = time.process_time()
    T, Z = front(aspect, cells, layer)
    spent = time.process_time() - start
    late, off = dam.beside(T, Z, aspect)
    return T, Z, late, np.abs(off).max(), spent


def draw(path, found):
    """found: scene → runs, one per grid. Fronts of the finest grid to the left, errors to the right."""
    plt = figure.pyplot()
    picture, (left, right) = plt.subplots(1, 2, figsize=(11, 4.2))
    for number, (name, runs) in enumerate(found.items()):
        T, Z, late = runs[-1][:3]
        left.plot(T + late, Z, color=f"C{number}", label=name)
        right.loglog([one[4] for one in runs], [100 * one[3] for one in runs], "o-", color=f"C{number}",
                     label=name)
        for cells, one in zip(GRIDS, runs):
            right.annotate(f"{cells}", (one[4], 100 * one[3]), textcoords="offset points", xytext=(0, 6))
    for aspect, marker in ((1, "o"), (2, "s")):
        left.plot(dam.AT[aspect], dam.FRONT, marker, color="black", markersize=4, fillstyle="none",
                  label=f"Martin & Moyce 1952, n² = {aspect}")
    left.set(xlabel="n t (g / a)^(1/2) [-], from the opening of the gate", ylabel="front x / a [-]",
             xlim=(0.0, 3.0), ylim=(0.9, 5.0))
    right.set(xlabel="processor time [s]; cells across the width at the points", ylim=(1.0, 20.0),
              ylabel="largest error of the front until 2.5 [%]")
    for axis in (left, right):
        axis.grid(alpha=0.3, which="both")
        axis.legend(frameon=False, fontsize="small")
    picture.tight_layout()
    picture.savefig(path, dpi=110)


if __name__ == "__main__":
    run(1, True, 4)  # everything compiled and loaded
    found = {name: [run(*scene, cells) for cells in GRIDS] for name, scene in SCENES.items()}
    for name, runs in found.items():
        print(name, [f"delay {one[2]:.3f}, error {one[3]:.4f}, at T 2 {np.interp(2.0, *one[:2]):.3f}, 2.5 "
                     f"{np.interp(2.5, *one[:2]):.3f}, {one[4]:.1f} s" for one in runs])
    draw(HERE / "dam_break.png", found)
