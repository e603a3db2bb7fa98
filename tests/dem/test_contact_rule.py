"""Modulus, window and step for balls that meet rocks: what they promise comes out."""
import numpy as np
import pytest

from dem_liggghts import Cluster, Interaction, Material, Scene, Spheres, Wall, critical_step, longest_window
from dem_liggghts.contact.rule import ALONE, TOGETHER, Scales

R, BALL = 0.05, 0.0025
SCALES = Scales(spacing=0.005, mass=7.5e-5, area=2.5e-5, rho=600.0, wave=300.0, height=0.2, speed=2.0)


def scene(E=1e6, rock=1e9, v=0.0, gravity=9.81, restitution=1.0):
    ball = Spheres([(0.0, 0.0, R + BALL)], [(0.0, 0.0, -v)], R, 2600.0)
    return Scene(ball, Wall.discs([(0.0, 0.0, 0.0)], BALL), Material(rock, 0.2), Material(E, 0.3),
                 at_wall=Interaction(restitution), gravity=(0.0, 0.0, -gravity))


@pytest.mark.parametrize("backend", ["reference", "liggghts"])
def test_the_force_presses_a_tenth(backend):
    """A rock with the force of the rule as its weight comes to rest, and to twice the depth^5/2 of that, on a
    ball."""
    fitted = scene().fitted(SCALES, speed=1.0)
    rule = fitted.contact_rule(SCALES, speed=1.0)
    assert rule.depth == pytest.approx(0.1, rel=1e-9) and rule.modulus == pytest.approx(rule.given, rel=1e-9)
    g = rule.force / fitted.spheres.mass[0]
    heavy = scene(rule.given, gravity=g)
    dt = 0.5 * min(critical_step(heavy))
    dem, lowest = heavy.open(backend, dt), 0.0
    for _ in range(400):
        dem.advance(5, heavy.wall.nodes, np.zeros((1, 3)))
        lowest = min(lowest, dem.particles()["x"][0, 2] - R - BALL)
    dem.close()
    swing = (2.5) ** (2.0 / 3.0)  # F d = 8/15 k d^(5/2) at the turn, F = 4/3 / (4/3) k d^(3/2) at rest
    assert -lowest == pytest.approx(0.1 * SCALES.spacing * swing, rel=1e-2)


def test_what_grows_with_what():
    slow, fast = (scene().contact_rule(SCALES, speed) for speed in (1.0, 2.0))
    assert fast.modulus > slow.modulus and fast.window < slow.window
    assert slow.depth > 0.1 and slow.window <= longest_window(scene(), ALONE[3] * SCALES.mass, slow.force)
    damped = scene(restitution=0.3).contact_rule(SCALES, 1.0)
    assert damped.window < slow.window  # a heavy rock's damper
    soft = SCALES._replace(wave=0.0)
    assert scene().contact_rule(soft, 1.0).force < slow.force
    still = scene().contact_rule(soft, 0.0)  # weight of soil and rock alone
    weight = SCALES.area * 9.81 * (600.0 * 0.2 + 4.0 / 3.0 * 2600.0 * R)
    assert still.force == pytest.approx(2.5 * (0.5 + 0.1) / 0.1 * weight, rel=1e-9)  # through half a spacing
    assert "contact modulus 1e+06 Pa" in str(slow)


@pytest.mark.parametrize("dim", [2, 3])
def test_masses_of_points_at_a_free_surface(dim):
    """Two points per cell and direction, linear basis: of one alone, and of all of the surface together."""
    x = np.arange(0.25, 8.0, 0.5)  # in cells
    hat = np.maximum(1.0 - abs(x[:, None] - np.arange(9)), 0.0)  # (points, nodes)
    side, down = hat.sum(axis=0)[4], hat.sum(axis=0)  # masses along the surface and from it inwards
    alone = (hat[0]**2 / down).sum() * ((hat[8]**2 / side).sum()) ** (dim - 1)
    assert 1.0 / alone == pytest.approx(ALONE[dim], rel=0.01)
    assert TOGETHER < 1.0 / (hat[0]**2 / down).sum() < 1.06 * TOGETHER


def test_clusters_and_named_materials():
    rock = Cluster.of_spheres([(0.0, 0.0, 0.0), (0.02, 0.0, 0.0)], 0.02, 2600.0, (0.0, 0.0, 0.05),
                              material="rock")
    balls = Wall.discs([(0.0, 0.0, 0.0)], BALL, material="soil")
    materials = {"rock": Material(1e9, 0.2), "soil": Material(1e5, 0.3)}
    stone = Scene(wall=balls, clusters=(rock,), materials=materials,
                  interactions={("rock", "soil"): Interaction()}, gravity=(0.0, 0.0, -9.81))
    fitted = stone.fitted(SCALES, 1.0)
    assert fitted.materials["soil"].E > 1e5 and fitted.materials["rock"] == Material(1e9, 0.2)
    assert fitted.contact_rule(SCALES, 1.0).depth == pytest.approx(0.1)
    force = fitted.contact_rule(SCALES, 1.0).force
    assert fitted.depth_at_wall(force) == pytest.approx(0.1 * SCALES.spacing)


def test_bad_input():
    with pytest.raises(ValueError, match="give the rocks a modulus of at least"):
        scene(rock=1e5).contact_rule(SCALES, 1.0)
    with pytest.raises(ValueError, match="nothing presses rocks and soil"):
        scene(gravity=0.0).contact_rule(SCALES, 0.0)
    with pytest.raises(ValueError, match="speed is -1.0 m/s"):
        scene().contact_rule(SCALES, -1.0)
