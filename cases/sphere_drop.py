"""A steel sphere falls on a bed of dry soil: how deep it goes, and which force stops it.

    python cases/sphere_drop.py                       a quarter of a small bed, half a minute
    python cases/sphere_drop.py h=0.01 dem=compare    finer, with both back ends
    python cases/sphere_drop.py dim=2                 a cylinder, in the plane
    python cases/sphere_drop.py preset=reference      the bed of 1.0 x 0.1 x 0.27 m, a quarter of it

Ball, soil and speed are those of the input `SphereImpact` of GeoTaichi, which takes 200,000 explicit steps
of 1e-6 s.
"""
from functools import partial
from pathlib import Path
from typing import Literal, Tuple

import numpy as np

import mpm_dem_checks as check
from coupling import Output, Run, Scheme, case
from dem_liggghts import Cluster, Interaction, Material, Scene, Wall
from mpm_fenicsx import MPM, Balls, Body, Box, Grid, InitialGround, Numerics, Soil, Support, flow_grid
from references import drop


@case(presets={"reference": dict(size=(1.0, 0.27, 0.1), h=0.01, t_end=0.2)})
def main(
    dim: Literal[2, 3] = 3,  # in space a sphere, a quarter of it; in the plane a cylinder, half of it
    size: Tuple[float, float, float] = (0.2, 0.12, 0.1),  # of the bed: length, height, width [m]
    radius: float = 0.0223,  # of the sphere [m]
    rho_sphere: float = 7850.0,  # its density [kg/m^3]
    v0: float = 1.12,  # its speed when it meets the bed [m/s]
    sphere_E: float = 1e9,  # its modulus in contacts [Pa]
    friction: float = 0.28,  # of the soil on it [-]
    soil: Soil = Soil(E=61e6, nu=0.2, rho=600.0, phi=16.0, psi=3.0),
    state: InitialGround = InitialGround(initial="geostatic"),
    ball: float = 0.25,  # radius of the balls in the place of material points [cells]
    ball_E: float = 0.0,  # their modulus in contacts [Pa]; 0: by the rule of Scene.contact_rule
    h: float = 0.0167,  # size of the background cells [m]
    g: float = 9.81,  # gravity [m/s^2]
    numerics: Numerics = Numerics(),
    scheme: Scheme = Scheme(dt=None, t_end=0.04),
    output: Output = Output(Path("out/sphere_drop")),
) -> Run:
    """Depth of a sphere in a granular bed and force on it over time."""
    for name, value in dict(radius=radius, rho_sphere=rho_sphere, v0=v0, g=g, ball=ball).items():
        check.positive(name, value)
    part = 4.0 if dim == 3 else 2.0  # of which one is computed, between planes of symmetry
    length, height, width = check.numbers("size", size, 3, "m", check.positive)
    bed = (0.5 * length, height, 0.5 * width)[:dim]
    body = Body(Box((0.0,) * dim, bed), Grid.counts(bed, h), 2, soil.material(dim), soil.rho, f_bar=True,
                thickness=width)
    grid = flow_grid(bed, h, (bed[0], height + 4 * h, bed[-1])[:dim], "")  # with room for what is thrown up
    down = (0.0, -g, 0.0)[:dim]
    supports = [Support(lambda x: x[:, 1] < 0.25 * h, "xyz"[:dim], name="the floor")]
    supports += [Support.column(axis, at, grid, axis, name=f"the side at {axis} = {at} m")
                 for axis, side in zip("xz", (bed[0], bed[-1])[:dim - 1]) for at in (0.0, side)]
    solid = MPM(grid, supports=supports, interface=Balls(ball * h), gravity=down, inertia="lumped",
                outflow={"+y": "remove"}, numerics=numerics, **state.ground(body, soil, down))

    highest = height * (1.0 - 0.25 / Grid.counts(bed, h)[1])  # of the points, two to a cell
    at = np.array((0.0, highest + ball * h + radius, 0.0)[:dim])  # on top of the balls
    mass = rho_sphere * np.pi * radius**2 * (4.0 / 3.0 * radius if dim == 3 else width) / part
    falls = (False, True) + (False,) * (1 if dim == 2 else 4)  # along y alone, by symmetry
    inertia = 0.4 * mass * radius**2 * np.ones(2 * dim - 3)
    sphere = Cluster(np.zeros((1, dim)), radius, at, mass, inertia, v=(0.0, -v0, 0.0)[:dim], free=falls)
    grains = Scene(clusters=(sphere,), wall=Wall.discs(np.zeros((0, dim)), ball * h),
                   material=Material(sphere_E, 0.3), wall_material=Material(ball_E or 1e6, soil.nu),
                   at_wall=Interaction(1.0, friction), gravity=down)
    if not ball_E:
        grains = grains.fitted(solid.contact_scales(), max(v0, solid.contact_scales().speed))
    columns = {"depth": ("m", "of the sphere's lowest point below where it met the bed",
                         lambda w: at[1] - w.particles["x"][0, 1]),
               "speed": ("m/s", "of the sphere, downward", lambda w: -w.particles["v"][0, 1]),
               "force": ("N", "of the bed on the whole sphere, upward",
                         lambda w: -part * w.wall_force[:, 1].sum())}
    return Run("sphere_drop", solid, grains, scheme, output, columns=columns,
               figure=partial(drop.draw, v0=v0, g=g))


if __name__ == "__main__":
    main.run()
