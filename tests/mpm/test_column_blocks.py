"""Large grids of columns on a terrain, of which only blocks near the points are made: the same motion as on a
whole one."""
import numpy as np
import pytest
from mpi4py import MPI

from mpm_fenicsx import MPM, Body, Box, Inflow, Terrain, linear, neo_hooke
from mpm_fenicsx.grid import blocks
from mpm_fenicsx.grid.column_blocks import ColumnBlocks
from mpm_fenicsx.output.snapshots import snapshot
from mpm_fenicsx.scene import column_grid

H, DT, SMALL = 0.1, 0.05, 6  # SMALL: cells of a block, and around points


def divide_all(monkeypatch):
    """Every grid of columns is a large one, and small bodies leave its blocks soon."""
    monkeypatch.setattr(column_grid, "LARGE_COLUMNS", 0)
    for sizes in (blocks.SIDE, blocks.AHEAD):
        for dim in (2, 3):
            monkeypatch.setitem(sizes, dim, SMALL)


@pytest.fixture
def in_blocks(monkeypatch):
    """See ``divide_all``."""
    divide_all(monkeypatch)


def rough(dim):
    """Level where the body starts, then a slope with bumps, in space twisted as well."""
    if dim == 2:
        return Terrain.function(lambda x: np.where(x < 1.5, 0.0, 0.05 * np.sin(3.0 * x) - 0.2 * (x - 1.5)),
                                (0.0, 8.0), cell=H)
    return Terrain.function(lambda x, y: np.where(x < 1.5, 0.0, 0.2 * (x - 1.5) * (y - 0.7)),
                            Box((0.0, 0.0), (6.0, 1.0)), cell=H)


def thrown(dim=2, **more):
    """A soft block that flies some blocks of cells over a terrain, and touches down on it."""
    ground, shape = rough(dim), Box((0.3, 0.3, 0.25)[3 - dim:], (0.7, 0.7, 0.55)[3 - dim:])
    body = Body(shape, (4, 4, 3)[3 - dim:], 2, neo_hooke(2e3, 0.3), 1000.0, f_bar=True,
                velocity=(6.0, 0.0, 0.5)[:1] + (0.0, 0.5)[3 - dim:])
    return MPM(ground.grid(H, above=1.5), body, gravity=(0.0,) * (dim - 1) + (-9.81,), inertia="lumped",
               structures=[ground.structure(friction=0.2)], outflow="remove", **more)


def motion(solid, steps):
    """Places and velocities of all points, in the order of their numbers, the force of the ground, and blocks
    met, after so many ``steps``."""
    met = set()
    for _ in range(steps):
        solid.advance(DT)
        met.add(solid.background.checksum)
    p = solid.points
    order = np.argsort(p.gid)
    return np.concatenate([p.x[order], p.v[order]], axis=1), solid.reaction("terrain"), met


@pytest.mark.parametrize("dim", [2, 3])
def test_cells_of_blocks_are_those_of_the_whole(in_blocks, dim):
    """To the bit, each once, and all that points may need."""
    ground = rough(dim)
    where = None if dim == 2 else [(0.1, 0.2), (5.8, 0.1), (5.0, 0.9)]
    grid = ground.grid(H, above=lambda p: 0.4 + 0.2 * p[:, 0], where=where)
    x = np.column_stack([np.linspace(2.9, 3.3, 30), *np.full((dim - 2, 30), 0.5)])
    x = np.column_stack([x, ground.height(x) + np.linspace(0.0, 0.3, 30)])
    near = ColumnBlocks.around(grid, [x], MPI.COMM_SELF)
    vertices, cells = near.mesh()
    assert near.hold(x) and near.count == len(cells) < 0.5 * grid.count
    rows = lambda v, c: np.unique(v[c].reshape(len(c), -1), axis=0)  # noqa: E731
    some, whole = rows(vertices, cells), rows(grid.vertices, grid.cells)
    both = np.unique(np.concatenate([some, whole]), axis=0)
    assert len(some) == len(cells) and len(both) == len(whole) == grid.count
    middle = grid.vertices[grid.cells].mean(axis=1)
    count = np.count_nonzero((abs(middle[:, None] - x) < blocks.NEEDED * H).all(axis=2).any(axis=1))
    middle = vertices[cells].mean(axis=1)
    assert count == np.count_nonzero((abs(middle[:, None] - x) < blocks.NEEDED * H).all(axis=2).any(axis=1))


def test_what_is_told_of_all_cells_needs_none(in_blocks):
    for dim in (2, 3):
        grid = rough(dim).grid(H, above=0.4)
        told = grid.count, grid.box, grid.cell_size, grid.affine
        assert not {"vertices", "cells"} & set(vars(grid))
        corners = grid.vertices[grid.cells]
        ends = tuple(grid.vertices.min(axis=0)), tuple(grid.vertices.max(axis=0))
        assert told[0] == len(grid.cells) and (told[1].lower, told[1].upper) == ends
        height = corners[:, corners.shape[1] // 2, -1] - corners[:, 0, -1]
        sizes = np.column_stack([np.ptp(corners[:, :, :-1], axis=1), height])
        np.testing.assert_allclose(sizes, np.broadcast_to(told[2], sizes.shape), rtol=1e-12)
        assert told[3] == (dim == 2)  # in space it is twisted


@pytest.mark.parametrize("dim", [2, 3])
def test_motion_is_that_on_a_whole_grid(monkeypatch, dim):
    """Also where it comes from cells that are parallelepipeds to others."""
    steps = 14
    whole, force, met = motion(thrown(dim), steps)
    assert len(met) == 1 and force[-1] != 0.0
    divide_all(monkeypatch)
    solid = thrown(dim)
    there, found, met = motion(solid, steps)
    assert len(met) > 1 and len(solid.background.owner) < 0.6 * solid.grid.count
    np.testing.assert_allclose(there, whole, rtol=0, atol=1e-8)
    np.testing.assert_allclose(found, force, rtol=0, atol=1e-6 * abs(force).max())
    x, cells, fields = snapshot(solid)["grid"]
    assert len(*cells.values()) == len(solid.background.owner)
    assert fields["mass"].sum() == pytest.approx(solid.points.mass.sum(), rel=1e-12)


@pytest.mark.parametrize("dim", [2, 3])
def test_what_comes_in_late_has_its_cells(monkeypatch, dim):
    """The block has left the blocks of the inlet when the first material comes there."""
    late = [0.0, 0.45, 0.46, 0.7], [0.0, 0.0, 0.05, 0.05]
    inlet = Inflow("the brook", at=(0.5, 0.5, 0.0)[:dim - 1] + (0.0,), normal="+x",
                   up="+" + "xyz"[dim - 1], depth=late, speed=0.4, width=0.2 if dim == 3 else None)
    found = []
    for change in (lambda patch: None, divide_all):
        change(monkeypatch)
        solid = thrown(dim, openings=[inlet])
        found.append((motion(solid, 14), solid.entered["mass"]))
    (whole, _, _), mass = found[0]
    (there, _, met), again = found[1]
    assert len(met) > 1 and again == pytest.approx(mass, rel=1e-12) and mass > 0.0
    np.testing.assert_allclose(there, whole, rtol=0, atol=1e-8)


def test_a_file_goes_on_bit_for_bit(in_blocks, tmp_path):
    solid = thrown()
    motion(solid, 9)
    solid.save(tmp_path / "state.h5")
    once, _, met = motion(solid, 4)
    other = thrown()
    assert other.background.checksum not in met
    other.load(tmp_path / "state.h5")
    np.testing.assert_array_equal(motion(other, 4)[0], once)


def test_a_million_columns():
    """Of whose eleven million cells those around a small body in the middle are made."""
    ground = Terrain.function(lambda x, y: 0.1 * x + 0.2 * y, Box((0.0, 0.0), (1000.0, 1000.0)), cell=500.0)
    body = Body(Box((500.0, 500.0, 152.0), (504.0, 502.0, 154.0)), (4, 2, 2), 1, linear(1e5, 0.3), 1000.0)
    grid = ground.grid(1.0, above=10.0)
    solid = MPM(grid, body, gravity=(0.0, 0.0, -9.81), outflow="remove")
    solid.advance(1e-3)
    assert grid.count == 11e6 and len(solid.background.owner) <= 18 * 512
    assert not {"vertices", "cells"} & set(vars(grid))  # nobody has asked for them
    assert solid.points.v[:, 2] == pytest.approx(-9.81e-3, rel=1e-9)


def test_a_body_beyond_all_columns_is_told(in_blocks):
    ground = rough(3)
    body = Body(Box((5.0, 0.2, 0.3), (5.3, 0.4, 0.5)), (3, 2, 2), 1, linear(1e5, 0.3), 1000.0)
    grid = ground.grid(H, above=1.0, where=lambda p: (p[:, 0] < 1.0) | (p[:, 0] > 5.9))
    with pytest.raises(ValueError, match="outside the grid"):
        MPM(grid, body)


RANKS = """
import sys

import numpy as np
import pytest
from mpi4py import MPI
from test_column_blocks import divide_all, motion, thrown

patch = pytest.MonkeyPatch()
divide_all(patch)
solid = thrown(3)
many = MPI.COMM_WORLD.allreduce(len(solid.points), MPI.MIN)
_, force, met = motion(solid, 12)
p = solid.points
parts = MPI.COMM_WORLD.gather((p.gid, p.x, p.v))
if parts:
    gid, x, v = map(np.concatenate, zip(*parts))
    order = np.argsort(gid)
    np.savez(sys.argv[1], x=x[order], v=v[order], force=force, met=len(met), many=many)
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
        np.testing.assert_allclose(two[name], one[name], rtol=0, atol=1e-8)
