"""Walls of discs, one around each node: force, friction, history, energy, agreement of both back ends."""
from dataclasses import replace

import numpy as np
import pytest

from dem_liggghts import Cluster, Interaction, Material, Scene, Spheres, Wall

R, DISC = 0.01, 0.006
SOFT, HARD = Material(1e7, 0.3), Material(4e7, 0.2)
REDUCED = R * DISC / (R + DISC)
MODULUS = 1.0 / ((1 - SOFT.nu**2) / SOFT.E + (1 - HARD.nu**2) / HARD.E)


def scene_of(discs, ball=None, v=None, friction=0.0, restitution=1.0, rho=2500.0, spin=0.0, **more):
    dim = np.shape(discs)[1]
    ball = np.zeros(dim) if ball is None else ball
    return Scene(Spheres([ball], [np.zeros(dim) if v is None else v], R, rho, [[0, 0, spin]]),
                 Wall.discs(discs, DISC), SOFT, HARD, at_wall=Interaction(restitution, friction), **more)


def step(dem, nodes, v=None):
    nodes = np.array(nodes, float)
    return dem.advance(1, nodes, 0 * nodes if v is None else v)


def test_force_is_that_of_two_spheres(dem, dim):
    """Hertz with R* = R r / (R + r), on the disc's own node, along the line of the centres, down to a centre
    inside the disc."""
    direction = np.array([0.6, 0.8, 0.0])[:dim] if dim == 2 else np.array([0.6, 0.48, 0.64])
    far = 0.5 * np.eye(dim)[0]
    ball = dem(scene_of([far, -far], rho=1e12), 1e-9)
    for distance in np.array([1.01, 0.99, 0.7, 0.35, 0.2]) * (R + DISC):
        nodes = [far, -distance * direction]
        for _ in range(2):
            force = step(ball, nodes)
        expected = -4 / 3 * MODULUS * np.sqrt(REDUCED) * max(R + DISC - distance, 0.0) ** 1.5 * direction
        assert force[1] == pytest.approx(expected, rel=1e-9, abs=1e-9) and not force[0].any()


def test_every_disc_counts(dem, dim):
    """No hierarchy as among segments: three discs, one behind the other as the sphere sees them, push
    together."""
    up = np.eye(dim)[-1]
    nodes = [-0.8 * (R + DISC) * up, -0.85 * (R + DISC) * up, -0.9 * (R + DISC) * up]
    far = np.array(nodes) - up
    ball = dem(scene_of(far, rho=1e12), 1e-9)
    for _ in range(2):
        force = step(ball, nodes)
    overlap = np.array([0.2, 0.15, 0.1]) * (R + DISC)
    assert force[:, -1] == pytest.approx(-4 / 3 * MODULUS * np.sqrt(REDUCED) * overlap**1.5, rel=1e-9)


def test_friction_sticks_and_slides(dem):
    """A heavy sphere pulled along over a disc at its lowest point: the spring of Mindlin, 8 G* sqrt(R* d),
    until Coulomb's limit; the torque has the arm R - d/2."""
    d, v, dt, friction = 2e-4, 0.01, 1e-5, 0.3
    G = 1.0 / sum(2 * (2 - m.nu) * (1 + m.nu) / m.E for m in (SOFT, HARD))
    ball = dem(scene_of([[0.0, -(R + DISC + 0.01)]], v=[v, 0.0], friction=friction, rho=1e13), dt)
    normal = 4 / 3 * MODULUS * np.sqrt(REDUCED) * d**1.5
    seen, spins, mass = [], [], ball.particles()["mass"][0]
    for _ in range(600):
        nodes = [[ball.particles()["x"][0, 0], -(R + DISC - d)]]  # stays below the centre, but does not move
        seen.append(-step(ball, nodes)[0])
        spins.append(ball.particles()["omega"][0, 2])
    force = np.array(seen)[2:]
    assert force[:, 1] == pytest.approx(normal, rel=1e-4)
    stiffness = np.diff(force[:20, 0]) / (v * dt)
    assert stiffness == pytest.approx(-8 * G * np.sqrt(REDUCED * d), rel=1e-4)
    assert force[-1, 0] == pytest.approx(-friction * normal, rel=1e-4)
    torque = 0.4 * mass * R**2 * np.diff(spins[-20:]) / dt
    assert torque == pytest.approx(-friction * normal * (R - d / 2) * np.ones(19), rel=1e-4)


def test_history_outlives_new_lists(dem):
    """A block held by friction on a row of discs on a slope does not creep while discs come from far away,
    which makes the lists anew."""
    x = np.arange(-30, 31)[:, None] * [0.002, 0.0]
    far = np.array([[0.0, 0.5], [0.1, 0.5]])
    slope = np.radians(10.0)
    g = 9.81 * np.array([np.sin(slope), -np.cos(slope)])
    block = Cluster.box((0.02, 0.018), (8, 8), (0.0, 0.01), 500.0, 0.198, rim=True)
    rest = dem(Scene(clusters=[block], wall=Wall.discs(np.vstack([x, far]) - [0.0, 0.001], 0.001),
                     material=HARD, wall_material=HARD, gravity=g, at_wall=Interaction(0.05, 0.5)), 1e-5)
    nodes = np.array(rest.scene.wall.nodes)
    for _ in range(40):
        rest.advance(500, nodes, 0 * nodes)
    held, turn = rest.bodies()["x"][0], rest.bodies()["quaternion"][0]
    v = np.zeros_like(nodes)
    for k in range(200):
        v[-2:, 1] = 2.0 if k % 2 else -2.0
        force = rest.advance(50, nodes, v)
        nodes = nodes + 50e-5 * v
    assert -force.sum(axis=0) == pytest.approx(-block.mass * g, rel=1e-6)
    assert np.abs(rest.bodies()["x"][0] - held).max() < 1e-9
    assert np.abs(rest.bodies()["quaternion"][0] - turn).max() < 1e-7


def test_energy_and_momentum_of_a_bounce(dem, dim):
    """Without damping and friction a sphere that falls between two discs keeps its energy, and what it loses
    in momentum is the impulse on the discs."""
    along, up = np.eye(dim)[0], np.eye(dim)[-1]
    start, v = 0.02 * up + 0.001 * along, -0.5 * up
    ball = dem(scene_of([-0.006 * along, 0.006 * along], start, v), 1e-6)
    nodes, mass = np.array(ball.scene.wall.nodes), ball.particles()["mass"][0]
    before, impulse, contact = sum(ball.energy().values()), 0.0, 0.0
    for _ in range(400):
        impulse = impulse + ball.advance(50, nodes, 0 * nodes).sum(axis=0) * 50e-6
        contact = max(contact, ball.energy()["contact"])
        assert sum(ball.energy().values()) == pytest.approx(before, rel=1e-4)
    assert contact > 0.5 * before and ball.particles()["v"][0, dim - 1] > 0.1
    assert mass * (ball.particles()["v"][0, :dim] - v) == pytest.approx(-impulse, abs=1e-12)


def rubble(dim):
    """Two blocks and a sphere with friction and adhesion over waving discs and a fixed floor."""
    random, up = np.random.default_rng(5), np.eye(dim)[-1]
    x = np.stack(np.meshgrid(*[np.arange(-12, 13) * 0.004] * (dim - 1)), -1).reshape(-1, dim - 1)
    nodes = np.column_stack([x, 0.001 * random.normal(size=len(x))])
    boxes = [Cluster.box([0.02] * dim, [4] * dim, 0.018 * up + a * np.eye(dim)[0], 800.0, depth=0.02,
                         v=-0.4 * up, material="wood") for a in (-0.012, 0.013)]
    floor = Wall([[-1.0, -0.02], [1.0, -0.02]], [[0, 1]], material="wood") if dim == 2 else \
        Wall([[-1.0, -1, -0.02], [1, -1, -0.02], [0, 1, -0.02]], [[0, 1, 2]], material="wood")
    rough = Interaction(0.4, 0.4, 1e3)
    pairs = {(a, b): rough for a in ("wood", "spheres") for b in ("wood", "wall")}
    scene = Scene(Spheres([0.04 * up], [-0.3 * up], 0.005, 2500.0), Wall.discs(nodes, 0.003), SOFT, HARD,
                  walls=[floor], clusters=boxes, gravity=-9.81 * up, interactions=pairs,
                  materials={"wood": Material(2e7, 0.3)})

    def window(t, length):
        at = [nodes * (1 + 0.05 * np.sin(60 * s)) + 1e-3 * np.sin(200 * s) * up for s in (t, t + length)]
        return at[0], (at[1] - at[0]) / length
    return scene, window


def test_back_ends_agree(both, dim):
    scene, window = rubble(dim)
    forces, bodies = [], []
    for dem in both(scene, 1e-5):
        forces.append(np.array([dem.advance(40, *window(dem.time, 40e-5)) for _ in range(60)]))
        bodies.append(dem.bodies())
        dem.close()
    assert (np.abs(forces[0]).max(axis=(1, 2)) > 0).sum() > 5
    assert np.abs(forces[0] - forces[1]).max() < 1e-10 * np.abs(forces[0]).max()
    assert np.abs(bodies[0]["x"] - bodies[1]["x"]).max() < 1e-10


def test_state_continues_bit_for_bit(dem):
    scene, window = rubble(2)
    pile = dem(scene, 1e-5)
    while not pile.get_state()["wall_force"].any() and pile.time < 0.05:
        pile.advance(17, *window(pile.time, 17e-5))
    state = pile.get_state()
    assert state["wall_force"].any()
    runs = []
    for other in (pile, dem(scene, 1e-5)):
        other.set_state(state)
        runs.append([other.advance(40, *window(other.time, 40e-5)) for _ in range(20)])
    assert np.array_equal(*runs)


def test_what_is_said_about_discs(dem):
    for wrong, message in ((lambda: Wall([[0, 0]], [[0]]), "discs .1 node. with a radius"),
                           (lambda: Wall.discs([[0, 0]], 0.0), "radius of the discs of the wall is 0.0 m: it "
                            "must be positive"), (lambda: Wall([[0, 0]], [[0]], depth=0.1, radius=0.1),
                                                  "the wall has discs and a depth"),
                           (lambda: Wall([[0, 0], [1, 0]], [[0, 1]], radius=0.1),
                            "wall elements have 2 nodes"), (lambda: dem(scene_of([[0.0, 0.015]]), 1e-6),
                                                            r"sphere 1 overlaps the wall by 0.001 m at the "
                                                            r"start")):
        with pytest.raises(ValueError, match=message):
            wrong()


@pytest.mark.parametrize("rolling", [0.0, 0.2])
def test_discs_near_the_sphere_are_enough(dem, dim, rolling):
    """A sphere rests on balls with friction, then is pushed over them: with the few that are near it in the
    wall, chosen anew ever so often, forces and motion are the same as with all of them."""
    place = np.arange(-4, 16) * 0.9 * DISC
    grid = np.stack(np.meshgrid(place, place[:8], indexing="ij"), -1).reshape(-1, 2)
    x = np.column_stack([place, 0 * place]) if dim == 2 else np.column_stack([grid[:, 0], 0 * grid[:, 0],
                                                                               grid[:, 1]])
    v, start = np.zeros(dim), np.zeros(dim)
    start[1], v[0] = R + DISC, 0.3
    scene = scene_of(x, start, v, 0.4, 0.3, gravity=[0.0, -9.81, 0.0][:dim])
    scene = replace(scene, at_wall=Interaction(0.3, 0.4, rolling=rolling))
    whole, few = dem(scene, 1e-5), dem(replace(scene, wall=Wall.discs(x[:0], DISC)), 1e-5)
    chosen, top = np.zeros(0, int), 0.0
    for window in range(60):
        centre = few.particles()["x"][0, :dim]
        near = np.flatnonzero(np.linalg.norm(x - centre, axis=1) < R + DISC + 0.003)
        if window % 3 == 0:
            was = np.full(len(near), -1)
            was[np.isin(near, chosen)] = np.flatnonzero(np.isin(chosen, near))
            few.replace_wall(Wall.discs(x[near], DISC), was)
            chosen = near
        a, b = whole.advance(50, x, 0 * x), few.advance(50, x[chosen], 0 * x[chosen])
        every, top = np.zeros_like(a), max(top, np.abs(a).max())
        every[chosen] = b
        assert np.abs(every - a).max() <= 1e-12 * top
    assert top > 0.01 and 0 < len(chosen) < (8 if dim == 2 else 40)
    one, other = (side.particles()[0] for side in (whole, few))
    assert np.abs(one["v"] - other["v"]).max() < 1e-12 and np.abs(one["omega"]).max() > 1.0
    with pytest.raises(ValueError, match="was has 1 numbers for"):
        few.replace_wall(Wall.discs(x[chosen], DISC), [0])
