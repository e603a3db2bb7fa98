"""Mechanics of the whole partition against closed forms."""
import warnings

import numpy as np
import pytest

from mpm_fenicsx import LAWS, Box, Grid, Support
from tests.mpm.conftest import LOOSE

SQUARE = ((-0.5, -0.5), (0.5, 0.5))


def spin(x):
    """Rigid rotation about the origin at 1 rad/s."""
    return np.column_stack([-x[:, 1], x[:, 0]])


def angular_momentum(points):
    return points.mass @ (points.x[:, 0] * points.v[:, 1] - points.x[:, 1] * points.v[:, 0])


MOVING = [("linear", cell, "plane_strain", inertia)
          for cell in ("quadrilateral", "triangle") for inertia in ("consistent", "lumped")]
MOVING += [(law, cell, stress_state, "lumped") for law in sorted(set(LAWS) - LOOSE)
           for cell, stress_state in (("quadrilateral", "plane_strain"), ("triangle", "plane_stress"))]


@pytest.mark.parametrize("make_law, cell, stress_state, inertia", sorted(set(MOVING)), indirect=["make_law"])
def test_a_body_in_uniform_motion_stays_as_it_is(make_mpm, make_law, cell, stress_state, inertia):
    """Seven cells of 0.5 m crossed along x, three along y: no stress, same momentum and energy. Cell and
    inertia in all pairs for one law; every law, which knows neither
    of them, in both stress states."""
    law, v = make_law(1e3, 0.3), np.array([1.0, 0.4])
    solid = make_mpm(cell, law=law, stress_state=stress_state, inertia=inertia, margin=8, velocity=v)
    start, surface, energy = solid.points.x.copy(), solid.surface()[0], solid.energy()
    for _ in range(25):
        solid.advance(0.14)
    np.testing.assert_allclose(solid.points.x, start + 3.5 * v, rtol=0, atol=1e-13)
    np.testing.assert_allclose(solid.surface()[0], surface + 3.5 * v, rtol=0, atol=1e-13)
    np.testing.assert_allclose(solid.momentum(), 2.0 * v, rtol=1e-13)
    assert solid.energy()["kinetic"] == pytest.approx(energy["kinetic"], rel=1e-13)
    assert abs(solid.cauchy_stress()).max() < 1e-12 * 1e3


def turned(make_mpm, h, speed=1.0, **changes):
    """A square after turning by half a radian in 50 steps."""
    solid = make_mpm(box=SQUARE, h=h, margin=2, velocity=lambda x: speed * spin(x), interface=None, **changes)
    before = angular_momentum(solid.points)
    for _ in range(50):
        solid.advance(0.01 / speed)
    return solid, angular_momentum(solid.points) / before


TURNING = pytest.mark.parametrize("cell, inertia", [("triangle", "consistent"), ("quadrilateral", "lumped")])


@TURNING
def test_a_turning_body_lags_behind_by_the_projection_error(make_mpm, cell, inertia):
    """The lumped projection gives a node at the rim the velocity of the points beside it, which sit further
    in: the angle falls short by O(h^2). Angular momentum is kept by consistent inertia, lost at O(h^2) by
    lumped inertia."""
    missing, kept = [], {"consistent": 1e-3, "lumped": 0.1}[inertia]
    for h in (0.25, 0.125):
        solid, momentum = turned(make_mpm, h, cell=cell, inertia=inertia)
        F = solid.points.F
        angle = np.arctan2((F[:, 1, 0] - F[:, 0, 1]).mean(), (F[:, 0, 0] + F[:, 1, 1]).mean())
        missing.append(0.5 - angle)
        assert momentum == pytest.approx(1.0, abs=kept * (4 * h) ** 2 * 1.3)
    assert missing[0] < 0.08 and np.log2(missing[0] / missing[1]) == pytest.approx(1.85, abs=0.1)


@TURNING
def test_rotation_alone_leaves_no_stress(make_mpm, cell, inertia):
    """What remains is real: centrifugal stress, about rho (omega r)^2 = 0.5 Pa at the corners (twice that for
    a body that starts without it), falling with the square of the speed, while E is 1000 Pa."""
    fast, slow = (abs(turned(make_mpm, 0.25, speed, cell=cell, inertia=inertia)[0].cauchy_stress()).max()
                  for speed in (1.0, 0.25))
    assert fast < 1.2 and fast / slow > 10


def clamped_sides(where, H):
    """One support per node of the lattice on the sides, moved to H x within 1 s."""
    return [Support(lambda x, at=at: np.linalg.norm(x - at, axis=1) < 1e-6, "xy",
                    lambda t, at=at: t * (H @ at)) for at in where]


@pytest.mark.parametrize("stress_state", ["plane_strain", "plane_stress"])
@pytest.mark.parametrize("block", ["fills the grid", "inside the grid"])
def test_patch(make_mpm, options, cell, law, stress_state, block, at_point):
    """Linear displacement of the sides, by 10 %, makes the same stress at every point, to round-off."""
    options(snes_rtol=1e-14, snes_atol=1e-15)
    H = np.array([[0.1, 0.05], [-0.03, -0.08]])
    x, y = (a.ravel() for a in np.meshgrid([0.0, 0.5, 1.0, 1.5, 2.0], [0.0, 0.5, 1.0, 1.5]))
    rim = (x == 0) | (x == 2) | (y == 0) | (y == 1.5)
    solid = make_mpm(cell, box=((0.0, 0.0), (2.0, 1.5)), margin=int(block == "inside the grid"), law=law,
                     rho=1e-16, stress_state=stress_state,
                     supports=clamped_sides(np.column_stack([x, y])[rim], H), interface=None)
    old = solid.points.x.copy()
    solid.advance(1.0)
    F = np.eye(2) + H
    point = at_point(law, stress_state)
    sigma = point.P(F) @ F.T / (np.linalg.det(F) * point.F33(F))
    np.testing.assert_allclose(solid.points.F, np.broadcast_to(F, solid.points.F.shape), rtol=0, atol=1e-13)
    np.testing.assert_allclose(solid.points.x, old @ F.T, rtol=0, atol=1e-13)
    np.testing.assert_allclose(solid.cauchy_stress(), np.broadcast_to(sigma, solid.points.F.shape), rtol=0,
                               atol=1e-13)


@pytest.mark.parametrize("inertia", ["consistent", "lumped"])
def test_free_fall_is_exact(make_mpm, cell, inertia):
    """x = v t + g t^2 / 2: Newmark's method is exact for a constant acceleration."""
    g, v = np.array([0.3, -1.0]), np.array([0.2, 0.5])
    solid = make_mpm(cell, margin=5, gravity=g, velocity=v, inertia=inertia)
    start, surface = solid.points.x.copy(), solid.surface()[0]
    for _ in range(20):
        solid.advance(0.1)
    np.testing.assert_allclose(solid.points.x - start, np.tile(2 * v + 2 * g, (len(start), 1)), rtol=0,
                               atol=1e-12)
    np.testing.assert_allclose(solid.surface()[0] - surface, np.tile(2 * v + 2 * g, (len(surface), 1)),
                               atol=1e-12)
    np.testing.assert_allclose(solid.surface()[1], np.tile(v + 2 * g, (len(surface), 1)), rtol=0, atol=1e-12)
    assert abs(solid.cauchy_stress()).max() < 1e-9
    energy = solid.energy()
    assert sum(energy.values()) == pytest.approx(2 * (v @ v) / 2 - 2 * g @ [1.0, 0.5], rel=1e-12)


def bar(make_mpm, h, free=False, inertia="consistent"):
    """Bar of 1 m with E = 1, rho = 1, nu = 0, started with the velocity of its first mode, and the mode as a
    function of positions. Its wave number is pi / 2 fixed-free and pi free-free, its frequency the same in
    rad/s."""
    grid = Grid(Box((-2 * h, -h), (1 + 2 * h, 2 * h)), (round(1 / h) + 4, 3))
    mode = (lambda x: np.cos(np.pi * x[:, 0])) if free else (lambda x: np.sin(np.pi / 2 * x[:, 0]))
    solid = make_mpm(grid=grid, box=((0.0, 0.0), (1.0, h)), h=h, law=LAWS["linear"](1.0, 0.0), shift=0.0,
                     supports=[] if free else [Support.column("x", 0.0, grid, "x")], inertia=inertia,
                     velocity=lambda x: 1e-6 * np.column_stack([mode(x), np.zeros(len(x))]))
    return solid, mode


def quarter_period(make_mpm, h, steps, free=False, inertia="consistent"):
    """Time at which the velocity of the first mode vanishes, over its exact value."""
    solid, mode = bar(make_mpm, h, free, inertia)
    dt, weight, q = (0.5 if free else 1.0) / steps, solid.points.mass * mode(solid.points.x), [1.0]
    for _ in range(steps + 2 + steps // 10):
        solid.advance(dt)
        q.append(weight @ solid.points.v[:, 0])
    # q has no curvature where it vanishes: a straight line finds the place
    after = np.argmax(np.array(q) < 0)
    return np.interp(0.0, [q[after], q[after - 1]], [after, after - 1]) / steps


@pytest.mark.parametrize("free", [False, True], ids=["fixed-free", "free-free"])
@pytest.mark.parametrize("inertia, share", [("consistent", 1 / 24), ("lumped", 1 / 8)])
def test_bar_vibrates_at_the_exact_frequency_as_the_grid_gets_finer(make_mpm, free, inertia, share):
    """The period is too long by (k h)^2 / 24 with consistent and (k h)^2 / 8 with lumped inertia: linear
    finite elements have -1/24 and 1/24, the lumped projection of velocity flattens the mode by (k h)^2 / 6
    and adds 1/12."""
    h, k = np.array([0.25, 0.125, 0.0625]), np.pi if free else np.pi / 2
    errors = np.array([quarter_period(make_mpm, size, 80, free, inertia) - 1 for size in h])
    np.testing.assert_allclose(np.log2(errors[:-1] / errors[1:]), 2.0, atol=0.1)
    np.testing.assert_allclose(errors, share * (k * h)**2, rtol=0.1)


@pytest.mark.parametrize("free", [False, True], ids=["fixed-free", "free-free"])
def test_bar_vibrates_at_the_exact_frequency_as_the_step_gets_smaller(make_mpm, free):
    """The average acceleration method makes the period longer by (omega dt)^2 / 12."""
    t = np.array([quarter_period(make_mpm, 0.125, steps, free) for steps in (5, 10, 20)])
    assert np.log2((t[0] - t[1]) / (t[1] - t[2])) == pytest.approx(2.0, abs=0.1)
    assert t[0] - t[2] == pytest.approx((1 - 1 / 16) * (np.pi / 2 / 5)**2 / 12, rel=0.1)


@pytest.mark.parametrize("inertia", ["consistent", "lumped"])
@pytest.mark.parametrize("tangent, tolerance", [("new", 1e-12), ("kept", 1e-6)])
def test_impulse_of_the_load_is_the_gain_of_momentum(make_mpm, options, cell, make_law, inertia, tangent,
                                                     tolerance):
    """A free body takes up F dt in each step, whatever the load does between the steps. With a new tangent to
    round-off at any tolerance of Newton's method, as inner forces add up to nothing and inertia is linear; a
    kept tangent has the inertia of older positions."""
    if tangent == "new":
        options(snes_lag_jacobian=1)
    solid = make_mpm(cell, law=make_law(1e3, 0.3), inertia=inertia, velocity=(0.3, -0.2))
    start, given, random = solid.momentum(), np.zeros(2), np.random.default_rng(5)
    for n, dt in enumerate([0.01, 0.01, 0.02, 0.005, 0.005]):
        force = random.normal(size=solid.interface.x.shape) if n != 3 else None
        solid.advance(dt, force)
        given += 0.0 if force is None else dt * force.sum(axis=0)
        np.testing.assert_allclose(solid.momentum() - start, given, rtol=0, atol=tolerance * abs(given).max())
        np.testing.assert_allclose(solid.applied, 0.0 if force is None else force.sum(axis=0), atol=1e-14)


def test_work_of_the_load_is_the_gain_of_energy(make_mpm):
    """Work: sum F (x_new - x_old) over the boundary particles. What is missing comes from the projection:
    O(h^2)."""
    def mismatch(h, steps=40):
        solid, work = make_mpm(h=h, segments=32, shift=1e-6), 0.0
        push = np.outer(np.sin(np.pi * solid.interface.x[:, 0] / 2) ** 2, [0.5, -1.0]) / 32
        for n in range(steps):
            x, force = solid.surface()[0], push * np.sin(np.pi * (n + 0.5) / steps)
            work += np.sum(force * (solid.advance(0.05 / steps, force)[0] - x))
        return sum(solid.energy().values()) / work - 1
    errors = [mismatch(h) for h in (0.25, 0.125)]
    assert 0 < errors[1] < 0.01 and np.log2(errors[0] / errors[1]) > 2


@pytest.mark.parametrize("inertia", ["consistent", "lumped"])
def test_projection_damps_a_vibration_by_h_squared_dt(make_mpm, inertia):
    """Energy lost in one period of the fixed-free bar, which Newmark's method alone would keep."""
    def loss(h, steps):
        solid = bar(make_mpm, h, inertia=inertia)[0]
        before = sum(solid.energy().values())
        for _ in range(steps):
            solid.advance(4 / steps)
        return 1 - sum(solid.energy().values()) / before
    coarse, fine, short = loss(0.25, 40), loss(0.125, 40), loss(0.25, 80)
    assert 0 < coarse < 0.007
    assert np.log2(coarse / fine) == pytest.approx(2.0, abs=0.1)
    assert np.log2(coarse / short) == pytest.approx(1.0, abs=0.1)


def test_a_body_follows_its_support(make_mpm, cell):
    """All nodes are moved along a curve: so are the points, exactly. For a cubic the acceleration is linear,
    and the trapezoidal rule gives the exact velocity."""
    move = Support(lambda x: np.full(len(x), True), "xy", lambda t: (0.3 * t**3, -0.1 * t))
    solid = make_mpm(cell, supports=[move], velocity=(0.0, -0.1))
    start = solid.points.x.copy()
    for _ in range(10):
        solid.advance(0.1)
    np.testing.assert_allclose(solid.points.x - start, np.tile([0.3, -0.1], (len(start), 1)), rtol=0,
                               atol=1e-13)
    np.testing.assert_allclose(solid.points.v, np.tile([0.9, -0.1], (len(start), 1)), rtol=0, atol=1e-12)
    np.testing.assert_allclose(solid.points.a, np.tile([1.8, 0.0], (len(start), 1)), rtol=0, atol=1e-11)


def test_a_pulled_bar_stretches_by_what_the_support_moves(make_mpm, cell):
    """Slow pull at nu = 0: the stress is uniform, S = E (F^2 - 1) / 2, sigma = S F at F = 1.05."""
    grid = Grid(Box((-0.5, -0.5), (2.5, 1.5)), (6, 4), cell)
    supports = [Support.column("x", 0.0, grid, "x"), Support.column("x", 2.0, grid, "x", lambda t: 0.1 * t)]
    solid = make_mpm(cell, grid=grid, law=LAWS["linear"](1e3, 0.0), rho=1e-6, supports=supports)
    solid.advance(1.0)
    sigma = solid.cauchy_stress()
    # Newton stops at 1e-6
    np.testing.assert_allclose(sigma[:, 0, 0], 1e3 * (1.05**2 - 1) / 2 * 1.05, rtol=1e-5)
    assert abs(sigma[:, 1, 1]).max() < 1e-6


def test_steps_of_other_size_need_no_restart(make_mpm):
    """The tangent is made anew for another dt, and a step of 0 or no number is refused."""
    solid = make_mpm(gravity=(0.0, -1.0), margin=4)
    for dt in (0.1, 0.2, 0.05):
        solid.advance(dt)
    assert solid.time == pytest.approx(0.35) and solid.step.tangents.count == 3
    for dt in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(ValueError, match=f"dt is {dt} s"):
            solid.advance(dt)


@pytest.mark.parametrize("cells, groups", [((5, 3), None), ((3, 3), 2), ((3, 1), 2)])
def test_points_too_far_apart_to_hold_together(make_mpm, cells, groups):
    """In the plane, 2 m x 1 m on cells of 0.5 m, one point per body cell: three along leave a column
    empty."""
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        make_mpm("quadrilateral", body_cells=cells, points=1, interface=None)
    words = [str(warning.message) for warning in said]
    assert words == ([] if groups is None else [f"the material points of body 1 lie in {groups} groups of "
                                                "cells without common nodes, and nothing holds these "
                                                "together: seed more points, or take a coarser grid"])
