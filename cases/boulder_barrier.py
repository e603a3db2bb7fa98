"""Soil slides down a chute, carries boulders along and strikes a barrier.

    python cases/boulder_barrier.py                              in space, two minutes
    python cases/boulder_barrier.py barrier=elastic              a plate that is fixed at its foot and bends
    python cases/boulder_barrier.py dim=2 dem=compare            in the plane, with both back ends
    mpirun -n 2 python cases/boulder_barrier.py h=0.02 animation=10
"""
from functools import partial
from pathlib import Path
from typing import Literal, Optional, Tuple

import numpy as np

import mpm_dem_checks as check
from coupling import Output, Run, Scheme, case
from dem_liggghts import Cluster, Interaction, Material, Scene, Spheres, Wall
from mpm_fenicsx import MPM, Balls, Body, Box, Grid, InitialState, Numerics, Soil, Structure, Support, linear
from references import barrier as reference

ELASTIC = (lambda keys: keys["barrier"] == "elastic", "with barrier=elastic")


@case(counts={"plate_E": ELASTIC, "plate_rho": ELASTIC})
def main(
    dim: Literal[2, 3] = 3,
    slope: float = 35.0,  # of the chute [degrees]
    deposit: Tuple[float, float, float] = (0.4, 0.16, 0.16),  # of soil: length, height, width [m]
    path: float = 0.5,  # from the soil to the barrier [m]
    barrier: Literal["rigid", "elastic"] = "rigid",
    height: float = 0.2,  # of the barrier [m]
    thickness: float = 0.08,  # of the barrier [m]
    cells: int = 2,  # force cells of the barrier, one above the other
    plate_E: float = 5e6,  # modulus of an elastic barrier [Pa]
    plate_rho: float = 1200.0,  # its density [kg/m^3]
    spheres: int = 2,  # boulders that are spheres, before the soil
    clusters: int = 3,  # boulders in it, clusters made from convex surfaces; none in the plane
    boulder: float = 0.03,  # their mean radius [m]
    rho_rock: float = 2600.0,  # their density [kg/m^3]
    rock_E: Optional[float] = None,  # their modulus in contacts [Pa]; none: 1e8, in the plane 5e8
    seed: int = 1,  # of their places
    soil: Soil = Soil(E=1e6, nu=0.3, rho=1600.0, phi=32.0),
    state: InitialState = InitialState(),
    bed: float = 0.35,  # friction of the bed with soil and boulders [-]
    friction: float = 0.4,  # of soil on boulders and barrier [-]
    restitution: float = 0.3,  # of boulders
    h: float = 0.04,  # size of the background cells [m]
    numerics: Numerics = Numerics(),
    scheme: Scheme = Scheme(dt=None, t_end=0.9, speed=2.5),  # [m/s], of boulders in the flow
    output: Output = Output(Path("out/boulder_barrier")),
) -> Run:
    """Force of a flow with boulders on a barrier: of soil and of rocks, on each of its force cells."""
    check.between("slope", slope, 0.0, 90.0, "degrees", ends="()")
    length, top, width = check.numbers("deposit", deposit, 3, "m", check.positive)
    whole, foot = reference.room(dim, (0.0, 0.0, 0.0), (length, top, width)), length + path
    room = reference.room(dim, (-2 * h, -2 * h, -h), (foot + 8 * h, top + height + 4 * h, width + h))
    gravity, stone = reference.down(dim, slope), Material(rock_E or (1e8 if dim == 3 else 5e8), 0.25)
    volume = 4.0 / 3.0 * np.pi * boulder**3
    family = [Cluster.from_surface(*reference.pebble(seed + k), rho_rock, volume=volume, spheres=12)
              for k in range(clusters if dim == 3 else 0)]
    rocks = Cluster.packed(family, whole, seed, gap=0.1 * h)  # in the soil; spheres lie before it
    rows = -(-spheres // max(1, int(width / (2.6 * boulder)))) if dim == 3 else spheres
    ahead = reference.room(dim, (length + 0.3 * h, 0.0, 0.0),
                           (length + 4 * boulder * max(rows, 1), 2.1 * boulder, width))
    balls = Spheres.packed(spheres, boulder, ahead, rho_rock, seed)
    body = Body(whole, reference.counts(whole, h), 2, soil.material(dim), soil.rho, f_bar=True,
                friction=friction, thickness=width).without([balls, *rocks], gap=0.25 * h)

    # an elastic barrier goes through the bed's plane, which ends before it, so that it does not rub there
    end = room.upper[0] if barrier == "rigid" else foot - 0.1 * h
    structures = reference.chute(Box(room.lower, (end, *room.upper[1:])), width, h, bed)
    front = reference.room(dim, (foot, -h, 0.0), (foot + thickness, height, width))
    wall = Structure.box("barrier", front, (1, cells, 1)[:dim], friction=friction)
    bodies, supports = [state.of(body)], []
    if barrier == "rigid":
        structures.append(wall)
    else:
        bodies.append(Body(front, reference.counts(front, h), 2, linear(plate_E, 0.3), plate_rho,
                           thickness=width, name=wall.name, force_cells=(1, cells, 1)[:dim]))
        supports.append(Support(lambda x: x[:, 1] < -0.5 * h, "xyz"[:dim], name="foot"))
    solid = MPM(Grid(room, reference.counts(room, h)), bodies, supports, Balls(0.25 * h), gravity=gravity,
                inertia="lumped", structures=structures, outflow="remove", numerics=numerics)
    met = {("spheres", one.name): Interaction(restitution, one.friction) for one in structures}
    grains = Scene(balls, Wall.discs(np.zeros((0, dim)), 0.25 * h), stone, Material(1e6, soil.nu),
                   Interaction(restitution, 0.5), Interaction(1.0, friction), gravity, clusters=rocks,
                   structures=tuple(structures), interactions=met)
    scales = solid.contact_scales()
    grains = grains.fitted(scales, scheme.speed or scales.speed)
    return Run("boulder_barrier", solid, grains, scheme, output,
               columns=reference.front(solid, foot, width), figure=partial(reference.draw, names=wall.cells))


if __name__ == "__main__":
    main.run()
