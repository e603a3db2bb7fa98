"""Seeding, and what is refused: one sentence that names the value and the remedy."""
import math

import numpy as np
import pytest

from mpm_fenicsx import MPM, Body, Box, Grid, Interface, MPMDivergedError, MPMError, linear, neo_hooke
from mpm_fenicsx.points.points import gauss_rule, seed

LAW, BOX = linear(1e3, 0.3), Box((0.0, 0.0), (2.0, 1.0))
RULES = [("quadrilateral", n) for n in range(1, 7)] + [("triangle", n) for n in (1, 3, 6, 7, 12)]


@pytest.mark.parametrize("cell, points", RULES)
def test_points_fill_the_body(cell, points):
    """Volume, centre of mass and count; all inside; thickness counts."""
    x, volume = seed(Body(BOX, (3, 2), points, LAW, 1.0, thickness=0.5, cell=cell))
    assert len(x) == (6 * points**2 if cell == "quadrilateral" else 12 * points)
    assert volume.sum() == pytest.approx(1.0, rel=1e-12) and (volume > 0).all()
    np.testing.assert_allclose(volume @ x, [1.0, 0.5], rtol=1e-12)
    assert (x > 0).all() and (x < BOX.upper).all()


@pytest.mark.parametrize("rule, degree", zip(RULES, (1, 3, 5, 7, 9, 11, 1, 2, 4, 5, 6)), ids=str)
def test_rules_integrate_polynomials(rule, degree):
    """int x^i y^j = 1 / (i + 1)(j + 1) on the square and i! j! / (i + j + 2)! on the triangle."""
    (cell, points), f = rule, math.factorial
    x, w = gauss_rule(cell, points)
    for i in range(degree + 1):
        for j in range(degree + 1 - i):
            exact = 1 / ((i + 1) * (j + 1)) if cell == "quadrilateral" else f(i) * f(j) / f(i + j + 2)
            assert w @ (x[:, 0]**i * x[:, 1]**j) == pytest.approx(exact, rel=1e-12)


def test_interface_on_the_upper_edge_has_the_outside_on_its_left():
    interface = Interface.top(BOX, 4, shift=0.25)
    np.testing.assert_allclose(interface.x, np.column_stack([[0.0, 0.5, 1.0, 1.5, 2.0], np.full(5, 0.75)]))
    tangent = np.diff(interface.x[interface.elements], axis=1)[:, 0]
    assert (np.column_stack([-tangent[:, 1], tangent[:, 0]])[:, 1] > 0).all()


def test_interface_on_the_upper_face_is_seen_counter_clockwise_and_covers_it():
    interface = Interface.top(Box((0, 0, 0), (3, 1, 2)), (3, 4), shift=0.25)
    a, b, c = np.moveaxis(interface.x[interface.elements], 1, 0)
    assert len(interface.x) == 20 and len(interface.elements) == 24 and (interface.x[:, 1] == 0.75).all()
    area = np.cross(b - a, c - a) / 2
    assert area == pytest.approx(np.tile([0.0, 0.25, 0.0], (24, 1)))


def body(**changes):
    return Body(**{**dict(shape=BOX, cells=(4, 2), points=2, law=LAW, rho=1.0), **changes})


@pytest.mark.parametrize("call, words", [
    (lambda: Box((0.0, 0.0), (1.0, 0.0)), "every upper coordinate must exceed the lower one"),
    (lambda: Box((0.0, 0.0), (1.0, np.nan)), r"upper corner of the box \(number 2 of 2\) is nan m: give a "
     r"finite number"),
    (lambda: Box((0.0,), (1.0,)), "2 or 3 coordinates each"),
    (lambda: Box((0.0, 0.0), (1.0, 1.0, 1.0)), "2 or 3 coordinates each"),
    (lambda: Grid(BOX, (0, 2)), r"cells of the grid is \(0, 2\): give 2 whole numbers, each at least 1"),
    (lambda: Grid(BOX, (4,)), "give 2 whole numbers"),
    (lambda: Grid(BOX, (4, 2.5)), "give 2 whole numbers"),
    (lambda: Grid(BOX, (4, 2), "hexagon"), "cell of the grid is 'hexagon': choose one of quadrilateral, "
     "triangle"),
    (lambda: Grid.counts((2.0, 1.0), 0.0), "h is 0.0 m: the cell size must lie between 0 and 1 m"),
    (lambda: Grid.counts((2.0, 1.0), 3.0), "h is 3.0 m"),
    (lambda: Grid.counts((2.0, 1.0), np.nan), "h is nan m"),
    (lambda: body(cells=(4, 0)), r"body \(its cells\) is \(4, 0\)"),
    (lambda: body(rho=0.0), "rho is 0.0 kg/m\\^3: the density must be positive"),
    (lambda: body(rho=np.nan), "rho is nan"),
    (lambda: body(thickness=-1.0), "thickness is -1.0 m: it must be positive"),
    (lambda: body(thickness=np.inf), "thickness is inf"),
    (lambda: body(points=7), r"points is 7: choose one of 1, 2, 3, 4, 5, 6 \(per direction\)"),
    (lambda: body(points=0), "points is 0"),
    (lambda: body(points=2, cell="triangle"), r"points is 2: choose one of 1, 3, 6, 7, 12 \(per triangle\)"),
    (lambda: body(cell="square"), "cell of the body is 'square'"),
    (lambda: body(stress_state="plane"), "stress_state is 'plane': choose one of plane_stress, plane_strain"),
    (lambda: body(stress_state="three_dimensional"), "choose one of plane_stress, plane_strain"),
    (lambda: Interface.top(BOX, 0), "segments is 0: give a whole number of at least 1"),
    (lambda: Interface.top(BOX, 4, -0.1), "shift is -0.1 m: it must lie between 0 and the height of the "
     "body, 1.0 m"),
    (lambda: Interface.top(BOX, 4, shift=1.0), "shift is 1.0 m"),
    (lambda: Interface.top(BOX, 4, shift=np.nan), "shift is nan m"),
])
def test_nonsense_is_refused(call, words):
    with pytest.raises(ValueError, match=words):
        call()


def test_body_outside_the_grid():
    with pytest.raises(ValueError, match="the body reaches out of the grid: a material point lies at .* "
                       "enlarge"):
        MPM(Grid(Box((0.5, 0.0), (3.0, 1.0)), (4, 2)), body())


def test_boundary_particle_outside_the_grid():
    with pytest.raises(ValueError,
                       match=r"a boundary particle lies at \[0.  1.1\] m, the grid covers .* enlarge"):
        MPM(Grid(Box((-1.0, -1.0), (3.0, 1.0)), (8, 4)), body(), interface=Interface.line((0.0, 1.1),
                                                                                          (1.0, 1.1), 4))


def test_unknown_inertia(make_mpm):
    with pytest.raises(ValueError, match="inertia is 'none': choose one of consistent, lumped, ghost"):
        make_mpm(inertia="none")


def test_a_point_that_leaves_the_grid_is_named(make_mpm, cell):
    """The rightmost points sit 2 x 0.5 m and their distance from the rim away from the edge: gone after 1
    s."""
    solid = make_mpm(cell, velocity=(1.0, 0.0), interface=None)
    with pytest.raises(MPMError,
                       match=r"material point \d+ left the grid at x = \[3.\d+, .*\] m, t = 1.2 s: enl"):
        for _ in range(30):
            solid.advance(0.2)


def test_a_boundary_particle_that_leaves_the_grid_is_named(make_mpm):
    solid = make_mpm(velocity=(1.02, 0.0), points=1)
    with pytest.raises(MPMError,
                       match=r"boundary particle 4 left the grid at x = \[3.\d+, .*\] m, t = 1 s: enlarge"):
        for _ in range(30):
            solid.advance(0.1)


def test_a_boundary_particle_far_from_all_points_is_named(make_mpm):
    far = Interface(np.array([[1.0, 0.9], [-0.9, -0.9]]), np.array([[0, 1]]))
    with pytest.raises(MPMError,
                       match=r"boundary particle 1 at x = \[-0.9, -0.9\] m has no material point near it at "
                       "t = 0 s: move the interface"):
        make_mpm(interface=far).advance(0.1)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_force_that_is_no_number(make_mpm, bad):
    solid, force = make_mpm(), np.zeros((5, 2))
    solid.advance(0.1)
    force[3, 1] = bad
    with pytest.raises(MPMError, match="the force on boundary particle 3 is not a number at t = 0.1 s"):
        solid.advance(0.1, force)
    assert solid.time == 0.1 and np.isfinite(solid.advance(0.1)[0]).all()  # nothing is lost


@pytest.mark.parametrize("changes, force, reason",
                         [(dict(snes_max_it=1), 1e3, "too many " "iterations.*snes_max_it 100"),
                          (dict(), -1e6, "smaller dt")])
def test_divergence_names_reason_step_and_option(make_mpm, options, changes, force, reason):
    """What has been tried stands before what remains."""
    options(**changes)
    solid = make_mpm(law=neo_hooke(1e3, 0.3))
    solid.advance(0.1)
    with pytest.raises(MPMDivergedError,
                       match=r"Newton's method diverged in step 2, t = 0.2 s after \d+ iterations with "
                       r"residual .* N \(DIVERGED_\w+\); new tangents, a start from rest, full "
                       r"Newton steps did not help(; neo_hooke has no stress at [^;]+)?; nor did "
                       r"the ghost penalty on inertia, the ghost penalty "
                       rf"on stiffness, 2, 4 or 8 shorter steps in its place: .*{reason}"):
        solid.advance(0.1, np.full((5, 2), force))
