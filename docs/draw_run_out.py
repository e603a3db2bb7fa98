"""Draws the picture of column.md: run-out and height of columns of soil and of mu(I) grains beside published
laws; some ten minutes.

    ./dev run python docs/draw_run_out.py                  docs/run_out.png
"""
import sys
import tempfile
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "cases"))

import column_collapse  # noqa: E402 - of the cases

from coupling.pictures import figure  # noqa: E402

WIDTH, RATIOS = 0.1, (0.5, 1.0, 2.0, 4.0, 8.0)
SOILS = {"mu(I), numbers of Lagrée et al.": lambda a: dict(
             law="mu_i", phi=17.745, phi_2=30.964, I_0=0.4, grain_diameter=a * WIDTH / 65, rho=1470.0),
         "mu(I), glass beads": lambda a: dict(law="mu_i", phi=20.9, grain_diameter=1.15e-3, rho=1470.0),
         "Mohr–Coulomb, 29.5 degrees": lambda a: dict(phi=29.5)}


def run(folder, a, soil):
    """Largest x and height at the end, both in widths of the column, the former from its foot."""
    end = round(4.5 * np.sqrt(a * WIDTH / 9.81), 3)
    history = column_collapse.main(aspect=a, h=0.01, dt=1e-3, t_end=end, out=folder, **soil(a))["solid"]
    return history["front"][-1] / WIDTH - 1.0, history["height"][-1] / WIDTH


def draw(path, found):
    """found: soil → run-outs and heights, shape (2, ratios); beside the laws."""
    plt = figure.pyplot()
    picture, (left, right) = plt.subplots(1, 2, figsize=(11, 4.2))
    a = np.geomspace(0.4, 10.0, 200)
    laws = {"2.2 a, 3.9 a^0.7 (Lagrée et al. 2011, mu(I))": np.where(a < 7.0, 2.2 * a, 3.9 * a**0.7),
            "1.8 a, 2.3 a^(2/3) (Lajeunesse et al. 2005, beads)": np.where(a < 3, 1.8 * a, 2.3 * a**(2 / 3)),
            "1.2 a, 1.9 a^(2/3) (Lube et al. 2005, sand)": np.where(a < 2.3, 1.2 * a, 1.9 * a**(2 / 3))}
    for style, (name, law) in zip(("-", "--", ":"), laws.items()):
        left.loglog(a, law, style, color="black", linewidth=1, label=name)
    right.loglog(a, np.minimum(a, 0.65 * a**0.35), "-", color="black", linewidth=1,
                 label="0.65 a^0.35 (Lagrée et al. 2011, mu(I))")
    for marker, (name, values) in zip("osD", found.items()):
        for axis, value in zip((left, right), values):
            axis.loglog(RATIOS, value, marker, label=name)
    left.set(xlabel="height over width at the start, a [-]", ylabel="run-out of the front over the width [-]",
             ylim=(0.15, 25.0))
    right.set(xlabel="height over width at the start, a [-]", ylabel="height at the end over the width [-]")
    for axis in (left, right):
        axis.grid(alpha=0.3, which="both")
        axis.legend(frameon=False, fontsize="small")
    picture.tight_layout()
    picture.savefig(path, dpi=110)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        found = {name: np.array([run(folder, a, soil) for a in RATIOS]).T for name, soil in SOILS.items()}
    print(found)
    draw(HERE / "run_out.png", found)
