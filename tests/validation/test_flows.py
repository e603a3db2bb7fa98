"""Flows against closed forms: down an incline, and a current that spreads."""
import numpy as np
import pytest

from mpm_fenicsx import MPM, Body, Box, Cloud, Grid, Numerics, Support, at_rest, herschel_bulkley, mu_i
from tests.mpm.incline import (
    G,
    bagnold,
    bingham,
    difference,
    grains,
    layer,
    profile,
    pull,
    sheared_in_time,
    spreading,
)

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


@pytest.mark.parametrize("across, dt, most", [
    (5, 1e-3, 0.035), pytest.param(10, 5e-4, 0.009, marks=pytest.mark.validation),
    pytest.param(20, 5e-4, 0.009, marks=pytest.mark.validation)])
def test_granular_layer_on_an_incline(across, dt, most):
    """From 0.8 of Bagnold's velocity, as the 1-D equation with elastic strain has it: the soil strains by
    0.5 % under its weight, as a stiffer one makes noise of pressure, which friction turns into one of the
    rate. B-splines make little of it, and the layer is 160 depths long: see docs/flows.md."""
    E, time, steady = 5e4, 0.6, bagnold(**SAND, **BEADS)
    start = lambda y: 0.8 * steady(y)
    y, v = flown(mu_i(E, 0.3, **BEADS), SAND, (40, across), 3.2, round(time / dt), dt, transfer="tpic",
                 basis="bspline", velocity=lambda x: np.column_stack([start(x[:, 1]), 0 * x[:, 1]]))
    at, (expected,) = sheared_in_time([time], start, **SAND, stress=grains(E / 2.6, **BEADS))
    assert difference(y, v, lambda y: np.interp(y, at, expected)) < most


def test_layer_in_time_ends_in_the_known_profile():
    """The 1-D equation by itself: Bagnold's profile without elastic strain, with it 1.5 % faster."""
    steady = bagnold(**SAND, **BEADS)
    for modulus, faster in ((1e12, 1.0), (5e4 / 2.6, 1.0148)):
        y, (v,) = sheared_in_time([4.0], lambda y: 0.8 * steady(y), **SAND, stress=grains(modulus, **BEADS))
        assert v[-1] == pytest.approx(faster * steady(y[-1]), rel=1e-3)


def spread_on_a_floor(body, h, room, dt, times):
    """Fronts and mean places [m] at ``times`` [s] of a ``body`` of Newton's fluid that spreads from a wall
    over a rough floor, on cells of h [m] in the ``room`` [m]. GIMP: with linear functions and F-bar the
    points crowd, see docs/flows.md."""
    held = [Support(lambda x: x[:, 1] < 1e-9, "xy"), Support(lambda x: x[:, 0] < 1e-9, "x")]
    solid = MPM(Grid(Box((0.0, 0.0), room), tuple(round(size / h) for size in room)), body, held,
                gravity=(0.0, -G), inertia="lumped", numerics=Numerics(basis="gimp"))
    fronts, means = [], []
    for steps in np.diff(np.round(np.concatenate([[0.0], times]) / dt).astype(int)):
        for _ in range(steps):
            solid.advance(dt)
        fronts.append(solid.points.x[:, 0].max() + 0.25 * h)
        means.append(np.average(solid.points.x[:, 0], weights=solid.points.V0))
    solid.close()
    return np.array(fronts), np.array(means)


def current(h, times, dt=0.02):
    """Front [m] at ``times`` [s] of a block, 20 cm by 10 cm, on cells of h [m]."""
    block = Body(Box((0.0, 0.0), (0.2, 0.1)), (round(0.2 / h), round(0.1 / h)), 2,
                 herschel_bulkley(1e5, 100.0), 1000.0, f_bar=True, stress=at_rest(0.1, 1000.0, G, 1.0))
    return spread_on_a_floor(block, h, (0.6, 0.12), dt, times)[0]


@pytest.mark.validation
@pytest.mark.parametrize("h", [0.02, 0.01, 0.005])
def test_viscous_gravity_current(h):
    """Against lubrication theory from the same block: within 5 % from 5 s on, which is the lead of the start,
    and growing with the same power but on the coarsest grid."""
    expected = spreading([5.0, 10.0], 0.2, 0.1, 0.1, 0.6)
    found = current(h, [5.0, 10.0])
    assert found == pytest.approx(expected, rel=0.05)
    assert np.log2(found[1] / found[0]) == pytest.approx(np.log2(expected[1] / expected[0]),
                                                         abs=0.04 if h > 0.01 else 0.01)


SPREADS = (G * 0.02**3 / 0.3) ** 0.2  # (g q^3 / 3 nu)^(1/5) of that area and fluid
MEAN_PLACE = 0.375 / 0.8413  # of the similarity solution, over its front: integrals of y f and f


def similar_depth(x, front):
    """Depth [m] of the similarity solution with its front there (Huppert 1982)."""
    return 0.02 / (0.8413 * front) * np.maximum(1.0 - (x / front) ** 2, 0.0) ** (1.0 / 3.0)


def similar_current(h, growths, start=0.4, dt=0.04):
    """Times [s] and prefactors of the front and of the mean place, the latter over that of the solution, at
    ``growths`` of the time of a current that begins as the similarity solution."""
    first = (start / (1.411 * SPREADS)) ** 5
    x = np.stack(np.meshgrid(*(0.5 * h * (np.arange(round(2 * size / h)) + 0.5) for size in (start, 0.1)),
                             indexing="ij"), axis=-1).reshape(-1, 2)
    x = x[x[:, 1] < similar_depth(x[:, 0], start)]
    cloud = Cloud(x, np.full(len(x), 0.02 / len(x)), np.full((len(x), 2), 0.25 * h))
    pressed = lambda x: np.outer(np.minimum(x[:, 1] - similar_depth(x[:, 0], start), 0.0), np.ones(3))  # noqa: E731
    body = Body(cloud, None, None, herschel_bulkley(1e5, 100.0), 1000.0, f_bar=True,
                stress=lambda x: 1000.0 * G * pressed(x))
    times = dt * np.round((np.asarray(growths) - 1.0) * first / dt)
    front, mean = spread_on_a_floor(body, h, (0.8, 0.08), dt, times)
    similar = SPREADS * (first + times) ** 0.2
    return first + times, front / similar, mean / (MEAN_PLACE * similar)


@pytest.mark.validation
def test_viscous_current_in_its_similar_range():
    """Begun as the similarity solution: x = 1.411 (g q^3 t / 3 nu)^(1/5)."""
    times, front, mean = similar_current(0.01, [1.5, 2.0, 3.0, 4.0])
    assert front == pytest.approx(1.411, rel=0.015) and mean == pytest.approx(1.411, rel=0.006)
    for prefactor, most in ((front, 0.02), (mean, 0.006)):
        above = np.log(prefactor[-1] / prefactor[0]) / np.log(times[-1] / times[0])  # of the power, 1/5
        assert above == pytest.approx(0.0, abs=most)


@pytest.mark.validation
def test_lubrication_comes_to_the_similar_solution():
    """Late, the front is 1.411 (g q^3 / (3 nu))^(1/5) t^(1/5), q the area of the half (Huppert 1982, doi
    10.1017/S0022112082001797). From this block the power between 5 and 10 s is still 0.19."""
    early, late, later = spreading([5.0, 10.0, 100.0], 0.2, 0.1, 0.1, 0.8)
    assert later == pytest.approx(1.411 * (G * 0.02**3 / 0.3 * 100.0)**0.2, rel=0.005)
    assert np.log2(late / early) == pytest.approx(0.19, abs=0.005)
