"""The figure of docs/element.md: soils in the triaxial cell, drained and undrained, a fluid at three rates.

    python docs/draw_element.py
"""
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
from mpm_fenicsx import PATHS, drive, drucker_prager, herschel_bulkley, mohr_coulomb  # noqa: E402

E, NU, PHI, PSI, C = 50e6, 0.3, 30.0, 10.0, 1e3


def main():
    """Draw it."""
    import matplotlib

    matplotlib.use("agg")
    from matplotlib import pyplot as plt

    figure, (left, middle, right) = plt.subplots(1, 3, figsize=(12, 3.8))
    for color, law in ("C0", mohr_coulomb(E, NU, PHI, PSI, C)), ("C1", drucker_prager(E, NU, PHI, PSI, C)):
        for pressure in (50e3, 100e3, 200e3):
            table = drive(law, PATHS["triaxial"](shortening=0.02, pressure=pressure))
            label = law.name if pressure == 100e3 else None
            left.plot(-100 * table["e_yy"], table["q"] / 1e3, color=color, label=label,
                      linestyle="-" if color == "C0" else "--")
    for name, style in ("triaxial", "-"), ("undrained", "--"):
        table = drive(mohr_coulomb(E, NU, PHI, PSI, C), PATHS[name](shortening=0.01, pressure=100e3))
        middle.plot(table["p"] / 1e3, table["q"] / 1e3, style, label=name)
    for rate in (0.1, 1.0, 10.0):
        table = drive(herschel_bulkley(1e5, 20.0, 50.0, 0.5), PATHS["simple_shear"](0.005, time=0.005 / rate))
        right.plot(table["e_xy"], table["s_xy"], label=f"{rate:g} /s")
    for axis, across, up in ((left, "shortening [%]", "q [kPa], cell at 50, 100, 200 kPa"),
                             (middle, "p [kPa]", "q [kPa]"), (right, "shear [-]", "shear stress [Pa]")):
        axis.set_xlabel(across)
        axis.set_ylabel(up)
        axis.grid(alpha=0.3)
        axis.legend(frameon=False, fontsize="small")
    figure.tight_layout()
    figure.savefig(HERE / "element.png", dpi=100)


if __name__ == "__main__":
    main()
