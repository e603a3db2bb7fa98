"""Compaction of a column 50 m high under its weight: to less than a third of its height at the foot.

One cell wide, 10 kPa (nu 0), 80 kg/m^3, gravity 10 m/s^2, in equal load steps without inertia, Hencky's law:
the column of AMPLE (Coombs & Augarde 2020, doi 10.1016/j.advengsoft.2019.102748, section 5.1). Nothing moves
sideways, so the vertical stress is rho g (l0 - Y) whatever the law, Y being the height at rest. The error is
theirs, the sum over the points of |stress - exact| V0 over rho g l0 sum V0. ``E=1e6`` is the stiff column,
whose top goes down by 2 %.
"""
import time

import numpy as np

from mpm_fenicsx import MPM, Body, Box, Grid, Support, von_mises
from studies.crossing.common import gather, numerics

HEIGHT, RHO, G = 50.0, 80.0, 10.0  # [m], [kg/m^3], [m/s^2]
NEVER = 1e12  # yields at [Pa]: what is left is Hencky's law
SWEEP = [dict(cells=n) for n in (8, 16, 32, 64)]
MEASURE = "error"


def run(basis: str = "linear", cells: int = 16, E: float = 1e4, points: int = 2, load_steps: int = 80,
        **others: str) -> dict:
    """Column of so many ``cells``, modulus ``E`` [Pa], points per cell and direction; others: see
    ``numerics``. Returns the error of the stress, how far the top has gone down [m], the speed that is left,
    fastest point in ten time steps over that of free fall [-], and what it costs, ``newton`` iterations per
    load step."""
    h = HEIGHT / cells
    body = Body(Box((0.0, 0.0), (h, HEIGHT)), (1, cells), points, von_mises(E, 0.0, yield_stress=NEVER), RHO)
    grid = Grid(Box((0.0, 0.0), (h, HEIGHT + h)), (1, cells + 1))
    supports = [Support(lambda x: x[:, 1] < 1e-9, "y", name="floor"),
                Support(lambda x: x[:, 0] > -1.0, "x", name="sides")]
    solid = MPM(grid, body, supports, gravity=(0.0, -G), numerics=numerics(basis, **others))
    start = gather(solid, solid.bodies[0].points.x[:, 1])
    volume = gather(solid, solid.bodies[0].points.V0)
    began = time.process_time()
    settled = solid.settle(load_steps)
    seconds = time.process_time() - began
    stress = gather(solid, solid.cauchy_stress()[:, 1, 1])
    end = gather(solid, solid.bodies[0].points.x[:, 1])
    dt, left = 0.1 * h / np.sqrt(E / RHO), 0.0
    for n in range(10):
        solid.advance(dt)
        left = max(left, np.abs(gather(solid, solid.bodies[0].points.v)).max() / (G * (n + 1) * dt))
    solid.close()
    weight = RHO * G
    error = np.abs(stress + weight * (HEIGHT - start)) @ volume / (weight * HEIGHT * volume.sum())
    return {"error": error, "sinks": (start - end).max(), "speed": left,
            "newton": settled.iterations / settled.steps, "step_ms": 1e3 * seconds / settled.steps,
            "seconds": seconds}
