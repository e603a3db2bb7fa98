"""Ghost penalty on inertia: linear fields keep theirs, single drops do not make the system singular."""
import numpy as np
import pytest

from mpm_fenicsx import LAWS, MPM, Body, Box, Cloud, Grid, Support
from mpm_fenicsx.terms.ghost import add_residual

SOIL = LAWS["mohr_coulomb"](5e4, 0.4, 22.0)
SIDES = {"quadrilateral": 2, "triangle": 2, "hexahedron": 3, "tetrahedron": 3}


def unit_facets(cell, make_mpm, **more):
    """Facets of a grid of 4 x 3 [x 2] cells of 0.5 m."""
    D = SIDES[cell]
    box = Box((0.0,) * D, (2.0, 1.5, 1.0)[:D])
    solid = make_mpm(cell=cell, box=((0.6,) * D, (0.9,) * D), h=0.3, points=1, inertia="ghost",
                     interface=None, grid=more.get("grid") or Grid(box, (4, 3, 2)[:D], cell))
    return solid, solid._facets


def force(facets, a):
    R = np.zeros_like(a)
    add_residual(facets.nodes, facets.matrix, np.ones(len(facets.nodes)), a, R)
    return R


def test_linear_fields_are_free(any_cell, make_mpm, distorted):
    """Also on a distorted mesh; a field with a kink is not."""
    rng = np.random.default_rng(0)
    for grid in (None, distorted(any_cell)):
        solid, facets = unit_facets(any_cell, make_mpm, grid=grid)
        x = solid.background.x
        linear = 1.0 + x @ rng.normal(size=(x.shape[1], x.shape[1]))
        assert np.abs(force(facets, linear)).max() < 1e-12
        assert np.abs(force(facets, x**2)).max() > 1e-3


def test_kink_costs_its_jump(any_cell, make_mpm):
    """Of a = |x - 1| the slope jumps by 2 over the facets at x = 1, all together as large as the grid's
    section."""
    solid, facets = unit_facets(any_cell, make_mpm)
    x = solid.background.x
    a = np.zeros_like(x)
    a[:, 0] = np.abs(x[:, 0] - 1.0)
    section = 1.5 if x.shape[1] == 2 else 1.5 * 1.0
    assert np.vdot(a, force(facets, a)) == pytest.approx(4.0 * section, rel=1e-12)
    assert facets.matrix == pytest.approx(facets.matrix.transpose(0, 2, 1), abs=1e-14)
    assert np.linalg.eigvalsh(facets.matrix).min() > -1e-12
    assert facets.volume.sum() == pytest.approx(2.0 * section)


@pytest.fixture
def column():
    """``column(**more)``: soil of 10 cm x 20 cm on cells of 2 cm, ready to collapse; keywords of MPM."""
    opened = []

    def make(**more):
        grid = Grid(Box((0.0, 0.0), (0.6, 0.3)), (30, 15))
        soil = Body(Box((0.0, 0.0), (0.1, 0.2)), (10, 20), 3, SOIL, 1300.0, cell="triangle", f_bar=True)
        held = [Support(lambda x, d=d: x[:, d] < 1e-9, fix) for d, fix in ((1, "xy"), (0, "x"))]
        opened.append(MPM(grid, soil, held, gravity=(0.0, -9.81), **more))
        return opened[-1]

    yield make
    for solid in opened:
        solid.close()


@pytest.fixture
def lump():
    """``lump(law)``: a lump with a ragged rim, and a drop, flying on a parabola."""
    rng = np.random.default_rng(2)
    x = np.vstack([rng.uniform((0.2, 0.2), (0.37, 0.33), (200, 2)), [[0.7, 0.7]]])
    opened = []

    def make(law):
        body = Body(Cloud(x, np.full(201, 1e-4)), None, None, law, 1300.0, velocity=(1.0, 0.5))
        opened.append(MPM(Grid(Box((0.0, 0.0), (1.0, 1.0)), (20, 20)), body, gravity=(0.0, -9.81),
                          inertia="ghost"))
        return opened[-1]

    yield make
    for solid in opened:
        solid.close()


def test_tangent_is_the_derivative(lump):
    """Of the residual with penalty and with a single point that gets lumped inertia, by the displacement."""
    solid = lump(LAWS["linear"](5e4, 0.4))
    step = solid.step
    step.begin(1e-3, 0.0, np.zeros((0, 2)))
    assert (step.ghost.weight > 0.0).any() and not step.ghost.consistent[solid.points.cell[-1]]
    rng, base = np.random.default_rng(1), 1e-3 * step.grid.v
    idle = step.equations.known.idle
    du = np.where(idle, 0.0, rng.normal(size=base.shape))
    ends = [np.empty_like(base) for _ in range(2)]
    for sign, end in zip((1.0, -1.0), ends):
        step.equations.residual(base + sign * 1e-7 * du, end)
    step.newton.make_tangent(step.equations.residual(base, np.empty_like(base)))
    vec, out = step.active_cells.vector(2), step.active_cells.vector(2)
    vec.array_w[:] = du.ravel()
    step.active_cells.matrix.mult(vec, out)
    change, tangent = (ends[0] - ends[1]) / 2e-7, out.array_r.reshape(base.shape)
    assert tangent[~idle] == pytest.approx(change[~idle], abs=1e-6 * np.abs(change).max())


def test_rigid_motion_stays(lump):
    """Every point keeps the velocity of the parabola, to round-off."""
    solid = lump(SOIL)
    for _ in range(20):
        solid.advance(2e-3)
    assert (solid.step.ghost.weight > 0.0).any()
    assert solid.points.v == pytest.approx(np.tile([1.0, 0.5 - 9.81 * 0.04], (201, 1)), abs=1e-10)


def test_dry_column_survives(column):
    """The front is that of lumped inertia, within 3 %."""
    fronts = {}
    for inertia in ("lumped", "ghost"):
        solid = column(inertia=inertia)
        for _ in range(100):
            solid.advance(1e-3)
        fronts[inertia] = np.quantile(solid.points.x[:, 0], 0.99)
    assert fronts["ghost"] == pytest.approx(fronts["lumped"], rel=0.03)


@pytest.mark.parametrize("basis", ["ugimp", "gimp"])
@pytest.mark.parametrize("D", [2, 3])
def test_domains_fill_cells_without_points(D, basis):
    """Of a box that ends a quarter of a cell beyond a grid line the outer points reach over that line; how
    full the cells on both sides are follows from the boxes around the points."""
    lower, upper = (0.55,) * D, (1.55,) * D
    body = Body(Box(lower, upper), (5,) * D, 1, SOIL, 1300.0, cell=("quadrilateral", "hexahedron")[D - 2])
    grid = Grid(Box((0.0,) * D, (2.0,) * D), (10,) * D, body.cell)
    solid = MPM(grid, body, inertia="ghost", basis=basis)
    fill, corner = solid._facets.filling(solid.bodies), solid.background.maps.corner[:, 0, None]
    x, half = solid.points.x, solid.points.domain
    solid.close()
    inside = np.maximum(np.minimum(corner + 0.2, x + half) - np.maximum(corner, x - half), 0.0) / (2.0 * half)
    volume = inside.prod(axis=-1) @ solid.points.V0
    assert fill == pytest.approx(volume / 0.2**D, abs=1e-12)
    assert fill @ np.full(len(fill), 0.2**D) == pytest.approx(1.0)


RANKS = """
import sys
import numpy as np
from mpm_fenicsx import LAWS, MPM, Body, Box, Grid
turn = lambda x: 10.0 * np.column_stack([0.5 - x[:, 1], x[:, 0] - 0.5])
body = Body(Box((0.3, 0.3), (0.7, 0.7)), (8, 8), 2, LAWS["neo_hooke"](1e5, 0.3), 1000.0, velocity=turn)
solid = MPM(Grid(Box((0.0, 0.0), (1.0, 1.0)), (20, 20)), body, inertia="ghost", basis="ugimp")
for _ in range(40):
    solid.advance(5e-3)
own = solid.background.cells_owned
fill = solid._facets.filling(solid.bodies)[:own], solid.background.original_cell[:own]
x, gid, fill, cell = (np.concatenate(solid.comm.allgather(values))
                      for values in (solid.points.x, solid.points.gid, *fill))
if solid.comm.rank == 0:
    np.savez(sys.argv[1], x=x[np.argsort(gid)], fill=fill[np.argsort(cell)])
"""


@pytest.mark.validation
def test_domains_reach_into_cells_of_other_ranks(tmp_path, on_ranks):
    ends = []
    for ranks in (1, 3):
        done = on_ranks(ranks, RANKS, tmp_path / f"{ranks}.npz")
        assert done.returncode == 0, done.stderr
        ends.append(np.load(tmp_path / f"{ranks}.npz"))
    one, three = ends
    assert three["x"] == pytest.approx(one["x"], abs=1e-8)
    assert three["fill"] == pytest.approx(one["fill"], abs=1e-6) and one["fill"].max() > 0.9
