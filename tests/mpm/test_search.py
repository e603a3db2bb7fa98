"""Search for the cells of points, on the lattice and by walking, and the distribution of the cells over
ranks."""
import json

import numpy as np
import pytest
from mpi4py import MPI

from mpm_fenicsx import MPM, Body, Box, Grid, Mesh, MPMError, linear
from mpm_fenicsx.grid.background import Background, whole_mesh
from mpm_fenicsx.grid.distribution import bisect
from mpm_fenicsx.points.points import Points

BOX = Box((0.0, 0.0), (4.0, 2.0))


def shaken(cell="triangle", counts=(20, 10), by=0.25, seed=1):
    """The lattice's cells with inner vertices moved by up to ``by`` of a cell and with shuffled numbers;
    parallelograms are sheared instead."""
    grid = Grid(BOX, counts, cell)
    vertices, cells = whole_mesh(grid)
    rng = np.random.default_rng(seed)
    if cell == "quadrilateral":
        vertices = vertices @ np.array([[1.0, 0.2], [0.3, 1.0]])
    else:
        inner = ((vertices > BOX.lower) & (vertices < BOX.upper)).all(axis=1)
        vertices[inner] += by * BOX.size / counts * rng.uniform(-1, 1, (inner.sum(), 2))
    return Mesh(vertices, cells[rng.permutation(len(cells))], cell)


def inside(background, x, cell):
    """Whether each point lies in its cell, by reference coordinates."""
    corner = background.x[background.cells[cell]]
    edges = np.swapaxes(corner[:, 1:3] - corner[:, :1], 1, 2)
    xi = np.linalg.solve(edges, (x - corner[:, 0])[..., None])[..., 0]
    upper = 1 - xi.sum(axis=1) if background.cells.shape[1] == 3 else 1 - xi.max(axis=1)
    return (xi.min(axis=1) > -1e-10) & (upper > -1e-10)


def points_at(x):
    return Points(gid=np.arange(len(x)), cell=np.zeros(len(x), np.int32), x=x)


def random_points(grid, n=2000):
    """Points in random cells of the grid's mesh, away from its boundary by construction."""
    rng = np.random.default_rng(3)
    vertices, cells = whole_mesh(grid)
    weights = rng.dirichlet(np.ones(cells.shape[1]), n)
    return np.einsum("pk,pkd->pd", weights, vertices[cells[rng.integers(len(cells), size=n)]])


@pytest.mark.parametrize("grid", [Grid(BOX, (20, 10)), Grid(BOX, (20, 10), "triangle"), shaken(),
                                  shaken("quadrilateral")], ids=["lattice", "triangles", "shaken", "sheared"])
def test_every_point_is_found_in_the_cell_that_holds_it(grid):
    background = Background(grid, MPI.COMM_SELF, np.zeros((0, 2)))
    x = random_points(grid)
    points = points_at(x)
    rank, number = background.search.relocate(points)
    assert (rank == 0).all()
    cell = background.search.local(number)
    assert inside(background, x, cell).all()


@pytest.mark.parametrize("cell", ["triangle", "quadrilateral"])
def test_the_walk_follows_points_over_several_cells(cell):
    grid = shaken(cell)
    background = Background(grid, MPI.COMM_SELF, np.zeros((0, 2)))
    points = points_at(random_points(grid))
    points.cell[:] = background.search.local(background.search.relocate(points)[1])
    targets = random_points(grid)[::-1]
    points.x = np.ascontiguousarray(points.x + 0.3 * (targets - points.x))
    row = np.zeros(len(background.cells), np.int32)
    leaving, inactive = background.search.locate(points, row)
    if leaving:  # only points beyond the longest walk may be left to the tree
        number = background.search.destinations(points)[1]
        points.cell[:] = background.search.local(number)
    assert inside(background, points.x, points.cell).all()
    assert not inactive


def test_a_walk_that_meets_a_hole_is_finished_by_the_tree():
    """A U-shaped mesh: from the left arm the walk to the right arm leaves through the gap, which is not the
    outside."""
    vertices, cells = whole_mesh(Grid(BOX, (20, 10), "triangle"))
    centre = vertices[cells].mean(axis=1)
    gap = (np.abs(centre[:, 0] - 2.0) < 0.5) & (centre[:, 1] > 0.5)
    background = Background(Mesh(vertices, cells[~gap], "triangle"), MPI.COMM_SELF, np.zeros((0, 2)))
    points = points_at(np.array([[1.0, 1.5]]))
    points.cell[:] = background.search.local(background.search.relocate(points)[1])
    points.x[:] = [3.0, 1.6]
    leaving, _ = background.search.locate(points, np.zeros(len(background.cells), np.int32))
    assert leaving
    rank, number = background.search.destinations(points)
    assert rank[0] == 0 and inside(background, points.x, background.search.local(number)).all()


@pytest.mark.parametrize("grid", [Grid(BOX, (20, 10)), shaken()], ids=["lattice", "walk"])
@pytest.mark.parametrize("x", [(4.1, 1.0), (-1e-6, 1.0), (np.nan, 1.0)])
def test_outside_is_nowhere(grid, x):
    background = Background(grid, MPI.COMM_SELF, np.zeros((0, 2)))
    points = points_at(np.array([x]))
    assert background.search.locate(points, np.zeros(len(background.cells), np.int32))[0]
    assert background.search.destinations(points)[0][0] == -1


def test_both_searches_give_the_same_run():
    """A block in uniform motion crosses several cells per step, once with each search on the same cells."""
    box = Box((0.2, 0.5), (1.2, 1.5))
    runs = []
    grid = Grid(BOX, (20, 10), "triangle")
    for background in (grid, Mesh(*whole_mesh(grid), grid.cell)):
        solid = MPM(background, Body(box, (6, 6), 2, linear(1e3, 0.3), 1.0, velocity=(1.0, 0.1)))
        for _ in range(8):
            solid.advance(0.25)
        runs.append(solid.points)
        solid.close()
    np.testing.assert_allclose(runs[0].x, runs[1].x, rtol=0, atol=1e-13)
    np.testing.assert_allclose(runs[0].x.mean(axis=0), [2.7, 1.2], rtol=1e-13)


def test_a_point_that_leaves_a_mesh_is_named():
    solid = MPM(shaken(), Body(Box((3.0, 0.5), (3.5, 1.0)), (2, 2), 2, linear(1e3, 0.3), 1.0,
                               velocity=(1.0, 0.0)))
    with pytest.raises(MPMError, match=r"material point \d+ left the grid at x = \[4\.\d+, .*t = 0.6 s"):
        for _ in range(10):
            solid.advance(0.2)
    solid.close()


@pytest.mark.parametrize("ranks", [1, 2, 3, 4, 7])
def test_bisection_gives_every_rank_its_share(ranks):
    """7 200 cells, all points in the lower left eighth: the sums of weights differ by little more than one
    cell's."""
    x = np.stack(np.meshgrid(np.arange(120.0), np.arange(60.0)), -1).reshape(-1, 2)
    weights = 0.02 + 16.0 * ((x[:, 0] < 60) & (x[:, 1] < 15))
    share = np.bincount(bisect(x, weights, ranks), weights, minlength=ranks)
    assert share.max() / share.mean() < 1.08
    np.testing.assert_array_equal(bisect(x, weights, ranks), bisect(x, weights, ranks))


TOGETHER = """
import json
import sys
import numpy as np
from mpi4py import MPI
from mpm_fenicsx.collective import Part
from mpm_fenicsx.grid.distribution import EMPTY_CELL, POINT, Cells, bisect, bisect_together
comm, random, same = MPI.COMM_WORLD, np.random.default_rng(5), []
for n, D, scale in (7200, 2, 1.0), (3000, 3, 1e-3), (500, 3, 1e6), (40, 2, 1.0), (1, 2, 1.0):
    x = scale * (random.random((n, D)) - 0.5)
    if n > 600:
        x = np.round(8.0 * x / scale) * scale  # many lie level
    weights = EMPTY_CELL + POINT * random.integers(0, 9, n) * (x[:, 0] < 0.1 * scale)
    mine = Part(comm.rank, comm.size).of(n)
    own = bisect_together(comm, Cells(x[mine], weights[mine], mine.start))
    same.append(bool((np.concatenate(comm.allgather(own)) == bisect(x, weights, comm.size)).all()))
if comm.rank == 0:
    with open(sys.argv[1], "w") as file:
        json.dump(same, file)
"""


@pytest.mark.mpi
@pytest.mark.parametrize("ranks", [1, 2, 3])
def test_bisection_by_all_ranks_together(on_ranks, tmp_path, ranks):
    """Each of them has a slice of the cells: the same cuts as with all, also where many cells lie level, and
    of one cell."""
    done = on_ranks(ranks, TOGETHER, tmp_path / "same.json")
    assert done.returncode == 0, done.stderr[-2000:]
    assert json.loads((tmp_path / "same.json").read_text()) == [True] * 5
