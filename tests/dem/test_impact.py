"""Normal impacts against closed forms (both back ends)."""
import numpy as np
import pytest

from dem_liggghts import Interaction, Material, Scene, Spheres, critical_step

ALUMINIUM, GLASS = Material(7e10, 0.3), Material(4.8e10, 0.2)
RIGID = Material(7e19, 0.3)


def drop(wall, v, radius=0.01, rho=2700.0, material=ALUMINIUM, wall_material=ALUMINIUM, gap=0.0, **more):
    """One sphere above the origin, moving down at v [m/s]."""
    up = np.eye(wall.dim)[-1]
    return Scene(Spheres([(radius + gap) * up], [-v * up], radius, rho), wall, material, wall_material,
                 **more)


def collide(dem, steps, wall_speed=0.0):
    """Force on the sphere [N] and its position per step; the wall rises at a constant speed [m/s]."""
    nodes = np.array(dem.scene.wall.nodes)
    v = np.zeros_like(nodes)
    v[:, -1] = wall_speed
    force, height = [], []
    for k in range(steps):
        force.append(-dem.advance(1, nodes + v * (k * dem.dt), v)[:, -1].sum())
        height.append(dem.particles()["x"][0, dem.scene.dim - 1])
    return np.array(force), np.array(height)


def hertz_impact(mass, radius, E, v):
    """Largest overlap [m], largest force [N], duration [s] (Johnson 1985, section 11.4)."""
    d = (15.0 * mass * v**2 / (16.0 * E * np.sqrt(radius))) ** 0.4
    return d, 4.0 / 3.0 * E * np.sqrt(radius) * d**1.5, 2.943 * d / v


def test_chung_ooi_aluminium_on_a_rigid_wall(dem, sheet, dim):
    """Chung and Ooi, Granular Matter 13 (2011), test 2: 4.972e-5 m, 11.37 kN, 0.7316 ms."""
    ball = dem(drop(sheet(dim, size=1.0), 0.2, 0.1, 2699.0, ALUMINIUM, RIGID), 4e-7)
    force, height = collide(ball, 1900)
    overlap, peak, duration = hertz_impact(ball.scene.spheres.mass[0], 0.1, 7e10 / (1 - 0.3**2), 0.2)
    assert 0.1 - height.min() == pytest.approx(overlap, rel=1e-5)
    assert force.max() == pytest.approx(peak, rel=1e-5)
    assert np.count_nonzero(force > 0) * ball.dt == pytest.approx(duration, rel=1e-3)
    assert (overlap, peak, duration) == pytest.approx((4.972e-5, 11.37e3, 0.7316e-3), rel=5e-4)


def test_chung_ooi_two_glass_spheres(dem, sheet, dim):
    """Chung and Ooi, test 1: 2.741e-4 m, 10.70 kN, 40.34 us."""
    x, v = np.zeros((2, dim)), np.zeros((2, dim))
    x[:, 0], x[:, -1], v[:, 0] = (-0.01, 0.01), 0.05, (10.0, -10.0)
    dt, balls = 2e-8, Spheres(x, v, 0.01, 2800.0)
    pair = dem(Scene(balls, sheet(dim), GLASS, GLASS), dt)
    nodes = np.array(pair.scene.wall.nodes)
    seen = [pair.particles()]
    for _ in range(2200):
        pair.advance(1, nodes, np.zeros_like(nodes))
        seen.append(pair.particles())
    gap = np.array([p["x"][1, 0] - p["x"][0, 0] for p in seen]) - 0.02
    force = -np.diff([p["v"][0, 0] for p in seen]) * balls.mass[0] / dt
    assert -gap.min() == pytest.approx(2.741e-4, rel=5e-4)
    assert force.max() == pytest.approx(10.70e3, rel=5e-4)
    assert np.count_nonzero(gap < 0) * dt == pytest.approx(40.34e-6, rel=1e-3)
    assert seen[-1]["v"][:, 0] == pytest.approx([-10.0, 10.0], rel=1e-6)


@pytest.mark.parametrize("attraction", [False, True])
@pytest.mark.parametrize("restitution", [0.05, 0.1, 0.3, 0.5, 0.7, 0.9, 1.0])
def test_restitution(dem, sheet, restitution, attraction):
    """The rebound speed is the nominal one, with and without a pull at the end of the contact."""
    ball = dem(drop(sheet(), 0.1, at_wall=Interaction(restitution, attraction=attraction)), 2e-8)
    nodes, forces = np.array(ball.scene.wall.nodes), []
    for _ in range(100):
        forces.append(-ball.advance(200, nodes, np.zeros_like(nodes))[:, 1].sum())
    assert ball.particles()["v"][0, 1] / 0.1 == pytest.approx(restitution, rel=1e-3)
    assert (min(forces) < 0.0) == (attraction and restitution < 1.0)


def test_restitution_of_zero(dem, sheet):
    """Without a pull it is met as 0.01; at the critical step, which strong damping shortens."""
    scene = drop(sheet(), 0.1, at_wall=Interaction(0.0))
    ball, nodes = dem(scene, min(critical_step(scene))), np.array(scene.wall.nodes)
    ball.advance(int(2e-3 / ball.dt), nodes, 0 * nodes)
    assert ball.particles()["v"][0, 1] / 0.1 == pytest.approx(0.01, rel=0.2)


@pytest.mark.parametrize("windows, steps", [(1000, 20), (1, 20000)])
def test_wall_at_constant_speed_throws_the_sphere_back(dem, sheet, dim, windows, steps):
    """v = 2 U - v0, from a distance of several radii, the whole way in one window too."""
    ball = dem(drop(sheet(dim), 0.3, gap=0.04), 1e-6)
    nodes = np.array(ball.scene.wall.nodes)
    v = np.zeros_like(nodes)
    v[:, -1] = 2.0
    for _ in range(windows):
        ball.advance(steps, nodes + v * ball.time, v)
    assert ball.particles()["v"][0, dim - 1] == pytest.approx(2 * 2.0 + 0.3, rel=1e-4)


def test_energy_is_kept_and_converges_with_the_step(dem, sheet):
    """Velocity Verlet: the error of the energy during elastic contact falls with the square of the step."""
    def worst(dt):
        ball = dem(drop(sheet(), 0.1, gravity=(0.0, -9.81)), dt)
        nodes, still = np.array(ball.scene.wall.nodes), np.zeros_like(ball.scene.wall.nodes)
        start = sum(ball.energy().values())
        errors = []
        for _ in range(40):
            ball.advance(int(round(1e-6 / dt)), nodes, still)
            errors.append(sum(ball.energy().values()) - start)
        assert ball.energy()["contact"] > 0.1 * ball.energy()["kinetic"]
        return np.abs(errors).max() / ball.energy()["kinetic"]

    coarse, fine = worst(5e-7), worst(2.5e-7)
    assert coarse < 1e-3
    assert np.log2(coarse / fine) == pytest.approx(2.0, abs=0.3)


def test_free_fall_is_exact(dem, sheet):
    ball = dem(drop(sheet(), 0.4, gap=0.5, gravity=(0.3, -9.81)), 1e-6)
    nodes = np.array(ball.scene.wall.nodes)
    for _ in range(10):
        force = ball.advance(100, nodes, np.zeros_like(nodes))
        assert not force.any()
    t, p = ball.time, ball.particles()[0]
    assert t == pytest.approx(1e-3)
    assert p["v"] == pytest.approx([0.3 * t, -0.4 - 9.81 * t, 0.0], rel=1e-12)
    assert p["x"] == pytest.approx([0.15 * t**2, 0.51 - 0.4 * t - 4.905 * t**2, 0.0], rel=1e-12)
    energy = ball.energy()
    assert energy["kinetic"] + energy["potential"] == pytest.approx(p["mass"] * (0.08 + 9.81 * 0.51),
                                                                    rel=1e-12)


@pytest.mark.parametrize("deep", [0.9, 2.0, 300.0])
def test_a_sphere_that_goes_through_the_wall_is_said_to(dem, sheet, dim, deep):
    """Hertz's overlap ``deep`` times the radius: less than one comes back, more is an error, however fast."""
    soft, radius, rho = Material(1e6, 0.3), 0.01, 2700.0
    mass, E = rho * 4 / 3 * np.pi * radius**3, 1e6 / (2 * (1 - 0.3**2))
    v = np.sqrt(16 * E * np.sqrt(radius) * (deep * radius) ** 2.5 / (15 * mass))
    scene = drop(sheet(dim), v, radius, rho, soft, soft)
    ball = dem(scene, 0.5 * min(critical_step(scene)))
    nodes, steps = np.array(scene.wall.nodes), int(4 * max(deep, 1.0) * radius / v / ball.dt) + 100
    if deep < 1:
        ball.advance(steps, nodes, 0 * nodes)
        assert ball.particles()["v"][0, dim - 1] == pytest.approx(v, rel=1e-3)
        return
    with pytest.raises(RuntimeError, match="sphere 1 is going through the wall: .* stiffer contact"):
        ball.advance(steps, nodes, 0 * nodes)
