"""Draws the picture of flows.md: a granular layer and a viscous current in time, beside the equations of one
dimension; some three minutes.

    ./dev run python docs/draw_flows.py                  docs/flows.png
"""
import sys
import time
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))

from coupling.pictures import figure  # noqa: E402
from mpm_fenicsx import mu_i  # noqa: E402
from tests.mpm import incline  # noqa: E402
from tests.validation.test_flows import BEADS, SAND, current  # noqa: E402

TIMES, E = np.linspace(0.1, 1.0, 10), 5e4
LAYERS = {"5 cells, steps of 1 ms": (5, 1e-3, 3.2, 40, "bspline"),
          "10, 0.5 ms": (10, 5e-4, 3.2, 40, "bspline"),
          "20, 0.5 ms": (20, 5e-4, 3.2, 40, "bspline"),
          "10, 2 ms, GIMP, layer half as long": (10, 2e-3, 1.6, 20, "gimp")}
STEADY = incline.bagnold(**SAND, **BEADS)


def start(y):
    """Velocity down the slope at the start."""
    return 0.8 * STEADY(y)


def layer(across, dt, length, along, basis):
    """Velocities at the surface over Bagnold's and differences from the 1-D equation at TIMES, time [s]."""
    solid = incline.layer(mu_i(E, 0.3, **BEADS), length=length, cells=(along, across), basis=basis, **SAND,
                          transfer="tpic", velocity=lambda x: np.column_stack([start(x[:, 1]), 0 * x[:, 1]]))
    y, expected = incline.sheared_in_time(TIMES, start, **SAND, stress=incline.grains(E / 2.6, **BEADS))
    begun, surface, off = time.process_time(), [], []
    for right in expected:
        for _ in range(round(0.1 / dt)):
            solid.advance(dt)
        at, v = incline.profile(solid, length, SAND["depth"], across)
        surface.append(v[-1] / STEADY(at[-1]))
        off.append(incline.difference(at, v, lambda x, right=right: np.interp(x, y, right)))
    solid.close()
    return surface, off, time.process_time() - begun


def main():
    """Run all, print, draw."""
    plt = figure.pyplot()
    picture, (left, right) = plt.subplots(1, 2, figsize=(11, 4.2))
    for name, scene in LAYERS.items():
        surface, off, spent = layer(*scene)
        left.plot(TIMES, surface, "o-", markersize=3, label=name)
        print(name, "surface", np.round(surface, 4), "off", np.round(off, 4), f"{spent:.1f} s", flush=True)
    for name, modulus, style in (("1-D equation", E / 2.6, "--"), ("1-D without elastic strain", 1e12, ":")):
        y, v = incline.sheared_in_time(TIMES, start, **SAND, stress=incline.grains(modulus, **BEADS))
        left.plot(TIMES, v[:, -1] / STEADY(y[-1]), style, color="black", label=name)
    times = np.array([0.5, 1.0, 2.0, 3.0, 5.0, 7.0, 10.0])
    expected = incline.spreading(times, 0.2, 0.1, 0.1, 0.6)
    for h in (0.01, 0.005):
        begun = time.process_time()
        fronts = np.array(current(h, times))
        right.loglog(times, fronts, "o-", markersize=3, label=f"cells of {1000 * h:.0f} mm")
        spent = time.process_time() - begun
        print(h, "front over lubrication", np.round(fronts / expected, 4), f"{spent:.1f} s", flush=True)
    right.loglog(times, expected, "--", color="black", label="lubrication, from the same block")
    right.loglog(times, 1.411 * (9.81 * 0.02**3 / 0.3 * times) ** 0.2, ":", color="black",
                 label="Huppert 1982, late")
    left.set(xlabel="time [s]", ylabel="velocity at the surface over Bagnold's [-]")
    right.set(xlabel="time [s]", ylabel="front [m]")
    for axis in (left, right):
        axis.grid(alpha=0.3, which="both")
        axis.legend(frameon=False, fontsize="small")
    picture.tight_layout()
    picture.savefig(HERE / "flows.png", dpi=110)


if __name__ == "__main__":
    main()
