"""Rigid structures among the particles: contact, motion, and the books of their impulses."""
import numpy as np
import pytest

from dem_liggghts import Cluster, Interaction, Material, Scene, Spheres, Wall, quaternion
from mpm_fenicsx import Box, Structure

G = 9.81
ROCK = Material(1e7, 0.25)
ROOM = Box((-1.0, -1.0, -1.0), (3.0, 2.0, 2.0))
NONE = np.zeros((0, 3))


def bed(angle=0.0, mu=0.3):
    """A plane through the origin that falls along x, off all axes."""
    return Structure.plane("bed", (0.0, 0.0, 0.0), (np.sin(angle), np.cos(angle), 0.0), ROOM, friction=mu)


def momentum(dem):
    """Linear and angular about zero of single spheres, shape (6,)."""
    p = dem.particles()
    linear = p["mass"][:, None] * p["v"]
    spin = 0.4 * (p["mass"] * p["radius"]**2)[:, None] * p["omega"]
    return np.concatenate([linear.sum(axis=0), (np.cross(p["x"], linear) + spin).sum(axis=0)])


def two(dem, structures, **more):
    spheres = Spheres([[0.0, 0.0501, -0.1], [0.2, 0.2, 0.1]], [[2.0, 0.0, 0.0]] * 2, 0.05, 2600.0)
    return dem(Scene(spheres, structures=structures, material=ROCK, gravity=(0.0, -G, 0.0), **more), 1e-5)


def test_momentum_is_that_of_the_structures(dem):
    """Two spheres bounce between bed and wall; impulses by force cell, to round-off where walls stand."""
    wall = Structure.box("wall", Box((0.5, -0.1, -0.2), (0.6, 0.3, 0.2)), cells=(1, 2, 1), friction=0.2)
    run = two(dem, [bed(), wall], interactions={("spheres", "wall"): Interaction(0.5, 0.2)})
    start = momentum(run)
    for _ in range(40):
        run.advance(1000, NONE, NONE)
    given = run.impulses()
    assert list(given) == ["gravity", "bed", "wall_1", "wall_2", "arms", "interface"]
    gained = momentum(run) - start - sum(given.values())
    assert abs(gained[:3]).max() < 1e-12 * abs(given["gravity"][1])
    assert given["wall_1"][0] < -1.0 and given["wall_2"][0] < -1.0
    assert abs(gained[3:]).max() < 1e-11 * abs(given["bed"][3:]).max()  # gravity's moment, step by step
    assert np.array_equal(given["interface"], np.zeros(6))


def test_without_gravity_the_moments_close_too(dem):
    wall = Structure.box("wall", Box((0.5, -0.5, -0.5), (0.6, 0.5, 0.5)), friction=0.3)
    spheres = Spheres([[0.0, 0.2, 0.1]], [[2.0, 0.7, -0.4]], 0.05, 2600.0, omega=[[1.0, 2.0, 3.0]])
    run = dem(Scene(spheres, structures=[wall], material=ROCK), 1e-5)
    start = momentum(run)
    run.advance(40000, NONE, NONE)
    given = run.impulses()["wall"]
    assert given[0] < -1.0 and momentum(run) - start == pytest.approx(given, abs=1e-11 * abs(given).max())


@pytest.mark.parametrize("rolling", [0.0, 0.1])
def test_friction_on_the_rim_of_balls_is_booked(dem, rolling):
    """A ball that spins falls on others, which move: what it gains in angular momentum is what the balls lose
    at their centres and the arms from there."""
    at = np.array([(x, 0.0, z) for x in (-0.03, 0.0, 0.03) for z in (-0.03, 0.0, 0.03)])
    ball = Spheres([[0.003, 0.0601, 0.002]], [[0.3, -0.5, 0.1]], 0.05, 2600.0, omega=[[5.0, 3.0, -20.0]])
    run = dem(Scene(ball, Wall.discs(at, 0.01), ROCK, ROCK, at_wall=Interaction(0.7, 0.4, rolling=rolling),
                    gravity=(0.0, -G, 0.0)), 1e-5)
    start, v = momentum(run), np.tile([0.1, 0.05, 0.0], (9, 1))
    for k in range(10):
        run.advance(100, at + 1e-3 * k * v, v)
    given = run.impulses()
    assert momentum(run) - start == pytest.approx(sum(given.values()), abs=1e-12)
    assert np.abs(given["arms"][3:]).max() > 0.1 * np.abs(given["interface"][3:]).max() > 1e-5
    assert not given["arms"][:3].any()


def test_books_are_part_of_a_state(dem):
    run = two(dem, [bed()])
    run.advance(2000, NONE, NONE)
    state, before = run.get_state(), run.impulses()
    run.advance(2000, NONE, NONE)
    after = run.impulses()
    run.set_state(state)
    assert all(np.array_equal(run.impulses()[name], before[name]) for name in before)
    run.advance(2000, NONE, NONE)
    assert all(np.array_equal(run.impulses()[name], after[name]) for name in after)


def test_other_walls_and_the_interface_are_booked(dem):
    floor = Wall([(-1, 0, -1), (3, 0, -1), (3, 0, 1), (-1, 0, 1)], [(0, 2, 1), (0, 3, 2)], material="floor")
    spheres = Spheres([[0.0, 0.05, 0.0], [0.3, 0.05, 0.0]], [[0.0, -0.1, 0.0]] * 2, 0.05, 2600.0)
    lid = Wall([(0.4, -1, -1), (0.4, -1, 1), (0.4, 1, 1), (0.4, 1, -1)], [(0, 1, 2), (0, 2, 3)])
    run = dem(Scene(spheres, lid, ROCK, ROCK, walls=[floor], materials={"floor": ROCK},
                           interactions={("spheres", "floor"): Interaction()}, gravity=(3.0, -G, 0.0)), 1e-5)
    start = momentum(run)
    for _ in range(5):
        run.advance(6000, lid.nodes, 0.0 * lid.nodes)
    given = run.impulses()
    assert list(given) == ["gravity", "floor", "arms", "interface"] and given["interface"][0] < -0.1
    assert momentum(run) - start == pytest.approx(sum(given.values()), abs=1e-11)


@pytest.mark.parametrize("angle, mu, rolls", [(30.0, 0.4, True), (40.0, 0.1, False)])
def test_a_sphere_rolls_or_slides_down_a_plane_off_the_axes(dem, angle, mu, rolls):
    """5/7 g sin t as long as mu > 2/7 tan t, else g (sin t - mu cos t)."""
    t = np.radians(angle)
    n, along = np.array([np.sin(t), np.cos(t), 0.0]), np.array([np.cos(t), -np.sin(t), 0.0])
    sphere = Spheres([n * 0.05], [[0.0, 0.0, 0.0]], 0.05, 2600.0)
    run = dem(Scene(sphere, structures=[bed(t, mu)], material=Material(1e9, 0.25), gravity=(0.0, -G, 0.0),
                    interactions={("spheres", "bed"): Interaction(0.1, mu)}), 5e-6)
    run.advance(10000, NONE, NONE)
    before = run.particles()["v"][0] @ along
    run.advance(20000, NONE, NONE)
    a = (run.particles()["v"][0] @ along - before) / 0.1
    assert a == pytest.approx(5 / 7 * G * np.sin(t) if rolls else G * (np.sin(t) - mu * np.cos(t)), rel=5e-3)


def test_a_moving_structure_takes_spheres_along(dem):
    """A plate of 0.5 m/s meets a sphere at rest and a turning one strikes another: v' = 2 u without loss."""
    plate = Structure.box("plate", Box((-0.2, -0.5, -0.5), (-0.06, 0.5, 0.5))).moving((0.5, 0.0, 0.0))
    arm = Structure.box("arm", Box((2.0, -0.1, -0.1), (3.0, 0.0, 0.1)), friction=0.0).turning(
        0.4, at=(2.0, 0.0, 0.0), axis=(0.0, 0.0, 1.0))
    spheres = Spheres([[0.0, 0.0, 0.0], [2.8, 0.08, 0.0]], [[0.0, 0.0, 0.0]] * 2, 0.05, 2600.0)
    run = dem(Scene(spheres, structures=[plate, arm], material=ROCK), 1e-5)
    for _ in range(30):
        run.advance(500, NONE, NONE)
    v = run.particles()["v"]
    assert v[0] == pytest.approx([1.0, 0.0, 0.0], abs=2e-3) and np.linalg.norm(v[1]) == pytest.approx(
        2 * 0.4 * 0.8, rel=0.02)
    assert run.impulses()["plate"][0] == pytest.approx(run.particles()["mass"][0] * v[0, 0], rel=1e-12)


def test_a_cluster_keeps_its_books(dem):
    rock = Cluster([[0.0, 0.0, 0.0], [0.06, 0.0, 0.0]], [0.05, 0.04], x=(0.0, 0.12, 0.0), mass=2.0,
                   inertia=(2e-3, 3e-3, 3e-3), v=(0.5, 0.0, 0.2), omega=(0.0, 0.0, 3.0))
    run = dem(Scene(clusters=[rock], structures=[bed()], material=ROCK, gravity=(0.0, -G, 0.0)), 1e-5)
    start = rock.mass * np.array(rock.v)
    spin = np.cross(rock.x, start) + np.array([0.0, 0.0, 3e-3 * 3.0])
    for _ in range(20):
        run.advance(1000, NONE, NONE)
    given = run.impulses()
    assert given["bed"][1] > 0.1
    assert rock.mass * run.bodies()["v"][0] - start == pytest.approx(sum(given.values())[:3], abs=1e-11)
    body = run.bodies()[0]
    turn = quaternion.matrix(body["quaternion"])
    spins = np.cross(body["x"], 2.0 * body["v"]) + turn @ rock.inertia @ turn.T @ body["omega"]
    assert spins - spin == pytest.approx(sum(given.values())[3:], abs=1e-11)


@pytest.mark.parametrize("structures, sentence", [
    (lambda: [Structure.box("block", Box((-0.5, -0.5, -0.5), (0.5, 0.5, 0.5)))],
     r"sphere 1 at .* lies inside block, 0.4\d* m below its surface: move it out$"),
    (lambda: [bed(), bed()], "'bed' is the name of two"),
    (lambda: ["bed"], "one of the structures is 'bed': it has no name"), (lambda: 5, "structures is 5"),
])
def test_bad_input_is_one_sentence(dem, structures, sentence):
    with pytest.raises(ValueError, match=sentence):
        two(dem, structures())
