"""Step wave: one end of an elastic bar is pulled away at constant velocity, and points there cross a cell.

Behind the front, which runs into the bar with c = sqrt(E / rho), the stress is rho c v for an end
velocity v, to a fourth of the strain v / c (at most 1.3 %). Any grid rings at a jump; so the plateau is
measured away from the front: from the end to six tenths of the bar, when the front has come to eight
tenths. Without crossings, ``cells=0.02``, it is then 1.000 with a spread of 0.004.
"""
import numpy as np

from mpm_fenicsx import MPM, Body, Box, Grid, Interface, Penalty, Support, neo_hooke
from studies.crossing.common import gather, march, numerics

LENGTH, E, RHO = 25.0, 100.0, 1.0  # [m], [Pa], [kg/m^3]
C = np.sqrt(E / RHO)  # [m/s]
FRONT, PLATEAU = 0.8, 0.6  # how far the front runs, and up to where it is measured, over the length
ROOM = 4  # cells of the grid beyond each end
SWEEP = [dict(h=0.5), dict(h=0.25), dict(h=0.125)]
MEASURE = "error"


def run(basis: str = "linear", h: float = 0.25, cells: float = 1.0, cfl: float = 0.5, ramp: int = 0,
        points: int = 2, **others: str) -> dict:
    """Cells of ``h`` [m], by how many of them the end is pulled (negative: pushed), time step over h / c,
    steps over which its velocity rises, points per cell and direction; others: see ``numerics``. Returns mean
    and spread (standard deviation over the points) of the plateau's stress over rho c v, the spread without
    the two cells at the end, the root of the mean squared error, and what it costs."""
    n, dt, t_end = round(LENGTH / h), cfl * h / C, FRONT * LENGTH / C
    steps, v, rise = round(t_end / dt), cells * h / t_end, ramp * dt

    def motion(t: float) -> tuple:
        return v * (t - 0.5 * rise if t > rise else 0.5 * t * t / (rise or 1.0)), 0.0

    bar = Body(Box((0.0, 0.0), (LENGTH, h)), (n, 1), points, neo_hooke(E, 0.0), RHO)
    grid = Grid(Box((-ROOM * h, 0.0), (LENGTH + ROOM * h, h)), (n + 2 * ROOM, 1))
    end = Interface.line((LENGTH, 0.0), (LENGTH, h), 1)
    solid = MPM(grid, bar, [Support(lambda x: x[:, 1] > -1.0, "y")],
                penalties=[Penalty(end, motion=motion, name="end")], numerics=numerics(basis, **others))
    start = gather(solid, solid.bodies[0].points.x[:, 0])
    taken = march(solid, dt, steps, lambda now: now.reaction("end")[0])
    stress = gather(solid, solid.cauchy_stress()[:, 0, 0]) / (RHO * C * v)
    solid.close()
    depth = LENGTH - start
    plateau, inside = (stress[(depth > 2 * h * cut) & (depth < PLATEAU * LENGTH)] for cut in (0, 1))
    return {"plateau": plateau.mean(), "spread": plateau.std(), "inside": inside.std(),
            "error": np.sqrt(((plateau - 1) ** 2).mean()), **taken.cost}
