"""A sphere at constant overlap moved along a wall: one contact and one force at faces, edges and vertices."""
import numpy as np
import pytest

from dem_liggghts import Material, Scene, Spheres, Wall
from dem_liggghts.scene.arrays import in_space
from dem_liggghts.scene.tables import wall_table
from dem_liggghts.search.elements import COLUMNS, DISTANCE, PAIR, at_rest, closest, corners_of
from dem_liggghts.search.hierarchy import before

STEEL = Material(2.1e11, 0.3)
RADIUS, OVERLAP = 0.01, 1e-6
HERTZ = 4.0 / 3.0 * 2.1e11 / (2 * (1 - 0.3**2)) * np.sqrt(RADIUS) * OVERLAP**1.5
STEP = 1e-9  # [s]


@pytest.fixture
def probe(dem):
    """``probe(wall, centres)``: force on a sphere at rest at these places [m], [N], shape (n, dim). The wall
    is moved instead, and its force is twice the mean over one step that starts without contact."""
    def force(wall, centres):
        up = np.eye(wall.dim)[-1]
        ball = dem(Scene(Spheres([up], [0 * up], RADIUS, 1e9), wall, STEEL, STEEL), STEP)
        start, nodes = ball.get_state(), np.array(wall.nodes)
        forces = []
        for centre in centres:
            ball.set_state(start)
            forces.append(-2.0 * ball.advance(1, nodes - centre + up, 0 * nodes).sum(axis=0))
        return np.array(forces)
    return force


def along(wall, slope_left, slope_right, n=241):
    """Centres with the same overlap on the two sides of a ridge (or valley) at the origin, and around the
    ridge."""
    r = RADIUS - OVERLAP
    left, right = np.arctan(slope_left), np.arctan(slope_right)
    first = r * np.tan(max(right - left, 0.0) / 2)  # in a valley the sides meet on the bisector
    s = np.linspace(first, first + 0.01, n)[:, None]
    normal = [np.column_stack([-np.sin(a), np.cos(a)]) for a in (left, right)]
    sides = [-s[::-1] * [np.cos(left), np.sin(left)] + r * normal[0],
             s * [np.cos(right), np.sin(right)] + r * normal[1]]
    if left > right:
        turn = np.linspace(left, right, n)
        sides.insert(1, r * np.column_stack([-np.sin(turn), np.cos(turn)]))
    plane = np.concatenate(sides)
    return plane if wall.dim == 2 else np.insert(plane, 1, 0.0031, axis=1)


@pytest.mark.parametrize("degrees", [0.0, 0.3, 0.5, 2.0, 5.0, 20.0, 60.0])
def test_flat_and_convex_walls_give_one_contact_everywhere(probe, sheet, dim, degrees):
    slope = np.tan(np.radians(degrees / 2))
    wall = sheet(dim, cells=10, height=lambda x: -slope * np.abs(x))
    force = probe(wall, along(wall, slope, -slope))
    assert np.sqrt((force**2).sum(axis=1)) / HERTZ == pytest.approx(1.0, rel=1e-9)
    jump = np.abs(np.diff(force, axis=0)).max()
    assert jump <= 1.01 * HERTZ * np.radians(degrees) / 240 + 1e-9 * HERTZ


def test_anywhere_on_a_flat_wall_of_triangles(probe, sheet):
    wall = sheet(3, cells=6)
    places = np.random.default_rng(1).uniform(-0.045, 0.045, (300, 3))
    places[:7 * 7, :2] = wall.nodes[:, :2] * 0.99  # near and on vertices
    places[49, :2] = 0.0
    places[:, 2] = RADIUS - OVERLAP
    force = probe(wall, places)
    assert force / HERTZ == pytest.approx(np.tile([0.0, 0.0, 1.0], (300, 1)), abs=1e-9)


def test_shallow_valley_is_one_contact(probe, sheet, dim):
    """Below one degree: one contact, whose direction turns by the angle of the valley; both sides share it at
    the bottom, where two halves at an angle make a little less than one."""
    slope = np.tan(np.radians(0.45))
    wall = sheet(dim, cells=10, height=lambda x: slope * np.abs(x))
    force = probe(wall, along(wall, -slope, slope))
    assert np.sqrt((force**2).sum(axis=1)) / HERTZ == pytest.approx(1.0, rel=4e-5)
    assert np.abs(np.diff(force, axis=0)).max() <= 1.01 * HERTZ * np.radians(0.9)


@pytest.mark.parametrize("half", [1e-3, 1e-5])
def test_force_does_not_jump_at_the_bottom_of_a_dent(probe, sheet, dim, half):
    """A sphere that goes across the bottom [rad]: its side force changes sign evenly between the two places
    where it leaves one side."""
    wall = sheet(dim, cells=10, height=lambda x: half * np.abs(x))
    width = (RADIUS - OVERLAP) * half
    centres = np.outer(np.linspace(-1.5, 1.5, 61) * width,
                       np.eye(dim)[0]) + (RADIUS - OVERLAP) * np.eye(dim)[-1]
    side = probe(wall, centres if dim == 2 else centres + [0, 0.0031, 0])[:, 0] / (HERTZ * half)
    assert side[30] == pytest.approx(0.0, abs=1e-3) and side[[0, -1]] == pytest.approx([1.0, -1.0], rel=0.04)
    assert np.abs(np.diff(side)).max() < 0.06
    assert np.diff(side)[12:48] == pytest.approx(-0.05, rel=0.05)


def test_dent_about_a_vertex(probe, sheet):
    """Over the vertex of four sides the force is straight up, and but a little beside it does not jump."""
    flat, slope = sheet(3, 10), 1e-3
    wall = Wall(flat.nodes + np.outer(slope * np.abs(flat.nodes[:, :2]).sum(axis=1), [0, 0, 1]),
                flat.elements)
    force = probe(wall, [[x, 0.3 * x, RADIUS - OVERLAP] for x in (0.0, 1e-9, -1e-9)])
    assert np.abs(force[0, :2]).max() < 1e-6 * slope * HERTZ
    assert np.abs(force[1:, :2]).max() < 1e-3 * slope * HERTZ
    assert force[:, 2] == pytest.approx(1.01**1.5 * HERTZ, rel=1e-4)


@pytest.mark.parametrize("degrees", [2.0, 20.0, 60.0])
def test_valley_is_two_contacts(probe, sheet, dim, degrees):
    half = np.radians(degrees / 2)
    wall = sheet(dim, cells=10, height=lambda x: np.tan(half) * np.abs(x))
    bottom = (RADIUS - OVERLAP) / np.cos(half) * np.eye(dim)[-1]
    force = probe(wall, [bottom])[0]
    assert force / HERTZ == pytest.approx(2 * np.cos(half) * np.eye(dim)[-1], abs=1e-8)


@pytest.mark.parametrize("aside", [0.0, 0.6e-3, 1.25e-3])
def test_deep_in_a_dented_wall_of_small_elements_is_one_contact(probe, sheet, dim, aside):
    """As below a sphere that presses on a body: elements in reach that come nearer where they join make no
    contacts."""
    wall, deep = sheet(dim, cells=40, height=lambda x: 2e-3 * x**2), 1e-3
    force = probe(wall, [(RADIUS - deep) * np.eye(dim)[-1] + aside * np.eye(dim)[0]])[0]
    assert np.sqrt((force**2).sum()) / HERTZ == pytest.approx((deep / OVERLAP) ** 1.5, rel=1e-4)


def test_free_end_of_the_wall(probe, sheet, dim):
    """Around the end of the wall the force points away from the end."""
    wall, r = sheet(dim), RADIUS - OVERLAP
    angle = np.linspace(0.0, np.pi / 2, 50)
    ends = np.zeros((50, dim))
    ends[:, 0], ends[:, -1] = 0.05 + r * np.sin(angle), r * np.cos(angle)
    away = ends - np.eye(dim)[0] * 0.05
    assert probe(wall, ends) / HERTZ == pytest.approx(away / r, abs=1e-9)


def test_nodes_share_the_force_by_barycentric_weights(dem):
    """Segment and triangle: the contact point is the weighted mean of the nodes."""
    for nodes, elements, centre, weights in (
            ([[-0.01, 0.0], [0.03, 0.0]], [[0, 1]], [0.0, RADIUS], [0.75, 0.25]),
            ([[0, 0, 0], [0.04, 0, 0], [0, 0.04, 0]], [[0, 1, 2]], [0.01, 0.02, RADIUS], [0.25, 0.25, 0.5])):
        down = -np.eye(len(centre))[-1]
        ball = dem(Scene(Spheres([centre], [0.1 * down], RADIUS, 7800.0), Wall(nodes, elements), STEEL,
                         STEEL), 1e-8)
        force = ball.advance(100, np.array(nodes, float), np.zeros(np.shape(nodes)))
        assert force[:, -1] / force[:, -1].sum() == pytest.approx(weights, rel=1e-12)


def test_closest_points_against_a_search():
    """Every region of the triangle: no sampled point is nearer, and the gap to the best sample is small."""
    random = np.random.default_rng(0)
    corner, weight, point = np.empty((3, 3)), np.empty(3), np.empty(3)
    a, b = (g.ravel() for g in np.meshgrid(np.linspace(0, 1, 201), np.linspace(0, 1, 201)))
    samples = np.column_stack([1 - a - b, a, b])[a + b <= 1 + 1e-12]
    features = set()
    for _ in range(200):
        triangle = wall_table(Scene(wall=Wall(np.eye(3), [[0, 1, 2]]), wall_material=STEEL))
        wall = at_rest(triangle, random.normal(size=(3, 3)))._replace(v=random.normal(size=(3, 3)))
        corners_of(wall, 0, 0.3, corner)
        p = random.normal(size=3) * 2
        r, feature = closest(corner, 3, p, weight, point)
        features.add(feature)
        assert corner == pytest.approx(wall.x + 0.3 * wall.v)
        assert weight.sum() == pytest.approx(1.0) and weight.min() >= 0.0
        assert point == pytest.approx(weight @ corner - p) and r == pytest.approx(np.linalg.norm(point))
        best = np.sqrt(((samples @ corner - p) ** 2).sum(axis=1).min())
        assert best - 0.03 <= r <= best + 1e-12
    assert features == {0, 1, 2}
    assert in_space(np.ones((2, 2))).tolist() == [[1, 1, 0], [1, 1, 0]]


@pytest.mark.parametrize("digit", [-1e-17, 0.0, 1e-17, 5e-15])
def test_round_off_does_not_choose_between_elements(digit):
    """At equal distance from a sphere of 1 cm the first of two elements counts; else the nearer one."""
    found = np.zeros((2, COLUMNS))
    found[:, DISTANCE], found[:, PAIR] = (0.01 + digit, 0.01), (3.0, 4.0)
    assert before(found, 0, 1, 0.01) and not before(found, 1, 0, 0.01)
    found[0, DISTANCE] = 0.01 + 1e-12
    assert before(found, 1, 0, 0.01) and not before(found, 0, 1, 0.01)
