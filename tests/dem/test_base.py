"""The ground shakes: in its frame a rock slides as Newmark's block does, and what it gives is booked."""
import numpy as np
import pytest

from dem_liggghts import Cluster, Interaction, Material, Scene, Spheres, Wall
from tests.newmark import FRICTION, GRAVITY, newmark, shaking

STONE = Material(1e8, 0.3)


def sled(**more):
    """A rock of discs in a row on a slope, too long to tip over."""
    r, mass = 0.05, 100.0
    row = np.column_stack([np.linspace(-0.27, 0.27, 7), np.zeros(7)])
    rock = Cluster(row, np.full(7, r), (0.0, r), mass, mass * 0.09)
    floor = Wall([(-9.0, 0.0), (9.0, 0.0)], [(0, 1)], material="floor")
    return Scene(None, None, STONE, gravity=GRAVITY, clusters=[rock], walls=[floor],
                 materials={"floor": STONE}, interactions={("spheres", "floor"): Interaction(0.1, FRICTION)},
                 **more)


def test_a_rock_slides_as_newmarks_block_does(dem):
    end, window, steps = 0.8, 2e-3, 100
    rock = dem(sled(base=shaking), window / steps)
    none = np.zeros((0, 2))
    start, energy = rock.bodies()["v"][0] * 100.0, sum(rock.energy().values())
    for _ in range(round(end / window)):
        rock.advance(steps, none, none)
    body = rock.bodies()[0]
    assert body["x"][0] == pytest.approx(newmark(end), rel=0.02)
    given = sum(rock.impulses().values())
    gained, allowed = 100.0 * body["v"] - start, 1e-9 * abs(given).max()
    np.testing.assert_allclose(gained[:2], given[:2], rtol=0, atol=allowed)
    assert energy + rock.base_work > sum(rock.energy().values())  # friction has taken some


def test_what_flies_keeps_its_path_in_space(dem):
    """Seen from the ground it moves against it; momentum, its moment and energy are in the books."""
    flies = Spheres([[0.0, 0.2, 0.1], [0.3, 0.0, 0.5]], [[1.0, 0.0, 0.0]] * 2, 0.01, 2500.0)
    ground = Wall([(-1, -9, -9), (1, -9, -9), (0, -9, 9)], [(0, 2, 1)])
    balls = dem(Scene(flies, ground, STONE, STONE, gravity=(0.0, -9.81, 0.0),
                      base=lambda t: (3.0 * t, 1.0, -2.0 * np.cos(9.0 * t))), 1e-4)
    x, start = np.array(ground.nodes, float), balls.particles()
    energy, state = sum(balls.energy().values()), None
    for n in range(20):
        if n == 7:
            state = balls.get_state()
        balls.advance(50, x, 0.0 * x)
    t, now = 0.1, balls.particles()
    moved = np.array([t - 0.5 * t**3, -0.5 * 10.81 * t**2, 2.0 / 81.0 * (1.0 - np.cos(9.0 * t))])
    np.testing.assert_allclose(now["x"] - start["x"], [moved] * 2, rtol=0, atol=2e-5)
    given, mass = sum(balls.impulses().values()), now["mass"][:, None]
    np.testing.assert_allclose((mass * (now["v"] - start["v"])).sum(axis=0), given[:3], rtol=0, atol=1e-13)
    turned = np.cross(now["x"], mass * now["v"]) - np.cross(start["x"], mass * start["v"])
    np.testing.assert_allclose(turned.sum(axis=0), given[3:], rtol=0, atol=2e-3 * abs(given).max())
    assert sum(balls.energy().values()) - energy == pytest.approx(balls.base_work, rel=1e-3)
    balls.set_state(state)
    for _ in range(7, 20):
        balls.advance(50, x, 0.0 * x)
    assert (balls.particles() == now).all()
    assert (sum(balls.impulses().values()) == given).all()


@pytest.mark.parametrize("base, words", [
    (1.0, "base is 1.0: give a function"),
    (([0.0, 1.0, 1.0], [(0.0, 0.0)] * 3), "the times of base do not increase: 1 s comes after 1 s, sort"),
    (lambda t: (1.0, 0.0, 0.0), r"the value of base has shape .*|the value of base is .*: give numbers of"),
    (lambda t: (np.nan, 0.0), r"the value of base .entry 0. is nan m/s.2: give finite")])
def test_what_is_no_motion_is_refused(base, words):
    with pytest.raises(ValueError, match=words):
        sled(base=base)
