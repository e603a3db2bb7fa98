"""Material that leaves the grid: it stops the run, is held at the edge or removed, and nothing is lost in the
books."""

import numpy as np
import pytest

from mpm_fenicsx import MPM, Balls, Body, Box, Cloud, Grid, Interface, Mesh, MPMError, linear, of_points
from mpm_fenicsx.scene.lattice import lattice

LAW, BOX, DT = linear(1e3, 0.3), Box((-1.0, -1.0), (3.0, 2.0)), 0.02
DROP = Cloud(np.array([[2.2, 0.3], [2.3, 0.3], [2.2, 0.4]]), np.full(3, 0.01))
RESTING = Body(Box((0.0, 0.0), (1.0, 1.0)), (4, 4), 2, LAW, 1.0)


def u_shaped():
    """A mesh with a gap between its arms, into which a drop flies."""
    vertices, cells = lattice(BOX, (16, 12), "quadrilateral")
    middle = vertices[cells].mean(axis=1)
    return Mesh(vertices, cells[~((middle[:, 0] > 1.4) & (middle[:, 0] < 1.9) & (middle[:, 1] > 0.0))],
                "quadrilateral")


def splash(outflow, velocity=(8.0, 1.0), grid=None, gravity=None, **more):
    drop = Body(DROP, None, None, LAW, 2.0, velocity=velocity)
    return MPM(grid or Grid(BOX, (16, 12)), [RESTING, drop], gravity=gravity, outflow=outflow, **more)


def books(solid):
    """Count, mass, momentum and energy of what is there and of what has left."""
    left, mass = solid.removed, sum(part.points.mass.sum() for part in solid.bodies)
    return np.array([solid.count + left["count"], mass + left["mass"],
                     sum(solid.energy().values()) + left["energy"], *(solid.momentum() + left["momentum"])])


@pytest.mark.parametrize("grid", [None, u_shaped()], ids=["grid", "mesh"])
@pytest.mark.parametrize("way", ["remove", "hold"])
def test_what_is_there_and_what_has_left_is_what_was_there(way, grid):
    """A drop leaves to the right, with gravity along it; in free flight energy and momentum are known."""
    solid = splash(way, grid=grid, gravity=(1.5, 0.0))
    start, steps = books(solid), 10
    for _ in range(steps):
        solid.advance(DT)
    left, now = solid.removed, books(solid)
    assert left["count"] == 3 and solid.count == 64 and left["mass"] == pytest.approx(0.06, rel=1e-14)
    assert left["momentum"][1] == pytest.approx(0.06, rel=1e-9)
    np.testing.assert_allclose(now[[0, 1, 4]], start[[0, 1, 4]], rtol=1e-12)
    # energy: gravity only moves it from one kind to another
    assert now[2] == pytest.approx(start[2], rel=1e-9)
    assert len(solid.bodies[1].points) == 0 and "points" in solid.snapshot()
    held = solid.held()[1]
    if way == "hold":
        np.testing.assert_allclose(held.x[:, 0], 3.0)
        assert not held.v.any() and len(solid.snapshot()["held1"][0]) == 3
    assert len(held) == (3 if way == "hold" else 0)
    solid.close()


def test_sides_that_are_not_named_stop():
    solid = splash({"+x": "remove"})
    for _ in range(10):
        solid.advance(DT)
    assert solid.removed["count"] == 3
    solid.close()
    for grid, velocity in ((None, (0.0, 10.0)), (u_shaped(), (-8.0, 0.0))):
        solid = splash({"+x": "remove", "-y": "hold"}, velocity, grid)
        with pytest.raises(MPMError,
                           match=r"material point 6\d left the grid at x = \[.*\] m, t = 0\.\d+ s: enlarge"):
            for _ in range(12):
                solid.advance(DT)
        assert solid.removed["count"] == 0
        solid.close()


def test_points_that_are_no_numbers_stop():
    solid = splash("remove")
    solid.advance(DT)
    solid.bodies[1].points.x[1] = np.nan
    with pytest.raises(MPMError, match="left the grid at x = .nan"):
        solid.advance(DT)
    solid.close()


@pytest.mark.parametrize("grid", [None, u_shaped()], ids=["grid", "mesh"])
def test_an_interface_of_the_points_stays_at_the_edge(grid):
    """Its particles keep their numbers; those without material rest, and a load on them reaches nobody."""
    drop = Body(DROP, None, None, LAW, 2.0, velocity=(8.0, 1.0))
    solid = splash("remove", grid=grid, interface=of_points(drop))
    for _ in range(8):
        x, v = solid.advance(DT, np.full((3, 2), 0.1))
    at_the_edge = x.copy()
    x, v = solid.advance(DT, np.full((3, 2), 0.1))
    np.testing.assert_array_equal(x, at_the_edge)
    np.testing.assert_allclose(x[:, 0], 3.0, atol=1e-9)
    assert solid.removed["count"] == 3 and not v.any() and not solid.applied.any()
    solid.close()


def test_a_state_has_what_has_left():
    solid = splash("hold", interface=Interface(np.array([[0.5, 0.5]]), np.zeros((0, 2), int)))
    for _ in range(3):
        solid.advance(DT)
    before = solid.get_state()
    for _ in range(6):
        solid.advance(DT)
    end, left, held = solid.get_state(), solid.removed, solid.held()[1].x.copy()
    solid.set_state(before)
    assert solid.removed["count"] == 0 and not len(solid.held()[1])
    for _ in range(6):
        solid.advance(DT)
    assert str(solid.removed) == str(left) and left["count"] == 3
    np.testing.assert_array_equal(solid.held()[1].x, held)
    for name in end.keys() - {"tangent"}:
        assert end[name].tobytes() == solid.get_state()[name].tobytes(), name
    solid.close()


def test_when_nothing_is_left_the_run_ends():
    solid = MPM(Grid(BOX, (16, 12)), Body(DROP, None, None, LAW, 2.0, velocity=(30.0, 0.0)), outflow="remove")
    with pytest.raises(MPMError, match=r"all 3 material points have left the grid at t = 0.04 s: enlarge it, "
                       r"or end"):
        for _ in range(5):
            solid.advance(DT)
    assert solid.count == 0
    solid.close()


@pytest.mark.parametrize("outflow, words", [
    ("gone", "outflow is 'gone': choose one of stop, hold, remove"),
    ({"x": "hold"}, "outflow has a side 'x': choose from -x, [+]x, -y, [+]y"),
    ({"+z": "hold"}, "outflow has a side '[+]z'"),
    ({"-y": None}, "outflow is None at -y: choose one of stop")])
def test_what_is_no_way_out_is_refused(outflow, words):
    with pytest.raises(ValueError, match=words):
        splash(outflow)


RANKS = """
import numpy as np
from mpi4py import MPI
from test_outflow import *
for way, grid in (("remove", None), ("hold", u_shaped())):
    drop = Body(DROP, None, None, LAW, 2.0, velocity=(8.0, 1.0))
    solid = splash(way, grid=grid, interface=of_points(drop))
    solid.rebalance_every = 3
    total = lambda: np.array([sum(part.points.mass.sum() for part in solid.bodies), len(solid.held()[1])])
    for _ in range(10):
        solid.advance(DT, np.full((3, 2), 0.1))
    mass, held = MPI.COMM_WORLD.allreduce(total())
    left, x = solid.removed, solid.surface()[0]
    same = MPI.COMM_WORLD.allgather(str(left))
    assert left["count"] == 3 and abs(left["mass"] + mass - 1.06) < 1e-12 and len(set(same)) == 1, left
    assert held == (3 if way == "hold" else 0) and np.abs(x[:, 0] - 3.0).max() < 1e-9
    assert np.abs(left["momentum"] - np.array([0.48, 0.06])).max() < 0.05
    solid.close()
print("fine", MPI.COMM_WORLD.rank)
"""


@pytest.mark.mpi
def test_books_are_the_same_on_every_rank(on_ranks):
    done = on_ranks(2, RANKS)
    assert done.returncode == 0 and done.stdout.count("fine") == 2, done.stdout + done.stderr


def test_balls_that_have_left_take_part_no_more():
    """They have no mass for a window, and the next choice is without them."""
    body = Body(Box((0.5, 0.0), (1.0, 0.5)), (2, 2), 1, linear(1e5, 0.3), 1000.0, velocity=(3.0, 0.0))
    solid = MPM(Grid(Box((0.0, 0.0), (1.5, 0.5)), (6, 2)), body, interface=Balls(0.02), outflow="remove")
    near = np.zeros(1, [("x", float, 3), ("v", float, 3), ("radius", float)])
    near["x"], near["radius"] = [(1.0, 0.25, 0.0)], 1.0
    assert len(solid.select(near, 0.01).x) == 4
    for _ in range(25):
        solid.advance(0.01, np.zeros((4, 2)))
    assert len(solid.points) == 2 and np.isinf(solid.window_mass()).sum() == 2
    assert len(solid.select(near, 0.01).x) == 2
    solid.close()
