"""Flows against closed forms: down an incline, and a current that spreads."""
import numpy as np
import pytest

from mpm_fenicsx import MPM, Body, Box, Grid, Support, at_rest, herschel_bulkley, mu_i
from tests.mpm.incline import G, bagnold, bingham, difference, layer, profile, pull

MUD = dict(depth=0.1, rho=1000.0, slope=15.0)
YIELD, VISCOSITY = 0.4 * 1000.0 * pull(15.0)[0] * 0.1, 100.0  # a plug of 0.4 of the depth
BEADS = dict(mu_s=0.382, mu_2=0.644, I_0=0.279, grain_diameter=4e-3, grain_density=2450.0)
SAND = dict(depth=0.02, rho=0.6 * 2450.0, slope=26.0)


def flown(law, scene, cells, length, steps, dt, **more):
    """Profile of a layer after ``steps`` of dt [s]."""
    solid = layer(law, length=length, cells=cells, **scene, **more)
    for _ in range(steps):
        solid.advance(dt)
    found = profile(solid, length, scene["depth"], cells[1])
    solid.close()
    return found


@pytest.mark.parametrize("across, most, off", [
    (5, 0.02, 0.1), pytest.param(10, 0.005, 0.02, marks=pytest.mark.validation),
    pytest.param(20, 0.0013, 0.01, marks=pytest.mark.validation)])
def test_bingham_fluid_on_an_incline(across, most, off):
    """From rest. The plug is elastic and passes on what happens at the ends, so the layer is 40 depths
    long."""
    y, v = flown(herschel_bulkley(1e5, VISCOSITY, YIELD), MUD, (50, across), 4.0, 80, 5e-3)
    velocity, plug = bingham(**MUD, yield_stress=YIELD, viscosity=VISCOSITY)
    assert difference(y, v, velocity) < most
    assert v[y > 0.1 - plug].mean() == pytest.approx(velocity(0.1), rel=0.02)
    # the parabola under the plug tells where it ends: 1 - v / v_plug = (1 - y / (H - plug))^2
    low = y < 0.8 * (0.1 - plug)
    slope, at_bed = np.polyfit(y[low], np.sqrt(1 - v[low] / velocity(0.1)), 1)
    assert 0.1 + at_bed / slope == pytest.approx(plug, rel=off)


@pytest.mark.parametrize("across, dt", [(5, 2e-3), pytest.param(10, 2e-3, marks=pytest.mark.validation),
                                        pytest.param(20, 1e-3, marks=pytest.mark.validation)])
def test_granular_layer_on_an_incline(across, dt):
    """From 0.8 of the velocity. The soil strains by 0.5 % under its weight: a stiffer one makes noise of
    pressure, which friction turns into one of the rate, see docs/flows.md."""
    velocity = bagnold(**SAND, **BEADS)
    y, v = flown(mu_i(5e4, 0.3, **BEADS), SAND, (20, across), 1.6, round(0.6 / dt), dt, transfer="tpic",
                 velocity=lambda x: np.column_stack([0.8 * velocity(x[:, 1]), 0 * x[:, 1]]))
    assert difference(y, v, velocity) < 0.03


@pytest.mark.validation
@pytest.mark.parametrize("h, most", [(0.01, 0.05), (0.005, 0.03)])
def test_viscous_gravity_current(h, most):
    """A block of Newton's fluid spreads on a rough floor, one half of it: x = 1.411 (g q^3 / (3 nu))^(1/5)
    t^(1/5), q the area of the half (Huppert 1982, doi 10.1017/S0022112082001797), once it is long and thin.
    The power of the time alone is not yet reached at this length, see docs/flows.md."""
    rho, viscosity, length, depth = 1000.0, 100.0, 0.2, 0.1
    block = Body(Box((0.0, 0.0), (length, depth)), (round(length / h), round(depth / h)), 2,
                 herschel_bulkley(1e5, viscosity), rho, f_bar=True, stress=at_rest(depth, rho, G, 1.0))
    held = [Support(lambda x: x[:, 1] < 1e-9, "xy"), Support(lambda x: x[:, 0] < 1e-9, "x")]
    solid = MPM(Grid(Box((0.0, 0.0), (0.6, 0.12)), (round(0.6 / h), round(0.12 / h))), block, held,
                gravity=(0.0, -G), inertia="lumped")
    for _ in range(500):
        solid.advance(0.02)
    front = solid.points.x[:, 0].max() + 0.25 * h
    solid.close()
    scale = (G * (length * depth) ** 3 / (3.0 * viscosity / rho) * 10.0) ** 0.2
    assert front == pytest.approx(1.411 * scale, rel=most)
