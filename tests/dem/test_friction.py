"""Tangential contact: sliding, rolling, Coulomb's limit, crossing the borders of elements (both back
ends)."""
import numpy as np
import pytest

from dem_liggghts import Interaction, Material, Scene, Spheres, Wall

SOFT, FIRM = Material(1e7, 0.3), Material(1e9, 0.3)
RADIUS = 0.01


def sphere_on(wall, v=0.0, spin=0.0, friction=0.4, restitution=0.3, rho=2500.0, height=RADIUS, x=-0.02,
              material=SOFT, **more):
    """A sphere over the wall moving along x at v [m/s], turning with the clock at spin [rad/s]."""
    centre, velocity = np.zeros((2, wall.dim))
    centre[0], centre[-1], velocity[0] = x, height, v
    omega = [0, 0, -spin] if wall.dim == 2 else [0, spin, 0]
    return Scene(Spheres([centre], [velocity], RADIUS, rho, [omega]), wall, material, material,
                 at_wall=Interaction(restitution, friction), **more)


def spin_of(ball):
    omega = ball.particles()["omega"][0]
    return -omega[2] if ball.scene.dim == 2 else omega[1]


def gravity(dim):
    return -9.81 * np.eye(dim)[-1]


def test_sliding_becomes_rolling_on_a_moving_wall(dem, sheet, dim):
    """Relative to the wall the sphere ends at 5/7 of its first speed, without slip: the angular momentum
    about the contact point is kept."""
    belt, start = 0.2, 0.7
    ball = dem(sphere_on(sheet(dim, 6, 0.4), start, material=FIRM, gravity=gravity(dim)), 5e-6)
    nodes, v = np.array(ball.scene.wall.nodes), np.zeros(ball.scene.wall.nodes.shape)
    v[:, 0] = belt
    for _ in range(60):
        ball.advance(500, nodes + v * ball.time, v)
    rolling = ball.particles()["v"][0, 0] - belt
    assert rolling == pytest.approx(5 / 7 * (start - belt), rel=2e-4)
    assert spin_of(ball) * RADIUS == pytest.approx(rolling, rel=1e-3)


def test_coulomb_limit_while_sliding(dem, sheet, dim):
    """The force is friction times normal force, against the motion; the spin gains 5/2 of what the speed
    loses."""
    ball = dem(sphere_on(sheet(dim, 6, 0.4), 2.0, friction=0.3, material=FIRM, gravity=gravity(dim)), 5e-6)
    nodes, still = np.array(ball.scene.wall.nodes), np.zeros(ball.scene.wall.nodes.shape)
    ball.advance(2000, nodes, still)
    for _ in range(100):
        force = -ball.advance(1, nodes, still).sum(axis=0)
        assert force[-1] > 0.0
        assert force[0] == pytest.approx(-0.3 * force[-1], rel=1e-10)
    lost = 2.0 - ball.particles()["v"][0, 0]
    arm = ball.particles()["x"][0, dim - 1]  # to the surface
    assert 0.4 * RADIUS**2 * spin_of(ball) == pytest.approx(lost * arm, rel=1e-5)


@pytest.mark.parametrize("restitution", [1.0, 0.9, 0.5, 0.3, 0.1])
def test_sliding_impact_stays_within_coulombs_limit(dem, restitution):
    """A sphere meets a wall at 60 degrees and slides all the time: the tangential impulse is the coefficient
    of friction times the normal one, whatever the damping."""
    wall = Wall([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    material = Material(1e8, 0.3)
    ball = dem(Scene(Spheres([[0, 0, RADIUS]], [[2.0, 0, -1.0]], RADIUS, 2500.0), wall, material, material,
                     at_wall=Interaction(restitution, 0.1)), 5e-7)
    ball.advance(6000, np.array(wall.nodes), np.zeros(wall.nodes.shape))
    v = ball.particles()["v"][0]
    assert (2.0 - v[0]) / (0.1 * (v[2] + 1.0)) == pytest.approx(1.0, rel=1e-9)
    assert v[2] == pytest.approx(restitution, rel=1e-3)


@pytest.mark.parametrize("attraction", [None, True])
def test_spring_and_damper_together_stay_within_coulombs_limit(both, attraction):
    """A sphere thrown obliquely at a wall, turning, damped: at every step, between spheres as at walls."""
    meet = Interaction(0.2, 0.3, attraction=attraction)
    wall = Wall([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    scene = Scene(Spheres([[0, 0, RADIUS], [0, 0, 3.02 * RADIUS]], [[0.05, 0, -1.0], [0, 0.02, -1.0]], RADIUS,
                          2500.0, [[0, 40, 0], [-10, 5, 0]]), wall, FIRM, FIRM, meet, meet)
    for dem in both(scene, 1e-7):
        nodes, bound, mass = np.array(wall.nodes), 0, scene.spheres.mass[0]
        for _ in range(1500):
            before = dem.particles()["v"]
            # mean of the forces at both ends of the step
            floor = -dem.advance(1, nodes, 0 * nodes).sum(axis=0)
            upper = mass * (dem.particles()["v"] - before)[1] / dem.dt
            for tangential, normal in ((floor[:2], floor[2]), (upper[:2], upper[2])):
                assert np.hypot(*tangential) <= 0.3 * max(normal, 0.0) * (1 + 1e-3) + 1e-6
                bound += np.hypot(*tangential) > 0.299 * normal > 0.0
        assert bound > 20
        dem.close()


def histories(dem, wall, windows=600, **start):
    ball = dem(sphere_on(wall, gravity=gravity(wall.dim), **start), 5e-5)
    nodes, still = np.array(wall.nodes), np.zeros(wall.nodes.shape)
    return np.array([np.concatenate([-ball.advance(2, nodes, still).sum(axis=0), ball.particles()["x"][0]])
                     for _ in range(windows)])


def test_borders_between_coplanar_elements_do_not_exist(dem, sheet, dim):
    """Sliding, sticking and rolling over many elements is what it is on one: the tangential history goes
    along."""
    start = dict(v=1.0, spin=20.0, restitution=0.1)
    one, many = histories(dem, sheet(dim, 1), **start), histories(dem, sheet(dim, 37), **start)
    assert one[-1, dim] - one[0, dim] > 5 * 0.1 / 37  # several elements were crossed
    assert many == pytest.approx(one, abs=1e-9 * np.abs(one[:, dim - 1]).max())


@pytest.mark.parametrize("degrees", [0.5, 5.0])
def test_tangential_force_is_continuous_over_a_ridge(dem, sheet, dim, degrees):
    """A heavy sphere dragged over a ridge on which it cannot slip: the tangential spring only grows."""
    slope = np.tan(np.radians(degrees / 2))
    wall = sheet(dim, 10, height=lambda x: -slope * np.abs(x))
    scene = sphere_on(wall, v=0.1, friction=50.0, restitution=1.0, rho=1e9, x=-5e-4, height=RADIUS + 5e-6)
    ball = dem(scene, 1e-5)
    nodes, v = np.array(wall.nodes), np.zeros(wall.nodes.shape)
    v[:, -1] = 2.0  # comes up to the sphere in the first steps, then stays
    ball.advance(50, nodes, v)
    nodes = nodes + v * ball.time
    force = np.array([-ball.advance(1, nodes, 0 * v).sum(axis=0) for _ in range(950)])
    assert ball.particles()["x"][0, 0] == pytest.approx(5e-4, rel=0.05)
    steps = np.abs(np.diff(force[5:, 0]))
    assert np.abs(force[-1, 0]) > 0.5 * np.abs(force[:, 0]).max()
    assert steps.max() < 0.01 * np.abs(force[:, 0]).max()


def test_no_friction_no_spin_and_no_history(dem, sheet, dim):
    ball = dem(sphere_on(sheet(dim), 0.5, spin=3.0, friction=0.0, gravity=gravity(dim)), 5e-5)
    nodes, still = np.array(ball.scene.wall.nodes), np.zeros(ball.scene.wall.nodes.shape)
    for _ in range(5):
        force = ball.advance(100, nodes, still).sum(axis=0)
    assert force[-1] < 0.0 and np.abs(force[:-1]).max() < 1e-15
    assert spin_of(ball) == 3.0 and ball.particles()["v"][0, 0] == pytest.approx(0.5, rel=1e-14)
    if dem.backend == "reference":
        assert ball.get_state()["near_elements_shear"].size == 0


def test_plane_scene_stays_in_the_plane(dem, sheet):
    ball = dem(sphere_on(sheet(2, 37, height=lambda x: 1e-3 * np.cos(300 * x)), 0.5, 20.0, height=0.011,
                         gravity=gravity(2)), 5e-5)
    nodes = np.array(ball.scene.wall.nodes)
    ball.advance(3000, nodes, np.zeros(nodes.shape))
    p = ball.particles()[0]
    assert p["x"][2] == p["v"][2] == p["omega"][0] == p["omega"][1] == 0.0
    assert p["omega"][2] != -20.0


@pytest.mark.parametrize("depth", [None, 0.5 * RADIUS])
def test_wall_and_sphere_keep_their_angular_momentum(dem, sheet, dim, depth):
    """What the sphere loses in an oblique impact, deep and with friction, is the angular impulse on the
    nodes."""
    plain = sheet(dim, 7, 0.1)
    along, up, soft, nodes = np.eye(dim)[0], np.eye(dim)[-1], Material(5e5, 0.3), np.array(plain.nodes)
    thrown = Spheres([RADIUS * up - 0.02 * along], [4.0 * along - 3.0 * up], RADIUS, 2500.0,
                     [[0, 0, -50] if dim == 2 else [0, 50, 0]])
    ball = dem(Scene(thrown, Wall(nodes, plain.elements, depth), soft, soft, at_wall=Interaction(0.5, 0.4)),
               2e-6)
    deepest, moment = RADIUS, np.zeros(3)
    before = momentum(ball)
    for _ in range(200):
        impulse = np.zeros((len(nodes), 3))
        impulse[:, :dim] = ball.advance(10, nodes, 0 * nodes) * 10 * ball.dt
        moment += np.cross(np.pad(nodes, ((0, 0), (0, 3 - dim))), impulse).sum(axis=0)
        deepest = min(deepest, ball.particles()["x"][0, dim - 1])
    assert deepest < 0.7 * RADIUS and ball.particles()["v"][0, dim - 1] > 0.5
    assert momentum(ball) + moment == pytest.approx(before, abs=1e-10 * np.abs(before).max())
    assert np.abs(moment).max() > 0.1 * np.abs(before).max()


def momentum(dem):
    """Angular momentum of the spheres about the origin [kg m^2/s]."""
    p = dem.particles()
    spin = 0.4 * p["radius"][:, None] ** 2 * p["omega"]
    return (p["mass"][:, None] * (np.cross(p["x"], p["v"]) + spin)).sum(axis=0)


def test_two_spheres_keep_their_angular_momentum(dem, sheet):
    spheres = Spheres([[0, 0.05], [0.018, 0.06]], [[2.0, 1.0], [-2.0, -1.0]], [RADIUS, 0.6 * RADIUS], 2500.0,
                      [[0, 0, 30], [0, 0, 50]])
    pair = dem(Scene(spheres, sheet(2), Material(5e5, 0.3), SOFT, between=Interaction(0.5, 0.4)), 2e-6)
    before, nodes = momentum(pair), np.array(pair.scene.wall.nodes)
    pair.advance(2000, nodes, 0 * nodes)
    assert np.abs(pair.particles()["omega"][:, 2] - [30, 50]).min() > 1.0
    assert momentum(pair) == pytest.approx(before, abs=1e-12 * np.abs(before).max())
