"""The dam of ``cases/dam_break.py`` on a bed along which the water has a laminar boundary layer.

    python cases/studies/bed_layer.py             both columns on 8 and 16 cells, without and with the layer

The layer is 0.3 mm thick, a tenth of a cell, so it is not resolved: its drag is taken from the velocity of
the points in the lowest cells between two steps. Bed that the tip has reached at the distance xi behind it
has rubbed for xi / u, so that, by Rayleigh's plate that starts to move (Batchelor, An Introduction to Fluid
Dynamics, section 4.3),

    tau = rho u^2 (nu / (pi u xi))^(1/2),

without a number to choose. One rank. The impulse is not in the books of the solid.
"""
import sys
from pathlib import Path
from typing import Tuple

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
import dam_break  # noqa: E402 - of the cases

from references import dam  # noqa: E402

VISCOSITY = 1e-6  # of water, kinematic [m^2/s]


def slow(x: np.ndarray, v: np.ndarray, mass: np.ndarray, cell: float, dt: float) -> None:
    """Take the drag of the bed y = 0 over ``dt`` [s] from the velocities v [m/s], shape (n, 2), of the
    points at x [m] of ``mass`` [kg] that are in the lowest cells, of ``cell`` [m]; implicit to first order.
    Bed below empty cells between points belongs to the nearest ones: the tip gets many times as long.

    >>> v = np.array([(1.0, 0.0)])
    >>> slow(np.array([(1e-3, 1e-3)]), v, np.array([4e-3]), cell=2e-3, dt=1e-3)
    >>> round(1.0 - v[0, 0], 5)  # 2 rho u (nu u L / pi)^(1/2) dt / m with L = 1.5 mm
    0.01081
    """
    low = np.flatnonzero(x[:, 1] < cell)
    number = (x[low, 0] / cell).astype(int)
    total = np.bincount(number, mass[low])
    filled = np.flatnonzero(total)
    u = np.bincount(number, mass[low] * v[low, 0])[filled] / total[filled]
    between = cell * (0.5 * (filled[1:] + filled[:-1]) + 0.5)
    tip = x[:, 0].max() + 0.25 * cell
    ends = np.concatenate([[0.0], between, [tip]])
    behind = np.sqrt(np.maximum(tip - ends, 0.0))  # roots of xi
    rub = 2.0 * dam.DENSITY * np.sqrt(VISCOSITY / np.pi * np.maximum(u, 0.0)) * (behind[:-1] - behind[1:])
    change = np.zeros(len(total))
    change[filled] = u / (1.0 + dt * rub / total[filled]) - u  # rub: the drag over u [kg/s]
    v[low, 0] += change[number]


def front(aspect: int, cells: int, layer: bool = True) -> Tuple[np.ndarray, np.ndarray]:
    """T and Z of a column, see ``references.dam``, with the layer or without."""
    cell, dt = dam.WIDTH / cells, 0.02 / cells
    solid = dam_break.main.__wrapped__(aspect=aspect, cells=cells).solid
    place = [solid.points.x[:, 0].max()]
    for _ in range(10 * cells):
        if layer:
            slow(solid.points.x, solid.points.v, solid.points.mass, cell, dt)
        solid.advance(dt)
        place.append(solid.points.x[:, 0].max())
    solid.close()
    return dam.scaled(dt * np.arange(len(place)), np.array(place), aspect, cell)


def main() -> None:
    """Print what comes out for both columns on two grids."""
    for aspect in (1, 2):
        for cells in (8, 16):
            for layer in (False, True):
                late, off = dam.beside(*front(aspect, cells, layer), aspect)
                print(f"n^2 = {aspect}, {cells} cells, layer {layer}: delay {late:.3f}, largest error "
                      f"{abs(off).max():.4f}")


if __name__ == "__main__":
    main()
