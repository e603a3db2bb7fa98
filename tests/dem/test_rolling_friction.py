"""Rolling friction: on a slope, rolling out, between spheres, of clusters, its springs (both back ends)."""
from dataclasses import replace

import numpy as np
import pytest

from dem_liggghts import Cluster, Interaction, Material, Scene, Spheres, Wall, open_dem

FIRM, SOFT, R, G = Material(1e9, 0.3), Material(1e7, 0.3), 0.01, 9.81
ROLLING = 0.1  # tangent of 5.7 degrees


def down(dim, degrees):
    """Gravity on a slope that falls along +x [m/s^2]."""
    t = np.radians(degrees)
    return G * (np.sin(t) * np.eye(dim)[0] - np.cos(t) * np.eye(dim)[-1])


def ball_on(wall, v=0.0, degrees=0.0, material=FIRM, rolling=ROLLING, restitution=0.3):
    """A sphere that rolls along x at v [m/s], at the start of a long wall."""
    centre, speed, spin = np.zeros(wall.dim), np.zeros(wall.dim), np.zeros(3)
    centre[0], centre[-1] = -0.1, R
    speed[0], spin[2 if wall.dim == 2 else 1] = v, (-v if wall.dim == 2 else v) / R
    return Scene(Spheres([centre], [speed], R, 2500.0, [spin]), wall, material, material,
                 at_wall=Interaction(restitution, 0.6, rolling=rolling), gravity=down(wall.dim, degrees))


def steps(dem, windows, size=500):
    """Speed along x after each window; the wall stays."""
    nodes = np.array(dem.scene.wall.nodes)
    speeds = []
    for _ in range(windows):
        dem.advance(size, nodes, 0 * nodes)
        speeds.append(dem.particles()["v"][0, 0])
    return np.array(speeds)


@pytest.mark.parametrize("rolling", [0.0, ROLLING])
def test_acceleration_on_a_slope(dem, sheet, dim, rolling):
    """g (sin - mu_r R/r cos) / (1 + 2/5 R^2/r^2), r the distance of the centre from the wall: 5/7 g (sin -
    mu_r cos) of a stiff sphere."""
    ball = dem(ball_on(sheet(dim, 5, 0.4), degrees=15.0, rolling=rolling), 5e-6)
    speed = steps(ball, 20)
    r, t = R / ball.particles()["x"][0, dim - 1], np.radians(15.0)
    expected = G * (np.sin(t) - rolling * r * np.cos(t)) / (1 + 0.4 * r**2)
    assert (speed[-1] - speed[7]) / (12 * 500 * 5e-6) == pytest.approx(expected, rel=1e-4)
    assert expected == pytest.approx(5 / 7 * G * (np.sin(t) - rolling * np.cos(t)), rel=1e-3)


@pytest.mark.parametrize("share, rests", [(0.95, True), (1.05, False)])
def test_rests_where_the_slope_is_below_the_coefficient(dem, sheet, dim, share, rests):
    ball = dem(ball_on(sheet(dim, 5, 0.4), degrees=np.degrees(np.arctan(share * ROLLING))), 5e-6)
    speed = steps(ball, 40)
    assert (abs(speed[-1]) < 1e-9) if rests else (speed[-1] > 2e-3)


def test_rolls_out(dem, sheet, dim):
    """A ball with a spin of its own about the normal stops after v^2 / (2 5/7 mu_r g) and stays; its energy
    only falls, and the spin about the normal is not what rolling friction acts on."""
    v = 0.2
    scene = ball_on(sheet(dim, 5, 0.4), v)
    if dim == 3:
        scene = replace(scene, spheres=replace(scene.spheres, omega=[[0.0, v / R, 3.0]]))
    ball = dem(scene, 5e-6)
    start, energy = ball.particles()["x"][0, 0], [sum(ball.energy().values())]
    for _ in range(20):
        steps(ball, 7)
        energy.append(sum(ball.energy().values()))
    end = ball.particles()[0]
    assert end["x"][0] - start == pytest.approx(v**2 / (2 * 5 / 7 * ROLLING * G), rel=0.01)
    assert np.abs(end["v"]).max() < 1e-9 and np.abs(end["omega"][:2]).max() < 1e-7
    assert np.diff(energy).max() < 1e-6 * (energy[0] - energy[-1])
    assert end["omega"][2] == pytest.approx(3.0 if dim == 3 else 0.0, rel=1e-9, abs=1e-7)


def test_two_spheres_lose_spin_as_they_hit(dem, dim):
    """Without other friction: what both spins lose, in opposite directions, is mu_r R* times the normal
    impulse."""
    other = 0.6 * R
    along, about = np.eye(dim)[0], np.array([0.0, 0.0, 1.0])
    spheres = Spheres([0.0 * along, (R + other) * along], [0.5 * along, -0.5 * along], [R, other], 2500.0,
                      [400.0 * about, 1000.0 * about - 2000.0 * about])
    pair = dem(Scene(spheres, Wall.none(dim), SOFT, SOFT, Interaction(0.7, rolling=0.2)), 5e-7)
    before, none = pair.particles(), np.zeros((0, dim))
    pair.advance(4000, none, none)
    after = pair.particles()
    impulse = before["mass"][0] * (before["v"] - after["v"])[0, 0]
    lost = (0.4 * before["mass"] * before["radius"]**2)[:, None] * (after["omega"] - before["omega"])
    assert after["v"][1, 0] - after["v"][0, 0] == pytest.approx(0.7, rel=1e-3)
    assert lost[0, 2] == pytest.approx(-0.2 * R * other / (R + other) * impulse, rel=1e-9)
    assert lost[1] == pytest.approx(-lost[0], rel=1e-9)


def test_two_spheres_pressed_together_come_to_rest(dem):
    """Held by adhesion they turn against each other, without slip: the damper of rolling friction ends it."""
    touch = Interaction(0.5, 0.5, adhesion=1e5, rolling=0.3)
    pair = dem(Scene(Spheres([[0.0, 0.0], [2 * R, 0.0]], [[0.003, 0.0], [-0.003, 0.0]], R, 2500.0,
                             [[0, 0, 1.0], [0, 0, -1.0]]), Wall.none(2), SOFT, SOFT, touch), 5e-6)
    none = np.zeros((0, 2))
    pair.advance(20000, none, none)
    assert np.abs(pair.particles()["omega"]).max() < 1e-4


def test_only_the_turn_relative_to_the_wall_counts(dem, sheet, dim):
    """A sphere pressed on a wall that turns with it keeps its spin; one that does not turn is taken along."""
    wall, rate = sheet(dim, 3, 0.1), 0.5
    up, axis = np.eye(dim)[-1], np.array([0, 0, 1.0] if dim == 2 else [0, -1.0, 0])
    nodes, v = np.array(wall.nodes), rate * np.outer(wall.nodes[:, 0], up)
    spins = []
    for spin in (rate, 0.0):
        scene = Scene(Spheres([R * up], [-0.05 * up], R, 2500.0, [spin * axis]), wall, SOFT, SOFT,
                      at_wall=Interaction(0.5, rolling=0.2))
        ball = dem(scene, 5e-6)
        ball.advance(400, nodes, v)
        spins.append(ball.particles()["omega"][0] @ axis)
    assert spins[0] == pytest.approx(rate, rel=1e-6) and spins[1] > 0.02


def test_wall_and_sphere_keep_their_angular_momentum(dem, sheet, dim):
    """The torque on the sphere is one on the nodes: an oblique impact, with both frictions."""
    wall, along, up = sheet(dim, 7, 0.1), np.eye(dim)[0], np.eye(dim)[-1]
    nodes, moment = np.array(wall.nodes), np.zeros(3)
    thrown = Spheres([R * up - 0.02 * along], [4.0 * along - 3.0 * up], R, 2500.0,
                     [[0, 0, -300] if dim == 2 else [100, 300, 50]])
    meet = Interaction(0.5, 0.4, rolling=0.3)
    ball = dem(Scene(thrown, wall, Material(5e5, 0.3), SOFT, at_wall=meet), 2e-6)
    before, spin = momentum(ball), ball.particles()["omega"][0]
    for _ in range(200):
        impulse = np.zeros((len(nodes), 3))
        impulse[:, :dim] = ball.advance(10, nodes, 0 * nodes) * 10 * ball.dt
        moment += np.cross(np.pad(nodes, ((0, 0), (0, 3 - dim))), impulse).sum(axis=0)
    after = ball.particles()[0]
    assert after["v"][dim - 1] > 0.5 and np.abs(after["omega"] - spin).max() > 20.0
    assert momentum(ball) + moment == pytest.approx(before, abs=1e-10 * np.abs(before).max())


def momentum(dem):
    """Angular momentum of the spheres about the origin [kg m^2/s]."""
    p = dem.particles()
    spin = 0.4 * p["radius"][:, None] ** 2 * p["omega"]
    return (p["mass"][:, None] * (np.cross(p["x"], p["v"]) + spin)).sum(axis=0)


def test_cluster_rolls_with_the_torque_of_its_spheres(dem, sheet):
    """Two spheres on one axle roll down a slope like one."""
    axle = Cluster.of_spheres([[0, -R, 0], [0, R, 0]], R, 2500.0, [-0.1, 0.0, R])
    roll = dem(Scene(clusters=[axle], wall=sheet(3, 5, 0.4), material=FIRM, wall_material=FIRM,
                     at_wall=Interaction(0.3, 0.6, rolling=ROLLING), gravity=down(3, 15.0)), 5e-6)
    speed = steps(roll, 20)
    r, t = R / roll.bodies()["x"][0, 2], np.radians(15.0)
    expected = G * (np.sin(t) - ROLLING * r * np.cos(t)) / (1 + 0.4 * r**2)
    assert (speed[-1] - speed[7]) / (12 * 500 * 5e-6) == pytest.approx(expected, rel=1e-4)


def test_borders_of_elements_and_a_new_wall_do_not_matter(dem, sheet, dim):
    """Over one element or many, and over walls that are replaced: the spring goes along. In contacts so
    soft, without damping, a new spring would take eight steps to reach its limit."""
    ends = []
    for cells, every in ((1, 0), (37, 0), (37, 10)):
        ball = dem(ball_on(sheet(dim, cells, 0.4), 0.2, material=Material(2e5, 0.3), restitution=1.0), 2e-5)
        for k in range(60):
            steps(ball, 1, 200)
            if every and k % every == every - 1:
                ball.replace_wall(sheet(dim, 30 - k // every, 0.4))
        ends.append(ball.particles()[0])
    assert ends[0]["x"][0] > -0.09
    for end in ends[1:]:
        for name in ("x", "v", "omega"):
            assert end[name] == pytest.approx(ends[0][name], rel=1e-7, abs=1e-10)


def test_a_new_wall_holds_what_rests_on_a_slope(dem, sheet, dim):
    """The sphere on a slope that rolling friction holds does not move when its wall is replaced."""
    ball = dem(ball_on(sheet(dim, 7, 0.4), degrees=4.0, material=SOFT), 2e-5)
    steps(ball, 1, 20000)
    held = ball.particles()[0]
    for cells in (12, 5):
        ball.replace_wall(sheet(dim, cells, 0.4))
        steps(ball, 1, 300)
    now = ball.particles()[0]
    assert np.abs(now["x"] - held["x"]).max() < 1e-11 and np.abs(now["v"]).max() < 1e-9


def with_rolling(scene, rolling=0.15):
    """The scene with rolling friction in all contacts."""
    return replace(scene, interactions={tuple(sorted(pair) * 2)[:2]: replace(meet, rolling=rolling)
                                        for pair, meet in scene.interactions.items()})


def run(dem, window, windows, size=20):
    return np.array([dem.advance(size, *window(dem.time, size * dem.dt)) for _ in range(windows)])


@pytest.mark.parametrize("what", ["tumble", "discs", "heap"])
def test_back_ends_agree(both, request, dim, what):
    """Spheres, clusters, waving and fixed walls, discs, with adhesion too; and rolling friction matters."""
    scene, window = request.getfixturevalue("heap" if what == "heap" else "tumble")(dim)
    if what == "discs":
        scene = replace(scene, wall=Wall.discs(scene.wall.nodes, 0.005))
    a, b = both(with_rolling(scene), 1.5e-5)
    plain = open_dem("reference", scene, 1.5e-5)
    first, second, without = (run(dem, window, 120) for dem in (a, b, plain))
    state = [np.abs(a.particles()[name] - b.particles()[name]).max() / np.abs(a.particles()[name]).max()
             for name in ("x", "v", "omega")]
    b.close()
    assert np.abs(first - second).max() < 1e-6 * np.abs(first).max() and max(state) < 1e-6
    assert np.abs(first - without).max() > 1e-3 * np.abs(first).max()


def test_state_goes_on_bit_for_bit(dem, heap, dim, tmp_path):
    """In the same instance, in a fresh one, and from a file."""
    scene, window = heap(dim)
    scene = with_rolling(scene)
    first = dem(scene, 1.5e-5)
    run(first, window, 70)
    state = first.get_state()
    first.save(tmp_path / "state.h5")
    forces, particles, bodies = run(first, window, 30), first.particles(), first.bodies()
    assert forces.any()
    for restored in (lambda other: other.set_state(state), lambda other: other.load(tmp_path / "state.h5")):
        for other in (first, dem(scene, 1.5e-5)):
            restored(other)
            assert np.array_equal(run(other, window, 30), forces)
            assert np.array_equal(other.particles(), particles) and np.array_equal(other.bodies(), bodies)


def test_no_history_without_rolling_friction(dem, heap):
    """Nor is a state of a scene without it one of a scene with it."""
    scene, window = heap(2)
    plain, rolls = dem(scene, 1.5e-5), dem(with_rolling(scene), 1.5e-5)
    run(plain, window, 2), run(rolls, window, 2)
    states = plain.get_state(), rolls.get_state()
    if dem.backend == "reference":
        assert [state["near_spheres_shear"].shape[1] for state in states] == [3, 6]
    else:
        assert states[1]["particles"].size > states[0]["particles"].size
    with pytest.raises(ValueError, match="its springs of friction differ"):
        rolls.set_state(states[0])


def test_heap_is_steeper(dem):
    """Twenty discs that fall on a rough floor reach less far and lie higher with rolling friction."""
    random, slope = np.random.default_rng(5), []
    x = np.array([[2.2 * R * (i - 1.5), R * (1.02 + 2.05 * k)] for k in range(5) for i in range(4)])
    x[:, 0] += 0.1 * R * random.random(20)
    floor = Wall([[-1.0, 0.0], [1.0, 0.0]], [[0, 1]])
    for rolling in (0.0, 0.3):
        meet = Interaction(0.2, 0.6, rolling=rolling)
        heap = dem(Scene(Spheres(x, 0 * x, R, 2500.0), floor, SOFT, SOFT, meet, meet, gravity=(0, -G)), 4e-5)
        heap.advance(20000, np.array(floor.nodes), np.zeros((2, 2)))
        end = heap.particles()["x"]
        slope.append(end[:, 1].mean() / np.abs(end[:, 0] - end[:, 0].mean()).mean())
    assert slope[1] > 1.5 * slope[0]


@pytest.mark.parametrize("bad", [-0.1, 1.1, np.nan, np.inf, "0.1"])
def test_bad_coefficient(bad):
    with pytest.raises(ValueError, match="^rolling is .*: give a value from 0 to 1, the tangent of the slope "
                       "on which a sphere does not roll$"):
        Interaction(rolling=bad)
