"""Soil slides down a chute, carries boulders along and strikes a barrier.

    python cases/boulder_barrier.py                              in space, two minutes
    python cases/boulder_barrier.py barrier=elastic              a plate that is fixed at its foot and bends
    python cases/boulder_barrier.py dim=2 dem=compare            in the plane, with both back ends
    mpirun -n 2 python cases/boulder_barrier.py h=0.02 animation=10
"""
from functools import partial
from pathlib import Path
from typing import Any, Literal, Tuple

import numpy as np

import mpm_dem_checks as check
from coupling import Output, Run, Scheme, case
from dem_liggghts import Cluster, Interaction, Material, Scene, Spheres, Wall
from mpm_fenicsx import MPM, Balls, Body, Box, Grid, Numerics, Soil, Structure, Support, linear
from references import barrier as reference

ELASTIC = (lambda keys: keys["barrier"] == "elastic", "with barrier=elastic")


@case(counts={"plate_E": ELASTIC, "plate_rho": ELASTIC})
def main(
    dim: Literal[2, 3] = 3,
    slope: float = 35.0,  # of the chute [degrees]
    deposit: Tuple[float, float, float] = (0.4, 0.16, 0.16),  # of soil: length, height, width of the chute [m]
    path: float = 0.5,  # from the soil to the barrier [m]
    barrier: Literal["rigid", "elastic"] = "rigid",
    height: float = 0.2,  # of the barrier [m]
    thickness: float = 0.08,  # of the barrier [m]
    cells: int = 2,  # force cells of a rigid barrier, one above the other
    plate_E: float = 5e6,  # modulus of an elastic barrier [Pa]
    plate_rho: float = 1200.0,  # its density [kg/m^3]
    spheres: int = 2,  # boulders that are spheres, before the soil
    clusters: int = 3,  # boulders in it, clusters made from convex surfaces; none in the plane
    boulder: float = 0.03,  # their mean radius [m]
    rho_rock: float = 2600.0,  # their density [kg/m^3]
    seed: int = 1,  # of their places
    soil: Soil = Soil(E=1e6, nu=0.3, rho=1600.0, phi=32.0),
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
    angle, cut = np.radians(slope), slice(dim)
    gravity = 9.81 * np.array([np.sin(angle), -np.cos(angle), 0.0])[cut]
    whole = Box((0.0, 0.0, 0.0)[cut], (length, top, width)[cut])
    room = Box((-2 * h, -2 * h, -h)[cut], (length + path + 8 * h, top + height + 4 * h, width + h)[cut])
    stone = Material(1e8, 0.25)
    family = [Cluster.from_surface(*reference.pebble(seed + k), rho_rock, volume=4.19 * boulder**3, spheres=12)
              for k in range(clusters if dim == 3 else 0)]
    rocks = Cluster.packed(family, whole, seed, gap=0.1 * h)  # in the soil; spheres lie before it
    ahead = Box((length + 0.3 * h, *whole.lower[1:]), (length + 4 * boulder, 2.1 * boulder, width)[cut])
    balls = Spheres.packed(spheres, boulder, ahead, rho_rock, seed)
    body = Body(whole, Grid.counts(whole.size, h), 2, soil.material(dim), soil.rho, f_bar=True,
                friction=friction, thickness=width).without([balls, *rocks], gap=0.25 * h)

    structures = [Structure.plane("bed", (0.0,) * dim, "+y", room, friction=bed),
                  Structure.plane("gate", (0.0,) * dim, "+x", Box(room.lower, (h, *room.upper[1:])))]
    if dim == 3:
        structures += [Structure.plane(name, (0.0, 0.0, z), normal, room)
                       for name, z, normal in (("left", 0.0, "+z"), ("right", width, "-z"))]
    foot = length + path
    front = Box((foot, -h, 0.0)[cut], (foot + thickness, height, width)[cut])
    bodies, supports, names = [body], [], ("barrier",)
    if barrier == "rigid":
        structures.append(Structure.box("barrier", front, (1, cells, 1)[cut], friction=friction))
        names = structures[-1].cells
    else:
        plate = Body(front, Grid.counts(front.size, 0.5 * h), 2, linear(plate_E, 0.3), plate_rho, thickness=width)
        bodies, names = [body, plate], ("barrier",)
        supports = [Support(lambda x: x[:, 1] < 0.5 * h, "xyz"[cut], name="barrier")]
    solid = MPM(Grid(room, Grid.counts(room.size, h)), bodies, supports, Balls(0.25 * h), gravity=gravity,
                inertia="lumped", structures=structures, outflow="remove", numerics=numerics)
    met = {("spheres", one.name): Interaction(restitution, one.friction) for one in structures}
    grains = Scene(balls, Wall.discs(np.zeros((0, dim)), 0.25 * h), stone, Material(1e6, soil.nu),
                   Interaction(restitution, 0.5), Interaction(1.0, friction), gravity, clusters=rocks,
                   structures=structures, interactions=met)
    scales = solid.contact_scales()
    grains = grains.fitted(scales, scheme.speed or scales.speed)
    return Run("boulder_barrier", solid, grains, scheme, output,
               columns=reference.front(solid, foot, width), figure=partial(reference.draw, names=names))


if __name__ == "__main__":
    main.run()
