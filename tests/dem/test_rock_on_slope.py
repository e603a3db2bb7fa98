"""A rock alone on a slope of terrain: rolling, jumps and run-out, against the mechanics of rigid bodies."""
import numpy as np
import pytest
from scipy.spatial import Delaunay

from dem_liggghts import Interaction, Material, Scene, Spheres
from mpm_fenicsx import Box, Structure, Terrain

G, RADIUS, RHO = 9.81, 0.5, 2600.0
ANGLE = np.radians(30.0)
GRAVITY = (G * np.sin(ANGLE), 0.0, -G * np.cos(ANGLE))  # along x, in axes along the slope
STIFF = Material(1e10, 0.25)
NONE = np.zeros((0, 3))


def ground(x, size=1.0, turned=0.0):
    """Triangles of all shapes over a plane z = 0 of ``x`` [m], turned about y by an angle."""
    rng = np.random.default_rng(2)
    counts = round((x[1] - x[0]) / size), round(6.0 / size)
    places = np.stack(np.meshgrid(*(np.arange(n + 1.0) for n in counts), indexing="ij"), axis=-1)
    places[1:-1, 1:-1] += rng.uniform(-0.3, 0.3, places[1:-1, 1:-1].shape)
    plan = places.reshape(-1, 2) * size + (x[0], -3.0)
    triangles = Delaunay(plan).simplices
    a, b, c = plan[triangles].transpose(1, 0, 2)
    down = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0] < 0.0
    triangles[down] = triangles[down][:, ::-1]
    turn = np.array([[np.cos(turned), 0.0, np.sin(turned)], [0.0, 1.0, 0.0],
                     [-np.sin(turned), 0.0, np.cos(turned)]])
    return Structure("slope", np.column_stack([plan, np.zeros(len(plan))]) @ turn.T, triangles), turn


def rock(dem, structure, x, v, gravity, dt, **contact):
    scene = Scene(Spheres([x], [v], RADIUS, RHO), structures=[structure], material=STIFF, gravity=gravity,
                  interactions={("spheres", "slope"): Interaction(**contact)})
    return dem(scene, dt)


@pytest.mark.parametrize("size", [0.125, 4.0], ids=["small triangles", "large triangles"])
def test_it_rolls_over_the_edges_of_triangles(dem, size):
    """5/7 of the slope's pull as on one plane, and no bump: it never leaves its height by more than 1e-6 of
    its radius. Turned out of all axes."""
    slope, turn = ground((-1.0, 7.0), size, turned=0.3)
    run = rock(dem, slope, turn @ (0.0, 0.1, RADIUS), (0.0, 0.0, 0.0), turn @ GRAVITY, 1e-4,
               restitution=0.3, friction=0.6)
    heights = []
    for _ in range(150):
        run.advance(100, NONE, NONE)
        heights.append((turn.T @ run.particles()["x"][0])[2])
    x, v = (turn.T @ run.particles()[name][0] for name in ("x", "v"))
    assert v[0] == pytest.approx(5.0 / 7.0 * GRAVITY[0] * 1.5, rel=1e-3)
    assert x[0] == pytest.approx(5.0 / 14.0 * GRAVITY[0] * 1.5**2, rel=2e-3) and abs(v[1]) < 1e-3 * v[0]
    assert np.ptp(heights[20:]) < 1e-6 * RADIUS


def jumps(v, restitution, friction, count):
    """Theory of a ball thrown along the slope with v = (along, up from it), without spin: places where it
    hits the ground, and heights of the jumps. It slides through each hit, so that friction takes
    mu (1 + e) |up| of its speed along (it spins up by 5/2 of that over R, and slides as long as it spins
    more slowly than it would roll)."""
    along, up, spin, x = v[0], v[1], 0.0, 0.0
    fall, pull = G * np.cos(ANGLE), G * np.sin(ANGLE)
    places, heights = [], []
    for _ in range(count):
        time = 2.0 * up / fall
        heights.append(up**2 / (2.0 * fall))
        x += along * time + 0.5 * pull * time**2
        along += pull * time
        places.append(x)
        along -= friction * (1.0 + restitution) * up
        spin += 2.5 * friction * (1.0 + restitution) * up
        up *= restitution
        assert along > spin
    return np.array(places), np.array(heights)


def test_it_jumps_as_far_and_as_high_as_a_rigid_ball(dem):
    """Two jumps over triangles; restitution 0.6, friction 0.1. In later hits the weight counts, too."""
    slope, _ = ground((-1.0, 15.0), 1.5)
    run = rock(dem, slope, (0.0, 0.0, RADIUS + 1e-9), (2.0, 0.0, 4.0), GRAVITY, 1e-5, restitution=0.6,
               friction=0.1)
    top, before, places, heights = 0.0, 4.0, [], []
    for _ in range(3600):
        run.advance(50, NONE, NONE)
        at, v = run.particles()["x"][0], run.particles()["v"][0]
        top = max(top, at[2] - RADIUS)
        if before < 0.0 < v[2]:  # it has hit the ground
            places.append(at[0] - v[0] * max(at[2] - RADIUS, 0.0) / v[2])
            heights.append(top)
            top = 0.0
        before = v[2]
    expected, high = jumps((2.0, 4.0), 0.6, 0.1, 2)
    assert np.array(places[:2]) == pytest.approx(expected, rel=0.015)
    assert np.array(heights[:2]) == pytest.approx(high, rel=0.015)


def test_regions_of_a_terrain_have_their_own_friction(dem):
    """A sphere rolls on rough ground, and slides over ice, whose seams it does not feel; the books of both
    close."""
    hill = Terrain.function(lambda x, y: -0.3 * x, Box((0.0, 0.0), (10.0, 4.0)), 0.5)
    ice = [(4.1, -1.0), (7.2, -1.0), (7.2, 5.0), (4.1, 5.0)]
    ground = hill.structure("ground", 0.5, {"ice": (ice, 0.05)})
    up, along = np.array([0.3, 0.0, 1.0]) / np.sqrt(1.09), np.array([1.0, 0.0, -0.3]) / np.sqrt(1.09)
    scene = Scene(Spheres([np.array([1.0, 2.0, -0.3]) + 0.2 * up], [[0.0, 0.0, 0.0]], 0.2, RHO),
                  structures=[ground], material=STIFF, gravity=(0.0, 0.0, -G),
                  interactions={("spheres", "ground"): Interaction(0.3, 0.5),
                                ("ground_ice", "spheres"): Interaction(0.3, 0.05)})
    assert {tuple(sorted(pair))[0]: one.friction for pair, one in scene.interactions.items()
            if any(name.startswith("ground") for name in pair)} == {"ground_ice": 0.05, "ground_rest": 0.5}
    run, seen = dem(scene, 2e-5), []
    for _ in range(300):
        run.advance(500, NONE, NONE)
        p = run.particles()
        seen.append([p["x"][0, 0], p["v"][0] @ along, 0.2 * p["omega"][0, 1], p["x"][0] @ up])
    (x, v, rim, height), time = np.array(seen).T, 0.01 * np.arange(300)
    steep = np.arctan(0.3)
    rolls, slides = 5.0 / 7.0 * np.sin(steep), np.sin(steep) - 0.05 * np.cos(steep)
    for start, end, pull in ((1.5, 4.0, rolls), (4.5, 7.0, slides)):
        on = (x > start) & (x < end)
        assert np.polyfit(time[on], v[on], 1)[0] == pytest.approx(G * pull, rel=2e-3)
    assert np.abs(v - rim)[(x > 1.5) & (x < 4.0)].max() < 1e-3 and (v - rim)[x > 7.0][0] > 0.5
    assert np.ptp(height[20:]) < 1e-6 * 0.2
    given, momentum = run.impulses(), run.particles()["mass"][0] * run.particles()["v"][0]
    assert sum(given.values())[:3] == pytest.approx(momentum, abs=1e-10 * abs(momentum).max())
