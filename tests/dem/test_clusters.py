"""Rigid clusters: mass and inertia, free flight, bounce, rest, sliding, toppling (both back ends)."""
import numpy as np
import pytest

from dem_liggghts import Cluster, Interaction, Material, Scene, Wall, quaternion

WOOD, STONE = Material(5e7, 0.3), Material(5e7, 0.3)
PLAIN = Interaction()
SIZE, DEPTH, RHO, G = (0.02, 0.018), 0.198, 500.0, 9.81


def block(x, angle=0.0, size=SIZE, n=(8, 8), rim=True, **more):
    """The paper's wooden block of 8 x 8 spheres, 2 cm wide, 1.8 cm high."""
    return Cluster.box(size, n, x, RHO, DEPTH, rim=rim, material="wood", angle=angle, **more)


def scene(clusters, meet=PLAIN, ground=True, gravity=(0.0, -G), wall=None, **more):
    """Blocks on a floor of stone along x, from -0.3 to 0.3 m."""
    floor = Wall([[-0.3, 0.0], [0.3, 0.0]], [[0, 1]], material="stone")
    return Scene(wall=wall, clusters=clusters, walls=[floor] if ground else [], gravity=gravity,
                 materials={"wood": WOOD, "stone": STONE, "wall": STONE},
                 interactions={("wood", "wood"): meet, ("wood", "stone"): meet, ("wood", "wall"): meet},
                 **more)


def run(dem, steps):
    nodes = np.array(dem.scene.wall.nodes)
    dem.advance(steps, nodes, 0 * nodes)


def total(dem):
    return sum(dem.energy().values())


def angular_momentum(dem, clusters):
    """About the origin [kg m^2/s], from bodies() and the inertia of the scene."""
    out = np.zeros(3)
    for body, cluster in zip(dem.bodies(), clusters):
        R = quaternion.matrix(body["quaternion"])
        out += R @ cluster.inertia @ R.T @ body["omega"] + body["mass"] * np.cross(body["x"], body["v"])
    return out


def test_mass_and_inertia_of_the_solid_and_of_the_spheres():
    solid = block((0, 0))
    mass = RHO * SIZE[0] * SIZE[1] * DEPTH
    assert solid.mass == pytest.approx(mass, rel=1e-15)
    assert solid.inertia[2, 2] == pytest.approx(mass / 12 * (SIZE[0]**2 + SIZE[1]**2), rel=1e-15)
    assert len(solid.radii) == 28 and len(block((0, 0), rim=False).radii) == 64
    assert np.abs(solid.places[:, 0]).max() + 0.00125 == pytest.approx(0.01)
    assert np.abs(solid.places[:, 1]).max() + 0.00125 == pytest.approx(0.009)
    ball = 4 / 3 * np.pi * 1e-6 * 1000
    pair = Cluster.of_spheres([[0, 0, 0], [0.02, 0, 0]], 0.01, 1000.0, (1, 2, 3))
    assert pair.mass == pytest.approx(2 * ball) and pair.centre == pytest.approx([0.01, 0, 0])
    across = 2 * ball * (0.4 * 1e-4 + 1e-4)
    assert pair.inertia == pytest.approx(np.diag([0.8 * ball * 1e-4, across, across]))
    assert pair.places == pytest.approx(np.array([[0.99, 2, 3], [1.01, 2, 3]]))


def test_principal_axes_of_a_crooked_body():
    """They diagonalise the tensor and are right-handed."""
    body = Cluster.of_spheres([[0, 0, 0], [0.02, 0, 0], [0.02, 0.02, 0], [0.02, 0.02, 0.02]], 0.01, 1000.0,
                              (0, 0, 0))
    moments, turn = body.principal()
    R = quaternion.matrix(turn)
    assert R @ np.diag(moments) @ R.T == pytest.approx(body.inertia) and np.linalg.det(R) == pytest.approx(
        1.0)


@pytest.mark.parametrize("steps", [20000])
def test_free_flight_in_space(dem, steps):
    """A crooked body tumbles about no principal axis: energy and angular momentum stay, the quaternion has
    norm one."""
    omega = np.array([20.0, -35.0, 50.0])
    body = Cluster.of_spheres([[0, 0, 0], [0.02, 0, 0], [0.02, 0.02, 0], [0.02, 0.02, 0.03],
                               [0.02, 0.02, 0.015]], 0.01, 1000.0, (0.1, 0.2, 0.3), v=(1.0, 2.0, 3.0),
                              omega=omega, quaternion=np.full(4, 0.5))
    flight = dem(Scene(clusters=[body], material=WOOD, gravity=(0.0, 0.0, -G)), 1e-5)
    start = total(flight), angular_momentum(flight, [body])
    x, v, L = np.array([0.1, 0.2, 0.3]), np.array([1.0, 2.0, 3.0]), start[1]
    run(flight, steps)
    t, now = flight.time, flight.bodies()[0]
    assert now["x"] == pytest.approx(x + v * t - [0, 0, G * t**2 / 2], abs=1e-12)
    own = angular_momentum(flight, [body]) - now["mass"] * np.cross(now["x"], now["v"])
    assert own == pytest.approx(L - now["mass"] * np.cross(x, v), rel=1e-7)
    assert total(flight) == pytest.approx(start[0], rel=1e-7)
    assert np.linalg.norm(now["quaternion"]) == pytest.approx(1.0, abs=1e-14)
    assert np.abs(now["omega"] - omega).max() > 10.0
    spheres = flight.particles()
    arms = (body.centres - body.centre) @ quaternion.matrix(now["quaternion"]).T
    assert spheres["x"] == pytest.approx(now["x"] + arms, abs=1e-14)
    assert spheres["v"] == pytest.approx(now["v"] + np.cross(now["omega"], arms), abs=1e-13)


def test_free_flight_in_the_plane_is_exact(dem):
    flying = dem(scene([block((0.0, 1.0), 0.3, v=(0.1, 0.2), omega=5.0)], ground=False), 1e-5)
    run(flying, 20000)
    body, t = flying.bodies()[0], flying.time
    assert body["x"] == pytest.approx([0.1 * t, 1.0 + 0.2 * t - G * t**2 / 2, 0.0], abs=1e-12)
    assert quaternion.angle(body["quaternion"]) == pytest.approx(0.3 + 5 * t, abs=1e-9)
    assert body["omega"] == pytest.approx([0.0, 0.0, 5.0], rel=1e-14) and not body["omega"][:2].any()
    assert body["v"][2] == 0.0 and body["x"][2] == 0.0
    assert not body["quaternion"][1:3].any() and not flying.particles()["x"][:, 2].any()
    energy = flying.energy()
    inertia = body["mass"] / 12 * (SIZE[0]**2 + SIZE[1]**2)
    assert energy["kinetic"] == pytest.approx(0.5 * body["mass"] * (body["v"] @ body["v"]) + 12.5 * inertia,
                                              rel=1e-12)


def test_elastic_bounce(dem, sheet):
    """A tilted block hits a bent wall without friction: energy stays, the wall's impulse is what the block
    loses."""
    wall = sheet(2, 40, 0.16, height=lambda x: 4 * x**2)
    body = block((0.002, 0.02), 0.35, v=(0.05, -0.5))
    bounce = dem(scene([body], ground=False, gravity=(0.0, 0.0), wall=wall), 1e-6)
    nodes, impulse, start = np.array(wall.nodes), 0.0, bounce.bodies()[0]
    before, worst = total(bounce), 0.0
    for _ in range(300):
        impulse = impulse + bounce.advance(200, nodes, 0 * nodes).sum(axis=0) * 200e-6
        worst = max(worst, abs(total(bounce) / before - 1))
    now = bounce.bodies()[0]
    lost = body.mass * (start["v"] - now["v"])[:2]
    assert worst < 2e-5 and np.abs(impulse - lost).max() < 1e-12 * np.abs(lost).max()
    assert now["v"][1] > 0.1 and abs(now["omega"][2]) > 1.0 and np.abs(impulse).max() > 0.01


def test_degrees_of_freedom_that_are_not_free(dem):
    """A fixed block stays, one that may only slide along x stays level and low, whatever falls on them."""
    fixed = block((0.0, 0.009), free=False)
    slides = block((0.03, 0.009), free=(True, False, False), v=(0.1, 0.0))
    falls = block((0.012, 0.0302), 0.2, v=(0.0, -1.0))
    rest = dem(scene([fixed, slides, falls], Interaction(0.5, 0.5)), 5e-6)
    run(rest, 8000)
    first, second, third = rest.bodies()
    assert first["x"].tolist() == [0.0, 0.009, 0.0] and first["quaternion"].tolist() == [1.0, 0.0, 0.0, 0.0]
    assert second["x"][1] == 0.009 and second["quaternion"].tolist() == [1.0, 0.0, 0.0,
                                                                         0.0] and second["v"][0] != 0.1
    assert third["x"][1] > 0.02


@pytest.mark.parametrize("slope, sliding", [(18.0, False), (26.0, True)])
def test_slope_below_and_above_the_friction_angle(dem, slope, sliding, record_property):
    """Friction 0.4, angle 21.8 degrees: at rest below, above it slides with g (sin t - mu cos t)."""
    t, mu = np.radians(slope), 0.4
    gravity = (G * np.sin(t), -G * np.cos(t))
    resting = dem(scene([block((0.0, 0.009))], Interaction(0.05, mu), gravity=gravity), 1e-5)
    run(resting, 10000)  # a damper for a restitution of 0.05 creeps to rest
    v, time = resting.bodies()["v"][0, 0], resting.time
    run(resting, 10000)
    gained = (resting.bodies()["v"][0, 0] - v) / (resting.time - time)
    record_property("acceleration", float(gained))
    if sliding:
        assert gained == pytest.approx(G * (np.sin(t) - mu * np.cos(t)), rel=1e-4)
    else:
        assert abs(gained) < 1e-6 and abs(resting.bodies()["v"][0, 0]) < 1e-7


def test_stack_does_not_creep(dem, record_property):
    """Three blocks, all free, settle for 0.2 s, then stay within round-off for 0.2 s."""
    stack = dem(scene([block((0.0, 0.009 + 0.018 * k)) for k in range(3)], Interaction(0.05, 0.4)), 1e-5)
    run(stack, 20000)
    before = stack.bodies()
    run(stack, 20000)
    now = stack.bodies()
    creep = np.abs(now["x"] - before["x"]).max()
    record_property("creep in 0.2 s", float(creep))
    assert creep < 1e-12 and np.abs(now["v"]).max() < 1e-9 and np.abs(now["quaternion"][:, 3]).max() < 1e-10


def test_toppling_block_follows_housner(dem, record_property):
    """A slender block released at the angle th0 < alpha on one lower edge: th'' = -p^2 (alpha - th) with p^2
    = m g R / I0 (Housner, Bull. Seism. Soc. Am. 53 (1963) 403-417), so th = alpha - (alpha - th0) cosh(p t),
    and it stands upright after arccosh(1 / (1 - th0/alpha)) / p. The block has a chain of tiny spheres at its
    foot only."""
    (width, height), tilt, r = (0.01, 0.1), 0.04, 1e-4
    mass = RHO * width * height * DEPTH
    foot = np.column_stack([np.linspace(r - width / 2, width / 2 - r, 50), np.full(50, r - height / 2)])
    c, s = np.cos(tilt), np.sin(tilt)
    x = np.array([0.0, r]) - np.array([[c, s], [-s, c]]) @ foot[-1]
    body = Cluster(foot, r, x, mass, mass / 12 * (width**2 + height**2), angle=-tilt, material="wood")
    hard = Material(5e10, 0.3)
    ground = Wall([[-0.3, 0.0], [0.3, 0.0]], [[0, 1]], material="wood")
    meet = {("wood", "wood"): Interaction(0.05, 5.0)}
    rocking = dem(Scene(clusters=[body], walls=[ground], gravity=(0.0, -G), materials={"wood": hard},
                        interactions=meet), 4e-6)
    R, alpha = np.hypot(width, height) / 2, np.arctan(width / height)
    p = np.sqrt(mass * G * R / (body.inertia[2, 2] + mass * R**2))
    expected = np.arccosh(1 / (1 - tilt / alpha)) / p
    while quaternion.angle(rocking.bodies()["quaternion"][0]) < 0.0 and rocking.time < 2 * expected:
        run(rocking, 20)
    record_property("time to upright over Housner", float(rocking.time / expected))
    assert rocking.time / expected == pytest.approx(1.0, abs=0.03)
