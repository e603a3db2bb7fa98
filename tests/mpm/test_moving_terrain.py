"""Soil on ground that moves, as in an earthquake told in space: the terrain has a motion of its own."""
import numpy as np
import pytest

from mpm_fenicsx import MPM, Body, Box, Numerics, Terrain, linear
from tests.newmark import FRICTION, SLOPE, gone, newmark

G, H = 9.81, 0.05
STIFF = linear(2e7, 0.2)
DOWN = np.array([np.cos(SLOPE), -np.sin(SLOPE)])


def block(terrain, bed, where, above=0.4, **more):
    """0.2 m of stiff soil."""
    body = Body(terrain.release(0.2, where, H), None, None, STIFF, 1000.0, **more)
    return MPM(terrain.grid(H, above), body, structures=[bed], inertia="lumped", numerics=Numerics(settle=1),
               gravity=(0.0,) * (terrain.dim - 1) + (-G,))


def centre(solid):
    return solid.points.mass @ solid.points.x / solid.points.mass.sum()


def until(solid, end, dt=2e-3):
    """The way of its centre [m]."""
    start = centre(solid)
    while solid.time < end - 1e-9:
        solid.advance(dt)
    return centre(solid) - start


def test_a_block_slides_as_newmarks_does():
    """On a slope that shakes along itself; momentum closes to round-off."""
    terrain, end = Terrain.function(lambda x: -np.tan(SLOPE) * x, (-1.0, 2.2), 0.07), 0.8
    bed = terrain.structure(friction=FRICTION, motion=lambda t: gone(t) * DOWN)
    solid = block(terrain, bed, (0.0, 0.4))
    before = sum(solid.impulses().values())
    way = until(solid, end)
    assert way @ DOWN - gone(end) == pytest.approx(newmark(end), rel=0.01)
    assert way @ (np.sin(SLOPE), np.cos(SLOPE)) == pytest.approx(0.0, abs=1e-6)
    given = sum(solid.impulses().values()) - before
    np.testing.assert_allclose(solid.momentum(), given[:2], rtol=0, atol=1e-10 * abs(given).max())
    solid.close()


@pytest.mark.parametrize("most, rides", [(2.8, True), (4.0, False)])
def test_a_block_rides_up_to_friction(most, rides):
    """Level ground, friction 0.3: accelerations of up to 2.94 m/s^2 take it along."""
    terrain, often = Terrain.function(lambda x: 0.0 * x, (-0.6, 1.0), 0.1), 4.0 * np.pi
    ground = lambda t: most / often**2 * (often * t - np.sin(often * t))  # noqa: E731
    solid = block(terrain, terrain.structure(friction=0.3, motion=lambda t: (ground(t), 0.0)), (0.0, 0.4))
    behind = ground(0.3) - until(solid, 0.3)[0]
    if rides:
        assert behind == pytest.approx(0.0, abs=2e-4)
    else:  # from where most sin(often t) is 0.3 g on, until both are equally fast
        assert 5e-3 < behind < 0.03
    solid.close()


def test_ground_from_far_away_comes_below():
    """A level raster runs along below the grid, ten times as far as its cells near it reach."""
    terrain = Terrain.function(lambda x: 0.0 * x, (-1.0, 6.0), 0.04)
    columns = Terrain.function(lambda x: 0.0 * x, (-0.6, 1.0), 0.1)
    body = Body(columns.release(0.2, (0.3, 0.7), H), None, None, STIFF, 1000.0)
    solid = MPM(columns.grid(H, 0.4), body, structures=[terrain.structure(friction=0.3).moving((-12.0, 0.0))],
                gravity=(0.0, -G), inertia="lumped", numerics=Numerics(settle=1))
    until(solid, 0.02)
    early, speed = solid.time, solid.momentum()
    until(solid, 0.35)
    found = (solid.momentum() - speed)[0] / solid.points.mass.sum() / (solid.time - early)
    assert found == pytest.approx(-0.3 * G, rel=1e-3) and solid.behind() == {"terrain": 0}
    solid.close()


def shaken(far=(0.0, 0.0), whole=True):
    """A block slides along a slope in space, half of it on ice; each vertex is told the way or the whole."""
    x, y = far
    terrain = Terrain.function(lambda a, b: 0.1 * (a - x) - 0.2 * (b - y),
                               Box((x, y), (x + 1.0, y + 0.8)), 0.1)
    way = lambda t: np.array([0.05, -0.02, 0.01]) * (1.0 - np.cos(20.0 * t))  # noqa: E731
    every = np.ones((len(terrain.x), 1))
    ice = [(x, y), (x + 0.5, y), (x + 0.5, y + 0.8), (x, y + 0.8)]
    bed = terrain.structure(friction=0.5, regions={"ice": (ice, 0.05)},
                            motion=way if whole else lambda t: every * way(t))
    where = [(x + 0.4, y + 0.3), (x + 0.6, y + 0.3), (x + 0.6, y + 0.5), (x + 0.4, y + 0.5)]
    return block(terrain, bed, where, 0.3, velocity=(2.0, 1.0, 0.0))


def forces(solid, steps=25):
    found = []
    for _ in range(steps):
        solid.advance(2e-3)
        found.append([solid.reaction(f"terrain_{name}") for name in ("ice", "rest")])
    solid.close()
    return np.array(found)


def test_places_and_ways_of_telling_change_nothing():
    """In coordinates of a map, and with the same way for each vertex: up to Newton's tolerance, 1e-7."""
    here = forces(shaken())
    assert abs(here).max(axis=(0, 2)).min() > 10.0
    np.testing.assert_allclose(forces(shaken(whole=False)), here, rtol=0, atol=1e-7 * abs(here).max())
    np.testing.assert_allclose(forces(shaken((4.5e5, 5.2e6))), here, rtol=0, atol=1e-7 * abs(here).max())


RANKS = """
import sys
import test_moving_terrain
from tests.mpm.travelling import travel

def look(solid):
    return [*solid.reaction("terrain_ice"), *solid.reaction("terrain_rest")]

travel(sys.argv[1], test_moving_terrain.shaken, 20, look=look)
"""


@pytest.mark.mpi
def test_ranks_change_nothing(tmp_path, on_ranks):
    ends = []
    for ranks in (1, 2):
        done = on_ranks(ranks, RANKS, tmp_path / f"{ranks}.npz", "-mpm_snes_rtol", "1e-12")
        assert done.returncode == 0, done.stderr
        ends.append(np.load(tmp_path / f"{ranks}.npz"))
    one, two = ends
    assert two["ranks"] == 2
    np.testing.assert_allclose(two["x"], one["x"], rtol=0, atol=1e-10)
    np.testing.assert_allclose(two["looks"], one["looks"], rtol=1e-6, atol=1e-6)
