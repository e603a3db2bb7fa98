"""A column of water collapses on a dry bed, after the experiment of Martin & Moyce 1952.

    python cases/dam_break.py                     as high as wide, three seconds
    python cases/dam_break.py aspect=2            twice as high
    python cases/dam_break.py floor=stick         on a bed to which water sticks
    python cases/dam_break.py cells=32 dt=6.25e-4    finer in space and time
"""
from functools import partial
from pathlib import Path
from typing import Literal

import mpm_dem_checks as check
from coupling import FlowPictures, Output, Run, Steps, case
from mpm_fenicsx import (
    MPM,
    Body,
    Box,
    FlowGauges,
    Numerics,
    Support,
    at_rest,
    flow_grid,
    herschel_bulkley,
    level_floor,
)
from references import dam


@case()
def main(
    aspect: Literal[1, 2] = 1,  # height of the column over its width of 57 mm, n^2 [-]
    cells: int = 16,  # across the width [-]
    bulk_modulus: float = 2e5,  # 360 times the largest pressure of a square column [Pa]
    viscosity: float = 1e-3,  # [Pa s]
    floor: Literal["slip", "stick"] = "slip",
    numerics: Numerics = Numerics(),
    steps: Steps = Steps(dt=1.25e-3, t_end=0.2),
    output: Output = Output(Path("out/dam_break")),
) -> Run:
    """Front of the water beside the experiment's, energies, pictures at given times."""
    cell = dam.WIDTH / check.count("cells", cells)
    size = dam.WIDTH, aspect * dam.WIDTH
    body = Body(Box((0.0, 0.0), size), (cells, aspect * cells), 2, herschel_bulkley(bulk_modulus, viscosity),
                dam.DENSITY, f_bar=True, stress=at_rest(size[1], dam.DENSITY, dam.GRAVITY, 1.0))
    grid = flow_grid(size, cell, (7.0 * dam.WIDTH, 1.5 * size[1]))
    supports, _ = level_floor(floor, cell, 2)
    supports.append(Support.column("x", 0.0, grid, "x", name="the wall"))
    solid = MPM(grid, body, supports, gravity=(0.0, -dam.GRAVITY), inertia="lumped", numerics=numerics,
                outflow={"+x": "remove"})
    observe = lambda solid, grains: [FlowGauges(solid),
                                     FlowPictures("dam_break", dam.TIMES, solid, walls=("-y", "-x"))]
    errors = partial(dam.errors, aspect=aspect, cell=cell)
    return Run("dam_break", solid, None, steps, output, observe=observe, errors=errors,
               figure=partial(dam.draw, aspect=aspect, cell=cell))


if __name__ == "__main__":
    main.run()
