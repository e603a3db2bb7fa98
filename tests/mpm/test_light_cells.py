"""Inertia that the nodes of a nearly empty cell exchange."""
import numpy as np
import pytest

from mpm_fenicsx import LAWS, MPM, Body, Box, Cloud, Grid, Numerics, Support
from mpm_fenicsx.solve.ladder import LIGHT_CELLS
from mpm_fenicsx.terms.grid_state import RIM
from mpm_fenicsx.terms.light_cells import LightCells
from mpm_fenicsx.terms.newmark import Increment

SOIL = LAWS["mohr_coulomb"](1e6, 0.3, 30.0, 0.0, 0.0)
H = 0.1


def reaching(into, dim=2, law=SOIL, **more):
    """A block of soil of two cells per direction whose upper points reach by ``into`` [cells] into the next
    layer, without weight."""
    side = (np.arange(4) + 0.5) * 0.5 * H + 0.2
    x = np.stack(np.meshgrid(*[side] * dim, indexing="ij"), axis=-1).reshape(-1, dim)
    x[:, -1] += (into + 0.25) * H
    body = Body(Cloud(x, np.full(len(x), (0.5 * H) ** dim)), None, None, law, 1500.0)
    grid = Grid(Box((0.0,) * dim, (0.6,) * dim), (6,) * dim)
    more.setdefault("inertia", "lumped")
    return MPM(grid, body, **more)


@pytest.mark.parametrize("dim", [2, 3])
def test_forces_keep_momentum_and_let_a_cell_move_as_a_whole(dim):
    solid, random = reaching(0.01, dim), np.random.default_rng(1)
    solid.attempt(1e-4)
    step, grid = solid.step, solid.step.grid
    cells, u = LightCells(step.active_cells), np.zeros_like(grid.v)
    cells.begin(grid)
    light = grid.mass[step.active_cells.cells[cells.number]].min(axis=1)
    assert len(light) == 2 ** (dim - 1)  # of the layer that is just reached
    assert cells.weight == pytest.approx(RIM * grid.full_mass - light) and light.max() < RIM * grid.full_mass
    change, R = random.uniform(-1.0, 1.0, grid.v.shape), np.zeros_like(grid.v)
    cells.residual(grid, Increment(1e-4, 1.0, u, grid.a + change), R)
    assert np.abs(R).max() > 0.0 and np.abs(R.sum(axis=0)).max() < 1e-15 * np.abs(R).sum()
    whole = np.zeros_like(grid.v)
    cells.residual(grid, Increment(1e-4, 1.0, u, grid.a + np.arange(1.0, dim + 1)), whole)
    assert np.abs(whole).max() < 1e-13 * np.abs(R).max()
    solid.close()


def test_full_cells_have_none():
    solid = reaching(0.5)
    solid.attempt(1e-4)
    cells = LightCells(solid.step.active_cells)
    cells.begin(solid.step.grid)
    assert len(cells.number) == 0
    solid.close()


def test_the_tangent_is_the_derivative(check_matrix):
    solid = reaching(0.01, law=LAWS["von_mises"](1e6, 0.3, yield_stress=1e9))
    solid.attempt(1e-4)
    assert solid.fall_back() == LIGHT_CELLS
    check_matrix(solid, np.random.default_rng(2), 1e-4, 1e-2)
    solid.close()


def test_it_comes_where_a_node_is_light_and_soil_has_lumped_inertia():
    for found, solid in ((LIGHT_CELLS, reaching(0.01)), ("", reaching(0.5)),
                         ("", reaching(0.01, basis="gimp")), ("the ghost penalty on inertia",
                                                              reaching(0.01, inertia="consistent")),
                         ("the ghost penalty on stiffness", reaching(0.01, law=LAWS["linear"](1e6, 0.3)))):
        solid.attempt(1e-4)
        assert solid.fall_back() == found
        solid.close()
    solid = reaching(0.01)
    solid.attempt(1e-4)
    assert [solid.fall_back(), solid.fall_back()] == [LIGHT_CELLS, ""]
    solid.close()


def falling():
    """A column that collapses, with books."""
    soil = Body(Box((0.0, 0.0), (0.1, 0.2)), (8, 16), 2, SOIL, 1500.0, f_bar=True)
    held = [Support(lambda x, d=d: x[:, d] < 1e-9, "y" if d else "x", name=f"wall {d}") for d in (0, 1)]
    return MPM(Grid(Box((0.0, 0.0), (0.6, 0.3)), (24, 12)), soil, held, gravity=(0.0, -9.81),
               inertia="lumped", numerics=Numerics(losses=True))


def test_books_close_and_states_know_of_it():
    solid = falling()
    for _ in range(30):
        solid.attempt(2e-3)
    before, plain = solid.get_state(), [solid.attempt(2e-3) for _ in range(10)][-1]
    solid.set_state(before)
    assert solid.fall_back() == LIGHT_CELLS
    start, momentum = solid.get_state(), solid.momentum()
    given = sum(row[:2] for row in solid.impulses().values())
    for _ in range(10):
        solid.attempt(2e-3)
    end = solid.points.x.copy()
    given = sum(row[:2] for row in solid.impulses().values()) - given
    assert solid.momentum() - momentum == pytest.approx(given, rel=0, abs=1e-12 * np.abs(momentum).max())
    solid.set_state(before)
    again = [solid.attempt(2e-3) for _ in range(10)][-1]
    assert all(np.array_equal(a, b) for a, b in zip(plain, again))  # without
    solid.set_state(start)
    for _ in range(10):
        solid.attempt(2e-3)
    assert np.array_equal(solid.points.x, end)  # and with it
    solid.close()


RANKS = """
import sys
import numpy as np
from test_light_cells import falling
solid = falling()
for n in range(40):
    solid.attempt(2e-3)
    if n == 29:
        assert solid.fall_back()
gathered = solid.comm.gather([np.concatenate([body.points.gid for body in solid.bodies]),
                              np.concatenate([body.points.x for body in solid.bodies])])
if solid.comm.rank == 0:
    gid, x = (np.concatenate(parts) for parts in zip(*gathered))
    np.save(sys.argv[1], x[np.argsort(gid)])
solid.close()
"""

EXACT = "-mpm_snes_atol", "1e-10", "-mpm_snes_rtol", "1e-14"


@pytest.mark.mpi
def test_two_ranks_give_what_one_gives(tmp_path, on_ranks):
    ends = []
    for ranks in (1, 2):
        done = on_ranks(ranks, RANKS, tmp_path / f"{ranks}.npy", *EXACT)
        assert done.returncode == 0, done.stderr
        ends.append(np.load(tmp_path / f"{ranks}.npy"))
    assert ends[1] == pytest.approx(ends[0], rel=0, abs=1e-11)
