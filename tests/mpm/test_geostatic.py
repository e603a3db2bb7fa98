"""Soil that starts with the stress of its weight stays at rest."""
import numpy as np
import pytest

from mpm_fenicsx import LAWS, MPM, Body, Box, Grid, Support, at_rest

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
