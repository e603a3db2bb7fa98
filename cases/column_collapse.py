"""A column of dry granular material collapses: the soil of the third example of Singer et al. 2022, alone.

    python cases/column_collapse.py                               a minute, with cells of 1 cm
    python cases/column_collapse.py preset=paper                  the paper's grid and time step
    python cases/column_collapse.py aspect=4 phi=30 floor=0.4     a slender column on a floor that it rubs on
    python cases/column_collapse.py dim=3 h=0.025 dt=1e-3         in space, between side walls
    python cases/column_collapse.py layers=0.1 layer_phi=22,35    two soils, the lower one rougher
"""
from pathlib import Path
from typing import Literal, Optional, Tuple

import mpm_dem_checks as check
from coupling import FlowPictures, Output, Run, Steps, case
from mpm_fenicsx import (
    MPM,
    Body,
    Box,
    FlowGauges,
    Grid,
    InitialGround,
    Numerics,
    Soil,
    Support,
    fall_room,
    flow_grid,
    level_floor,
)
from references import granular

POINTS = {"triangle": 3, "quadrilateral": 2, "tetrahedron": 4, "hexahedron": 2}  # per body cell
Cell = Optional[Literal["quadrilateral", "triangle", "hexahedron", "tetrahedron"]]
IN_SPACE = (lambda keys: keys["dim"] == 3, "in space, dim=3")


@case(presets={"paper": dict(h=0.005, dt=5e-5)},
      counts={"depth": IN_SPACE, "open_side": IN_SPACE})
def main(
    dim: Literal[2, 3] = 2,  # in the plane (plane strain) or in space
    width: float = granular.SIZE[0],  # of the column, which leans against a smooth wall at x = 0 [m]
    aspect: float = 2.0,  # height of the column over its width [-]
    depth: float = 0.20,  # of the column in space [m]
    open_side: bool = False,  # in space: no wall at its front side, so that it runs out in both directions
    soil: Soil = granular.SOIL,
    g: float = granular.GRAVITY,  # gravity [m/s^2]
    state: InitialGround = InitialGround(),
    floor: str = "stick",  # stick, slip, or a coefficient of friction
    h: float = 0.01,  # size of the background cells [m]
    cell: Cell = None,  # of the grid
    box: Optional[Tuple[float, ...]] = None,  # size of the grid [m]; none: as far as free fall throws
    body_cell: Cell = None,  # of the body; none: triangle, hexahedron
    refine: Optional[int] = None,  # body cells per background cell and direction [-]; none: 2, in space 1
    points: Optional[int] = None,  # per body cell: in all (simplices) or per direction [-]; none: 3, 2, 4, 2
    f_bar: bool = True,  # average the volume change over each background cell, against locking
    inertia: Literal["lumped", "consistent", "ghost"] = "lumped",  # ghost: consistent with a ghost penalty
    outflow: Literal["stop", "hold", "remove"] = "remove",  # of soil at open sides; stop: that ends the run
    numerics: Numerics = Numerics(),
    steps: Steps = Steps(dt=5e-4, t_end=0.5),
    output: Output = Output(Path("out/column_collapse")),
) -> Run:
    """Collapse of a granular column: front, energies and volume over time, pictures at given times."""
    for name, value, unit in (("width", width, "m"), ("aspect", aspect, ""), ("depth", depth, "m")):
        check.positive(name, value, unit)
    check.positive("g", g, "m/s^2", "without gravity nothing collapses, give a positive number")
    size, ways = (width, aspect * width, depth)[:dim], "xz" if open_side else "x"
    kind = body_cell or ("triangle" if dim == 2 else "hexahedron")
    fine = (2 if dim == 2 else 1) if refine is None else check.count("refine", refine)
    gravity = (0.0, -g, 0.0)[:dim]
    body = Body(Box((0.0,) * dim, size), tuple(n * fine for n in Grid.counts(size, h)),
                POINTS[kind] if points is None else points, soil.material(dim), soil.rho, cell=kind,
                f_bar=f_bar)
    stated = state.ground(body, soil, gravity)
    grid = flow_grid(size, h, fall_room(size, g, steps.t_end, ways) if box is None else box, ways, cell)
    supports, walls = level_floor(granular.floor_kind(floor), h, dim)
    supports.append(Support.column("x", 0.0, grid, "x", name="the wall"))
    for z in (0.0, depth)[:0 if dim == 2 else 1 if open_side else 2]:
        supports.append(Support.column("z", z, grid, "z", name=f"the side wall at z = {z} m"))
    solid = MPM(grid, supports=supports, gravity=gravity, inertia=inertia, penalties=walls,
                numerics=numerics, outflow={f"+{axis}": outflow for axis in (*ways, "y")}, **stated)
    observe = lambda solid, grains: [
        FlowGauges(solid), FlowPictures("column_collapse", granular.TIMES, solid, walls=("-y", "-x", "-z"))]
    errors = lambda histories: granular.errors(histories["solid"], stated["body"], g)
    return Run("column_collapse", solid, None, steps, output, observe=observe, errors=errors,
               figure=granular.draw)


if __name__ == "__main__":
    main.run()
