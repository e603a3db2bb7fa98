"""Bar in its first mode: an elastic bar, held at one end, swings along its axis so far that points cross
cells.

A quarter wave with strains of 7.5 %; the free end swings by 1.2 m to both sides, five cells of 25 cm. The
bar must keep its energy, and its momentum must follow that of a fine finite-element mesh of the same law
in the same time steps (``references/vibrating_bar.py``), as it has no closed solution at this amplitude.
"""
import numpy as np

from coupling.records.report import relative_l2
from mpm_fenicsx import MPM, Body, Box, Grid, Support, neo_hooke
from references import vibrating_bar
from studies.crossing.common import march, numerics

LENGTH, E, RHO = 25.0, 100.0, 1.0  # [m], [Pa], [kg/m^3]: waves of 10 m/s, a period of 10 s
SWEEP = [dict(h=1.0), dict(h=0.5), dict(h=0.25)]
MEASURE = "history"


def run(basis: str = "linear", h: float = 0.5, speed: float = 0.75, periods: int = 10, dt: float = 0.1,
        points: int = 2, **others: str) -> dict:
    """Cells of ``h`` [m], end speed [m/s], swings, time step [s], points per cell and direction; others: see
    ``numerics``. Returns the energy left, the largest energy ever (both over that at the start), errors of
    the period and of the momentum's history (relative), and what it costs."""
    n, steps = round(LENGTH / h), round(periods * 10.0 / dt)

    def start(x: np.ndarray) -> np.ndarray:
        return np.column_stack([speed * np.sin(0.5 * np.pi / LENGTH * x[:, 0]), 0 * x[:, 0]])

    bar = Body(Box((0.0, 0.0), (LENGTH, h)), (n, 1), points, neo_hooke(E, 0.0), RHO, velocity=start)
    room = int(np.ceil(2.0 * speed / 0.75 / h)) + 2  # the free end goes 1.2 m beyond the bar
    grid = Grid(Box((0.0, 0.0), (LENGTH + room * h, h)), (n + room, 1))
    held = [Support(lambda x: x[:, 0] < 1e-9, "x"), Support(lambda x: x[:, 1] > -1.0, "y")]
    solid = MPM(grid, bar, held, numerics=numerics(basis, **others))
    begin = sum(solid.energy().values())
    taken = march(solid, dt, steps, lambda now: (sum(now.energy().values()), now.momentum()[0]))
    solid.close()
    energy, momentum = taken.rows.T
    exact = vibrating_bar.vibrate(LENGTH, E, RHO, speed, dt, steps)
    t = dt * np.arange(1, steps + 1)
    swing = vibrating_bar.period(t, exact.momentum)
    return {"energy": energy[-1] / begin, "most": energy.max() / begin,
            "period": vibrating_bar.period(t, momentum) / swing - 1,
            "history": relative_l2(momentum / h, exact.momentum), **taken.cost}
