"""The figure of docs/softening.md: a sheared layer and a pressed sample of clay that softens, on three grids.

    python docs/draw_softening.py
"""
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
from tests.mpm import biaxial, shear_layer  # noqa: E402

ROWS = {"shear": (4, 8, 16), "biaxial": (8, 16, 32)}


def main():
    """Draw it."""
    import matplotlib

    matplotlib.use("agg")
    from matplotlib import pyplot as plt

    figure, (left, middle, right) = plt.subplots(1, 3, figsize=(12, 3.8), width_ratios=(2, 2, 1.2))
    for color, n, m in zip(("C0", "C1", "C2"), ROWS["shear"], ROWS["biaxial"]):
        for regular, style in ((False, ":"), (True, "-")):
            u, tau = shear_layer.sheared(n, regular)
            left.plot(1e3 * u, tau, style, color=color, label=f"{n} rows" if regular else None)
            (v, q), x, strain = biaxial.pressed(m, regular)
            middle.plot(1e3 * v, q, style, color=color, label=f"{m} rows" if regular else None)
        print(f"{n} and {m} rows drawn")
    left.plot(1e3 * u, shear_layer.exact(u), "k--", linewidth=0.8, label="closed form")
    dots = right.scatter(*x.T, c=100 * strain, s=3, marker="s", vmax=10.0)
    right.set_aspect("equal")
    figure.colorbar(dots, ax=right, label="plastic strain [%]")
    for axis, across, up in ((left, "slide of the top [mm]", "shear stress [Pa]"),
                             (middle, "shortening [mm]", "axial stress [Pa]")):
        axis.set_xlabel(across)
        axis.set_ylabel(up)
        axis.grid(alpha=0.3)
        axis.legend(frameon=False, fontsize="small")
    figure.tight_layout()
    figure.savefig(HERE / "softening.png", dpi=100)


if __name__ == "__main__":
    main()
