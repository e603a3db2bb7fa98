"""Soil in creases of one structure: it touches several flanks, each with its own force and friction."""
import numpy as np
import pytest

from mpm_fenicsx import LAWS, MPM, Body, Box, Cloud, Grid, Structure, Terrain, linear
from mpm_fenicsx.terms import springs
from mpm_fenicsx.terms.creases import has_creases
from mpm_fenicsx.terms.wall_surfaces import find_surfaces
from tests.mpm.travelling import on_one_and_more

G, H, DT = 9.81, 0.05, 2.5e-3
SOIL, SAND = linear(1e6, 0.3), LAWS["mohr_coulomb"](1e6, 0.3, 35.0, 0.0, cohesion=0.0)


def tan(angle):
    return np.tan(np.radians(angle))


COS, TAN = np.cos(np.radians(30.0)), tan(30.0)


def valley(angle=30.0, friction=0.0):
    """Two planes of that angle [degrees] along a crease at x = 0.987, each of them a region."""
    terrain = Terrain.profile([0.0, 0.987, 2.0], [0.987 * tan(angle), 0.0, 1.013 * tan(angle)])
    return terrain, terrain.structure(friction=friction, regions={"left": ((0.0, 0.987), friction)})


def flanks(solid, angle):
    """Normal forces of both [N]."""
    a = np.radians(angle)
    return np.array([solid.reaction(f"terrain_{name}") @ (side * np.sin(a), np.cos(a))
                     for name, side in (("left", 1.0), ("rest", -1.0))])


def test_each_flank_carries_its_share():
    """Soil that fills the valley up to a level surface: N = W / (2 cos 30) on each, also in each step."""
    terrain, bed = valley()
    soil = terrain.release(lambda x: np.maximum(0.2 * TAN - terrain.height(x), 0.0), (0.787, 1.187), H)
    solid = MPM(terrain.grid(H, 0.3), Body(soil, None, None, SOIL, 1000.0), structures=[bed],
                gravity=(0.0, -G), inertia="lumped")
    share = solid.points.mass.sum() * G / (2.0 * COS)
    solid.settle(4)
    assert flanks(solid, 30.0) == pytest.approx([share, share], rel=1e-9)
    for _ in range(50):
        solid.advance(DT)
        assert flanks(solid, 30.0) == pytest.approx([share, share], rel=1e-9)
    solid.close()


def layer(angle, friction=0.0, depth=0.05):
    """Of sand, in the crease of a valley."""
    terrain, bed = valley(angle, friction)
    soil = terrain.release(depth, (0.9, 1.1), H)
    return MPM(terrain.grid(H, 0.4), Body(soil, None, None, SAND, 1000.0, f_bar=True), structures=[bed],
               gravity=(0.0, -G), inertia="lumped")


@pytest.mark.parametrize("height, found", [(0.05, False), (0.3, True)])
def test_a_crease_is_found_wherever_it_is(height, found):
    """One valley far from all points, in a hill that bends by more than that angle, but nowhere at once."""
    def z(x, y):
        return 2.0 * np.sin(0.5 * x) - height * np.maximum(0.0, 0.3 - abs(x - 4.0) - abs(y - 1.0))

    bed = Terrain.function(z, Box((0.0, 0.0), (6.0, 2.0)), 0.05).structure()
    assert has_creases(*find_surfaces([bed], None), far=0.1) is found


def on_both(solid):
    """Number of points of this rank that press on both flanks."""
    return int(solid.points.wall_force.any(axis=2).all(axis=1).sum())


@pytest.mark.parametrize("angle, depth, in_crease", [(30.0, 0.05, False), (60.0, 0.1, True)])
def test_sand_that_has_flowed_together_presses_evenly(angle, depth, in_crease):
    """A layer comes to rest in the crease, where a point then touches both flanks or none does: with the
    force of statics in every step."""
    solid, force = layer(angle, depth=depth), []
    share = solid.points.mass.sum() * G / (2.0 * np.cos(np.radians(angle)))
    while solid.time < 1.2:
        solid.advance(2e-3)
        force.append(flanks(solid, angle) / share)
    assert np.mean(force[-200:], axis=0) == pytest.approx([1.0, 1.0], abs=1e-3)
    assert abs(np.diff(force[-200:], axis=0)).max() < 1e-3
    assert (on_both(solid) > 0) == in_crease
    solid.close()


def trough():
    """A valley of two planes of 30 degrees along x, in four triangles, with its crease at y = 0.21."""
    ends = [(x, y, z) for x in (0.0, 1.5) for y, z in ((-0.19, 0.4 * TAN), (0.21, 0.0), (0.61, 0.4 * TAN))]
    return Terrain(np.array(ends), np.array([(0, 3, 1), (3, 4, 1), (1, 4, 2), (4, 5, 2)]))


@pytest.mark.parametrize("a, friction", [(30.0, 0.3), (20.0, 0.5)])
def test_a_block_slides_along_a_crease(a, friction):
    """With g (sin a - mu cos a / cos 30), or rests: in a trough whose crease falls by the angle a."""
    a, terrain = np.radians(a), trough()
    gravity = (G * np.sin(a), 0.0, -G * np.cos(a))
    soil = terrain.release(lambda xy: np.maximum(0.12 - abs(xy[:, 1] - 0.21), 0.0) * TAN,
                           [(0.3, 0.09), (0.5, 0.09), (0.5, 0.33), (0.3, 0.33)], H)
    solid = MPM(terrain.grid(H, 0.25), Body(soil, None, None, SOIL, 1000.0), inertia="lumped",
                structures=[terrain.structure(friction=friction)], gravity=gravity)
    mass, time, speed = solid.points.mass.sum(), [], []
    while solid.time < 0.3:
        solid.advance(2e-3)
        time.append(solid.time)
        speed.append(solid.momentum() / mass)
    found = np.polyfit(time[50:], speed[50:], 1)[0]
    wanted = G * max(np.sin(a) - friction * np.cos(a) / COS, 0.0)
    assert found == pytest.approx([wanted, 0.0, 0.0], rel=1e-3, abs=3e-4)
    solid.close()


def thrown(structures, basis="linear", law=SOIL):
    """Soil that is thrown into a corner."""
    body = Body(Box((0.1, 0.05), (0.4, 0.25)), (6, 4), 2, law, 1000.0, velocity=(2.0, -1.0))
    return MPM(Grid(Box((-0.6, -0.3), (0.8, 1.1)), (14, 14)), body, inertia="lumped", structures=structures,
               gravity=(0.0, -G), basis=basis)


FLOOR, WALL = [(-0.55, 0.01), (0.513, 0.01)], [(0.513, 0.01), (0.513, 0.8)]


def corner(joined=True):
    """A floor and a wall."""
    one = Structure("one", FLOOR + WALL[1:], [(0, 1), (1, 2)], friction=0.4)
    return [one] if joined else [Structure("floor", FLOOR, [(0, 1)], friction=0.4),
                                 Structure("wall", WALL, [(0, 1)], friction=0.4)]


@pytest.mark.parametrize("basis", ["linear", "ugimp"])
def test_a_corner_of_one_structure_is_that_of_two(basis):
    one, two = (thrown(corner(joined), basis, SAND) for joined in (True, False))
    both = 0
    for _ in range(120):
        one.advance(DT)
        two.advance(DT)
        apart = np.array([two.reaction(name) for name in ("floor", "wall")])
        both += bool(apart.any(axis=1).all())
        assert abs(one.points.x - two.points.x).max() < 1e-12
        assert one.reaction("one") == pytest.approx(apart.sum(axis=0), abs=1e-9 * (1.0 + abs(apart).max()))
    assert both > 5
    one.close()
    two.close()


def test_a_sheet_that_folds_gets_a_crease():
    """A level sheet becomes a valley under falling sand, which is then caught as by one that always was."""
    terrain, valley_ = valley(60.0)
    sheet = Structure("terrain", terrain.x * (1.0, 0.0), terrain.elements, cell=valley_.cell,
                      names=valley_.names, motion=lambda t: min(t / 0.08, 1.0) * terrain.x * (0.0, 1.0))
    soil, found = terrain.release(0.05, (0.9, 1.1), H), []
    soil = Cloud(soil.x + (0.0, 0.1), soil.volume, soil.half)
    for bed in (valley_, sheet):
        solid = MPM(terrain.grid(H, 0.4), Body(soil, None, None, SAND, 1000.0, f_bar=True), structures=[bed],
                    gravity=(0.0, -G), inertia="lumped")
        both = 0
        while solid.time < 0.4:
            solid.advance(DT)
            both += on_both(solid)
        found.append((solid.points.x.copy(), flanks(solid, 60.0)))
        assert both > 0
        solid.close()
    for stood, folded in zip(*found):
        np.testing.assert_allclose(folded, stood, rtol=0, atol=1e-9 * abs(stood).max())


def test_walls_that_close_in_are_a_corner_all_the_way():
    """A wall that comes to a block on a floor: as one structure whose vertices move, and as two."""
    way = lambda t: np.array([-0.3 * t, 0.0])  # noqa: E731
    floor = [(-0.55, 0.01), (0.913, 0.01)]
    wall = np.array([(0.713, 0.005), (0.713, 0.8)])
    one = Structure("one", np.vstack([floor, wall]), [(0, 1), (2, 3)], friction=0.4,
                    motion=lambda t: np.vstack([np.zeros((2, 2)), np.tile(way(t), (2, 1))]))
    two = [Structure("floor", floor, [(0, 1)], friction=0.4),
           Structure("wall", wall, [(0, 1)], friction=0.4, motion=way)]
    joined, apart = thrown([one], law=SAND), thrown(two, law=SAND)
    both = 0
    for _ in range(120):
        joined.advance(DT)
        apart.advance(DT)
        parts = np.array([apart.reaction(name) for name in ("floor", "wall")])
        both += bool(parts.any(axis=1).all())
        assert abs(joined.points.x - apart.points.x).max() < 1e-12
        assert joined.reaction("one") == pytest.approx(parts.sum(axis=0), abs=1e-9 * (1.0 + abs(parts).max()))
    assert both > 5
    joined.close()
    apart.close()


def feet_of(structure, x, half=0.01):
    """Number of feet of soil in points x (n, dim) with that half-width [m]."""
    dim, h = x.shape[1], 0.05
    low, high = x.min(axis=0) - 2 * h, x.max(axis=0) + 2 * h
    cells = Grid.counts(high - low, h)
    cloud = Cloud(x, np.full(len(x), (2.0 * half) ** dim), np.full(x.shape, half))
    solid = MPM(Grid(Box(low, high), cells), Body(cloud, None, None, SOIL, 1000.0), structures=[structure])
    contact, = solid._contacts
    feet, _ = contact._find_feet()
    count = np.bincount(feet.point, minlength=len(x))
    most = contact._creases[0].most
    solid.close()
    return count, most


def above(terrain, heights=(0.003, 0.01, 0.03), n=400):
    """Places over the middle of a terrain."""
    rng = np.random.default_rng(3)
    low, high = terrain.x.min(axis=0)[:-1], terrain.x.max(axis=0)[:-1]
    plan = low + (high - low) * (0.2 + 0.6 * rng.random((n, len(low))))
    return np.concatenate([np.column_stack([plan, terrain.height(plan) + height]) for height in heights])


AREA = Box((0.0, 0.0), (0.8, 0.8))


@pytest.mark.parametrize("z, most", [(lambda x, y: 0.3 * x + 0.1 * y, 1),
                                     (lambda x, y: 2.5 * ((x - 0.4) ** 2 + (y - 0.4) ** 2), 3),
                                     (lambda x, y: -0.7 * abs(x - 0.41) - 0.5 * abs(y - 0.37), 3)],
                         ids=["plane", "bowl of four cells' radius", "ridges"])
def test_one_foot_on_a_plane_in_a_bowl_and_on_ridges(z, most):
    """In triangles of two fifths of a cell."""
    terrain = Terrain.function(z, AREA, 0.02)
    count, found = feet_of(terrain.structure(), above(terrain))
    assert (count == 1).all() and found == most


def test_one_foot_around_a_box():
    places = np.random.default_rng(1).uniform(-0.06, 0.26, (2000, 3))
    places = places[((places < 0.0) | (places > 0.2)).any(axis=1)]
    assert feet_of(Structure.box("box", Box((0.0,) * 3, (0.2,) * 3)), places)[0].max() == 1


def test_three_feet_in_a_corner_from_inside():
    """Near one, two and three of the faces of a box, and in its middle."""
    box = Structure.box("box", Box((0.0,) * 3, (0.2,) * 3))
    room = Structure("room", box.x, [list(e[::-1]) for e in box.elements[:-1]])  # open: it is not turned
    x = np.array([(0.01, 0.1, 0.1), (0.01, 0.012, 0.1), (0.01, 0.012, 0.013), (0.1, 0.1, 0.1)])
    assert feet_of(room, x)[0].tolist() == [1, 2, 3, 0]


def loaded():
    """Points in a corner that press, stick, slide and are open."""
    random, solid = np.random.default_rng(4), thrown(corner())
    p, (contact,) = solid.points, solid._contacts
    p.x[:] += np.array([0.516, 0.007]) - (0.4, 0.05) + random.normal(size=p.x.shape) * 3e-3
    p.v[:] = random.normal(size=p.v.shape) * 0.1
    feet, _ = contact._find_feet()
    at = feet.point, feet.slot
    p.wall_element[at] = feet.element
    p.wall_gap[at], p.wall_force[at] = (random.normal(size=(len(at[0]), 2)) * size for size in (3e-3, 2e3))
    return solid, random


def test_matrix_is_the_derivative_of_the_residual(check_matrix):
    """Away from the kinks, with points that have two feet."""
    solid, random = loaded()
    check_matrix(solid, random, 1e-3, 1e-4)
    kinds = solid.points.wall_status
    assert set(np.unique(kinds % springs.CLOSED)) >= {springs.FREE, springs.STICK}
    assert kinds.max() > springs.CLOSED + 1 and (kinds >= springs.CLOSED).all(axis=1).sum() >= 1


def test_state_continues_bit_for_bit():
    """With points that press and rub on both flanks."""
    solid = layer(60.0, 0.3)
    while solid.time < 0.1 or not on_both(solid):
        solid.advance(DT)
    state, ends = solid.get_state(), []
    for _ in range(2):
        for _ in range(20):
            solid.advance(DT)
        ends.append((solid.points.x.copy(), solid.points.v.copy(), solid.points.wall_force.copy()))
        solid.set_state(state)
    for one, other in zip(*ends):
        np.testing.assert_array_equal(one, other)
    solid.close()


RANKS = """
import sys
import test_creases
from tests.mpm.travelling import travel

def look(solid):
    both = solid.comm.allreduce(test_creases.on_both(solid))
    return [*solid.reaction("terrain_left"), *solid.reaction("terrain_rest"), both]

travel(sys.argv[1], lambda: test_creases.layer(60.0, 0.3), 40, look=look)
"""


@pytest.mark.mpi
def test_ranks_change_nothing(tmp_path, on_ranks):
    one, two = on_one_and_more(on_ranks, tmp_path, RANKS, 2)
    assert one["looks"][:, -1].max() > 0
    np.testing.assert_allclose(two["looks"], one["looks"], rtol=1e-6, atol=1e-6)
