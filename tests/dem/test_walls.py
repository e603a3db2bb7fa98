"""Walls that push outwards only, fixed walls of their own material, replacement of the moving wall (both back
ends)."""
import numpy as np
import pytest

from dem_liggghts import Cluster, Interaction, Material, Scene, Spheres, Wall

R, E = 0.01, 1e7
SOFT = Material(E, 0.3)
HERTZ = 4 / 3 * E / (2 * (1 - 0.3**2)) * np.sqrt(R)


def heavy(wall, **more):
    """A sphere too heavy to move, far above the wall, which is lifted to it."""
    up = np.eye(wall.dim)[-1]
    return Scene(Spheres([0.3 * up], [0 * up], R, 1e15), wall, SOFT, SOFT, **more)


def force_at(dem, lift):
    """Force on the sphere with the wall lifted so [m], (dim,)."""
    nodes = np.array(dem.scene.wall.nodes) + lift
    return [-dem.advance(1, nodes, 0 * nodes).sum(axis=0) for _ in range(2)][1]


def near(force, expected):
    assert force == pytest.approx(expected, rel=1e-9, abs=1e-6)


def test_one_sided_wall_pushes_outwards_only_and_to_its_depth(dem, sheet, dim):
    """The overlap goes on below the surface, to R + depth; two-sided, the same sphere is pushed down."""
    plain, up = sheet(dim), np.eye(dim)[-1]
    one = dem(heavy(Wall(plain.nodes, plain.elements, depth=1.5 * R)), 1e-9)
    two = dem(heavy(plain), 1e-9)
    for height in R * np.array([1.1, 0.9, 0.3, 0.001, -0.001, -0.7, -1.4, -1.6]):
        overlap = max(R - height, 0.0) if height > -1.5 * R else 0.0
        aside = 0.0031 * np.eye(dim)[0]
        near(force_at(one, (0.3 - height) * up + aside), HERTZ * overlap**1.5 * up)
        other = np.sign(height) * HERTZ * max(R - abs(height), 0.0) ** 1.5
        assert force_at(two, (0.3 - height) * up + aside) == pytest.approx(other * up, rel=1e-9, abs=1e-6)


def test_centre_on_the_surface_of_a_one_sided_wall(dem, sheet):
    """There the two-sided wall knows no direction."""
    plain, up = sheet(2), np.eye(2)[-1]
    one = dem(heavy(Wall(plain.nodes, plain.elements, depth=R)), 1e-9)
    for aside in (0.0, 0.0031):  # on a node, on a segment
        assert force_at(one, 0.3 * up + [aside, 0.0]) == pytest.approx(HERTZ * R**1.5 * up, rel=1e-6,
                                                                       abs=1e-3)


def test_thin_finger_pushes_with_its_near_face_only(dem):
    """A plate thinner than the sphere: from outside one contact, two-sided too; from within its far half, the
    far face."""
    t, length = 0.4 * R, 0.2
    nodes = [[-length, -t / 2], [length, -t / 2], [length, t / 2], [-length, t / 2]]
    finger = Wall(nodes, [[1, 0], [2, 1], [3, 2], [0, 3]], depth=R)
    plate = dem(heavy(finger), 1e-9)
    for height in np.array([0.9, 0.5, 0.25, 0.1]) * R:  # of the centre over the middle of the plate
        expected = HERTZ * (R - (height - t / 2)) ** 1.5
        assert force_at(plate, [0.0, 0.3 - height]) == pytest.approx([0.0, expected], rel=1e-9, abs=1e-6)
        assert force_at(plate, [0.0, 0.3 + height]) == pytest.approx([0.0, -expected], rel=1e-9, abs=1e-6)


def test_corners_of_a_one_sided_wall(dem):
    """Around a square: outside a corner radially, inside towards the nearest face; beyond a free end as
    two-sided."""
    corners = [[-0.03, -0.03], [0.03, -0.03], [0.03, 0.03], [-0.03, 0.03]]
    box = dem(heavy(Wall(corners, [[1, 0], [2, 1], [3, 2], [0, 3]], depth=R)), 1e-9)
    diagonal = np.array([1.0, 1.0]) / np.sqrt(2)
    corner, above = np.array([0.03, 0.03]), np.array([0.0, 0.3])
    near(force_at(box, above - corner - 0.5 * R * diagonal), HERTZ * (0.5 * R) ** 1.5 * diagonal)
    inside = corner - [0.2 * R, 0.5 * R]
    assert force_at(box, above - inside) == pytest.approx([HERTZ * (1.2 * R) ** 1.5, 0.0], rel=1e-9, abs=1e-6)
    assert not force_at(box, above).any()  # deeper than R
    end = dem(heavy(Wall([[0.0, 0.0], [0.1, 0.0]], [[0, 1]], depth=R)), 1e-9)
    beyond = np.array([-0.3, -0.4]) * R
    near(force_at(end, above - beyond), HERTZ * (0.5 * R) ** 1.5 * np.array([-0.6, -0.8]))


def test_fixed_walls_have_their_own_materials(dem):
    """Two blocks slide on a rough and on a smooth floor: each slows down with its own friction."""
    floors = [Wall([[x, 0.0], [x + 0.1, 0.0]], [[0, 1]], material=name) for x, name in ((-0.2, "rough"),
                                                                                        (0.1, "ice"))]
    blocks = [Cluster.box((0.02, 0.01), (8, 4), (x, 0.005), 500.0, 0.1, v=(0.2, 0.0), material="wood")
              for x in (-0.18, 0.12)]
    meet = {("wood", "wood"): Interaction(), ("wood", "rough"): Interaction(0.05, 0.5),
            ("wood", "ice"): Interaction(0.05, 0.1)}
    slide = dem(Scene(clusters=blocks, walls=floors, gravity=(0.0, -9.81), interactions=meet,
                      materials={name: Material(5e7, 0.3) for name in ("wood", "rough", "ice")}), 1e-5)
    none = np.zeros((0, 2))
    slide.advance(1000, none, none)
    before, time = slide.bodies()["v"][:, 0], slide.time
    slide.advance(2000, none, none)
    lost = (before - slide.bodies()["v"][:, 0]) / (slide.time - time)
    assert lost == pytest.approx([0.5 * 9.81, 0.1 * 9.81], rel=1e-3)


def strip(n):
    """A level wall of n segments."""
    x = np.linspace(-0.1, 0.1, n + 1)
    return Wall(np.column_stack([x, 0 * x]), np.column_stack([np.arange(n), np.arange(1, n + 1)]))


def rolling(friction=0.4):
    balls = Spheres([[-0.02, R], [0.01, R]], [[0.3, -0.05], [0.1, 0.0]], R, 2500.0)
    return Scene(balls, strip(21), SOFT, SOFT, at_wall=Interaction(0.7, friction), gravity=(0.3, -9.81))


@pytest.mark.parametrize("friction", [0.0, 0.4])
def test_same_surface_in_other_pieces_changes_nothing(dem, friction):
    """Sphere after replacement of 21 segments by 34 on the same line goes on as if nothing had happened."""
    plain, other = dem(rolling(friction), 1e-5), dem(rolling(friction), 1e-5)
    for k in range(60):
        for one in (plain, other):
            nodes = np.array(one.scene.wall.nodes)
            one.advance(33, nodes, 0 * nodes)
        if k % 5 == 4:
            other.replace_wall(strip(34 - k // 5))
    a, b = plain.particles(), other.particles()
    for name in ("x", "v", "omega"):
        assert b[name] == pytest.approx(a[name], rel=1e-9, abs=1e-12)
    assert a["x"][0, 1] < R and (friction == 0.0 or np.abs(a["omega"]).max() > 1.0)


def test_replacement_keeps_impulse_and_springs(dem):
    """Block on a slope held by its tangential springs: it does not jump when the wall is replaced, and the
    impulse on the wall stays minus the change of momentum."""
    t = np.radians(15.0)
    g = 9.81 * np.array([np.sin(t), -np.cos(t)])
    block = Cluster.box((0.02, 0.018), (8, 8), (0.0, 0.009), 500.0, 0.198, rim=True)
    rest = dem(Scene(clusters=[block], wall=strip(21), material=SOFT, wall_material=SOFT, gravity=g,
                     at_wall=Interaction(0.05, 0.4)), 1e-5)
    nodes = np.array(rest.scene.wall.nodes)
    rest.advance(20000, nodes, 0 * nodes)
    held, before = rest.bodies()["x"][0], rest.bodies()["v"][0, :2]
    for n in (34, 13, 21):
        rest.replace_wall(strip(n))
        nodes = np.array(rest.scene.wall.nodes)
        impulse = rest.advance(200, nodes, 0 * nodes).sum(axis=0) * 200e-5
        now = rest.bodies()["v"][0, :2]
        assert impulse + block.mass * (now - before) == pytest.approx(block.mass * g * 200e-5, rel=1e-11)
        before = now
    assert np.abs(rest.bodies()["x"][0] - held).max() < 1e-10


def test_state_from_before_the_replacement(dem):
    """It brings the old wall back; bit for bit."""
    ball = dem(rolling(), 1e-5)
    old, new = rolling().wall, strip(8)
    for _ in range(10):
        ball.advance(33, old.nodes, 0 * old.nodes)
    state = ball.get_state()
    forces = [ball.advance(33, old.nodes, 0 * old.nodes) for _ in range(20)]
    for _ in range(2):
        ball.replace_wall(new)
        ball.advance(33, new.nodes, 0 * new.nodes)
        ball.set_state(state)
        assert np.array_equal([ball.advance(33, old.nodes, 0 * old.nodes) for _ in range(20)], forces)


def test_back_ends_agree_after_replacement(both):
    """Replaced by a bent wall of another number of segments, one-sided, in mid-contact."""
    x = np.linspace(-0.1, 0.1, 31)
    nodes = np.column_stack([x, 2e-4 * np.cos(60 * x) - 2.5e-4])
    bent = Wall(nodes, np.column_stack([np.arange(30), np.arange(1, 31)]), R)
    forces = []
    for dem in both(rolling(), 1e-5):
        first = [dem.advance(33, dem.scene.wall.nodes, 0 * dem.scene.wall.nodes) for _ in range(20)]
        dem.replace_wall(bent)
        forces.append(np.array([dem.advance(33, bent.nodes, 0 * bent.nodes) for _ in range(40)]))
        assert first[-1].any()
        dem.close()
    assert np.abs(forces[0] - forces[1]).max() < 1e-9 * np.abs(forces[0]).max()
