"""Dry sand slides down a flume and strikes a rigid wall: the force over time.

    python cases/sand_on_wall.py                       45 degrees, in the plane, a minute
    python cases/sand_on_wall.py slope=65 h=0.0125     steeper and finer
    python cases/sand_on_wall.py dim=3 width=0.1       in space, between smooth sides

Sizes, densities and friction are those of Moriguchi et al. 2009 (doi 10.1007/s11440-009-0084-5) as a later
model has them: 0.5 x 0.3 m of sand, 1.8 m of free path, a wall of 0.3 m. Their peaks are not at hand: the
force is drawn beside that of a jet, and its impulse beside the momentum that the sand has lost.
"""
from functools import partial
from pathlib import Path
from typing import Literal, Tuple

import mpm_dem_checks as check
from coupling import Output, Run, Steps, case
from mpm_fenicsx import MPM, Body, Grid, InitialState, Numerics, Soil, Structure
from references import barrier as reference


@case()
def main(
    dim: Literal[2, 3] = 2,
    slope: float = 45.0,  # of the flume [degrees]
    deposit: Tuple[float, float] = (0.5, 0.3),  # of sand: length and height [m]
    width: float = 0.3,  # of the flume [m]
    path: float = 1.8,  # from the sand to the wall [m]
    height: float = 0.3,  # of the wall [m]
    thickness: float = 0.1,  # of the wall [m]
    cells: int = 3,  # force cells of the wall, one above the other
    soil: Soil = Soil(E=21.6e6, nu=0.3, rho=1379.0, phi=30.0),
    state: InitialState = InitialState(),
    friction: float = 0.3,  # of the sand on bed and wall [-]
    h: float = 0.025,  # size of the background cells [m]
    numerics: Numerics = Numerics(),
    scheme: Steps = Steps(dt=1e-3, t_end=1.4),
    output: Output = Output(Path("out/sand_on_wall")),
) -> Run:
    """Force of dry sand on a wall across a flume, on each of its force cells."""
    check.between("slope", slope, 0.0, 90.0, "degrees", ends="()")
    length, top = check.numbers("deposit", deposit, 2, "m", check.positive)
    whole, foot = reference.room(dim, (0.0, 0.0, 0.0), (length, top, width)), length + path
    body = Body(whole, reference.counts(whole, h), 2, soil.material(dim), soil.rho, f_bar=True,
                thickness=width)
    room = reference.room(dim, (-4 * h, -4 * h, -h), (foot + 24 * h, 1.5 * (top + height), width + h))
    structures = reference.chute(room, width, h, friction)
    front = reference.room(dim, (foot, -3 * h, 0.0), (foot + thickness, height, width))
    wall = Structure.box("wall", front, (1, cells, 1)[:dim], friction=friction)
    solid = MPM(Grid(room, reference.counts(room, h)), state.of(body), gravity=reference.down(dim, slope),
                inertia="lumped", structures=[*structures, wall], outflow="remove", numerics=numerics)
    return Run("sand_on_wall", solid, None, scheme, output, columns=reference.front(solid, foot, width),
               figure=partial(reference.draw, names=wall.cells))


if __name__ == "__main__":
    main.run()
