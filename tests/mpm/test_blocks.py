"""Large grids, of which only blocks near the points are made: the same motion as on a whole one."""
import numpy as np
import pytest
from mpi4py import MPI

from mpm_fenicsx import MPM, Body, Box, Grid, GridWall, Numerics, Structure, Support, linear, neo_hooke
from mpm_fenicsx.grid import blocks
from mpm_fenicsx.grid.background import Background, Choice, whole_mesh
from mpm_fenicsx.scene import bodies

H, DT = 0.1, 0.05


def divide_all(monkeypatch):
    """Every regular grid is a large one, and small bodies leave its blocks soon."""
    monkeypatch.setattr(bodies, "LARGE", 0)
    for sizes in (blocks.SIDE, blocks.AHEAD):
        monkeypatch.setitem(sizes, 2, 8)


@pytest.fixture
def in_blocks(monkeypatch):
    """See ``divide_all``."""
    divide_all(monkeypatch)


def thrown(fields=1, **more):
    """A soft block that flies 90 cells, more than a block of the grid, over a bed that it touches down on."""
    shape = Box((0.5, 0.5), (0.9, 0.8))
    stated = [Body(shape, (4, 3), 2, neo_hooke(2e3, 0.3), 1000.0, velocity=(8.0, 1.0), f_bar=True)]
    if fields == 2:
        stated.append(Body(Box((1.0, 0.5), (1.4, 0.8)), (4, 3), 2, neo_hooke(3e3, 0.3), 1000.0,
                           velocity=(7.5, 1.0)))
    bed = Structure.box("bed", Box((-0.5, -0.5), (13.0, 0.2)), friction=0.2)
    return MPM(Grid(Box((0.0, 0.0), (12.0, 3.0)), (120, 30)), stated, gravity=(0.0, -9.81), inertia="lumped",
               structures=[bed], outflow="remove", **more)


def motion(solid, steps):
    """Places and velocities of all points, in the order of their numbers, and blocks met, after so many
    ``steps``."""
    met = set()
    for _ in range(steps):
        solid.advance(DT)
        met.add(solid.background.checksum)
    parts = [(body.points.x, body.points.v, np.argsort(body.points.gid)) for body in solid.bodies]
    return np.concatenate([np.concatenate([x[order], v[order]], axis=1) for x, v, order in parts]), met


@pytest.mark.parametrize("cell", ["quadrilateral", "triangle", "hexahedron", "tetrahedron"])
def test_cells_of_blocks_are_those_of_the_whole(in_blocks, cell):
    """The same vertices to the bit, and each point in the cell that it is in on the whole grid."""
    counts = (40, 30) if cell in ("quadrilateral", "triangle") else (40, 24, 20)
    D = len(counts)
    grid = Grid(Box((-0.3,) * D, tuple(0.07 * n - 0.3 for n in counts)), counts, cell)
    x = np.random.default_rng(3).uniform(-0.2, 0.2, (40, D))
    near = blocks.Blocks.around(grid, [x], MPI.COMM_SELF)
    some, whole = (Background(grid, MPI.COMM_SELF, x, choice=Choice(blocks=b)) for b in (near, None))
    assert len(some.owner) < 0.5 * len(whole.owner) and near.hold(x)
    found = [b.copies[0][b.copies[1][b.search.assign(x)[1]]] for b in (some, whole)]
    np.testing.assert_array_equal(*found)
    assert not near.hold(np.full((1, D), 0.07 * (min(counts) - 1) - 0.3))


@pytest.mark.parametrize("fields", [1, 2])
def test_motion_is_that_on_a_whole_grid(monkeypatch, fields):
    whole, met = motion(thrown(fields), 16)
    assert len(met) == 1
    divide_all(monkeypatch)
    solid = thrown(fields)
    there, met = motion(solid, 16)
    assert len(met) > 1 and len(solid.background.owner) < fields * 3600
    np.testing.assert_allclose(there, whole, rtol=0, atol=1e-9)


def test_a_state_from_before_the_blocks_changed(in_blocks):
    solid = thrown()
    motion(solid, 4)
    state, before = solid.get_state(), solid.background.checksum
    once, _ = motion(solid, 10)
    assert solid.background.checksum != before
    solid.set_state(state)
    again, _ = motion(solid, 10)
    np.testing.assert_allclose(again, once, rtol=0, atol=1e-9)


def test_a_file_goes_on_bit_for_bit(in_blocks, tmp_path):
    solid = thrown()
    motion(solid, 9)
    solid.save(tmp_path / "state.h5")
    once, met = motion(solid, 5)
    other = thrown()
    assert other.background.checksum not in met
    other.load(tmp_path / "state.h5")
    np.testing.assert_array_equal(motion(other, 5)[0], once)


def test_a_billion_cells():
    """Of which those around a small body in the middle are made."""
    body = Body(Box((5.0, 5.0, 5.0), (5.04, 5.02, 5.02)), (4, 2, 2), 1, linear(1e5, 0.3), 1000.0)
    solid = MPM(Grid(Box((0.0,) * 3, (10.0,) * 3), (1000,) * 3), body, gravity=(0.0, 0.0, -9.81))
    solid.advance(1e-3)
    assert len(solid.background.owner) <= 27 * 512
    assert solid.points.v[:, 2] == pytest.approx(-9.81e-3, rel=1e-9)


@pytest.mark.parametrize("more", [
    dict(numerics=Numerics(basis="gimp")),
    dict(penalties=[GridWall(lambda x: x[:, 2] < 1e-9, "+z", name="floor")])])
def test_what_needs_all_of_a_grid_says_so(more):
    body = Body(Box((5.0, 5.0, 5.0), (5.04, 5.02, 5.02)), (4, 2, 2), 1, linear(1e5, 0.3), 1000.0)
    grid = Grid(Box((0.0,) * 3, (100.0,) * 3), (10000,) * 3)
    with pytest.raises(ValueError, match=r"1e\+12 cells of the grid .* take larger and fewer cells"):
        MPM(grid, body, inertia="lumped", **more)


RANKS = """
import sys

import numpy as np
from mpi4py import MPI

import pytest
from test_blocks import divide_all, motion, thrown

patch = pytest.MonkeyPatch()
divide_all(patch)
solid = thrown()
many = MPI.COMM_WORLD.allreduce(len(solid.bodies[0].points), MPI.MIN)
_, met = motion(solid, 14)
p = solid.bodies[0].points
parts = MPI.COMM_WORLD.gather((p.gid, p.x, p.v))
if parts:
    gid, x, v = map(np.concatenate, zip(*parts))
    order = np.argsort(gid)
    np.savez(sys.argv[1], x=x[order], v=v[order], met=len(met), many=many)
patch.undo()
"""


@pytest.mark.mpi
def test_ranks_give_what_one_gives(on_ranks, tmp_path):
    found = []
    for ranks in (1, 2):
        path = tmp_path / f"{ranks}.npz"
        done = on_ranks(ranks, RANKS, path)
        assert done.returncode == 0, done.stderr[-2000:]
        found.append(np.load(path))
    one, two = found
    assert one["met"] > 1 and two["many"] > 0
    for name in "xv":
        np.testing.assert_allclose(two[name], one[name], rtol=0, atol=1e-9)


def test_supports_and_whole_meshes_as_before():
    """A grid that is not large is made as a whole."""
    grid = Grid(Box((0.0, 0.0), (1.0, 1.0)), (10, 10))
    body = Body(Box((0.0, 0.0), (0.5, 0.5)), (5, 5), 2, linear(1e5, 0.3), 1000.0)
    solid = MPM(grid, body, [Support(lambda x: x[:, 1] < 1e-9, "y")])
    assert solid.background.blocks is None and len(solid.background.owner) == 100
    np.testing.assert_array_equal(solid.background.whole[0], whole_mesh(grid)[0])
