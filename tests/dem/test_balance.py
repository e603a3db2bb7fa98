"""Momentum, torque, and states: what must hold to round-off (both back ends)."""
import numpy as np
import pytest

from dem_liggghts import Interaction, Material, Scene, Spheres

SOFT, DT = Material(1e7, 0.3), 5e-5


def run(dem, window, windows, steps=20):
    return np.array([dem.advance(steps, *window(dem.time, steps * dem.dt)) for _ in range(windows)])


def momentum(dem):
    p = dem.particles()
    return (p["mass"][:, None] * p["v"])[:, :dem.scene.dim].sum(axis=0)


def test_impulse_on_the_wall_is_what_the_spheres_lose(dem, tumble, dim):
    """Window by window: wall impulse + change of momentum = weight times time."""
    scene, window = tumble(dim)
    spheres = dem(scene, DT)
    weight = spheres.scene.spheres.mass.sum() * np.array(spheres.scene.gravity)
    before, total, contacts = momentum(spheres), 0.0, 0
    for _ in range(60):
        impulse = run(spheres, window, 1)[0].sum(axis=0) * 20 * DT
        now = momentum(spheres)
        total = max(total, np.abs(impulse).max())
        contacts += impulse.any()
        assert np.abs(impulse + now - before - weight * 20 * DT).max() < 1e-12 * max(total,
                                                                                     np.abs(before).max())
        before = now
    assert contacts > 10


def test_torque_on_the_sphere_is_the_moment_of_the_nodal_forces(dem, sheet, dim):
    """The nodal forces act at the contact point, at R - d from the centre: that is the arm of the friction
    too, so that sphere and wall keep their angular momentum (LIGGGHTS has R - d/2)."""
    wall, radius = sheet(dim, 5, height=lambda x: 0.1 * x), 0.01
    centre, spin = np.zeros(dim), np.zeros(3)
    centre[-1], spin[2 if dim == 2 else 1] = 2 * radius, -5.0
    scene = Scene(Spheres([centre], [0 * centre], radius, 2500.0, [spin]), wall, SOFT, SOFT,
                  at_wall=Interaction(0.7, 0.5))
    ball, nodes = dem(scene, 1e-6), np.array(wall.nodes)
    nodes[:, -1] += 2 * radius - (radius - 1e-4) * np.sqrt(1.01)
    force = np.zeros((len(nodes), 3))
    arm = np.zeros((len(nodes), 3))
    force[:, :dim], arm[:, :dim] = ball.advance(1, nodes, 0 * nodes), nodes
    p = ball.particles()[0]
    moment = np.cross(arm - p["x"], force).sum(axis=0)
    torque = 0.4 * p["mass"] * radius**2 * (p["omega"] - spin) / 1e-6
    assert torque == pytest.approx(-moment, rel=1e-9, abs=1e-9 * np.abs(moment).max())
    assert np.abs(torque).max() > 0.0


def test_spheres_keep_their_angular_momentum(dem, sheet, dim):
    """Two spheres in an oblique hit with friction, far from the wall: momentum, and angular momentum about
    their centre to the overlap (the two arms R - d/2 add up to the distance of the centres)."""
    x, v = np.zeros((2, dim)), np.zeros((2, dim))
    x[:, 0], x[:, -1] = (-0.01, 0.01), (0.05, 0.055)
    v[:, 0] = 0.3, -0.3
    meet = Interaction(0.6, 0.4)
    pair = dem(Scene(Spheres(x, v, [0.01, 0.008], 2500.0), sheet(dim), SOFT, SOFT, meet, meet), 1e-5)

    def angular():
        p = pair.particles()
        spin = 0.4 * p["mass"] * p["radius"] ** 2 @ p["omega"]
        return spin + (p["mass"][:, None] * np.cross(p["x"], p["v"])).sum(axis=0)

    nodes = np.array(pair.scene.wall.nodes)
    before = momentum(pair), angular()
    pair.advance(2000, nodes, 0 * nodes)
    assert momentum(pair) == pytest.approx(before[0], abs=1e-14 * pair.particles()["mass"].sum())
    assert angular() == pytest.approx(before[1], abs=1e-9 * np.abs(before[1]).max())
    assert np.abs(pair.particles()["omega"]).max() > 1.0


@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_restored_state_continues_bit_for_bit(dem, tumble, dim, friction):
    """In mid-contact with tangential history; in the same and in a fresh instance."""
    scene, window = tumble(dim, friction)
    first = dem(scene, DT)
    run(first, window, 10)
    while not first.get_state()["wall_force"][:-2].any() and first.time < 0.05:
        run(first, window, 1, steps=7)
    state, time = first.get_state(), first.time
    kept = {name: np.array(value) for name, value in state.items()}
    assert state["wall_force"].any()
    forces, particles, energy = run(first, window, 30), first.particles(), first.energy()
    for other in (first, dem(scene, DT)):
        other.set_state(state)
        assert other.time == time
        assert np.array_equal(run(other, window, 30), forces)
        assert np.array_equal(other.particles(), particles) and other.energy() == energy
    assert all(np.array_equal(kept[name], state[name]) for name in state)  # a state is not changed by its use


def test_particles_and_their_order(dem, tumble):
    scene, _ = tumble(2)
    p = dem(scene, DT).particles()
    assert p["id"].tolist() == [1, 2, 3, 4, 5]
    assert p["x"][:, :2] == pytest.approx(scene.spheres.x, abs=0) and not p["x"][:, 2].any()
    assert p["mass"] == pytest.approx(scene.spheres.mass, rel=1e-14)
    assert p["radius"] == pytest.approx(scene.spheres.radius, abs=0)


def test_windows_may_have_any_number_of_steps(dem, tumble):
    """A still wall: ten windows of one step are one window of ten, and the mean force is the mean of the
    forces."""
    scene, _ = tumble(2)
    nodes = np.array(scene.wall.nodes)
    one, ten = dem(scene, DT), dem(scene, DT)
    for _ in range(30):
        mean = np.mean([one.advance(1, nodes, 0 * nodes) for _ in range(10)], axis=0)
        assert ten.advance(10, nodes, 0 * nodes) == pytest.approx(mean, rel=1e-12, abs=1e-14)
    assert np.array_equal(one.particles()["x"], ten.particles()["x"])
