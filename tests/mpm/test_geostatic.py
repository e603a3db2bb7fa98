"""Soil that starts with the stress of its weight stays at rest."""
import numpy as np
import pytest

from mpm_fenicsx import LAWS, MPM, Body, Box, Grid, Soil, Support, at_rest

SOIL = LAWS["mohr_coulomb"](5e4, 0.4, 22.0)


def strip(law=SOIL, ratio=0.6, stressed=True, cell="quadrilateral", cells=4, f_bar=True):
    """Soil of 0.2 m x 0.2 m on ``cells`` cells per side between smooth walls, on a rough floor."""
    grid = Grid(Box((0.0, 0.0), (0.2, 0.3)), (cells, cells * 3 // 2), cell)
    stress = at_rest(0.2, 1300.0, 9.81, ratio) if stressed else None
    soil = Body(Box((0.0, 0.0), (0.2, 0.2)), (cells, cells), {"triangle": 3}.get(cell, 2), law, 1300.0,
                cell=cell, f_bar=f_bar, stress=stress)
    held = [Support(lambda x: x[:, 1] < 1e-9, "xy")]
    held += [Support(lambda x, at=at: np.abs(x[:, 0] - at) < 1e-9, "x") for at in (0.0, 0.2)]
    return MPM(grid, soil, held, gravity=(0.0, -9.81), inertia="lumped")


def test_soil_at_rest_stays_at_rest():
    """For 1,000 steps, while soil that starts without stress settles by millimetres."""
    solid = strip()
    start, stress = solid.points.x.copy(), solid.cauchy_stress()
    assert stress[:, 1, 1] == pytest.approx(-1300.0 * 9.81 * (0.2 - start[:, 1]), rel=1e-12)
    assert stress[:, 0, 0] == pytest.approx(0.6 * stress[:, 1, 1], rel=1e-12)
    for _ in range(1000):
        solid.advance(1e-3)
    assert np.abs(solid.points.x - start).max() < 1e-9 and np.abs(solid.points.v).max() < 1e-8
    assert solid.cauchy_stress() == pytest.approx(stress, abs=1e-4)
    solid.close()
    settling = strip(stressed=False)
    for _ in range(30):
        settling.advance(1e-3)
    assert np.abs(settling.points.x - start).max() > 1e-3
    settling.close()


def motion_of_triangles(steps=20, **more):
    """Farthest way of a point [m]."""
    solid = strip(cell="triangle", **more)
    start = solid.points.x.copy()
    for _ in range(steps):
        solid.advance(1e-3)
    solid.close()
    return np.abs(solid.points.x - start).max()


def test_triangles():
    """A stress that grows with depth is in balance on triangles; with F-bar the pressure is one for each
    square of two, and what is left of its balance moves the soil by a part of the settlement that falls with
    the square of the cell."""
    assert motion_of_triangles(f_bar=False) < 1e-9
    coarse, fine = (motion_of_triangles(60, cells=cells) for cells in (4, 8))
    assert 2.5 * fine < coarse < 0.1 * motion_of_triangles(60, stressed=False)


def test_stress_beyond_the_yield_surface_does_not_stay():
    """Less than the active earth pressure, tan(45 - phi/2)^2 = 0.455, cannot hold the soil's shape."""
    solid = strip(ratio=0.2)
    assert solid.cauchy_stress()[:, 0, 0] != pytest.approx(0.2 * solid.cauchy_stress()[:, 1, 1], rel=1e-2)
    solid.close()


def test_bad_input():
    with pytest.raises(ValueError, match="the law linear cannot start with a stress"):
        strip(law=LAWS["linear"](5e4, 0.4))
    with pytest.raises(ValueError, match="ratio is -1.0: the ratio of horizontal to vertical stress must be "
                       "0 or"):
        strip(ratio=-1.0)


def layer(dim, slope, phi, depth=0.2, length=2.0, h=0.05):
    """A layer on a rough incline, in the axes of the incline, x downhill, that starts at rest."""
    g = 9.81 * np.array([np.sin(np.radians(slope)), -np.cos(np.radians(slope)), 0.0])[:dim]
    size = (length, depth, h)[:dim]
    soil = Soil(E=1e5, nu=0.3, rho=1500.0, phi=phi)
    stress = at_rest(depth, soil.rho, g, soil.at_rest, phi)
    body = Body(Box((0.0,) * dim, size), Grid.counts(size, h), 2, soil.material(dim), soil.rho, f_bar=True,
                stress=stress)
    upper = (length + 0.2, depth + 0.1, h)[:dim]
    floor = Support(lambda x: x[:, 1] < 1e-9, "xyz"[:dim])
    sides = [Support(lambda x: (x[:, 2] < 1e-9) | (x[:, 2] > h - 1e-9), "z")] if dim == 3 else []
    uphill = Support(lambda x: x[:, 0] < 1e-9, "x")
    grid = Grid(Box((0.0,) * dim, upper), Grid.counts(upper, h))
    return MPM(grid, body, [floor, uphill, *sides], gravity=g, inertia="lumped"), g


@pytest.mark.parametrize("slope", [15.0, 26.0])
def test_a_layer_starts_at_rest_on_a_slope(slope):
    """Below the friction angle the middle, which no wave from the ends has reached, does not move."""
    solid, g = layer(2, slope, 30.0)
    for _ in range(20):
        solid.advance(2e-3)
    middle = np.abs(solid.points.x[:, 0] - 1.0) < 0.3
    assert np.abs(solid.points.v[middle]).max() < 0.01 * g[0] * 0.04
    solid.close()


@pytest.mark.validation
@pytest.mark.parametrize("dim", [2, 3])
def test_a_layer_rests_below_the_friction_angle_and_flows_above(dim):
    """Above it the layer gains what friction leaves of gravity: g (sin a - cos a tan phi), at its top."""
    phi, t = 30.0, 0.06
    speeds = {}
    for slope in (15.0, 28.0, 34.0):
        solid, g = layer(dim, slope, phi)
        for _ in range(30):
            solid.advance(2e-3)
        middle = np.abs(solid.points.x[:, 0] - 1.0) < 0.2
        speeds[slope] = solid.points.v[middle, 0].max() / (g[0] * t)
        solid.close()
    left = 1.0 - np.tan(np.radians(phi)) / np.tan(np.radians(34.0))  # of gravity along the slope
    assert max(speeds[15.0], speeds[28.0]) < 0.01
    assert speeds[34.0] == pytest.approx(left, rel=0.35) and speeds[34.0] > 5.0 * speeds[28.0]
