"""Dry soil collapses and carries rocks along a floor: a scene of one's own, in space.

    python own_scene.py                        half a minute, with the built-in DEM
    python own_scene.py dem=compare h=0.02     finer, with both back ends; --help shows all keys
"""
import numpy as np

from coupling import Output, Run, Scheme, case
from dem_liggghts import Interaction, Material, Scene, Spheres, Wall
from mpm_fenicsx import MPM, Balls, Body, Box, Grid, Soil, Support, fall_room, flow_grid, level_floor


@case
def main(
    h: float = 0.025,  # size of the background cells [m]
    radius: float = 0.01,  # of the rocks [m]
    soil: Soil = Soil(E=50e3, nu=0.3, rho=1500.0, phi=30.0),
    scheme: Scheme = Scheme(dt=2e-3, t_end=0.4, substeps=40),
    output: Output = Output("out/own_scene", animation=10),
):
    """How far soil that collapses carries rocks, and with which force."""
    size, gravity = (0.1, 0.15, 0.1), (0.0, -9.81, 0.0)  # of the soil [m], [m/s^2]
    body = Body(Box((0.0, 0.0, 0.0), size), Grid.counts(size, h), 2, soil.material(3), soil.rho, f_bar=True)
    grid = flow_grid(size, h, fall_room(size, -gravity[1], scheme.t_end))
    supports, _ = level_floor("stick", h, dim=3)
    sides = ("x", 0.0), ("z", 0.0), ("z", size[2])  # where the soil leans against smooth walls [m]
    supports += [Support.column(axis, at, grid, axis) for axis, at in sides]
    solid = MPM(grid, body, supports, Balls(0.25 * h), gravity=gravity, inertia="lumped")

    x = np.array([(x, radius, z) for x in (0.14, 0.18) for z in (0.02, 0.05, 0.08)])
    rocks = Spheres(x, np.zeros_like(x), radius, rho=2600.0)
    corners = (0, 0, 0), (1, 0, 0), (1, 0, size[2]), (0, 0, size[2])
    floor = Wall(corners, [(0, 2, 1), (0, 3, 2)], material="floor")
    grains = Scene(rocks, None, Material(1e7, 0.25), Material(1.5e6, 0.3), Interaction(0.5, 0.5),
                   Interaction(0.5, 0.4), gravity, walls=[floor], materials={"floor": Material(1e7, 0.25)},
                   interactions={("spheres", "floor"): Interaction(0.5, 0.4)})
    columns = {"front": ("m", "largest x of the rocks", lambda w: w.particles["x"][:, 0].max()),
               "push": ("N", "force of the soil on the rocks along x", lambda w: -w.wall_force[:, 0].sum())}
    return Run("own_scene", solid, grains, scheme, output, columns=columns)


if __name__ == "__main__":
    main.run()
