"""Draws the picture of flows.md: fronts of dams that break beside the experiment's, error against run time on
three grids; some four minutes.

    ./dev run python docs/draw_dam.py                  docs/dam_break.png
"""
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "cases"))

import dam_break  # noqa: E402 - of the cases

from coupling.pictures import figure  # noqa: E402
from references import dam  # noqa: E402

SCENES = {"as high as wide, smooth bed": (1, "slip"), "as high as wide, sticks": (1, "stick"),
          "twice as high, smooth bed": (2, "slip")}
GRIDS = 8, 16, 32


def run(folder, aspect, floor, cells):
    """T and Z of a run, the delay of the gate, the largest error of the front, and processor time [s]."""
    start = time.process_time()
    history = dam_break.main(aspect=aspect, floor=floor, cells=cells, dt=0.02 / cells, out=folder)["solid"]
    spent = time.process_time() - start
    T, Z = dam.scaled(history, aspect, dam.WIDTH / cells)
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
    with tempfile.TemporaryDirectory() as folder:
        run(folder, 1, "slip", 4)  # everything compiled and loaded
        found = {name: [run(folder, *scene, cells) for cells in GRIDS] for name, scene in SCENES.items()}
    for name, runs in found.items():
        print(name, [f"delay {one[2]:.3f}, error {one[3]:.4f}, {one[4]:.1f} s" for one in runs])
    draw(HERE / "dam_break.png", found)
