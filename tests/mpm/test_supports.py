"""Supports: which nodes they hold, and that none is ignored in silence."""
import numpy as np
import pytest

from mpm_fenicsx import Box, Grid, Support
from mpm_fenicsx.grid.supports import Supports
from mpm_fenicsx.terms import newmark

X = np.stack(np.meshgrid([0.0, 1.0, 2.0], [0.0, 1.0], indexing="ij"), -1).reshape(-1, 2)


def left(x):
    return x[:, 0] < 0.5


def low(x):
    return x[:, 1] < 0.5


def test_only_the_named_directions_are_held():
    fixed = Supports([Support(left, "y"), Support(low, "xy")], X).fixed
    np.testing.assert_array_equal(fixed, np.column_stack([low(X), left(X) | low(X)]))


def test_the_last_support_counts():
    """Displacement over the step from t = 1 s to 1.5 s."""
    supports = Supports([Support(left, "xy", lambda t: (t, 2 * t)), Support(low, "y", lambda t: 6 * t)], X)
    v, a = np.ones((2, *X.shape))
    known = supports.displacement(np.arange(len(X)), 1.0, 0.5, v, a)
    expected = np.column_stack([0.5 * left(X), np.where(low(X), 3.0, 1.0 * left(X))])
    np.testing.assert_allclose(known, expected, atol=1e-15)
    np.testing.assert_allclose(v[supports.fixed], 2 * known[supports.fixed], atol=1e-14)
    assert abs(a[supports.fixed]).max() < 1e-13 and (v[~supports.fixed] == 1).all() and (a[~supports.fixed]
                                                                                         == 1).all()


def test_a_support_without_motion_stands_still():
    v, a = np.ones((2, *X.shape))
    assert not Supports([Support(left, "xy")], X).displacement(np.arange(len(X)), 1.0, 0.5, v, a).any()
    assert not v[left(X)].any() and not a[left(X)].any()


def ends_of_steps(motion, dt, steps=8):
    """Acceleration at the start of each step, and at its end by Newmark's method, of a support that moves
    along x."""
    supports, pairs = Supports([Support(left, "x", motion)], X), []
    for n in range(steps):
        v, a = np.zeros((2, *X.shape))
        known = supports.displacement(np.arange(len(X)), n * dt, dt, v, a)
        pairs.append((a[0, 0], newmark.acceleration(known, v, a, dt)[0, 0]))
    return np.array(pairs)


def test_a_motion_is_asked_for_times_in_the_step_only():
    """From rest with constant acceleration, which the cubic through four places in a step has exactly."""
    asked = []
    pairs = ends_of_steps(lambda t: asked.append(t) or 1.5 * t**2, 0.1)
    np.testing.assert_allclose(pairs, 3.0, rtol=1e-10)
    assert min(asked) == 0.0 and max(asked) <= 0.8 * (1 + 1e-15)
    for n, times in enumerate(np.reshape(asked, (8, -1))):
        assert 0.1 * n <= times.min() and times.max() <= 0.1 * n + 0.1


def test_steps_end_with_the_acceleration_that_starts_the_next_one():
    """To second order in the step, and both are the motion's own to that order."""
    errors = []
    for dt in (0.1, 0.05):
        pairs = ends_of_steps(np.sin, dt, round(1 / dt))
        exact = -np.sin(dt * np.arange(len(pairs)))
        errors.append([abs(pairs[:-1, 1] - pairs[1:, 0]).max(), abs(pairs[:, 0] - exact).max()])
    assert (np.divide(*errors) > 3.6).all() and max(errors[0]) < 3e-3


def test_a_column_is_the_one_nearest_to_the_place():
    grid = Grid(Box((-1.0, 0.0), (3.0, 2.0)), (4, 4))
    x, y = Support.column("x", 0.6, grid, "y"), Support.column("y", 1.2, grid, "y")
    nodes = np.array([[0.0, 1.0], [1.0, 1.0], [1.0, 0.5], [2.0, 1.5]])
    np.testing.assert_array_equal(x.where(nodes), [False, True, True, False])
    np.testing.assert_array_equal(y.where(nodes), [True, True, False, False])


def test_a_held_node_stays_and_carries_the_weight(make_mpm, cell):
    """A block standing on its lower edge: the points near it hardly move, the block does not fall."""
    solid = make_mpm(cell, supports=[Support(lambda x: x[:, 1] < 0.25, "xy")], gravity=(0.0, -1.0))
    start = solid.points.x.copy()
    for _ in range(20):
        solid.advance(0.05)  # 1 s: 0.5 m in free fall
    assert abs(solid.points.x - start).max() < 0.01


def test_a_support_beside_the_body_is_a_warning_at_the_start(make_mpm):
    solid = make_mpm(supports=[Support(lambda x: x[:, 0] < -0.9, "y", name="bearing")])
    with pytest.warns(UserWarning, match=r"bearing \(fix 'y'\) holds no grid node of the body at t = 0 s: "
                      r"move it") as told:
        for _ in range(3):
            solid.advance(0.1)
    assert len(told) == 1


@pytest.mark.filterwarnings("error")
def test_a_support_that_the_body_leaves_holds_nothing_any_more(make_mpm):
    """The body slides along its bearing and off it: it then falls freely."""
    solid = make_mpm(supports=[Support(lambda x: (x[:, 0] < 0.1) & (x[:, 1] < 1e-9), "y", name="bearing")],
                     velocity=(2.0, 0.0), gravity=(0.0, -1.0), margin=6)
    for _ in range(22):
        solid.advance(0.05)
    fall = solid.momentum()[1] / solid.points.mass.sum()
    solid.advance(0.05)
    assert solid.points.x[:, 0].min() > 0.5 and fall < -0.1
    assert solid.momentum()[1] / solid.points.mass.sum() - fall == pytest.approx(-0.05, rel=1e-9)


@pytest.mark.parametrize("fix", ["", "u", "xq"])
def test_directions_without_a_name(fix):
    with pytest.raises(ValueError, match=f"support fixes '{fix}': give one or more of the letters x, y, z"):
        Support(left, fix)


def test_no_third_direction_in_the_plane():
    with pytest.raises(ValueError, match="support fixes 'z', the scene has 2 dimensions"):
        Supports([Support(left, "z")], X)
