"""Cantilever bent to k = P L^2 / (E I) = 10: its end goes down by eight tenths of its length.

10 m x 1 m, 12 MPa, nu 0.2, plane strain, 100 kN across the end in equal load steps without inertia: AMPLE's
beam (Coombs & Augarde 2020, doi 10.1016/j.advengsoft.2019.102748). Beside it finite elements of the same law,
``references.cantilever``, at k = 1, 5 and 10.
"""
import time

import numpy as np

from mpm_fenicsx import MPM, Body, Box, Grid, Interface, Load, Support, neo_hooke
from references import cantilever
from references.cantilever import DEPTH, FORCE, LENGTH, NU, E
from studies.crossing.common import numerics

# Finite elements, 80 x 8, see ``references.cantilever``: load factor → v, u of the middle of the end [m]
FINE = {0.1: (2.93742, 0.52789), 0.5: (7.15276, 3.79697), 1.0: (8.21205, 5.507)}
ROOM = 10.0  # of the grid below the beam [m]
SWEEP = [dict(h=0.5), dict(h=0.25), dict(h=0.125)]
MEASURE = "error"


def run(basis: str = "linear", h: float = 0.25, points: int = 4, load_steps: int = 50, **others: str) -> dict:
    """Cells of ``h`` [m], points per cell and direction; others: see ``numerics``. Returns the deflections v
    and u of the end under the whole load [m], the errors of v there and, as ``error_1`` and ``error_5``, at
    k = 1 and 5, relative to v of the finite elements, the shortest load step as part of an equal one, and
    what it costs, ``newton`` iterations per load step."""
    box = Box((0.0, 0.0), (LENGTH, DEPTH))
    n = Grid.counts((LENGTH, DEPTH), h)
    body = Body(box, n, points, neo_hooke(E, NU), rho=1000.0)
    grid = Grid(Box((0.0, -ROOM), (LENGTH + 1.0, DEPTH + 1.0)), Grid.counts((LENGTH + 1.0, ROOM + 2.0), h))
    end = Interface.line((LENGTH - 1e-6 * h, 0.0), (LENGTH - 1e-6 * h, DEPTH), 2 * n[1])
    share = np.full(len(end.x), 1.0)
    share[[0, -1]] = 0.5
    load = Load(end, force=np.outer(share / share.sum(), (0.0, -FORCE)), name="end")
    solid = MPM(grid, body, [Support(lambda x: x[:, 0] < 1e-9, "xy")], end, loads=[load],
                numerics=numerics(basis, **others))
    rows = [(0.0, 0.0, 0.0)]
    look = lambda factor: rows.append((factor, *-solid.displacement()[n[1], ::-1]))  # noqa: E731
    began = time.process_time()
    settled = solid.settle(load_steps, on_step=look)
    seconds = time.process_time() - began
    look(1.0)  # after what has moved at full load
    solid.close()
    factor, v, u = np.array(rows).T
    errors = {at: np.interp(at, factor[:-1], v[:-1]) / FINE[at][0] - 1.0 for at in FINE}
    return {"v": v[-1], "u": u[-1], "error": v[-1] / FINE[1.0][0] - 1.0, "error_1": errors[0.1],
            "error_5": errors[0.5], "shortest": settled.shortest,
            "newton": settled.iterations / settled.steps, "step_ms": 1e3 * seconds / settled.steps,
            "seconds": seconds}


def elastica(factor: float) -> tuple:
    """Deflections v, u of a beam without stretch and shear [m], see ``references.cantilever``."""
    return tuple(LENGTH * value for value in cantilever.elastica(10.0 * factor))
