"""Boulders in a flow strike a barrier: dry soil and rocks run down a chute of 35 degrees.

    python boulders.py                  a minute or two
    python boulders.py h=0.03 dt=5e-4   finer
"""
import numpy as np

from coupling import Output, Run, Scheme, case
from dem_liggghts import Cluster, Interaction, Material, Scene, Wall
from mpm_fenicsx import MPM, Balls, Body, Box, Grid, Soil, Structure

CORNERS = np.array([(0, 0, 0), (1, 0, 0), (1.1, 0.8, 0), (0.1, 0.9, 0.1), (0.2, 0.1, 0.7), (0.9, 0.8, 0.8)])
FACES = [(0, 2, 1), (0, 3, 2), (0, 1, 4), (1, 5, 4), (1, 2, 5), (2, 3, 5), (3, 4, 5), (3, 0, 4)]


@case
def main(
    slope: float = 35.0,  # of the chute [degrees]
    boulders: int = 4,  # in the soil and before it
    h: float = 0.04,  # size of the background cells [m]
    soil: Soil = Soil(E=1e6, nu=0.3, rho=1600.0, phi=30.0),
    scheme: Scheme = Scheme(dt=None, t_end=0.5, speed=2.0),
    output: Output = Output("out/boulders"),
):
    """Force of soil and boulders on each half of a barrier."""
    down = 9.81 * np.array([np.sin(np.radians(slope)), -np.cos(np.radians(slope)), 0.0])
    heap, ahead = Box((0.0, 0.0, 0.0), (0.24, 0.16, 0.16)), Box((0.26, 0.0, 0.0), (0.42, 0.1, 0.16))
    rock = Cluster.from_surface(CORNERS, FACES, rho=2600.0, size=0.07, spheres=12)
    rocks = Cluster.packed([rock.scaled(size) for size in np.linspace(0.7, 1.0, boulders)], ahead, seed=1)

    body = Body(heap, Grid.counts(heap.size, h), 2, soil.material(3), soil.rho, f_bar=True)
    room = Box((-h, -h, -h), (0.8, 0.4, 0.16 + h))
    chute = Box((-0.5 * h, -0.5 * h, -0.5 * h), (0.76, 0.36, 0.16 + 0.5 * h))
    floor = Structure.plane("floor", (0.0, 0.0, 0.0), "+y", chute, friction=0.3)
    sides = [Structure.plane(name, (0.0, 0.0, z), normal, chute)
             for name, z, normal in (("right", 0.16, "-z"), ("left", 0.0, "+z"))]
    back = Structure.plane("back", (0.0, 0.0, 0.0), "+x", chute)
    front = Box((0.64, 0.0, 0.0), (0.7, 0.16, 0.16))
    barrier = Structure.box("barrier", front, cells=(1, 2, 1), friction=0.3)
    structures = (floor, *sides, back, barrier)

    solid = MPM(Grid(room, Grid.counts(room.size, h)), body, interface=Balls(0.25 * h), gravity=down,
                inertia="lumped", structures=structures, outflow="remove")
    stone, ball = Material(1e8, 0.25), Material(1e6, soil.nu)
    met = {("spheres", one.name): Interaction(0.3, one.friction) for one in structures}
    grains = Scene(None, Wall.discs(np.zeros((0, 3)), 0.25 * h), stone, ball, Interaction(0.3, 0.5),
                   Interaction(1.0, 0.4), down, clusters=rocks, structures=structures, interactions=met)
    return Run("boulders", solid, grains.fitted(solid.contact_scales(), scheme.speed), scheme, output)


if __name__ == "__main__":
    main.run()
