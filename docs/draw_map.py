"""Draws the picture of maps.md: soil runs down a gully behind six boulders; a minute.

    ./dev run python docs/draw_map.py                      docs/map.png
"""
import shutil
import tempfile
from pathlib import Path

import numpy as np

from coupling import Gauge, Line, Maps, Output, Run, Scheme
from dem_liggghts import Interaction, Material, Scene, Spheres, Wall
from mpm_fenicsx import MPM, Balls, Body, Box, Soil, Structure, Terrain

H, RELEASE, GRAVITY = 2.0, [(8, 28), (24, 30), (24, 42), (8, 40)], (0.0, 0.0, -9.81)


def height(x, y):
    """Of the gully [m], which winds and opens into a plain."""
    across = y - 30.0 - 6.0 * np.sin(x / 18.0)
    bumps = 0.8 * np.sin(x / 7.0) * np.cos(y / 9.0)
    return 40.0 - 0.55 * x + 0.0022 * x**2 + 0.02 * across**2 * np.exp(-x / 90.0) + bumps


def scene(terrain):
    """Solid and grains: 2.5 m of soil at the upper end, six boulders before it, a dam below."""
    soil = Soil(E=2e6, nu=0.3, rho=1800.0, phi=22.0)
    body = Body(terrain.release(2.5, RELEASE, H), None, None, soil.material(3), soil.rho)
    dam = Structure.box("dam", Box((94.0, 36.0, -10.0), (99.0, 52.0, 25.0)), friction=0.3)
    structures = [terrain.structure("bed", friction=0.2), dam]
    solid = MPM(terrain.grid(H, above=6.0), body, (), Balls(0.25 * H), gravity=GRAVITY, inertia="lumped",
                structures=structures, outflow="remove")
    places = np.array([(27.0 + 3.0 * i, 32.0 + 3.0 * j) for j in (0, 1) for i in (0, 1, 2)])
    x = np.column_stack([places, terrain.height(places) + 1.1])
    rocks = Spheres(x, np.zeros_like(x), 0.8, 2600.0)
    return solid, Scene(rocks, Wall.discs(np.zeros((0, 3)), 0.25 * H), Material(1e8, 0.25),
                        Material(2e6, 0.3), Interaction(0.4, 0.4), Interaction(1.0, 0.3), GRAVITY,
                        structures=tuple(structures))


def main():
    """Run it and keep the map."""
    terrain = Terrain.function(height, Box((0.0, 0.0), (120.0, 60.0)), 2.0)
    bridge = Line("bridge", (55.0, 15.0), (55.0, 45.0))
    maps = Maps(terrain, 1.0, 0.5, [Gauge("road", (70.0, 30.0))], [bridge])
    with tempfile.TemporaryDirectory() as out:
        Run("gully", *scene(terrain), Scheme(dt=0.02, t_end=9.0, substeps=40), Output(out), maps=maps).go()
        shutil.copyfile(Path(out) / "map.png", Path(__file__).with_name("map.png"))


if __name__ == "__main__":
    main()
