"""Bad input: one clear sentence with the value and the remedy."""
import warnings
from dataclasses import replace

import numpy as np
import pytest

from dem_liggghts import (
    Cluster,
    Interaction,
    Material,
    Scene,
    Spheres,
    Wall,
    check_start,
    contact_energy,
    critical_step,
    longest_window,
    open_dem,
    warn_if_window_too_long,
)
from dem_liggghts.contact.damping import damping_ratio

STEEL = Material(2.1e11, 0.3)


def scene(wall, x=((0.0, 0.01),), radius=0.01, **more):
    return Scene(Spheres(np.array(x, float), np.full(np.shape(x), 0.1), radius, 7800.0, **more), wall, STEEL,
                 STEEL)


@pytest.mark.parametrize("make, message", [(lambda: Material(0.0, 0.3), "E is 0.0 Pa: Young's modulus must "
                                            "be positive"),
                                           (lambda: Material(1.0, 0.6),
                                            r"nu is 0.6: Poisson's ratio must lie in \(-1, 0.5\]"),
                                           (lambda: Interaction(restitution=-0.01),
                                            "restitution is -0.01: give a value from 0 to 1"),
                                           (lambda: Interaction(friction=-0.1),
                                            "friction is -0.1: it must not be negative"),
                                           (lambda: Spheres([[0, 0]], [[0, 0]], -1.0, 1.0),
                                            "radius is -1.0: it must be positive"),
                                           (lambda: Spheres([[0, 0]], [[0, 0]], 1.0, np.nan),
                                            r"rho \(density of the spheres\) is nan: it must be positive"),
                                           (lambda: Spheres([[0, np.inf]], [[0, 0]], 1.0, 1.0),
                                            "x of the spheres contains NaN or infinity"),
                                           (lambda: Spheres([[0, 0]], [[0, 0, 0]], 1.0, 1.0),
                                            r"v of the spheres has shape \(1, 3\): give an array of shape"),
                                           (lambda: Spheres([[0, 0], [1, 1]], [[0, 0]], 0.1, 1.0),
                                            "2 positions, 1 velocities, 2 spins: give one of each"),
                                           (lambda: Wall([[0, 0], [1, 0]], [[0, 2]]),
                                            r"wall elements name nodes 0..2, there are 2"),
                                           (lambda: Wall([[0, 0], [1, 0]], [[0, 1, 1]]),
                                            "wall elements have 3 nodes in 2 dimensions"),])
def test_nonsense_values(make, message):
    with pytest.raises(ValueError, match=message):
        make()


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1e31, "1", None, True])
@pytest.mark.parametrize("make, name", [(lambda bad: Material(bad, 0.3), "E"),
                                        (lambda bad: Material(1e7, bad), "nu"),
                                        (lambda bad: Interaction(bad), "restitution"),
                                        (lambda bad: Interaction(1.0, bad), "friction"),
                                        (lambda bad: Interaction(1.0, 0.0, bad), "adhesion"),
                                        (lambda bad: Wall.discs([[0, 0]], bad if bad is not None else "1"),
                                         "radius of the discs of the wall"),
                                        (lambda bad: Wall([[0, 0], [1, 0]], [[0, 1]], "1" if bad is None
                                                          else bad), "depth of the wall"),
                                        (lambda bad: Scene(wall=Wall.none(2), gravity=(0.0, bad)), "gravity"),
                                        (lambda bad: cluster(mass=bad), "mass of the cluster"),
                                        (lambda bad: cluster(angle=bad), "angle of the cluster"),
                                        (lambda bad: cluster(omega=bad), "omega of the cluster")])
def test_no_number(make, name, bad):
    """NaN, infinity, what is no number at all or beyond all measure: refused by the field's name wherever it
    is."""
    with pytest.raises(ValueError, match=rf"^{name}.* is .*: "):
        make(bad)


def cluster(mass=1.0, **more):
    return Cluster([[0.0, 0.0]], 0.1, (0.0, 0.0), mass, 1.0, **more)


@pytest.mark.parametrize("make, message",
                         [(lambda: Wall([[0, 0], [1, 0]], [[0, np.nan]]), "wall elements is .*: give whole "
                           "numbers"), (lambda: Wall([[0, 0], [1, 0]], [[0, 0.5]]),
                                        "wall elements is .*: give whole numbers"),
                          (lambda: Wall([[0, 0], [1, 0]], np.array([[0, 2**32 + 1]])),
                           "wall elements name nodes 0..4294967297, there are"),
                          (lambda: Wall([[0, 0], [1, 0]], [[0, 1], [0]]), "wall elements is .*: give numbers "
                           "of shape"), (lambda: Spheres([["a", 0]], [[0, 0]], 1.0, 1.0),
                                         "x of the spheres is .*: give an array of shape"),
                          (lambda: Spheres([[0, 0], [1, 1]], [[0, 0], [0, 0]], [1, 1, 1], 1.0),
                           r"radius has shape \(3,\): give one number"),
                          (lambda: Spheres([[0, 0]], [[0, 0]], np.inf, 1.0), "radius is inf: it must be "
                           "positive"), (lambda: cluster(free=np.nan), "free of the cluster is nan: give one "
                                         "truth value, or 3"),
                          (lambda: Cluster.box((np.inf, 1), (2, 2), (0, 0), 1.0, 1.0),
                           r"size of the cluster \(entry 0\) is inf m: give finite"),
                          (lambda: Cluster.box((1, 1), (2.5, 2), (0, 0), 1.0, 1.0),
                           "at least two spheres along each"),])
def test_numbers_that_are_none(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_unknown_back_end(sheet):
    with pytest.raises(ValueError, match="dem is 'ligghts': the back ends are reference and liggghts"):
        open_dem("ligghts", scene(sheet()), 1e-8)


@pytest.mark.parametrize("dt", [0.0, -1e-8, np.nan, np.inf, "1e-8", None])
def test_step_must_be_positive(dem, sheet, dt):
    with pytest.raises(ValueError, match="the DEM time step must be positive"):
        dem(scene(sheet()), dt)


def test_touching_is_fine_overlap_is_not(dem, sheet, dim):
    at = lambda height: scene(sheet(dim), [height * np.eye(dim)[-1]])  # noqa: E731
    dem(at(0.01), 1e-8)
    dem(at(0.01 * (1 - 1e-12)), 1e-8)
    with pytest.raises(ValueError, match="sphere 1 overlaps the wall by 1e-05 m at the start: move it away"):
        dem(at(0.01 - 1e-5), 1e-8)
    with pytest.raises(ValueError, match="sphere 1 overlaps the wall"):
        dem(scene(sheet(dim), [0.055 * np.eye(dim)[0]]), 1e-8)  # beyond the rim: neither inside nor outside
    dem(scene(sheet(dim), [0.065 * np.eye(dim)[0] - 0.03 * np.eye(dim)[-1]]), 1e-8)


def test_sphere_inside_the_body(dem, sheet, dim):
    for height in (lambda x: 0 * x, lambda x: 0.5 * np.abs(x), lambda x: -0.5 * np.abs(x)):
        with pytest.raises(ValueError, match="sphere 1 at .* lies inside the body, .* below its surface: "
                           "move it out"):
            dem(scene(sheet(dim, height=height), [-0.03 * np.eye(dim)[-1]]), 1e-8)


def test_inside_and_outside_of_closed_bodies():
    """A square and a tetrahedron, points near edges and vertices included."""
    square = Wall([[0, 0], [1, 0], [1, 1], [0, 1]], [[1, 0], [2, 1], [3, 2], [0, 3]])
    tetrahedron = Wall([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [0, 3, 2],
                                                                      [1, 2, 3]])
    for wall, inside in ((square, lambda p: (p > 0).all() and (p < 1).all()),
                         (tetrahedron, lambda p: (p > 0).all() and p.sum() < 1)):
        points = np.random.default_rng(2).uniform(-0.6, 1.6, (200, wall.dim))
        for p in points:
            tiny = scene(wall, [p], radius=1e-6)
            if inside(p):
                with pytest.raises(ValueError, match="lies inside the body"):
                    check_start(tiny)
            else:
                check_start(tiny)


def test_spheres_that_overlap(dem, sheet):
    x = [[0.0, 0.02], [0.03, 0.02], [0.045, 0.02]]
    with pytest.raises(ValueError, match="spheres 2 and 3 overlap by 0.005 m at the start: move them apart"):
        dem(scene(sheet(), x), 1e-8)


def test_spin_out_of_the_plane(dem, sheet):
    with pytest.raises(ValueError, match="sphere 1 of a plane scene has spin .* only the third component"):
        dem(scene(sheet(), omega=[[1.0, 0.0, 0.0]]), 1e-8)


def test_windows_that_make_no_sense(dem, sheet):
    ball, nodes = dem(scene(sheet()), 1e-8), np.array(sheet().nodes)
    for steps in (0, -1, 2.5, np.nan, "3", True):
        with pytest.raises(ValueError, match=f"steps is {steps!r}: a window has at least one DEM step"):
            ball.advance(steps, nodes, nodes)
    with pytest.raises(ValueError, match="steps is 4294967316: give a whole number of .* at most 2147483647"):
        ball.advance(2**32 + 20, nodes, nodes)  # 20 in 32 bits
    ball.advance(np.float64(2), nodes, 0 * nodes)
    assert ball.time == 2e-8
    with pytest.raises(ValueError,
                       match=r"x of the wall nodes has shape \(8, 2\): give numbers of shape \(9, 2\)"):
        ball.advance(1, nodes[1:], nodes[1:])


def test_nan_is_reported_with_place_and_time(dem, sheet, dim):
    ball, nodes = dem(scene(sheet(dim), [0.01 * np.eye(dim)[-1]]), 1e-8), np.array(sheet(dim).nodes)
    bad = np.zeros_like(nodes)
    bad[0, 0] = np.nan
    ball.advance(10, nodes, 0 * nodes)
    with pytest.raises(FloatingPointError, match="the wall given at t = 1e-07 s contains NaN or infinity"):
        ball.advance(10, nodes, bad)


def test_particle_that_gets_lost_in_numbers(dem, sheet):
    """The wall jumps onto the centre of the sphere: no direction to push it to."""
    ball, nodes = dem(scene(sheet(2, 2), [[0.0, 0.02]]), 1e-8), np.array(sheet(2, 2).nodes)
    state = ball.get_state()
    nodes = nodes + ball.particles()["x"][0, :2] + ball.particles()["v"][0, :2] * 1e-8
    with pytest.raises(FloatingPointError, match=r"particle 1 is at .*nan.* m at t = 2e-08 s"):
        ball.advance(2, nodes, 0 * nodes)
    if dem.backend == "reference":
        ball.set_state(state)
        assert np.isfinite(ball.advance(1, np.array(sheet(2, 2).nodes), 0 * nodes)).all()


def test_critical_step(sheet):
    """Steel sphere R = 1 cm at 0.1 sqrt(2) m/s by hand, and the warning."""
    limit = critical_step(scene(sheet()))
    G = 2.1e11 / 2.6
    assert limit.rayleigh == pytest.approx(0.2 * np.pi * 0.01 * np.sqrt(7800 / G) / (0.163 * 0.3 + 0.8766))
    m, E = 7800 * 4 / 3 * np.pi * 1e-6, 2.1e11 / 0.91 / 2
    assert limit.hertz == pytest.approx(2.87 / 20 * (m**2 / (0.01 * E**2 * 0.1 * np.sqrt(2))) ** 0.2)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        open_dem("reference", scene(sheet()), 0.99 * min(limit))
    with pytest.warns(UserWarning, match="DEM time step 1e-05 s exceeds the limit 2.11e-06 s .Rayleigh "
                      "2.11e-06 s, H"):
        open_dem("reference", scene(sheet()), 1e-5)


def test_contact_energy_is_the_integral_of_the_force(sheet, dim):
    """2/5 k d^2.5 of a wall contact and of a pair, by hand."""
    up = np.eye(dim)[-1]
    balls = scene(sheet(dim), [0.01 * up, 0.03 * up])
    d = 1e-5
    E = 2.1e11 / 0.91 / 2
    wall = 8 / 15 * E * np.sqrt(0.01) * d**2.5
    pair = 8 / 15 * E * np.sqrt(0.005) * d**2.5
    nodes = balls.wall.nodes
    assert contact_energy(balls, balls.spheres.x - d * up, nodes) == pytest.approx(wall, rel=1e-9)
    assert contact_energy(balls, [0.01 * up, (0.03 - d) * up], nodes) == pytest.approx(pair, rel=1e-9)
    assert contact_energy(balls, balls.spheres.x + d * up, nodes) == pytest.approx(0.0, abs=1e-30)


@pytest.mark.parametrize("radius", [0.01, 0.02])
def test_window_against_the_contact_of_the_moving_wall(sheet, radius):
    """Stiffness and damping of Hertz' contact at an overlap of one radius, by hand; steel on both sides."""
    one, mass = scene(sheet(), x=((0.0, radius),), radius=radius), 0.3
    E, ball = STEEL.E / (2 * (1 - 0.3**2)), one.spheres.mass[0]
    stiffness = 2.0 * E * radius
    limit = np.sqrt(4 / 3 * mass / stiffness)
    assert longest_window(one, mass) == pytest.approx(limit, rel=1e-12)
    assert longest_window(Scene(wall=sheet(), wall_material=STEEL), mass) == np.inf
    force = 1e4
    overlap = (0.75 * force / (E * np.sqrt(radius))) ** (2 / 3)
    assert longest_window(one, mass, force) == pytest.approx(np.sqrt(4 / 3 * mass / (1.5 * force / overlap)),
                                                             rel=1e-12)
    damped = replace(one, at_wall=Interaction(restitution=0.05), interactions={})
    ratio = damping_ratio(0.05, damped.at_wall.pulls)
    gamma = 2 * np.sqrt(5 / 6) * ratio * np.sqrt(stiffness * ball)
    dt = longest_window(damped, 1e-5 * ball)
    assert dt == pytest.approx(2 / np.sqrt(3) * 1e-5 * ball / gamma, rel=0.01)  # the damping rules
    assert 0.75 * stiffness * dt**2 + np.sqrt(0.75) * gamma * dt == pytest.approx(1e-5 * ball, rel=1e-12)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warn_if_window_too_long(one, 0.99 * limit, mass)
    text = r"the window of .* s exceeds .* s, the limit of .* modulus is 2.1e\+11 Pa, on nodes of m = 0.3 kg"
    with pytest.warns(UserWarning, match=text):
        warn_if_window_too_long(one, 1.01 * limit, mass)


@pytest.mark.parametrize("restitution", [1.0, 0.3])
def test_contact_at_the_wall(dem, sheet, dim, restitution):
    """Stiffness and damping are the derivatives of the force on the wall, here of one that is pressed into a
    sphere."""
    up, d, dt, speed = np.eye(dim)[-1], 1e-5, 1e-9, 1e-3
    spheres = Spheres(0.01 * up[None], 0 * up[None], 0.01, 7800.0)
    ball = dem(Scene(spheres, sheet(dim), STEEL, STEEL, at_wall=Interaction(restitution)), dt)
    start, nodes = ball.get_state(), np.array(ball.scene.wall.nodes)

    def force(lift, v=0.0):
        """At the end of a step [N], of which the mean has half; there is none at its start."""
        ball.set_state(start)
        push = np.tile(v * up, (len(nodes), 1))
        return -2.0 * (ball.advance(1, nodes + lift * up - dt * push, push) @ up).sum()

    stiffness, damping, mass = ball.contact_at_wall(force(d))[:, 0]
    assert mass == pytest.approx(spheres.mass[0], rel=1e-12)
    assert stiffness == pytest.approx((force(d + 1e-8) - force(d - 1e-8)) / 2e-8, rel=1e-4)
    assert damping == pytest.approx((force(d, speed) - force(d, -speed)) / (2 * speed), rel=1e-3, abs=1.0)
    assert (damping > 100.0) == (restitution < 1.0)
