"""Where elements and walls meet: facets with nodes of their own, two walls side by side, one behind the other
(both back ends)."""
import numpy as np
import pytest

from dem_liggghts import Interaction, Material, Scene, Spheres, Wall

RADIUS, G = 0.01, 9.81
SOFT = Material(1e7, 0.3)
ROUGH = Interaction(0.1, 0.4)


def soup(wall):
    """The same wall with nodes of their own for every element, as in an STL file."""
    return Wall(wall.nodes[wall.elements.ravel()], np.arange(wall.elements.size).reshape(wall.elements.shape))


def strip(dim, *x, below=0.0):
    """A level wall over the places x; in space 0.1 m wide."""
    x = np.array(x)
    if dim == 2:
        k = np.arange(len(x) - 1)
        return Wall(np.column_stack([x, 0 * x - below]), np.column_stack([k, k + 1]))
    nodes = [[a, b, -below] for a in x for b in (-0.05, 0.05)]
    k = 2 * np.arange(len(x) - 1)
    return Wall(nodes,
                np.concatenate([np.column_stack([k, k + 2, k + 3]), np.column_stack([k, k + 3, k + 1])]))


def roll(dem, dim, wall=None, walls=(), steps=150, x=-0.011, v=0.5, height=RADIUS):
    """Path of a sphere that slides, sticks and rolls along: x, v, spin after every window; it goes about 0.03
    m."""
    along, up = np.eye(dim)[0], np.eye(dim)[-1]
    ball = Spheres([x * along + height * up], [v * along], RADIUS, 2500.0,
                   [[0, 0, -20] if dim == 2 else [0, 20, 0]])
    scene = Scene(ball, wall, SOFT, SOFT, at_wall=ROUGH, walls=walls, gravity=-G * up)
    ball, seen = dem(scene, 5e-5), []
    nodes = np.array(scene.wall.nodes)
    for _ in range(steps):
        ball.advance(10, nodes, 0 * nodes)
        p = ball.particles()[0]
        seen.append(np.concatenate([p["x"], p["v"], RADIUS * p["omega"]]))
    return np.array(seen)


def test_facets_with_their_own_nodes_slide_as_connected_ones(dem, sheet, dim):
    """The tangential history goes from facet to facet."""
    wall = sheet(dim, 37)
    one, many = roll(dem, dim, wall), roll(dem, dim, soup(wall))
    assert one[-1, 0] - one[0, 0] > 5 * 0.1 / 37
    assert many == pytest.approx(one, rel=1e-9, abs=1e-12)


def test_facets_with_their_own_nodes_deep_in_a_dent(dem, sheet, dim):
    """One contact, as on the connected wall, and all of its force on the nodes of the facets."""
    up, wall = np.eye(dim)[-1], sheet(dim, 40, height=lambda x: 2e-3 * x**2)
    forces = []
    for surface in (wall, soup(wall)):
        ball = dem(Scene(Spheres([up], [0 * up], RADIUS, 1e9), surface, SOFT, SOFT), 1e-9)
        nodes = surface.nodes + up - (0.9 * RADIUS * up + 0.6e-3 * np.eye(dim)[0])
        forces.append([ball.advance(1, nodes, 0 * nodes).sum(axis=0) for _ in range(2)][1])
    assert forces[1] == pytest.approx(forces[0], rel=1e-12, abs=1e-12 * np.abs(forces[0]).max())


@pytest.mark.parametrize("kind", ["two at rest", "one moves"])
def test_seam_of_two_level_walls_does_not_exist(dem, dim, kind):
    """A sphere rolls over it as over one wall, and at rest on it has the overlap that it has anywhere; the
    nodes of the two walls need not meet."""
    left, right = strip(dim, -0.1, 0.0), strip(dim, 0.0, 0.03, 0.1)
    if dim == 3:
        right = Wall(right.nodes * [1, 0.8, 1], right.elements)
    parts = dict(walls=[left, right]) if kind == "two at rest" else dict(walls=[left], wall=right)
    whole = strip(dim, -0.1, 0.1)
    for start in (dict(), dict(x=0.0, v=0.0)):
        one, two = roll(dem, dim, whole, **start), roll(dem, dim, **parts, **start)
        assert two == pytest.approx(one, rel=1e-8, abs=1e-11)
    assert one[-1, 0] > 0 and one[-1, dim - 1] < RADIUS


def pushed(dem, dim, d, walls, wall=None):
    """Upward force [N] on a sphere too heavy to be slowed down, about an overlap d [m], and the overlap then
    [m]."""
    up, v, dt = np.eye(dim)[-1], 1.0, d / 100
    ball = dem(Scene(Spheres([(RADIUS + 1e-7) * up + 1e-9 * np.eye(dim)[0]], [-v * up], RADIUS, 1e7), wall,
                     SOFT, SOFT, walls=walls), dt)
    nodes = np.array(ball.scene.wall.nodes)
    ball.advance(100, nodes, 0 * nodes)
    before = ball.particles()
    ball.advance(1, nodes, 0 * nodes)
    after = ball.particles()
    gained = (after["v"] - before["v"])[0, dim - 1] * before["mass"][0] / dt
    return gained, RADIUS - 0.5 * (before["x"] + after["x"])[0, dim - 1]


def hertz(overlap):
    return 4 / 3 * SOFT.E / (2 * (1 - SOFT.nu**2)) * np.sqrt(RADIUS) * overlap**1.5


@pytest.mark.parametrize("bend", [1e-7, -1e-7, 1e-3, -1e-3])
def test_seam_bent_a_little_is_one_contact(dem, dim, bend):
    """Valley and ridge of less than a degree [rad]: the sum of the forces is that of one contact."""
    left, right = strip(dim, -0.1, 0.0), strip(dim, 0.0, 0.1)
    right = Wall(right.nodes + np.outer(bend * right.nodes[:, 0], np.eye(dim)[-1]), right.elements)
    for parts in (dict(walls=[left], wall=right), dict(walls=[right, left])):
        force, overlap = pushed(dem, dim, 1e-4, **parts)
        assert force == pytest.approx(hertz(overlap), rel=2e-4)


def test_walls_one_behind_the_other_are_two_obstacles(dem, dim):
    """A sheet a millimetre above a floor: both push."""
    sheet, floor = strip(dim, -0.1, 0.1), strip(dim, -0.1, 0.1, below=1e-3)
    force, overlap = pushed(dem, dim, 3e-3, [sheet, floor])
    assert force == pytest.approx(hertz(overlap) + hertz(overlap - 1e-3), rel=1e-4)
