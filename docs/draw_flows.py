"""Draws the picture of flows.md: Bingham's fluid and a granular layer on an incline and a viscous current on
three grids each, beside what is known of them, and errors over run time; some five minutes.

    ./dev run python docs/draw_flows.py                  docs/flows.png
"""
import sys
import time
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))

from coupling.pictures import figure  # noqa: E402
from mpm_fenicsx import herschel_bulkley, mu_i  # noqa: E402
from tests.mpm import incline  # noqa: E402
from tests.validation.test_flows import (  # noqa: E402
    BEADS,
    MUD,
    SAND,
    SPREADS,
    VISCOSITY,
    YIELD,
    current,
    flown,
    similar_current,
)

TIMES, E = np.linspace(0.1, 1.0, 10), 5e4
LAYERS = {"5 cells, steps of 1 ms": (5, 1e-3, 3.2, 40, "bspline"),
          "10, 0.5 ms": (10, 5e-4, 3.2, 40, "bspline"),
          "20, 0.5 ms": (20, 5e-4, 3.2, 40, "bspline"),
          "10, 2 ms, GIMP, layer half as long": (10, 2e-3, 1.6, 20, "gimp")}
CELLS = 0.02, 0.01, 0.005  # of the currents [m]
STEADY = incline.bagnold(**SAND, **BEADS)


def start(y):
    """Velocity down the slope at the start."""
    return 0.8 * STEADY(y)


def layer(across, dt, length, along, basis):
    """Velocities at the surface over Bagnold's and differences from the 1-D equation at TIMES."""
    solid = incline.layer(mu_i(E, 0.3, **BEADS), length=length, cells=(along, across), basis=basis, **SAND,
                          transfer="tpic", velocity=lambda x: np.column_stack([start(x[:, 1]), 0 * x[:, 1]]))
    y, expected = incline.sheared_in_time(TIMES, start, **SAND, stress=incline.grains(E / 2.6, **BEADS))
    surface, off = [], []
    for right in expected:
        for _ in range(round(0.1 / dt)):
            solid.advance(dt)
        at, v = incline.profile(solid, length, SAND["depth"], across)
        surface.append(v[-1] / STEADY(at[-1]))
        off.append(incline.difference(at, v, lambda x, right=right: np.interp(x, y, right)))
    solid.close()
    return surface, off


def timed(function, *given):
    """What it returns, and its processor time [s]."""
    begun = time.process_time()
    found = function(*given)
    return found, time.process_time() - begun


def draw_mud(axis):
    """Profiles of Bingham's fluid. Returns label, processor time [s] and error of each grid."""
    velocity, _ = incline.bingham(**MUD, yield_stress=YIELD, viscosity=VISCOSITY)
    rows, law = [], herschel_bulkley(1e5, VISCOSITY, YIELD)
    for across, marker in ((5, "o"), (10, "s"), (20, ".")):
        (y, v), spent = timed(flown, law, MUD, (50, across), 4.0, 80, 5e-3)
        axis.plot(v, y, marker, label=f"{across} cells", fillstyle="none")
        rows.append((f"{across}", spent, incline.difference(y, v, velocity)))
    y = np.linspace(0.0, MUD["depth"], 200)
    axis.plot(velocity(y), y, "k--", label="closed form")
    axis.set(xlabel="velocity [m/s]", ylabel="height [m]", title="Bingham's fluid, 15°, from rest, at 0.4 s")
    return rows


def draw_layers(axis):
    """Velocities at the surface of the granular layer. Returns as ``draw_mud``."""
    rows = []
    for name, scene in LAYERS.items():
        (surface, off), spent = timed(layer, *scene)
        axis.plot(TIMES, surface, "o-", markersize=3, label=name)
        print(name, "surface", np.round(surface, 4), "off", np.round(off, 4), f"{spent:.1f} s", flush=True)
        rows.append((f"{scene[0]}", spent, off[-1]))
    for name, modulus, style in (("1-D equation", E / 2.6, "--"), ("1-D without elastic strain", 1e12, ":")):
        y, v = incline.sheared_in_time(TIMES, start, **SAND, stress=incline.grains(modulus, **BEADS))
        axis.plot(TIMES, v[:, -1] / STEADY(y[-1]), style, color="black", label=name)
    axis.set(xlabel="time [s]", ylabel="velocity at the surface over Bagnold's [-]",
             title="granular layer, mu(I), 26°")
    return rows[:3]


def draw_currents(axis):
    """Fronts of blocks, and prefactors of currents begun as the similarity solution. Returns as ``draw_mud``,
    of the latter."""
    rows, times = [], np.array([0.5, 1.0, 2.0, 3.0, 5.0, 7.0, 10.0])
    expected = incline.spreading(times, 0.2, 0.1, 0.1, 0.6)
    for h in CELLS:
        fronts, spent = timed(current, h, times)
        axis.loglog(times, fronts, "o-", markersize=3, label=f"block, cells of {1000 * h:.0f} mm")
        print(h, "front over lubrication", np.round(fronts / expected, 4), f"{spent:.1f} s", flush=True)
        (_, front, mean), spent = timed(similar_current, h, [1.5, 2.0, 3.0, 4.0])
        print(h, "prefactors", np.round(front, 4), np.round(mean, 4), f"{spent:.1f} s", flush=True)
        rows.append((f"{1000 * h:.0f} mm", spent, abs(front / 1.411 - 1.0).max()))
    axis.loglog(times, expected, "--", color="black", label="lubrication, from the same block")
    axis.loglog(times, 1.411 * SPREADS * times**0.2, ":", color="black", label="Huppert 1982, late")
    axis.set(xlabel="time [s]", ylabel="front [m]", title="viscous current")
    return rows


def main():
    """Run all, print, draw."""
    plt = figure.pyplot()
    picture, axes = plt.subplots(2, 2, figsize=(11, 8.4))
    last = axes[1, 1]
    timed(flown, herschel_bulkley(1e5, VISCOSITY, YIELD), MUD, (50, 5), 4.0, 2, 5e-3)  # everything compiled
    timed(current, 0.02, [0.04])
    for name, rows in (("Bingham: velocity, relative L2", draw_mud(axes[0, 0])),
                       ("layer: velocity at 1 s, relative L2", draw_layers(axes[0, 1])),
                       ("current, begun similar: prefactor, largest", draw_currents(axes[1, 0]))):
        print(name, [f"{label}: {spent:.1f} s, {error:.4f}" for label, spent, error in rows], flush=True)
        last.loglog([row[1] for row in rows], [100.0 * row[2] for row in rows], "o-", label=name)
        for label, spent, error in rows:
            last.annotate(label, (spent, 100.0 * error), textcoords="offset points", xytext=(4, 5))
    last.set(xlabel="processor time [s]; cells over the depth, or their size, at the points",
             ylabel="error [%]", title="error over run time")
    for axis in axes.flat:
        axis.grid(alpha=0.3, which="both")
        axis.legend(frameon=False, fontsize="small")
    picture.tight_layout()
    picture.savefig(HERE / "flows.png", dpi=110)


if __name__ == "__main__":
    main()
