"""Rigid structures: their shapes, and soil that meets them anywhere in the grid."""
import numpy as np
import pytest

from mpm_fenicsx import LAWS, MPM, Body, Box, Grid, Structure
from mpm_fenicsx.scene.facets import normal_areas

SAND = LAWS["mohr_coulomb"](1e6, 0.3, 30.0, 0.0, 0.0)
G = 9.81


def volume(one):
    """By the divergence theorem [m^3; m^2 in the plane]."""
    middle = one.x[one.elements].mean(axis=1)
    return np.sum(normal_areas(one.x, one.elements) * middle) / one.dim


BOXES = Box((1.0, 2.0), (1.5, 4.0)), Box((1.0, 2.0, 3.0), (1.5, 4.0, 3.2))


@pytest.mark.parametrize("box, counts", [(BOXES[0], (1, 1)), (BOXES[0], (2, 3)), (BOXES[1], (1, 1, 1)),
                                         (BOXES[1], (2, 1, 3)), (BOXES[1], (3, 3, 3))],
                         ids=["plane", "plane cut", "space", "space cut", "with a cell inside"])
def test_a_box_is_closed_and_cut_into_cells(box, counts):
    one = Structure.box("wall", box, counts)
    assert one.closed and volume(one) == pytest.approx(np.prod(box.size))
    n = int(np.prod(counts)) - (counts == (3, 3, 3))
    assert one.cells == (("wall",) if n == 1 else tuple(f"wall_{k + 1}" for k in range(n)))
    assert one.width == pytest.approx(min(box.size))
    first = one.x[one.elements[one.cell == 0]].reshape(-1, one.dim)
    assert first.max(axis=0) == pytest.approx(np.array(box.lower) + box.size / counts)


def test_round_shapes_have_the_volume_of_the_circle():
    pile = Structure.cylinder("pile", (1.0, 0.0, 0.0), (1.0, 2.0, 1.0), 0.3, sides=7)
    assert pile.closed and volume(pile) == pytest.approx(np.pi * 0.09 * np.sqrt(5.0))
    assert volume(Structure.circle("pile", (5.0, 1.0), 0.3)) == pytest.approx(np.pi * 0.09)


@pytest.mark.parametrize("normal", ["+y", (1.0, 2.0, 0.0), (1.0, 1.0, 1.0)])
def test_a_plane_is_cut_by_the_box(normal):
    one = Structure.plane("bed", (0.2, 0.1, 0.3), normal, Box((0.0, 0.0, 0.0), (1.0, 1.0, 1.0)))
    n = np.array([0.0, 1.0, 0.0] if isinstance(normal, str) else normal) / np.linalg.norm(
        [1.0] if isinstance(normal, str) else normal)
    assert not one.closed and abs((one.x - (0.2, 0.1, 0.3)) @ n).max() < 1e-12
    areas = normal_areas(one.x, one.elements)
    assert areas @ n == pytest.approx(np.linalg.norm(areas, axis=1))
    assert (abs(one.x - 0.5) < 0.5 + 1e-9).all()


def test_a_surface_inside_out_is_turned():
    one = Structure.box("wall", BOXES[1])
    assert volume(Structure("wall", one.x, one.elements[:, ::-1])) == pytest.approx(volume(one))


@pytest.mark.parametrize("make, sentence", [
    (lambda: Structure("a wall", BOXES[0].lower, [(0, 1)]), "name of a structure is 'a wall'"),
    (lambda: Structure("w", [(0.0, 0.0), (1.0, 0.0)], np.zeros((0, 2))), "w has no elements"),
    (lambda: Structure("w", [(0.0, 0.0), (0.0, 0.0)], [(0, 1)]), "w has elements without extent"),
    (lambda: Structure("w", [(0.0, 0.0), (1.0, 0.0)], [(0, 1)], friction=-1.0), "friction of w is -1.0"),
    (lambda: Structure("w", [(0.0, 0.0), (1.0, 0.0)], [(0, 1)], cell=[1]), "number them from 0 on"),
    (lambda: Structure("w", [(0.0, 0.0), (1.0, 0.0)], [(0, 1)], cell=[0.5]), "number them from 0 on"),
    (lambda: Structure("w", [(0.0, 0.0), (1.0, 0.0)], [(0, 1)], friction=True), "friction of w is True"),
    (lambda: Structure("w", [(0.0, 0.0), (1.0, 0.0)], [(0, 1)], xi=0.0), "xi of w is 0.0: it must be pos"),
    (lambda: Structure("w", [(0.0, 0.0), (1.0, 0.0)], [(0, 1)], xi=[-1.0]), "xi of w is -1.0"),
    (lambda: Structure.box("w", BOXES[0], (1, 0)), "force cells of w .* 0"),
    (lambda: Structure.box("w", BOXES[0], (10**9, 10**9)), "give at most 10000 in all"),
    (lambda: Structure.box("w", BOXES[0]).turning(1.0, (0, 0), (0, 0, 1)), "give none in a plane scene"),
    (lambda: Structure.plane("w", (9.0, 9.0), "+x", BOXES[0]), "misses the box"),
    (lambda: Structure.cylinder("w", (0, 0, 0), (0, 0, 0), 1.0), "starts and ends at"),
    (lambda: Structure.read("w", "no.stl"), "no.stl"),
])
def test_bad_input_is_one_sentence(make, sentence):
    with pytest.raises(ValueError, match=sentence):
        make()


def chute(dim, basis="linear", t_end=0.3):
    """Soil slides down a bed off the grid's nodes onto a wall that it partly passes by; momentum closes."""
    side = () if dim == 2 else ((0.0, 0.05),)
    lower, upper = ((0.0, 0.01), (0.15, 0.11)) if dim == 2 else ((0.0, 0.01, 0.0), (0.15, 0.11, 0.05))
    box = Box((-0.3, -0.05, -0.1)[:dim], (1.0, 0.4, 0.2)[:dim])
    front = Box((0.203, 0.0, 0.012)[:dim], (0.273, 0.063, 0.05)[:dim])
    bed = Structure.plane("bed", (0.0, 0.01, 0.0)[:dim], "+y", box, friction=0.3)
    wall = Structure.box("wall", front, cells=(1, 2, 1)[:dim], friction=0.3)
    body = Body(Box(lower, upper), Grid.counts(np.subtract(upper, lower), 0.025), 2, SAND, 1500.0, f_bar=True)
    grid = Grid(Box((-0.1, -0.05, -0.1)[:dim], (0.5, 0.25, 0.15)[:dim]), (24, 12, 10)[:dim])
    solid = MPM(grid, body, structures=[bed, wall], gravity=(7.0, -7.0, 0.0)[:dim], inertia="lumped",
                outflow="remove", basis=basis)
    assert len(side) == dim - 2
    hit = 0.0
    while solid.time < t_end:
        solid.advance(2e-3)
        found = [solid.reaction(name) for name in ("wall", "wall_1", "wall_2")]
        assert found[0] == pytest.approx(found[1] + found[2], abs=1e-9 * max(1.0, abs(found[0]).max()))
        hit = min(hit, found[0][0])
        inside = ((solid.points.x > np.add(front.lower, 0.005)) & (solid.points.x < np.subtract(
            front.upper, 0.005))).all(axis=1)
        assert not inside.any()
    return solid, hit


@pytest.mark.parametrize("dim, basis", [(2, "linear"), (2, "ugimp"), (3, "linear")])
def test_soil_strikes_a_box_off_the_nodes(dim, basis):
    solid, hit = chute(dim, basis, 0.3 if dim == 2 else 0.16)
    assert hit < (-20.0 if dim == 2 else -0.5) and solid.behind() == {"bed": 0, "wall": 0}
    given = solid.impulses()
    assert {"bed", "wall_1", "wall_2", "gravity"} <= set(given)
    assert solid.momentum() == pytest.approx(sum(given.values())[:dim], abs=1e-11 * abs(given["bed"]).max())
    assert given["wall_1"][0] < 0.0
    solid.close()


def test_a_moving_structure_takes_the_soil_along():
    """A plate pushes a block over a smooth floor: it gets the velocity of the plate."""
    box = Box((-1.0, -1.0), (3.0, 1.0))
    floor = Structure.plane("floor", (0.0, 0.003), "+y", box)
    plate = Structure.box("plate", Box((-0.2, -0.1), (0.0, 0.3))).moving((0.5, 0.0))
    block = Body(Box((0.0, 0.003), (0.2, 0.203)), (4, 4), 2, LAWS["linear"](1e6, 0.3), 1000.0)
    solid = MPM(Grid(Box((-0.4, -0.1), (0.8, 0.4)), (24, 10)), block, structures=[floor, plate],
                gravity=(0.0, -G), inertia="lumped")
    for _ in range(200):
        solid.advance(1e-3)
    v = solid.momentum() / 40.0
    assert 0.4 < v[0] < 1.1 and solid.points.x[:, 0].min() > 0.1 - 0.02 and solid.behind()["plate"] == 0
    solid.close()


def test_a_thin_one_is_told_of():
    thin = Structure.box("wall", Box((0.5, 0.0), (0.51, 0.3)))
    block = Body(Box((0.0, 0.0), (0.2, 0.2)), (4, 4), 2, LAWS["linear"](1e6, 0.3), 1000.0)
    with pytest.warns(UserWarning, match="wall is 0.01 m thick, the cells of the grid 0.05 m"):
        MPM(Grid(Box((0.0, 0.0), (1.0, 0.5)), (20, 10)), block, structures=[thin]).close()


@pytest.mark.parametrize("more, sentence", [
    ([Structure.box("a", Box((5.0, 5.0), (6.0, 6.0)))], "a lies outside the grid"),
    ([Structure.box("a", Box((0.5, 0.0), (0.7, 0.3))), Structure.box("a", Box((0.8, 0.0), (0.9, 0.3)))],
     "'a' is the name of two"),
    ([Structure.box("a", BOXES[1])], "a has 3 dimensions, the grid 2"),
    (["a"], "one of the structures is 'a'"),
])
def test_a_scene_refuses(more, sentence):
    block = Body(Box((0.0, 0.0), (0.2, 0.2)), (4, 4), 2, LAWS["linear"](1e6, 0.3), 1000.0)
    with pytest.raises(ValueError, match=sentence):
        MPM(Grid(Box((0.0, 0.0), (1.0, 0.5)), (20, 10)), block, structures=more)
