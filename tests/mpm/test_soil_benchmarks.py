"""Soil at rest under its weight, and under a footing: benchmarks with closed forms and known weaknesses."""
import numpy as np
import pytest

from mpm_fenicsx import MPM, Body, Box, Grid, Interface, Penalty, Support, mohr_coulomb, neo_hooke, von_mises

HEIGHT, E, RHO, G = 50.0, 1e6, 80.0, 10.0  # of the column
COHESION = 1e3  # of the clay [Pa]
POINTS = {"quadrilateral": 2, "triangle": 3}


def compacted(cells, load, steps=60, slowly=20.0):
    """Column after its weight times ``load`` has come smoothly in 20 s, 11 of its periods: mean error of the
    stress over the weight, greatest motion over a cell's size, settlement of the top [m]."""
    h, count = HEIGHT / cells, round(1.2 * cells)
    ramp = lambda t: (s := min(t / slowly, 1.0)) ** 3 * (10.0 - 15.0 * s + 6.0 * s**2)  # noqa: E731
    body = Body(Box((0.0, 0.0), (h, HEIGHT)), (1, cells), 2, neo_hooke(E, 0.0), RHO)
    sides = [Support(lambda x: x[:, 1] < 1e-9, "y"), Support(lambda x: x[:, 0] > -1.0, "x")]
    column = MPM(Grid(Box((0.0, 0.0), (h, h * count)), (1, count)), body, sides,
                 body_force=lambda x, t: np.tile([0.0, -load * G * ramp(t)], (len(x), 1)))
    for _ in range(steps):
        column.advance(slowly / steps)
    p, weight = column.points, RHO * G * load * HEIGHT
    exact = -weight * (1.0 - p.x0[:, 1] / HEIGHT)
    error = p.V0 @ np.abs(column.cauchy_stress()[:, 1, 1] - exact) / (weight * p.V0.sum())
    column.close()
    settlement = (p.x0 - p.x)[:, 1].max()
    return error, settlement / h, settlement


def test_column_compacts_under_its_weight():
    """s_yy = -rho0 g (l0 - Y) whatever the law, as the area stays (the example of AMPLE,
    wmcoombs.github.io/tests). The stress is constant in each cell: first order, the error being the way from
    a point to the middle, 1 / (2 sqrt(3) cells). That holds until points leave the cells they were seeded in:
    then the standard method, whose gradients jump there, stops converging, as it is known for."""
    still = [compacted(n, 1e-3) for n in (5, 10, 20)]
    np.testing.assert_allclose([error for error, *_ in still], [0.5 / np.sqrt(3) / n for n in (5, 10, 20)],
                               rtol=1e-3)
    np.testing.assert_allclose(still[-1][2], 1e-3 * RHO * G * HEIGHT**2 / (2 * E), rtol=1e-3)
    large = {n: compacted(n, 1.0) for n in (5, 10, 20, 80)}
    assert large[10][1] < 0.25 < 0.5 < large[80][1]
    assert large[10][0] < 0.55 * large[5][0] < 0.032
    assert all(0.03 < large[n][0] < 0.06 for n in (20, 80))


def footing(cell, law, f_bar, h, steps=10, settlement=2e-3, half_width=1.0, size=(5.0, 2.5)):
    """Mean pressure under a stiff rough strip of 2 m pressed into weightless clay, over its cohesion, after
    each step."""
    (width, depth), counts = size, tuple(round(s / h) for s in size)
    grid = Grid(Box((0.0, -depth), (width, 2 * h)), (counts[0], counts[1] + 2), cell)
    body = Body(Box((0.0, -depth), (width, 0.0)), counts, POINTS[cell], law, 1.0, cell=cell, f_bar=f_bar)
    x = np.arange(0.0, half_width + h / 2, h)
    strip = Penalty(Interface(np.column_stack([x, 0 * x]), np.zeros((0, 2), int)), name="strip",
                    motion=lambda t: np.array([0.0, -settlement * t]))
    sides = [Support(lambda x: (x[:, 0] < 1e-9) | (x[:, 0] > width - 1e-9), "x"),
             Support(lambda x: x[:, 1] < 1e-9 - depth, "xy")]
    clay, pressure = MPM(grid, body, sides, penalties=[strip], inertia="lumped"), []
    for _ in range(steps):
        clay.advance(1.0 / steps)
        pressure.append(-clay.reaction("strip")[1] / (half_width * COHESION))
    clay.close()
    return np.array(pressure)


CLAY = {"mohr_coulomb": mohr_coulomb(1e7, 0.49, 0.0, cohesion=COHESION),
        "von_mises": von_mises(1e7, 0.49, np.sqrt(3.0) * COHESION)}


@pytest.mark.parametrize("cell", sorted(POINTS))
def test_f_bar_finds_the_load_that_a_footing_bears(cell):
    """Prandtl: (2 + pi) c. The field has a kink at the edge, which lies somewhere in its cell: the load of a
    strip wider by half a cell is the measure here. Without F-bar the clay locks and bears any load."""
    free, locked = (footing(cell, CLAY["mohr_coulomb"], f_bar, 0.25, settlement=4e-3)
                    for f_bar in (True, False))
    assert free[-1] == pytest.approx((2 + np.pi) * 1.125, rel=0.04)
    assert free[-1] - free[-4] < 0.02 * free[-1]
    assert locked[-1] > 1.7 * free[-1] and locked[-1] - locked[-4] > 0.1 * free[-1]


@pytest.mark.validation
@pytest.mark.parametrize("law", sorted(CLAY))
@pytest.mark.parametrize("cell", sorted(POINTS))
def test_load_of_a_footing_converges_to_prandtl(cell, law):
    """Towards (2 + pi) c with the cell size; extrapolated within 2 %."""
    coarse, fine = (footing(cell, CLAY[law], True, h, steps=20, settlement=4e-3)[-1] for h in (0.25, 0.125))
    assert 2 + np.pi < fine < coarse
    assert 2 * fine - coarse == pytest.approx(2 + np.pi, rel=0.02)
