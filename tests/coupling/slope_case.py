"""Soil slides down a plane slope in space and carries spheres: a case with maps, as a script of its own."""
import numpy as np

from coupling import Gauge, Line, Maps, Output, Run, Scheme, case
from dem_liggghts import Interaction, Material, Scene, Spheres, Wall
from mpm_fenicsx import MPM, Balls, Body, Box, Grid, Soil, Structure, Terrain


@case
def main(
    dim: int = 3,
    h: float = 0.05,  # size of the background cells [m]
    size: float = 0.2,  # of the soil [m]
    fall: float = 0.7,  # of the slope [-]
    cell: float = 0.025,  # of the map [m]
    every: float = 0.1,  # from map to map [s]
    spheres: int = 2,
    far: float = 0.9,  # length of the map [m]
    scheme: Scheme = Scheme(dt=1e-3, t_end=0.05, substeps=10),
    output: Output = Output("out/slope"),
):
    """A heap on a slope."""
    gone = 3 - dim  # axes that a plane scene does not have
    corner, measures = (0.0,) * dim, (size, size, 0.6 * size)[::1 + gone]
    law = Soil(E=1e5, nu=0.3, rho=1500.0, phi=25.0).material(dim)
    body = Body(Box(corner, measures), Grid.counts(measures, h), 2, law, 1500.0, friction=0.3, thickness=0.5)
    upper = far + 2 * h, size + 2 * h, size
    room = Box((-2 * h, -2 * h, -fall * far - 2 * h)[::1 + gone], upper[::1 + gone])
    bed = Structure.plane("bed", corner, (fall, 0.0, 1.0)[::1 + gone], room, friction=0.3)
    solid = MPM(Grid(room, Grid.counts(room.size, h)), body, (), Balls(0.25 * h), inertia="lumped",
                gravity=(0.0, 0.0, -9.81)[gone:], structures=[bed], outflow="remove")
    radius, steep = 0.02, np.hypot(fall, 1.0)
    x = np.zeros((spheres, dim))
    x[:, 0] = size + 0.05 + 0.06 * np.arange(spheres)
    x[:, 1:-1] = 0.5 * size
    x[:, -1] = -fall * x[:, 0] + radius * steep
    rocks = Spheres(x, np.zeros_like(x), radius, 2600.0)
    stone = Material(1e7, 0.25)
    scene = Scene(rocks, Wall.discs(np.zeros((0, dim)), 0.25 * h), stone, Material(1e5, 0.3),
                  Interaction(0.3, 0.5), Interaction(1.0, 0.4), solid.scene.gravity,
                  structures=(bed,), interactions={("spheres", "bed"): Interaction(0.3, 0.5)})
    extent = Box((0.0, 0.0), (far, size)) if dim == 3 else (0.0, far)
    terrain = Terrain.function(lambda x, *y: -fall * x, extent, 0.1)
    middle = (0.5 * size,)[:dim - 2]
    gauges = [Gauge("top", (0.1, *middle)), Gauge("foot", (0.6, *middle), width=0.1)]
    lines = [Line("gate", (0.25, 0.0), (0.25, size)) if dim == 3 else Line("gate", (0.25,))]
    return Run("slope", solid, scene, scheme, output, maps=Maps(terrain, cell, every, gauges, lines))


if __name__ == "__main__":
    main.run()
