"""Voellmy's basal friction, mu N + rho g v^2 / xi, under what slides down an incline."""
import numpy as np
import pytest

from mpm_fenicsx import LAWS, MPM, Body, Box, Grid, Structure, Terrain

# firm, and damped a little: an elastic block that is not damped shakes itself more and more where it rubs
FIRM = LAWS["von_mises"](1e6, 0.3, 1e5, viscosity=50.0)
G, SLOPE, H, LENGTH, RHO = 9.81, np.radians(30.0), 0.1, 0.4, 1000.0
S, C = np.sin(SLOPE), np.cos(SLOPE)


def sliding(beds, dim=2, friction=0.2, dt=2e-3, t_end=0.8):
    """Times [s] and mean velocity [m/s] down the slope of a block after each step."""
    deep = ((0.0, 0.1),) if dim == 3 else ()
    lower, upper = (0.0, 0.0, *(a for a, _ in deep)), (LENGTH, H, *(b for _, b in deep))
    block = Body(Box(lower, upper), (8, 2, 2)[:dim], 2, FIRM, RHO)
    grid = Grid(Box((-0.1, -0.05, -0.05)[:dim], (1.6, 0.2, 0.15)[:dim]), (34, 5, 4)[:dim])
    solid = MPM(grid, block, structures=beds, gravity=(G * S, -G * C, 0.0)[:dim], inertia="lumped")
    v, mass = [], RHO * H * LENGTH * (0.1 if dim == 3 else 1.0)
    for _ in range(round(t_end / dt)):
        solid.advance(dt)
        v.append(solid.momentum()[0] / mass)
    solid.close()
    return dt * np.arange(1, len(v) + 1), np.array(v)


def exact(t, friction, xi):
    """h dv/dt = g h (sin s - mu cos s) - g v^2 / xi, from rest."""
    steady = np.sqrt(xi * H * (S - friction * C))
    return steady * np.tanh(G * (S - friction * C) * t / steady)


def bed(dim=2, **more):
    box = Box((-1.0, -1.0, -1.0)[:dim], (2.0, 1.0, 1.0)[:dim])
    return Structure.plane("bed", (0.0,) * dim, "+y", box, **more)


@pytest.mark.parametrize("friction, xi", [(0.2, 20.0), (0.0, 10.0), (0.4, 10.0)])
def test_block_reaches_the_steady_velocity(friction, xi):
    """v^2 = xi h (sin s - mu cos s), on the curve that leads there."""
    t, v = sliding([bed(friction=friction, xi=xi)])
    expected = exact(t, friction, xi)
    assert v[-1] == pytest.approx(expected[-1], rel=0.01)
    assert v[-100:].mean() == pytest.approx(expected[-100:].mean(), rel=0.003)
    assert expected[-1] > 0.97 * np.sqrt(xi * H * (S - friction * C))
    late = t > 0.1  # in the first step there is no friction yet, and the block then shakes
    assert abs(v - expected)[late].max() < 0.02 * expected[-1]


def test_in_space():
    t, v = sliding([bed(3, friction=0.2, xi=20.0)], dim=3, t_end=0.3)
    assert v[-1] == pytest.approx(exact(t, 0.2, 20.0)[-1], rel=0.015)


def test_a_bed_that_moves_along_does_not_resist():
    """The velocity against the bed counts."""
    t, v = sliding([bed(friction=0.2, xi=20.0).moving((0.5, 0.0))], t_end=0.8)
    assert v[-1] == pytest.approx(0.5 + np.sqrt(20.0 * H * (S - 0.2 * C)), rel=0.02)


def test_regions_of_a_terrain():
    ground = Terrain.profile([-1.0, 0.5, 2.0], [0.0, 0.0, 0.0])
    one = ground.structure(friction=0.3, xi=500.0, regions={"forest": ((0.5, 2.0), 0.4, 100.0)})
    assert sorted(zip(one.friction, one.xi)) == [(0.3, 500.0), (0.4, 100.0)]
    kept = ground.structure(friction=0.3, xi=lambda x: 400.0 + x[:, 0], regions={"ice": ((0.5, 2.0), 0.1)})
    assert sorted(kept.xi) == [399.75, 401.25] and sorted(kept.friction) == [0.1, 0.3]
    with pytest.raises(ValueError, match="region ice is .*: give .polygon, friction. or .polygon, fric"):
        ground.structure(regions={"ice": (0.1,)})
    with pytest.raises(ValueError, match="xi of region ice is 0.0"):
        ground.structure(regions={"ice": ((0.5, 2.0), 0.1, 0.0)})
