"""Vibrating flyer: a free elastic block swings along its axis while it flies through the grid.

``scene=flight`` of ``extreme.py``: steel in plane stress, first mode along the axis, constant velocity of
100 m/s. Seen from the block nothing flies: the velocity of its end, less that of the flight, must be that
of the same block at rest in the grid, which is the reference.
"""
from dataclasses import replace

import numpy as np

from coupling.records.report import relative_l2
from mpm_fenicsx import MPM
from studies import extreme_references as known
from studies.crossing.common import March, march, numerics
from studies.extreme_keys import Ball, Block, Extreme, Resolution, Windows
from studies.extreme_scene import interface_on, make_solid

T_END, FLY = 1.68e-4, 100.0  # [s], eleven swings; [m/s]
SWEEP = [dict(h=5e-3), dict(h=2.5e-3)]
MEASURE = "noise"


def run(basis: str = "linear", h: float = 5e-3, cfl: float = 1.0, points: int = 3, **others: str) -> dict:
    """Cells of ``h`` [m], time step over that of an explicit method, points per cell and direction;
    others: see ``numerics``. Returns the noise (root mean square of the difference in the end's velocity
    to the block at rest, over that of the latter), the largest change of energy over that of the
    vibration, and what the flight costs."""
    given = Extreme("flight", 2, Block(length=0.04, height=0.02, fly=FLY), Ball(v0=0.1),
                    Resolution(h=h, points=points), Windows(cfl=cfl), (1.0, 1.0, 1.0),
                    numerics(basis, **others))
    flown, still = _fly(given), _fly(replace(given, block=replace(given.block, fly=0.0)))
    end, energy = flown.rows.T
    return {"noise": relative_l2(end - FLY, still.rows[:, 0]),
            "energy_change": np.abs(energy - energy[0]).max(), **flown.cost}


def _fly(given: Extreme) -> March:
    """Velocity of the end of the upper side [m/s] and energy seen from the block's centre of mass, over that
    of the vibration at the start."""
    p = known.timed(given)
    p = replace(p, windows=replace(p.windows, windows=round(T_END / p.dt)))  # for which there is room
    solid = make_solid(p, interface_on(p))
    mass, vibration = p.block.mass, 0.25 * p.block.mass * p.ball.v0**2

    def look(now: MPM) -> tuple:
        along = now.momentum()[0]
        return now.surface()[1][0, 0], (sum(now.energy().values()) - 0.5 * along**2 / mass) / vibration

    taken = march(solid, p.dt, p.windows.windows, look)
    solid.close()
    return taken
