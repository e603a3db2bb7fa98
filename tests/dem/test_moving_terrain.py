"""Rocks on ground that moves, as in an earthquake told in space: the terrain has a motion of its own."""
import numpy as np
import pytest

from dem_liggghts import Cluster, Interaction, Material, Scene, Spheres
from mpm_fenicsx import Terrain
from tests.newmark import FRICTION, GRAVITY, gone, newmark

STONE, G = Material(1e8, 0.3), 9.81
NONE = np.zeros((0, 2))


def test_a_rock_slides_as_newmarks_block_does(dem):
    """A rock of discs in a row, too long to tip over, on a terrain along which the slope has been turned."""
    r, mass, end, window, steps = 0.05, 100.0, 0.8, 2e-3, 100
    row = np.column_stack([np.linspace(-0.27, 0.27, 7), np.zeros(7)])
    rock = Cluster(row, np.full(7, r), (0.0, r), mass, mass * 0.09)
    ground = Terrain.profile(np.linspace(-9.0, 9.0, 181), np.zeros(181))
    bed = ground.structure("bed", motion=lambda t: (gone(t), 0.0))
    sled = dem(Scene(None, None, STONE, gravity=GRAVITY, clusters=[rock], structures=[bed],
                     materials={"bed": STONE}, interactions={("spheres", "bed"): Interaction(0.1, FRICTION)}),
               window / steps)
    for _ in range(round(end / window)):
        sled.advance(steps, NONE, NONE)
    body = sled.bodies()[0]
    assert body["x"][0] - gone(end) == pytest.approx(newmark(end), rel=0.02)
    given, gained = sum(sled.impulses().values()), mass * body["v"][:2]
    np.testing.assert_allclose(gained, given[:2], rtol=0, atol=1e-9 * abs(given).max())


@pytest.mark.parametrize("far", [(0.0, 0.0), (4.5e5, 5.2e6)], ids=["near", "map"])
def test_a_ball_rolls_on_ground_that_is_driven_away(dem, far):
    """Of what the ground does it takes two sevenths, on a raster with two regions; in coordinates of a
    map."""
    (x, y), r, drive = far, 0.05, 1.0
    ground = Terrain.raster(np.zeros((21, 9)), 0.1, (x, y))
    half = [(x, y), (x + 0.53, y), (x + 0.53, y + 0.8), (x, y + 0.8)]
    bed = ground.structure("bed", friction=0.5, regions={"ice": (half, 0.4)},
                           motion=lambda t: (0.5 * drive * t**2, 0.0, 0.0))
    ball = Spheres([[x + 0.5, y + 0.4, r]], [[0.0, 0.0, 0.0]], r, 2600.0)
    run = dem(Scene(ball, structures=[bed], material=Material(1e7, 0.25), gravity=(0.0, 0.0, -G),
                    domain=((x, y, -1.0), (x + 3.0, y + 0.8, 1.0))), 2e-5)
    none = np.zeros((0, 3))
    for _ in range(50):
        run.advance(500, none, none)
    assert run.particles()["x"][0, 0] - x - 0.5 == pytest.approx(2.0 / 7.0 * 0.5 * drive * 0.5**2, rel=0.01)
