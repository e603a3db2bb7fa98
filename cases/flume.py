"""Sand slides down a flume of 80 m and carries eight light blocks against a cube with two force cells.

    python cases/flume.py                          cells of 20 cm, 28 thousand points
    mpirun -n 2 python cases/flume.py h=0.1        cells of 10 cm
    python cases/flume.py blocks=false t_end=3     sand alone

The scene is hdro-0008 of HydroUQ (NHERI SimCenter), made after the debris-flow flume of the US Geological
Survey: 28 m^3 of sand on a bed of 30 degrees that levels out behind the cube. Its fronts arrive as without
friction at the bed, so that is the default here, whatever its text says.
"""
from functools import partial
from pathlib import Path
from typing import Optional

import numpy as np

from coupling import Output, Run, Scheme, case
from dem_liggghts import Interaction, Material, Scene, Wall
from mpm_fenicsx import MPM, Balls, Body, Box, Grid, InitialState, Numerics, Soil, Structure, Terrain
from references import flume as reference


@case()
def main(
    h: float = 0.2,  # size of the background cells [m]
    soil: Soil = Soil(E=1e7, nu=0.3, rho=1700.0, phi=40.0, law="drucker_prager"),
    state: InitialState = InitialState(),
    friction: float = 0.0,  # of sand and blocks on bed, sides and cube [-]
    blocks: bool = True,  # of plastic, on the sand
    rho_block: float = 981.0,  # their density [kg/m^3]
    rubbing: float = 3.0,  # largest speed of blocks in the sand that is expected [m/s]
    room: float = 5.0,  # over the bed, for the splash [m]
    numerics: Numerics = Numerics(),
    scheme: Scheme = Scheme(dt=4e-3, t_end=8.0, substeps=256),
    output: Output = Output(Path("out/flume")),
) -> Run:
    """Force of sand and blocks on both halves of a cube at the end of a flume, and what gauges see."""
    width, gravity = reference.WIDTH, reference.GRAVITY
    sand = Box((0.0, 0.0, 0.0), (7.0, width, 2.0))
    body = Body(sand, Grid.counts(tuple(sand.size), h), 2, soil.material(3), soil.rho, f_bar=True)
    ground = Terrain.function(reference.bed, Box((-1.0, -h), (reference.END, width + h)), h)
    sides = Box((-1.0, -h, -1.0), (reference.SIDES, width + h, room))
    cube = Box((reference.FRONT, reference.ACROSS[0], 0.0), (reference.FRONT + 1.0, reference.ACROSS[1],
                                                             reference.HIGH))
    structures = [ground.structure("bed", friction=friction),
                  Structure.plane("gate", (0.0, 0.0, 0.0), "+x", Box(sides.lower, (h, width + h, room))),
                  Structure.plane("left", (0.0, 0.0, 0.0), "+y", sides, friction=friction),
                  Structure.plane("right", (0.0, width, 0.0), "-y", sides, friction=friction),
                  Structure.box("cube", cube, cells=(1, 1, 2), friction=friction)]
    solid = MPM(ground.grid(h, above=room), state.of(body), interface=Balls(0.25 * h) if blocks else None,
                gravity=gravity, inertia="lumped", structures=structures, outflow="remove",
                numerics=numerics)
    grains: Optional[Scene] = None
    if blocks:
        plastic = tuple(reference.block(place, rho_block, h) for place in reference.BLOCKS)
        grains = Scene(wall=Wall.discs(np.zeros((0, 3)), 0.25 * h), material=Material(2e9, 0.3),
                       wall_material=Material(1e6, 0.3), between=Interaction(0.5, 0.3),
                       at_wall=Interaction(1.0, 0.3), gravity=gravity, clusters=plastic,
                       structures=tuple(structures)).fitted(solid.contact_scales(), rubbing)
    return Run("flume", solid, grains, scheme, output, columns=reference.gauges(solid, h),
               errors=partial(reference.compare, friction=friction), figure=reference.draw)


if __name__ == "__main__":
    main.run()
