"""Coordinates as in maps: the same motion as near zero, true coordinates in and out (both back ends)."""
from dataclasses import replace

import numpy as np
import pytest

from dem_liggghts import Material, Scene, Spheres, Wall, check_start
from dem_liggghts.scene import frame

MAP = np.array([4.5e5, 5.2e6, 300.0])


def far(scene):
    """``scene`` where its coordinates are those of a map, and how far away that is, shape (dim,)."""
    by = MAP[:scene.dim]
    return frame.translated(scene, MAP), by


def test_creep_is_not_lost(dem):
    x, v, none = MAP[None], np.array([[0.004, 0.004, 0.0]]), np.zeros((0, 3))
    ball = dem(Scene(Spheres(x, v, 0.01, 7960.0), Wall.none(3), Material(2e11, 0.3)), 1e-7)
    for _ in range(5):
        ball.advance(20000, none, none)
    assert (ball.particles()["x"][0] - MAP)[:2] / (0.004 * ball.time) == pytest.approx([1.0, 1.0], abs=1e-5)


def run(dem, window, windows, by=0.0):
    out = []
    for _ in range(windows):
        x, v = window(dem.time, 20 * dem.dt)
        out.append(dem.advance(20, x + by, v))
    return np.array(out)


def test_same_motion_as_near_zero(dem, heap, dim):
    """A heap on a waving wall: what differs comes from the digits of the coordinates given (1e-9 m)."""
    scene, window = heap(dim)
    there, by = far(scene)
    a, b = dem(scene, 1.5e-5), dem(there, 1.5e-5)
    assert not a.origin.any() and (b.origin[:dim] == by).all()
    forces = run(a, window, 120), run(b, window, 120, by)
    assert np.abs(forces[1] - forces[0]).max() < 1e-3 * np.abs(forces[0]).max() > 0.0
    moved = np.zeros(3)
    moved[:dim] = by
    for of in ("particles", "bodies"):
        near, away = getattr(a, of)(), getattr(b, of)()
        assert away["x"] - moved == pytest.approx(near["x"], abs=1e-7)
        assert away["v"] == pytest.approx(near["v"], abs=1e-5)
    energies = a.energy(), b.energy()
    for name in ("kinetic", "contact"):
        assert energies[1][name] == pytest.approx(energies[0][name], rel=1e-3)


def test_back_ends_agree_far_away(both, heap):
    scene, window = heap(2)
    there, by = far(scene)
    dems = both(there, 1.5e-5)
    forces = [run(dem, window, 120, by) for dem in dems]
    assert forces[0].any()
    dems[1].close()
    assert np.abs(forces[0] - forces[1]).max() < 1e-6 * np.abs(forces[0]).max()


def test_state_and_new_wall_far_away(dem, heap):
    """Bit for bit, in the same and a fresh instance; a wall that is replaced by itself changes nothing."""
    scene, window = heap(2)
    there, by = far(scene)
    first = dem(there, 1.5e-5)
    while not run(first, window, 1, by).any() and first.time < 0.05:
        pass
    state = first.get_state()
    forces = run(first, window, 20, by)
    for other in (first, dem(there, 1.5e-5)):
        other.set_state(state)
        assert np.array_equal(run(other, window, 20, by), forces) and forces.any()
    first.set_state(state)
    first.replace_wall(replace(there.wall, nodes=window(first.time, 1.0)[0] + by))
    assert first.scene.wall.nodes.min() > 1e5
    assert np.abs(run(first, window, 20, by) - forces).max() < 1e-3 * np.abs(forces).max()


def test_origin_of_another_start_comes_with_the_state(dem):
    """The same sphere, started elsewhere."""
    scenes = [Scene(Spheres([x], [[0.1, 0.2]], 0.01, 2500.0), Wall.none(2), Material(1e7, 0.3))
              for x in ([0.0, 0.0], MAP[:2])]
    none = np.zeros((0, 2))
    for k in (0, 1):
        first, second = dem(scenes[k], 1e-5), dem(scenes[1 - k], 1e-5)
        first.advance(100, none, none)
        second.set_state(first.get_state())
        assert np.array_equal(first.particles(), second.particles())
        assert np.array_equal(first.advance(100, none, none), second.advance(100, none, none))
        assert np.array_equal(first.particles(), second.particles())


def test_touching_far_away_and_true_coordinates_in_messages(dem):
    """A sphere that touches the wall as well as coordinates can say it is fine."""
    wall = Wall(MAP[:2] + [[-0.1, 0.0], [0.1, 0.0]], [[0, 1]])
    at = lambda height: Scene(Spheres([MAP[:2] + [0.0, height]], [[0.0, 0.0]], 0.01, 2500.0), wall,  # noqa: E731
                              Material(1e7, 0.3), Material(1e7, 0.3))
    check_start(at(0.01))
    dem(at(0.01), 1e-6)
    with pytest.raises(ValueError, match=r"sphere 1 at \[ 450000. *5199999.95\] m lies inside the body"):
        check_start(at(-0.05))


@pytest.mark.parametrize("x, size", [([0.0, 0.0], 1.0), ([50.0, 0.0], 1.0), ([0.0, 3.0], 0.01)])
def test_near_zero_nothing_moves(x, size):
    """Up to a thousand times the size of the scene."""
    scene = Scene(Spheres([x], [[0.0, 0.0]], size, 1000.0), Wall.none(2), Material(1e7, 0.3))
    assert not frame.find_origin(scene).any() and frame.translated(scene, -frame.find_origin(scene)) is scene
