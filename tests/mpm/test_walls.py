"""Walls stop soil, however they are made and wherever the grid is cut; what has gone through is counted and
named."""
import warnings

import numpy as np
import pytest

from mpm_fenicsx import (
    LAWS,
    MPM,
    Body,
    Box,
    Grid,
    GridWall,
    Interface,
    Penalty,
    Support,
    Terrain,
    mohr_coulomb,
)
from mpm_fenicsx.compiled import specialise
from mpm_fenicsx.points.box_tree import make_tree
from mpm_fenicsx.points.closest import closest
from mpm_fenicsx.points.surface import normal_areas
from mpm_fenicsx.scene.refine import divide
from mpm_fenicsx.terms.behind import BEHIND, FRONT, THROUGH
from mpm_fenicsx.terms.wall_elements import WallElements, find_rim, make_room, nearest
from mpm_fenicsx.terms.wall_surfaces import WallSurfaces, find_surfaces
from tests.mpm.travelling import on_one_and_more

SOIL = LAWS["mohr_coulomb"](2e5, 0.3, 20.0, 0.0, 0.0)


def test_divided_triangles_keep_area_and_turn():
    """Each into its own number of pieces; particles in one place are one where two sides are divided
    alike."""
    patch = Interface.patch((0, 0, 0), (2, 0, 0), (0, 1.5, 0.3), (3, 2))
    x, elements = np.asarray(patch.x), np.asarray(patch.elements)
    pieces = np.random.default_rng(0).integers(1, 5, len(elements))
    parents, weights, divided = divide(elements, len(x), pieces)
    places = np.einsum("nk,nkd->nd", weights, x[parents])
    area = normal_areas(places, divided)
    assert len(divided) == (pieces**2).sum() and len(np.unique(places.round(9), axis=0)) == len(places)
    np.testing.assert_array_equal(places[:len(x)], x)
    np.testing.assert_allclose(area.sum(axis=0), normal_areas(x, elements).sum(axis=0), atol=1e-14)
    assert (area @ normal_areas(x, elements)[0] > 0).all()


def test_a_surface_ends_where_an_edge_has_one_element():
    """Of a patch whose triangles have their own particles."""
    patch = Interface.patch((0, 0, 0), (2, 0, 0), (0, 1, 0), (2, 2))
    x = np.asarray(patch.x)[np.asarray(patch.elements)].reshape(-1, 3)
    elements = np.arange(len(x)).reshape(-1, 3)
    rim = find_rim(x, elements, 0.1)
    middle = (x == [1.0, 0.5, 0.0]).all(axis=1).reshape(-1, 3)
    assert rim[~middle, 0].all() and not rim[middle, 0].any() and rim[..., 1].sum() == 8


def hill(motion=None):
    """7,200 triangles over 6 m x 6 m, with a rim."""
    ground = Terrain.function(lambda x, y: 0.3 * np.sin(x) * np.cos(y), Box((0.0, 0.0), (6.0, 6.0)), 0.1)
    return find_surfaces([ground.structure(motion=motion)], None)


@pytest.mark.parametrize("at", [(3.0, 3.0), (0.1, 5.9)])
@pytest.mark.parametrize("motion", [None, lambda t: (0.5 * t, 0.0, 0.1 * t)], ids=["rests", "moves"])
def test_what_is_there_of_a_wall_follows_the_points(at, motion):
    """Of all of it elements near them, with its rim, which ends elsewhere than the elements do."""
    h, (whole,) = 0.05, hill(motion)
    x = np.column_stack([np.array(at) + np.linspace(-0.2, 0.2, 5)[:, None], np.full(5, 0.2)])
    walls = WallSurfaces([whole], h, 2.0 * h, Box((-1.0,) * 3, (8.0,) * 3), [x])
    number, corners = walls.number, whole.x[whole.elements]
    assert 100 < len(number) < 0.12 * len(corners) and (np.diff(number) > 0).all()
    near = (abs(corners[..., :2] - np.array(at)) < 0.4).all(axis=(1, 2))
    assert np.isin(np.flatnonzero(near), number).all()
    np.testing.assert_array_equal(walls.walls.rim, find_rim(whole.x, whole.elements, h)[number])
    assert walls.walls.rim.any() == (at == (0.1, 5.9)) and (walls.walls.normal[:, 2] > 0.9).all()
    everywhere = np.arange(len(corners))
    np.testing.assert_array_equal(number[walls.among(number)], number)
    assert (walls.among(np.setdiff1d(everywhere, number)) == -1).all() and walls.among(np.array([-1])) == -1
    assert not walls.follow([x + 0.3]) and walls.follow([x - (0.0, 1.0, 0.0)])
    assert not np.array_equal(walls.number, number)
    walls.place(2.0)
    way = np.array(motion(2.0) if motion else (0.0, 0.0, 0.0))
    np.testing.assert_allclose(walls.walls.corners, corners[walls.number] + way, rtol=0, atol=1e-14)


def test_a_rank_without_points_has_one_element():
    (whole,) = hill()
    walls = WallSurfaces([whole], 0.05, 0.1, Box((-1.0,) * 3, (8.0,) * 3), [np.zeros((0, 3))])
    assert len(walls.number) < 1000 and not walls.follow([np.zeros((0, 3))])
    assert walls.follow([np.full((1, 3), 4.0)])


def by_hand(x, corners, far):
    """Distance of each place to the nearest of the elements, inf beyond ``far``."""
    D = x.shape[1]
    weight, work = np.empty(D), np.empty((3, D))
    square = np.full(len(x), np.inf)
    for p, place in enumerate(x):
        for corner in corners:
            closest(place, corner, D, weight, work)
            square[p] = min(square[p], ((place - weight @ corner) ** 2).sum())
    return np.where(square <= far * far, np.sqrt(square), np.inf)


@pytest.mark.parametrize("dim, count", [(2, 1), (2, 37), (3, 4), (3, 5), (3, 200)])
def test_the_nearest_element_is_found(dim, count):
    """Of elements small and large, also after all have gone on by some way."""
    random = np.random.default_rng(count)
    size = np.where(random.random(count) < 0.1, 1.0, 0.05)[:, None, None]
    corners = random.random((count, 1, dim)) + size * random.random((count, dim, dim))
    x, far, way = 2.0 * random.random((60, dim)) - 0.5, 0.4, np.arange(1.0, dim + 1.0)
    tree = make_tree(corners.min(axis=1), corners.max(axis=1))
    assert sorted(tree.order) == list(range(count)) and (tree.lower[1] == corners.min(axis=(0, 1))).all()
    find, weight, room = specialise(nearest, D=dim), np.empty(dim), make_room(dim)
    wanted = by_hand(x, corners, far)
    assert 0 < np.isfinite(wanted).sum() < 60
    for shift in (np.zeros(dim), way):
        elements = WallElements(corners + shift, np.ones((count, dim)), np.zeros(count, int),
                                np.zeros((count, dim, 2), bool))
        for p in range(len(x)):
            e, square, _, _ = find(p, x + shift, tree._replace(shift=shift), elements, far, weight, room)
            assert (e < 0) == np.isinf(wanted[p])
            assert e < 0 or np.sqrt(square) == pytest.approx(wanted[p], rel=1e-9, abs=1e-12)


def thrown(walls, velocity=(3.0, 0.0), stiffness=None):
    """Soil thrown at what is at x = 0.5 m."""
    body = Body(Box((0.1, 0.1), (0.4, 0.3)), (6, 4), 2, SOIL, 1000.0, velocity=velocity)
    return MPM(Grid(Box((-0.4, -0.3), (1.4, 0.7)), (18, 10)), body, inertia="lumped", penalties=walls)


def line(cells, **others):
    """A wall of segments of that many cells along x = 0.53 m."""
    return Penalty(Interface.line((0.53, -0.28), (0.53, 0.68), round(9.6 / cells)), (-1, 0), separates=True,
                   name="wall", **others)


@pytest.mark.parametrize("wall", ["nodes", 1.5, 2.0, 9.6])
def test_nothing_passes(wall):
    """Thrown back twice by a wall of nodes or of segments of many cells; at 2 cells 21 % passed."""
    walls = [GridWall(lambda x: abs(x[:, 0] - 0.5) < 1e-9, "-x",
                      separates=True)] if wall == "nodes" else [line(wall)]
    solid = thrown(walls)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for _ in range(60):
            solid.advance(2.5e-3)
    x = solid.points.x[:, 0]
    assert x.max() < 0.55 and (solid.points.side[x > 0.45]
                               == FRONT).all() and sum(solid.behind().values()) == 0


def test_what_goes_through_is_counted_and_named_once():
    """Soil that a soft wall gives way to by a cell: all that is more than half a cell behind."""
    solid = thrown([line(1.0, stiffness=1e3)])
    assert set(solid.points.side) == {0, FRONT}
    with pytest.warns(UserWarning,
                      match=r"\d+ material points? ha\w+ gone through wall, more than 0.5 cells deep, at t = "
                      r"0.0\d+ s: take a smaller dt") as told:
        for _ in range(60):
            solid.advance(2.5e-3)
    behind = np.count_nonzero(solid.points.x[:, 0] > 0.58)
    assert len(told) == 1 and 0 < behind == solid.behind()["wall"] == solid.columns()["behind"][2]()
    assert set(solid.points.side) <= {BEHIND, 0, FRONT, THROUGH}


@pytest.mark.parametrize("wall", ["nodes", "line"])
def test_a_mirror_image_gives_the_mirror_image(wall, options):
    """Soil that comes to the wall from the left and from the right: to round-off, as Newton's method goes.
    Nodes of the wall in cells that no point has come to yet are held on both sides."""
    options(snes_rtol=1e-12)
    ends = []
    for sign in (-1.0, 1.0):
        if wall == "nodes":
            held = GridWall(lambda x: abs(x[:, 0]) < 1e-9, "+x" if sign > 0 else "-x", 0.3, True)
        else:
            held = Penalty(Interface.line((-0.025 * sign, -0.4), (-0.025 * sign, 0.4), 16), (sign, 0), 0.3,
                           True)
        box = Box((0.1, -0.1), (0.4, 0.1)) if sign > 0 else Box((-0.4, -0.1), (-0.1, 0.1))
        body = Body(box, (6, 4), 2, SOIL, 1000.0, velocity=np.array([-3.0 * sign, 0.4]))
        solid = MPM(Grid(Box((-0.6, -0.6), (0.6, 0.6)), (12, 12)), body, inertia="lumped", penalties=[held])
        for _ in range(40):
            solid.advance(2.5e-3)
        ends.append(solid.points.x * [sign, 1.0])
    one, other = (x[np.lexsort(x.round(7).T)] for x in ends)
    np.testing.assert_allclose(one, other, rtol=0, atol=1e-12)


RANKS = """
import sys
import test_walls
from tests.mpm.travelling import travel

floor = test_walls.GridWall(lambda x: abs(x[:, 1]) < 1e-9, "+y", 0.3, True, name="floor")
travel(sys.argv[1], lambda: test_walls.thrown([test_walls.line(2.0, friction=0.3), floor], (3.0, -1.0)), 30,
       look=lambda solid: sum(solid.behind().values()))
"""


@pytest.mark.mpi
def test_ranks_and_new_partitions_change_nothing_at_walls(tmp_path, on_ranks):
    one, two = on_one_and_more(on_ranks, tmp_path, RANKS, 2)
    assert one["looks"][-1] == two["looks"][-1] == 0


@pytest.mark.parametrize("lower", [0.0, 0.1, -0.3])
def test_boundary_particles_may_lie_on_the_edge_of_the_grid(lower):
    """On three of its sides, where rounding puts them a last digit out."""
    grid = Grid(Box((lower, lower), (lower + 1.1, lower + 0.9)), (11, 9))
    body = Body(Box((lower, lower), (lower + 1.1, lower + 0.5)), (11, 5), 2, LAWS["linear"](1e6, 0.3), 1000.0)
    x = np.array([[lower, lower + 0.3], [lower + 1.1, lower + 0.3], [lower + 0.5, lower]])
    solid = MPM(grid, body, interface=Interface(x, np.zeros((0, 2), int)))
    np.testing.assert_allclose(solid.advance(1e-4)[0], x, rtol=0, atol=1e-12)


@pytest.mark.parametrize("cell", ["quadrilateral", "triangle"])
def test_a_floor_that_gives_may_lie_on_the_edge_of_the_grid(cell):
    """Soil sinks into the springs of its floor, on any ranks and with any number of cells beside it; the same
    with a layer of cells below. What misses the floor by more has left the grid."""
    x, deepest = [], []
    for below in (0, 1):
        grid = Grid(Box((0.0, -0.1 * below), (0.8, 0.4)), (8, 4 + below), cell)
        soil = Body(Box((0.0, 0.0), (0.3, 0.3)), (6, 6), 4 if cell == "quadrilateral" else 12,
                    mohr_coulomb(1e5, 0.3, 30.0, 0.0, 0.0), 1500.0, cell=cell)
        floor = GridWall(lambda x: abs(x[:, 1]) < 1e-9, "+y", friction=0.4, stiffness=6e5)
        solid = MPM(grid, soil, [Support(lambda x: x[:, 0] < 1e-9, "x")], penalties=[floor],
                    gravity=(0, -9.81), inertia="lumped")
        lowest = [solid.advance(2e-3) and solid.points.x[:, 1].min() for _ in range(100)]
        x.append(solid.points.x.copy())
        deepest.append(min(lowest))
    assert -0.01 < deepest[0] < -1e-3  # a tenth of a cell at most
    assert abs(x[0] - x[1]).max() < 0.02 and abs(x[0] - x[1]).mean() < 1e-3
