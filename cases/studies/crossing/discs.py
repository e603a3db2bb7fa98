"""Two elastic discs meet head-on, bounce and part: after Sulsky, Chen & Schreyer 1994 (doi
10.1016/0045-7825(94)90112-0).

Kinetic and strain energy together must be what they were, and the rims must meet when they do. The discs are
``bonded``, without contact: what they share is the grid, so that each feels the other as soon as they share a
node. How early that is, is part of what is found.
"""
from typing import Optional

import numpy as np

from mpm_fenicsx import MPM, Body, Cloud, Grid, neo_hooke
from mpm_fenicsx import Box as Room
from studies.crossing.common import march, numerics

R, E, NU, RHO, V = 0.2, 1000.0, 0.3, 1000.0, 0.1  # [m], [Pa], [-], [kg/m^3], [m/s] along each axis
CENTRES = (0.2, 0.2), (0.8, 0.8)  # [m]
END = 3.6  # [s]
MEET = (0.6 * np.sqrt(2.0) - 2.0 * R) / (2.0 * np.sqrt(2.0) * V)  # [s]
FELT = 1e-3  # of a disc's momentum, lost when it feels the other
SWEEP = [dict(h=0.1), dict(h=0.05), dict(h=0.025)]
MEASURE = "loss"


def seeds(centre: tuple, spacing: float) -> Cloud:
    """Points of a disc on a lattice of ``spacing`` [m], each with an equal share of its area."""
    line = spacing * (np.arange(-np.ceil(R / spacing), np.ceil(R / spacing)) + 0.5)
    x = np.stack(np.meshgrid(line, line, indexing="ij"), axis=-1).reshape(-1, 2)
    x = x[np.linalg.norm(x, axis=1) < R]
    return Cloud(np.array(centre) + x, np.full(len(x), np.pi * R**2 / len(x)))


def run(basis: str = "linear", h: float = 0.05, inertia: str = "consistent", transfer: Optional[str] = None,
        cfl: float = 0.1, points: int = 2, **others: str) -> dict:
    """Cells of ``h`` [m], inertia, transfer, time step over h / sqrt(E / rho), points per cell and direction;
    others: see ``numerics``. Returns ``energy``, the part of it that is there after they have parted,
    ``loss``, how far that is from all of it, and ``largest``, the most at any time; ``early``, the distance
    of the rims when they feel each other, in cells; ``restitution`` of the discs' velocities; ``momentum``,
    the change of the sum over that of one disc; ``helped``, in how many steps something had to help; and what
    it costs."""
    more = {} if transfer is None else {"transfer": transfer}
    discs = [Body(seeds(centre, h / points), None, None, neo_hooke(E, NU), RHO, velocity=(sign * V,) * 2)
             for centre, sign in zip(CENTRES, (1.0, -1.0))]
    cells = round(1.4 / h)
    grid = Grid(Room((-0.2, -0.2), (1.2, 1.2)), (cells, cells))
    solid = MPM(grid, discs, inertia=inertia, bonded=True, numerics=numerics(basis, **more, **others))
    dt = cfl * h / np.sqrt(E / RHO)
    steps = int(np.ceil(END / dt))

    def look(now: MPM) -> tuple:
        points = now.bodies[0].points
        mine = points.mass @ points.v
        return sum(now.energy().values()), *now.comm.allreduce(mine), *now.momentum()

    start = np.array(look(solid))
    taken = march(solid, dt, steps, look)
    energy, first, both = taken.rows[:, 0] / start[0], taken.rows[:, 1:3], taken.rows[:, 3:]
    speed = first.sum(axis=1) / start[1:3].sum()
    felt = dt * (1 + np.argmax(speed < 1.0 - FELT))
    helped = sum(count for _, count in solid.helped.values())
    solid.close()
    return {"loss": abs(1.0 - energy[-1]), "energy": energy[-1], "largest": energy.max(),
            "early": 2.0 * np.sqrt(2.0) * V * (MEET - felt) / h, "restitution": -speed[-1],
            "momentum": np.abs(both - start[3:]).max() / np.abs(start[1:3]).max(), "helped": helped,
            **taken.cost}
