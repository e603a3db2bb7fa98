"""Rocks from surfaces, and places for them: the solid against closed forms, the spheres, motion on both back
ends."""
import functools
from types import SimpleNamespace

import meshio
import numpy as np
import pytest

from dem_liggghts import Cluster, Interaction, Material, Scene, Spheres, Wall, quaternion

STONE, RHO, G = Material(1e7, 0.25), 2600.0, 9.81
TURN = np.array([0.5, -0.1, 0.7, 0.5]) / np.linalg.norm([0.5, -0.1, 0.7, 0.5])
GOLD = 0.5 * (1.0 + 5.0**0.5)


def icosphere(levels):
    """Vertices on the unit sphere and triangles of an icosahedron divided ``levels`` times; vertices on
    edges are there twice."""
    x = np.array([(-1, GOLD, 0), (1, GOLD, 0), (-1, -GOLD, 0), (1, -GOLD, 0)], float)
    x = np.concatenate([x, np.roll(x, 1, axis=1), np.roll(x, 2, axis=1)])
    near = np.linalg.norm(x[:, None] - x, axis=2) < 2.1
    t = [(a, b, c) for a in range(12) for b in range(a) for c in range(b)
         if near[a, b] and near[b, c] and near[a, c]]
    t = np.array([(a, b, c) if np.linalg.det(x[[a, b, c]]) > 0.0 else (a, c, b) for a, b, c in t])
    for _ in range(levels):
        (a, b, c), n = x[t.T], len(t)
        ab, bc, ca = (len(x) + n * k + np.arange(n) for k in range(3))
        x = np.concatenate([x, a + b, b + c, c + a])
        x /= np.linalg.norm(x, axis=1)[:, None]
        t = np.concatenate([np.column_stack(part) for part in (
            (t[:, 0], ab, ca), (ab, t[:, 1], bc), (ca, bc, t[:, 2]), (ab, bc, ca))])
    return x / np.linalg.norm(x, axis=1)[:, None], t


def irregular(levels=3):
    """An icosphere with bumps and hollows, longer than wide, as a scanned rock may be."""
    x, t = icosphere(levels)
    random = np.random.default_rng(1)
    waves, phases = 1.5 * random.normal(size=(12, 3)), random.uniform(0.0, 6.28, 12)
    return x * (1.0 + 0.7 * np.sin(x @ waves.T + phases).mean(axis=1))[:, None] * [1.3, 1.0, 0.75], t


def box(lower, upper):
    """Surface of a box, and mass, centre and inertia about zero of its solid of density one."""
    corners = np.array([[(lower, upper)[k >> axis & 1][axis] for axis in range(3)] for k in range(8)], float)
    sides = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    size, middle = np.subtract(upper, lower), 0.5 * np.add(lower, upper)
    volume = size.prod()
    second = volume * (np.diag(size**2) / 12.0 + np.outer(middle, middle))
    triangles = [(q[0], q[1], q[k]) if k == 2 else (q[0], q[2], q[3]) for q in sides for k in (2, 3)]
    return corners, triangles, volume, middle, second


def about_centre(volume, centre, second):
    """Inertia about the centre of mass from the integral of x x^T."""
    second = second - volume * np.outer(centre, centre)
    return np.trace(second) * np.eye(3) - second


def closed_form(shape):
    """Vertices, triangles, volume, centre, inertia about it."""
    if shape == "box":
        x, t, volume, centre, second = box((-1.0, 0.5, 2.0), (1.0, 1.5, 2.5))
        return x, t, volume, centre, about_centre(volume, centre, second)
    if shape == "tetrahedron":
        inertia = np.full((3, 3), 1.0 / 480.0) + np.eye(3) * (1.0 / 80.0 - 1.0 / 480.0)
        faces = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]
        return np.eye(4, 3, -1), faces, 1 / 6, np.full(3, 0.25), inertia
    outline = np.array([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)], float)
    x = np.concatenate([np.column_stack([outline, np.full(6, z)]) for z in (0.0, 1.0)])
    fan = [(0, k, k + 1) for k in range(1, 5)]
    ends = [(k, (k + 1) % 6) for k in range(6)]
    t = [(a, c, b) for a, b, c in fan] + [(a + 6, b + 6, c + 6) for a, b, c in fan]
    t += [(a, b, b + 6) for a, b in ends] + [(a, b + 6, a + 6) for a, b in ends]
    parts = [box((0, 0, 0), (2, 1, 1))[2:], box((0, 1, 0), (1, 2, 1))[2:]]
    volume, second = sum(p[0] for p in parts), sum(p[2] for p in parts)
    centre = sum(p[0] * p[1] for p in parts) / volume
    return x, t, volume, centre, about_centre(volume, centre, second)


@pytest.mark.parametrize("shape", ["box", "tetrahedron", "L"])
@pytest.mark.parametrize("away, rel", [(0.0, 1e-14), (1e4, 1e-11)])
def test_mass_centre_and_inertia_of_the_solid(shape, away, rel):
    """In any orientation, inside out, and 1e4 m from zero, where a coordinate has 1e-12 m."""
    x, t, volume, centre, inertia = closed_form(shape)
    R = quaternion.matrix(TURN)
    for triangles in (np.array(t), np.array(t)[:, ::-1]):
        rock = Cluster.from_surface(x @ R.T + away, triangles, RHO, spheres=1)
        assert rock.mass == pytest.approx(RHO * volume, rel=rel)
        assert rock.centre == pytest.approx(R @ centre + away, abs=10 * rel)
        assert rock.x == pytest.approx(rock.centre)
        assert rock.inertia == pytest.approx(RHO * R @ inertia @ R.T, abs=10 * rel * RHO * inertia.max())


def test_the_sphere_is_met_to_second_order():
    errors = []
    for levels in (3, 4):
        ball = Cluster.from_surface(*icosphere(levels), 1.0)
        errors.append((ball.mass / (4 / 3 * np.pi) - 1, ball.inertia[0, 0] / (8 / 15 * np.pi) - 1))
        assert ball.inertia == pytest.approx(ball.inertia[0, 0] * np.eye(3), abs=1e-13)
    assert np.array(errors[1]) == pytest.approx(np.array(errors[0]) / 4.0, rel=0.01)


def test_the_same_from_files(tmp_path):
    """STL names every corner anew, also in single precision; OBJ and PLY share vertices."""
    x, t = irregular(2)
    rock = Cluster.from_surface(x, t, RHO, (0, 0, 0), scale=0.1, spheres=5)
    for name, precision, keys in (("a.stl", 1e-12, {}), ("b.stl", 1e-6, {"binary": True}),
                                  ("c.obj", 1e-12, {}), ("d.ply", 1e-12, {})):
        meshio.write_points_cells(tmp_path / name, x, [("triangle", t.astype(np.int32))], **keys)
        same = Cluster.read(tmp_path / name, RHO, (0, 0, 0), scale=0.1, spheres=5)
        assert same.mass == pytest.approx(rock.mass, rel=precision)
        assert same.inertia == pytest.approx(rock.inertia, abs=precision * rock.inertia.max())
        assert same.filling.spheres == 5 and same.filling.covered == pytest.approx(rock.filling.covered)
    quads = [("quad", [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)])]
    meshio.write_points_cells(tmp_path / "e.obj", box((0, 0, 0), (2, 3, 4))[0], quads)
    assert Cluster.read(tmp_path / "e.obj", RHO).mass == pytest.approx(24 * RHO)


def test_the_spheres_of_a_cube_are_known():
    """The first one is the inscribed one and covers pi / 6, its gap is that of the corners. The next eight
    sit in the corners, and all touch the nearest side."""
    x, t, *_ = box((0, 0, 0), (1, 1, 1))
    cube = Cluster.from_surface(x, t, RHO, spheres=1)
    assert cube.centres[0] == pytest.approx(np.full(3, 0.5)) and cube.radii[0] == pytest.approx(0.5)
    assert cube.filling.covered == pytest.approx(np.pi / 6, abs=0.01)
    assert cube.filling.gap == pytest.approx(0.5 * (np.sqrt(3.0) - 1.0), rel=1e-12)
    cube = Cluster.from_surface(x, t, RHO, spheres=9)
    assert len(np.unique(cube.centres[1:] > 0.5, axis=0)) == 8
    assert cube.radii == pytest.approx(np.minimum(cube.centres, 1.0 - cube.centres).min(axis=1), rel=1e-14)


def test_spheres_touch_the_surface_from_inside():
    """Of an irregular rock, against distances from points all over the surface; more spheres cover more."""
    x, t = irregular(5)
    few, many = (Cluster.from_surface(x, t, RHO, spheres=n) for n in (10, 40))
    for rock in (few, many):
        apart = np.linalg.norm(x[:, None] - rock.centres, axis=2) - rock.radii
        assert apart.min() > 0.0 and apart.min(axis=0).max() < 2e-3
        gap = apart.min(axis=1).max()
        assert gap <= rock.filling.gap < gap + rock.filling.spacing
    assert few.filling.covered > 0.85 and many.filling.covered > 0.95
    assert many.filling.gap < 0.5 * few.filling.gap < 0.1
    inside = np.random.default_rng(2).uniform(x.min(axis=0), x.max(axis=0), (100000, 3))
    hit = np.zeros(len(inside), bool)
    for c, r in zip(many.centres, many.radii):
        hit |= np.linalg.norm(inside - c, axis=1) < r
    volume = hit.mean() * np.ptp(x, axis=0).prod()
    assert volume / (many.mass / RHO) == pytest.approx(many.filling.covered, abs=0.01)


def test_what_is_asked_for_is_met_or_refused():
    x, t = irregular()
    rock = Cluster.from_surface(x, t, RHO, coverage=0.95)
    assert 20 < len(rock.radii) < 50 and rock.filling.covered >= 0.95
    assert Cluster.from_surface(x, t, RHO, spheres=60, smallest=0.5).radii.min() >= 0.5
    few = (r"^5 spheres of at least 0.0488 m cover 0.[78]\d+ of the volume inside the surface, and coverage "
           "is 0.95: give more spheres than 5, or less coverage")
    with pytest.raises(ValueError, match=few):
        Cluster.from_surface(x, t, RHO, spheres=5, coverage=0.95)
    with pytest.raises(ValueError, match="spheres of at least 0.5 m cover .* give a lower smallest, or less"):
        Cluster.from_surface(x, t, RHO, coverage=0.99, smallest=0.5)
    with pytest.raises(ValueError, match=r"no sphere of smallest=3 m fits .* largest has 0\.\d+ m: give a"):
        Cluster.from_surface(x, t, RHO, smallest=3.0)


def test_sizes_of_one_shape():
    x, t = irregular()
    one = Cluster.from_surface(x, t, RHO, (0, 0, 1), spheres=8, material="rock")
    for other in (Cluster.from_surface(x, t, RHO, (0, 0, 1), spheres=8, scale=0.2),
                  Cluster.from_surface(x, t, RHO, (0, 0, 1), spheres=8, size=0.2 * np.ptp(x, axis=0).max()),
                  Cluster.from_surface(x, t, RHO, (0, 0, 1), spheres=8, volume=0.008 * one.mass / RHO),
                  one.scaled(0.2)):
        assert other.mass == pytest.approx(0.008 * one.mass)
        assert other.inertia == pytest.approx(0.2**5 * one.inertia)
        assert other.arms() == pytest.approx(0.2 * one.arms(), abs=1e-12)
        assert other.radii == pytest.approx(0.2 * one.radii)
        assert other.filling.gap == pytest.approx(0.2 * one.filling.gap)
        assert other.surface.x == pytest.approx(0.2 * one.surface.x, abs=1e-12)
    assert len(one.surface.triangles) == len(t) and Cluster.packed([one], room(9, 9, 9), 1)[0].surface
    assert one.scaled(2.0, x=(1, 2, 3)).x.tolist() == [1, 2, 3] and one.scaled(2.0).material == "rock"
    plate = Cluster.box((0.02, 0.01), (4, 2), (0, 0), RHO, depth=0.1, angle=0.3).scaled(2.0)
    assert quaternion.angle(plate.quaternion) == pytest.approx(0.3) and plate.radii[0] == 0.005
    with pytest.raises(ValueError, match="scale=2.0 and size=1 of the surface: give one of them"):
        Cluster.from_surface(x, t, RHO, scale=2.0, size=1)


X, T = icosphere(1)
OPPOSITE = np.concatenate([T[1:], T[:1, ::-1]])


@pytest.mark.parametrize("x, t, message", [
    (X, T[2:], r"not closed: \d of its 120 edges are open, .* \(the first from .* to .* m\): close"),
    (X, OPPOSITE, "opposite sides outside: 3 of its 120 edges are run through in one direction only"),
    (X * [1, 1, 0], T, "encloses 0 m.3, which is nothing: give the surface of a body, not a sheet"),
    (X, [[0, 0, 1], [2, 2, 2]], "has 2 triangles, and none has three corners in different places"),
    (np.where(X > 0.9, np.nan, X), T, "vertices of the surface contains NaN or infinity"),
    (X, T + 1, "triangles of the surface name vertices 1..[0-9]+, there are"),
    (np.concatenate([X, X + 0.5]), np.concatenate([T, T + len(X)]), "the surface crosses itself, or parts"),
    (np.concatenate([X, X + 3.0]), np.concatenate([T, T[:, ::-1][:, [1, 0, 2]] + len(X)]), None)])
def test_surfaces_that_bound_no_body(x, t, message):
    if message is None:  # two bodies beside each other are one cluster
        assert Cluster.from_surface(x, t, RHO).mass == pytest.approx(2 * Cluster.from_surface(X, T, RHO).mass)
        return
    with pytest.raises(ValueError, match=message):
        Cluster.from_surface(x, t, RHO)


def test_files_that_hold_no_surface(tmp_path):
    (tmp_path / "a.stl").write_text("no mesh")
    (tmp_path / "b.obj").write_text("v 0 0 0\n")
    with pytest.raises(ValueError, match="a.stl cannot be read as a surface .*: give a file that meshio"):
        Cluster.read(tmp_path / "a.stl", RHO)
    with pytest.raises(ValueError, match="b.obj holds no triangles: give a surface of triangles"):
        Cluster.read(tmp_path / "b.obj", RHO)
    with pytest.raises(ValueError, match="c.stl: this file does not exist"):
        Cluster.read(tmp_path / "c.stl", RHO)


@functools.lru_cache(maxsize=None)
def rolling_rock():
    """Filled once for all tests that move it."""
    return Cluster.from_surface(*irregular(), RHO, (0, 0, 0), spheres=12, size=0.3)


def floor(away=0.0):
    x = np.array([[-9, -9, 0], [9, -9, 0], [9, 9, 0], [-9, 9, 0]], float) + away
    return Wall(x, [[0, 1, 2], [0, 2, 3]])


def on_floor(friction, away=0.0):
    rock = rolling_rock().changed(x=np.array([0.0, 0.0, 0.2]) + away, v=(1.5, 0.2, 0.0),
                                  omega=(0.0, 5.0, 2.0))
    meet = Interaction(0.1, friction)
    return Scene(wall=floor(away), clusters=[rock], material=STONE, wall_material=STONE, at_wall=meet,
                 gravity=(0, 0, -G))


def windows(dem, count, steps):
    """Energies at the end of each window."""
    nodes, out = np.array(dem.scene.wall.nodes), []
    for _ in range(count):
        dem.advance(steps, nodes, 0 * nodes)
        out.append(dem.energy())
    return out


@pytest.mark.parametrize("friction", [0.0, 0.5])
def test_an_irregular_rock_comes_to_rest(dem, friction, record_property):
    """Its energy only falls: to round-off without friction. The springs of friction are no part of it; they
    hold at most what the contacts hold that it counts."""
    rock = dem(on_floor(friction), 1e-4)
    energies = windows(rock, 80 if friction else 30, 500)
    total = np.array([sum(e.values()) for e in energies])
    rise = np.diff(total).max()
    record_property("largest rise of the energy [J]", float(rise))
    assert rise < (max(e["contact"] for e in energies) if friction else 1e-13 * total[0])
    body = rock.bodies()[0]
    if friction:
        assert energies[-1]["kinetic"] < 1e-6 * energies[0]["kinetic"]
        assert body["x"][0] > 0.15 and np.abs(body["quaternion"][1:]).max() > 0.3  # it has rolled over
        low = rock.particles()
        assert np.count_nonzero(low["x"][:, 2] < low["radius"]) >= 3  # and stands
    else:
        assert body["v"][:2] == pytest.approx([1.5, 0.2], abs=1e-12)


def test_far_from_the_origin_it_falls_alike(dem):
    near, far = dem(on_floor(0.5), 1e-4), dem(on_floor(0.5, 1e4), 1e-4)
    for one in (near, far):
        windows(one, 1, 4000)
    a, b = near.bodies()[0], far.bodies()[0]
    assert b["x"] - 1e4 == pytest.approx(a["x"], abs=1e-7)
    assert b["v"] == pytest.approx(a["v"], abs=1e-6) and b["omega"] == pytest.approx(a["omega"], abs=1e-5)


def test_a_free_rock_spins_on(dem):
    """About its middle axis, which is not stable: energy and angular momentum stay."""
    moments, turn = rolling_rock().principal()
    axes = quaternion.matrix(turn)
    rock = rolling_rock().changed(omega=axes @ [0.02, 20.0, 0.0])
    assert moments[0] < 0.9 * moments[1] and moments[1] < 0.95 * moments[2]
    spin = dem(Scene(clusters=[rock], material=STONE), 1e-5)
    momentum = []
    for steps in (0, 40000, 40000):
        if steps:
            windows(spin, 1, steps)
        body = spin.bodies()[0]
        R = quaternion.matrix(body["quaternion"])
        momentum.append(R @ rock.inertia @ R.T @ body["omega"])
        energy = 0.5 * body["omega"] @ momentum[-1]
        assert energy == pytest.approx(0.5 * rock.omega @ rock.inertia @ rock.omega, rel=1e-7)
        assert spin.energy()["kinetic"] == pytest.approx(energy, rel=1e-10)
        assert momentum[-1] == pytest.approx(momentum[0], abs=1e-7 * np.linalg.norm(momentum[0]))
    assert R[:, 1] @ [0, 1, 0] < 0.9  # it has tumbled


def room(*upper, lower=None):
    return SimpleNamespace(lower=lower or (0.0,) * len(upper), upper=upper)


def overlaps(x, radius, gap):
    """Largest overlap of any two spheres [m]."""
    apart = np.linalg.norm(x[:, None] - x, axis=2) - radius[:, None] - radius - gap
    return -apart[np.triu_indices(len(x), 1)].min()


@pytest.mark.parametrize("upper", [(1.0, 2.0), (1.0, 2.0, 0.5)], ids=["plane", "space"])
@pytest.mark.parametrize("radius", [0.03, (0.02, 0.06), np.linspace(0.01, 0.07, 80)],
                         ids=["one", "pair", "each"])
def test_packed_spheres(upper, radius):
    inside, gap, dim = room(*upper), 0.005, len(upper)
    balls = Spheres.packed(80, radius, inside, RHO, seed=4, gap=gap, v=np.eye(dim)[0], material="rock")
    x, r = balls.x, balls.radius
    assert len(x) == 80 and balls.dim == dim and balls.material == "rock"
    assert (balls.v == np.eye(dim)[0]).all()
    assert overlaps(x, r, gap) < 0.0
    assert (x >= r[:, None]).all() and (x <= upper - r[:, None]).all()
    if np.ndim(radius) and len(radius) == 80:
        assert r.tolist() == radius.tolist()
    else:
        assert (r >= np.min(radius)).all() and (r <= np.max(radius)).all()
    again = Spheres.packed(80, radius, inside, RHO, seed=4, gap=gap)
    other = Spheres.packed(80, radius, inside, RHO, seed=5, gap=gap)
    assert (again.x == x).all() and (other.x != x).any()


def test_packed_spheres_lie_everywhere():
    """A thin gas is uniform, and a pair of radii gives all between."""
    balls = Spheres.packed(20000, (1e-4, 3e-4), room(1.0, 1.0, 1.0), RHO, seed=1)
    for column in (*balls.x.T, (balls.radius - 1e-4) / 2e-4):
        assert np.histogram(column, 10, (0.0, 1.0))[0] == pytest.approx(2000, abs=5 * np.sqrt(2000))


def test_dense_spheres_fit_up_to_the_known_limit():
    """Random sequential addition jams near 0.384 (in a large box); 0.3 is reached, 0.45 refused."""
    inside, radius = room(1.0, 1.0, 1.0), 0.03
    ball = 4 / 3 * np.pi * radius**3
    assert len(Spheres.packed(int(0.3 / ball), radius, inside, RHO, 1).x) == int(0.3 / ball)
    with pytest.raises(ValueError, match=r"spheres fill 0\.3[0-9]+ of the box, and the next one finds no "
                                         "place in 100000 tries .*: give fewer or smaller ones"):
        Spheres.packed(int(0.45 / ball), radius, inside, RHO, 1)


def test_packed_clusters():
    """Rocks of one shape in a box far away: none overlap, all are inside, the orientations are uniform."""
    rock = Cluster.from_surface(*irregular(), RHO, spheres=8, size=0.2, v=(0, 0, -1), material="rock")
    family = [rock.scaled(s) for s in np.linspace(0.3, 1.0, 60)]
    inside = room(1e4 + 1.0, 1e4 + 1.0, 1e4 + 1.0, lower=(1e4, 1e4, 1e4))
    rocks = Cluster.packed(family, inside, seed=2, gap=1e-3)
    assert [r.mass for r in rocks] == [r.mass for r in family]
    assert all(r.material == "rock" and r.v.tolist() == [0, 0, -1] for r in rocks)
    x, r = np.concatenate([c.places for c in rocks]), np.concatenate([c.radii for c in rocks])
    assert (x - r[:, None] > 1e4 - 1e-10).all() and (x + r[:, None] < 1e4 + 1 + 1e-10).all()
    apart = np.linalg.norm(x[:, None] - x, axis=2) - r[:, None] - r
    number = np.repeat(np.arange(60), 8)
    assert apart[number[:, None] != number].min() > 1e-3 - 1e-10
    again = Cluster.packed(family, inside, seed=2, gap=1e-3)
    assert all((a.x == b.x).all() and (a.quaternion == b.quaternion).all() for a, b in zip(rocks, again))
    tiny = Cluster.packed([rock.scaled(1e-3)] * 4000, room(1.0, 1.0, 1.0), seed=1)
    axes = np.array([quaternion.matrix(c.quaternion) for c in tiny])
    assert np.abs(axes.mean(axis=0)).max() < 5 / np.sqrt(3 * 4000)
    assert (axes**2).mean(axis=0) == pytest.approx(np.full((3, 3), 1 / 3), abs=5 * 0.3 / np.sqrt(4000))


def test_packed_clusters_in_the_plane():
    plank = Cluster.box((0.1, 0.02), (5, 1 + 1), (0, 0), RHO, depth=0.1)
    planks = Cluster.packed([plank] * 20, room(1.0, 0.5), seed=1)
    assert len({float(quaternion.angle(p.quaternion)) for p in planks}) == 20
    x, r = np.concatenate([p.places for p in planks]), np.concatenate([p.radii for p in planks])
    apart = np.linalg.norm(x[:, None] - x, axis=2) - r[:, None] - r
    number = np.repeat(np.arange(20), 10)
    assert apart[number[:, None] != number].min() > -1e-12
    assert planks[0].inertia == pytest.approx(plank.inertia)


def test_packed_rocks_and_gravel_fall_onto_a_floor(dem):
    """Apart at the start; none falls through, and the energy falls."""
    rock = Cluster.from_surface(*irregular(2), RHO, spheres=8, size=0.2)
    rocks = Cluster.packed([rock.scaled(s) for s in (0.6, 0.8, 1.0, 1.2)], room(0.8, 0.8, 0.6), seed=1)
    gravel = Spheres.packed(30, (0.02, 0.03), room(0.8, 0.8, 0.9, lower=(0.0, 0.0, 0.61)), RHO, seed=2)
    meet = Interaction(0.3, 0.5)
    heap = dem(Scene(gravel, floor(), STONE, STONE, meet, meet, (0, 0, -G), clusters=rocks), 4e-5)
    assert heap.energy()["contact"] == 0.0
    energies = windows(heap, 3, 4000)
    total = [sum(e.values()) for e in energies]
    assert total[2] < total[1] < total[0] and energies[-1]["contact"] > 0.0
    low = heap.particles()
    assert (low["x"][:, 2] > 0.9 * low["radius"]).all() and (heap.bodies()["x"][:, 2] > 0.02).all()


@pytest.mark.parametrize("keys, message", [
    (dict(radius=0.6), "a sphere of radius 0.6 m does not fit inside the box from"),
    (dict(count=99, radius=0.2), "99 spheres would fill 3.32 times the box: give fewer"),
    (dict(radius=(0.2, 0.1)), r"radius is \(0.2, 0.1\) m: give \(low, high\) with 0 < low <= high"),
    (dict(radius=[0.1] * 8), r"radius has shape \(8,\): give numbers of shape"),
    (dict(inside=(0, 1)), r"inside is \(0, 1\): give a box, something with lower and upper"),
    (dict(inside=room(1, 0, 1)), "inside goes from .* every upper coordinate must exceed the lower one"),
    (dict(count=0), "count of the spheres is 0: give a whole number of at least 1"),
    (dict(seed=-1), "seed is -1: give a whole number of at least 0"),
    (dict(gap=-1), "gap is -1 m: give 0 or a positive number")])
def test_spheres_that_cannot_be_packed(keys, message):
    with pytest.raises(ValueError, match=message):
        Spheres.packed(**{**dict(count=9, radius=0.1, inside=room(1, 1, 1), rho=RHO, seed=1), **keys})


def test_clusters_that_cannot_be_packed():
    brick = Cluster.box((0.6, 0.6, 0.6), (2, 2, 2), (0, 0, 0), RHO)
    with pytest.raises(ValueError, match=r"the box inside has 2 dimensions and the clusters have \[3\]: use"):
        Cluster.packed([brick], room(1, 1), 1)
    with pytest.raises(ValueError, match="1 of 9 clusters, whose spheres fill 0.113 of the box, and the"):
        Cluster.packed([brick] * 9, room(1, 1, 1), 1)
    assert Cluster.packed([], room(1, 1, 1), 1) == ()
