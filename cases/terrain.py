"""Soil is released in a mountain valley with a bend, takes rocks along and meets a check dam.

    python cases/terrain.py                                cells of 2 m
    python cases/terrain.py h=1.5 rocks=20 bed=0.25        finer, more rocks, a rougher bed
    mpirun -n 2 python cases/terrain.py animation=25 paraview=1

The valley is made up, a raster in coordinates of a map; that of a survey is read with Terrain.read. Maps of
depth, speed and pressure are rasters in the same coordinates.
"""
from pathlib import Path

import numpy as np

from coupling import Maps, Output, Run, Scheme, case
from dem_liggghts import Interaction, Material, Scene, Wall
from mpm_fenicsx import MPM, Balls, Body, InitialState, Numerics, Soil, Structure
from references import valley as reference


@case()
def main(
    depth: float = 2.5,  # of the soil that is released [m]
    rocks: int = 8,  # on the ground before it
    radius: float = 0.9,  # of the rocks [m]
    seed: int = 1,  # of their places
    soil: Soil = Soil(E=2e6, nu=0.3, rho=1800.0, phi=25.0),
    state: InitialState = InitialState(),
    bed: float = 0.15,  # friction of soil and rocks with the ground [-]
    forest: float = 0.4,  # the same on the outer side of the bend, which has trees [-]
    dam: float = 4.0,  # height of the check dam [m]
    cell: float = 2.0,  # of the raster [m]
    h: float = 2.0,  # size of the background cells [m]
    numerics: Numerics = Numerics(),
    scheme: Scheme = Scheme(dt=None, t_end=14.0, speed=12.0),  # [m/s], of rocks in the flow
    output: Output = Output(Path("out/terrain")),
) -> Run:
    """Flow down a valley: hazard maps, paths of rocks, force on a dam."""
    ground = reference.ground(cell)
    gravity, stone = (0.0, 0.0, -9.81), Material(1e9, 0.25)
    boulders = reference.rocks(ground, rocks, radius, seed)
    release, corridor = reference.release(), reference.corridor()
    body = Body(ground.release(depth, release, h), None, None, soil.material(3), soil.rho, f_bar=True)
    slope = ground.structure("ground", friction=bed, regions={"forest": (reference.forest(), forest)})
    check_dam = Structure.box("dam", reference.dam(ground, dam, thickness=2.0 * h), friction=0.4)
    solid = MPM(ground.grid(h, above=6.0 * h, where=corridor), state.of(body), interface=Balls(0.25 * h),
                gravity=gravity, inertia="lumped", structures=[slope, check_dam], outflow="remove",
                numerics=numerics)
    grains = Scene(boulders, Wall.discs(np.zeros((0, 3)), 0.25 * h), stone, Material(1e7, 0.3),
                   Interaction(0.3, 0.5), Interaction(1.0, 0.4), gravity, structures=(slope, check_dam),
                   interactions={("spheres", "ground"): Interaction(0.3, 0.4),
                                 ("spheres", "dam"): Interaction(0.3, 0.4)})
    grains = grains.fitted(solid.contact_scales(), scheme.speed or 12.0)
    return Run("terrain", solid, grains, scheme, output, maps=Maps(ground, cell=cell, every=2.0))


if __name__ == "__main__":
    main.run()
