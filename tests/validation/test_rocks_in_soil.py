"""Rocks in soil of no strength, which is a heavy liquid: they float or sink by their density; and momentum,
exact in every window, with rocks inside a flow."""

import numpy as np
import pytest

from coupling import Output, Run, Scheme
from dem_liggghts import Cluster, Interaction, Material, Scene, Wall
from mpm_fenicsx import MPM, Body, Box, Grid, Soil, Support, at_rest, of_points

G, RHO, H = 9.81, 1500.0, 0.05
LIQUID = Soil(E=2e5, nu=0.3, rho=RHO, phi=0.0, cohesion=2.0, law="von_mises")
RADIUS, BED = 0.2, (1.0, 0.8)
DISPLACED = RHO * G * np.pi * RADIUS**2  # weight of the soil in the place of the rock [N]


def disc(density, **more):
    """A disc in the plane, 1 m thick."""
    mass = density * np.pi * RADIUS**2
    return Cluster(np.zeros((1, 2)), RADIUS, (0.5 * BED[0], 0.45), mass, 0.5 * mass * RADIUS**2, **more)


def scene(rock, t_end, out):
    """The rock in the liquid, which rests under the pressure of its depth."""
    gap = 0.25 * H
    body = Body(Box((0.0, 0.0), BED), Grid.counts(BED, H), 2, LIQUID.material(2), RHO, f_bar=True,
                stress=at_rest(BED[1], RHO, G, 1.0)).without(rock, gap=gap)
    grid = Grid(Box((0.0, 0.0), (BED[0], BED[1] + 4 * H)), Grid.counts((BED[0], BED[1] + 4 * H), H))
    held = [Support(lambda x: x[:, 1] < 1e-9, "y"),
            Support(lambda x: (x[:, 0] < 1e-9) | (x[:, 0] > BED[0] - 1e-9), "x")]
    points = of_points(body)
    solid = MPM(grid, body, held, points, gravity=(0.0, -G), inertia="lumped")
    grains = Scene(clusters=(rock,), wall=Wall.discs(points.x, gap), material=Material(1e10, 0.3),
                   wall_material=Material(1e6, 0.3), at_wall=Interaction(1.0, 0.0), gravity=(0.0, -G))
    columns = {"push": ("N", "of the soil on the rock, upward", lambda w: -w.wall_force[:, 1].sum()),
               "y": ("m", "rise of the rock", lambda w: w.particles["x"][0, 1] - rock.x[1])}
    return Run("float", solid, grains.fitted(solid.contact_scales(), 0.3),
               Scheme(None, t_end, substeps=16, speed=0.3), Output(out), columns=columns)


@pytest.mark.validation
def test_buoyancy_is_the_weight_of_the_soil_that_is_not_there(tmp_path):
    """A rock that is held: the mean over the ringing that its first contact starts, 1.004 and, in windows of
    half the length, 1.014 of it."""
    history = scene(disc(2.0 * RHO, free=False), 0.8, tmp_path).go()["reference"]
    assert history["push"].mean() == pytest.approx(DISPLACED, rel=0.03)
    assert history["momentum_error"].max() < 1e-12  # with what holds it
    assert 0.03 < history["deepest_ball"].max() < 0.1


@pytest.mark.validation
def test_rocks_float_stay_and_sink_by_their_density(tmp_path):
    """With the same added mass, that of the liquid which they move: more than in an unbounded one."""
    t, ratios, rises = 0.2, (0.5, 1.0, 2.0), []
    for ratio in ratios:
        history = scene(disc(ratio * RHO), t, tmp_path / str(ratio)).go()["reference"]
        assert history["momentum_error"].max() < 1e-12 and history["deepest_ball"].max() < 0.1
        rises.append(2.0 * history["y"][-1] / t**2)  # acceleration [m/s^2]
    light, same, heavy = rises
    assert light > 0.2 * G and heavy < -0.2 * G and abs(same) < 0.015 * G
    raw = np.mean([abs(ratio - 1.0) * G / abs(a) - ratio for ratio, a in ((0.5, light), (2.0, heavy))])
    lift = G + same * (1.0 + raw)  # of the soil on its own mass: one of its density sinks by a little
    added = [(lift - ratio * G) / a - ratio for ratio, a in ((0.5, light), (2.0, heavy))]
    assert added[0] == pytest.approx(added[1], rel=0.1) and 1.0 < added[0] < 2.0


@pytest.mark.parametrize("back_end", ["reference", "liggghts"])
def test_momentum_with_rocks_inside_a_flow(tmp_path, back_end):
    """Soil collapses with a rock in it, which it carries: all momentum that is exchanged is booked, in every
    window. Angular momentum, too: that of each side to round-off, what friction on the rim of balls does to
    the rock alone as "arms"; from one to the other it passes half a window apart."""
    size, h, y = (0.2, 0.3), 0.025, 0.16
    rock = Cluster.of_spheres([(0.0, 0.0), (0.05, 0.0)], (0.04, 0.03), 2600.0, (0.1, y), angle=0.5)
    soil = Soil(E=2e5, nu=0.3, rho=1500.0, phi=30.0)
    body = Body(Box((0.0, 0.0), size), Grid.counts(size, h), 2, soil.material(2), soil.rho, thickness=0.06,
                f_bar=True).without(rock, gap=0.25 * h)
    held = [Support(lambda x: x[:, 1] < 1e-9, "xy"), Support(lambda x: x[:, 0] < 1e-9, "x")]
    points = of_points(body)
    solid = MPM(Grid(Box((0.0, 0.0), (0.6, 0.4)), (24, 16)), body, held, points, gravity=(0.0, -G),
                inertia="lumped")
    grains = Scene(clusters=(rock,), wall=Wall.discs(points.x, 0.25 * h), material=Material(1e10, 0.3),
                   wall_material=Material(1e6, 0.3), at_wall=Interaction(1.0, 0.4), gravity=(0.0, -G))
    run = Run("carried", solid, grains.fitted(solid.contact_scales(), 1.0),
              Scheme(1e-3, 0.06, substeps=64, dem=back_end), Output(tmp_path))
    history = run.go()[back_end]
    assert np.abs(history["impulse_grains_x"]).max() > 0.0  # it is carried
    assert history["momentum_error"].max() < 1e-12 and history["angular_error"].max() < 1e-6
    left = np.abs(history["impulse_grains"] + history["impulse_solid"])
    assert left.max() < 1e-12 * np.abs(history["impulse_grains"]).max()
