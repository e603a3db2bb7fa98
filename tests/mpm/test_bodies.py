"""Several bodies in one grid, each with its own law."""
import numpy as np
import pytest

from mpm_fenicsx import MPM, Body, Box, Grid, Interface, Penalty, Support, linear, neo_hooke

SOFT = linear(1e3, 0.3)
POINTS = {"quadrilateral": 2, "triangle": 3, "hexahedron": 2, "tetrahedron": 4}


def dim(cell):
    return 2 if cell in ("quadrilateral", "triangle") else 3


def grid_of(cell):
    D = dim(cell)
    return Grid(Box((-1.0,) * D, (4.0, 2.0, 2.0)[:D]), (10, 6, 6)[:D], cell)


def block(cell, lower, upper, law=SOFT, rho=1.0, **more):
    """Body from ``lower`` to ``upper`` along x [m], 1 m across, in body cells of 0.5 m."""
    D = dim(cell)
    box = Box((lower, 0.0, 0.0)[:D], (upper, 1.0, 1.0)[:D])
    return Body(box, (round(2 * (upper - lower)), 2, 2)[:D], POINTS[cell], law, rho, cell=cell, **more)


def whole(solid, field):
    return np.concatenate([getattr(part.points, field) for part in solid.bodies])


@pytest.mark.parametrize("law", [linear(1e3, 0.3), neo_hooke(1e3, 0.3)], ids=lambda law: law.name)
def test_two_halves_of_one_material_are_one_body(start, any_cell, law):
    """Same points, same motion, to what Newton's method makes of round-off (measured 3e-10); the points come
    in another order."""
    D = dim(any_cell)
    spin = dict(velocity=lambda x: np.column_stack([-x[:, 1], x[:, 0], 0 * x[:, 0]])[:, :D])
    top = Interface(np.array([(0.5, 0.9, 0.5), (1.2, 0.9, 0.5)])[:, :D], np.zeros((0, D), int))
    make = lambda bodies: start(grid_of(any_cell), bodies, interface=top, inertia="lumped",  # noqa: E731
                                gravity=(0.0, -1.0, 0.2)[:D], bonded=True)
    one = make(block(any_cell, 0.0, 2.0, law, **spin))
    two = make([block(any_cell, 0.0, 1.0, law, **spin), block(any_cell, 1.0, 2.0, law, **spin)])
    order = [np.lexsort(np.round(whole(solid, "x"), 9).T) for solid in (one, two)]
    for n in range(10):
        force = np.full((2, D), np.sin(n))
        surface = one.advance(0.02, force), two.advance(0.02, force)
    np.testing.assert_allclose(surface[1], surface[0], rtol=0, atol=3e-9)
    for name, size in (("x", 1.0), ("v", 1.0), ("a", 1e3), ("F", 1.0)):
        a, b = (whole(solid, name)[rows] for solid, rows in zip((one, two), order))
        np.testing.assert_allclose(b, a, rtol=0, atol=3e-9 * size, err_msg=name)
    np.testing.assert_allclose(list(two.energy().values()), list(one.energy().values()), rtol=1e-8)
    np.testing.assert_allclose(two.momentum(), one.momentum(), rtol=1e-8, atol=1e-9)


def pulled(start, cell, first, second):
    """Two blocks side by side from 0 to 2 m, pulled apart by 0.02 m within a step, without inertia, nu =
    0."""
    D = dim(cell)
    box = Box((0.0,) * D, (2.0, 1.0, 1.0)[:D])
    ends = [Support(lambda x: x[:, 0] < 1e-9, "x"), Support(lambda x: x[:, 0] > 2 - 1e-9, "x",
                                                            lambda t: 0.02 * t)]
    ends += [Support(lambda x, d=d: x[:, d] < 1e-9, "xyz"[d]) for d in range(1, D)]
    bodies = [block(cell, 0.0, 1.0, first, 1e-9), block(cell, 1.0, 2.0, second, 1e-9)]
    solid = start(Grid(box, (4, 2, 2)[:D], cell), bodies, ends, bonded=True)
    solid.advance(1.0)
    return solid


@pytest.mark.parametrize("contrast", [1.0, 1e4, 1e8])
def test_two_springs_in_a_row(start, options, any_cell, contrast):
    """The strain is shared by the stiffness, the stress is the same: E = 1e3 Pa against that times the
    contrast, linear against neo-Hookean. Round-off in the stiff body is eps E = 2e-5 Pa of 20 Pa."""
    options(snes_rtol=1e-12)
    solid = pulled(start, any_cell, linear(1e3, 0.0), neo_hooke(1e3 * contrast, 0.0))
    soft, stiff = (part.points.F[:, 0, 0] - 1 for part in solid.bodies)
    axial = [part.cauchy_stress()[:, 0, 0] for part in solid.bodies]
    assert np.ptp(soft) < 1e-9 and soft.mean() + stiff.mean() == pytest.approx(0.02, rel=1e-9)
    # a law's own nonlinearity
    assert soft.mean() == pytest.approx(0.02 * contrast / (1 + contrast), rel=0.01)
    np.testing.assert_allclose(np.concatenate(axial), axial[0].mean(), rtol=0.02 if contrast == 1.0 else 1e-4)


def test_contrast_in_motion(start, any_cell):
    """A soft block hits one 1e8 times as stiff and ten times as heavy: momentum to what round-off in the
    stiff body leaves of a residual (eps E h = 1e-5 N a step; measured 2e-6 kg m/s), energy does not grow."""
    D = dim(any_cell)
    bodies = [block(any_cell, 0.0, 1.0, velocity=(0.01, 0.0, 0.0)[:D]),
              block(any_cell, 1.001, 2.001, neo_hooke(1e11, 0.3), 10.0)]
    solid = start(grid_of(any_cell), bodies, inertia="lumped")
    before, energy = solid.momentum(), sum(solid.energy().values())
    for _ in range(25):
        solid.advance(0.01)
    after = sum(solid.energy().values())
    np.testing.assert_allclose(solid.momentum(), before, rtol=0, atol=1e-5)
    assert 0.05 * energy < after < energy
    assert solid.bodies[1].points.v[:, 0].mean() > 0.0003
    F = solid.bodies[1].points.F
    assert abs(np.swapaxes(F, 1, 2) @ F - np.eye(D)).max() < 1e-6  # it turns, but does not deform


def test_sums_over_the_bodies(start):
    """Momentum and kinetic energy by hand; the points are numbered through; what ParaView shows tells the
    bodies apart."""
    bodies = [block("quadrilateral", 0.0, 1.0, rho=2.0, velocity=(1.0, 0.0)),
              block("quadrilateral", 1.5, 3.0, neo_hooke(1e4, 0.2), rho=3.0, velocity=(0.0, -2.0))]
    solid = start(grid_of("quadrilateral"), bodies, gravity=(0.0, -1.0))
    np.testing.assert_allclose(solid.momentum(), [2.0, -9.0], rtol=1e-14)
    assert solid.energy()["kinetic"] == pytest.approx(1.0 + 9.0, rel=1e-14)
    assert solid.energy()["potential"] == pytest.approx(0.5 * (2.0 + 4.5), rel=1e-14)
    solid.advance(0.001)
    np.testing.assert_array_equal(whole(solid, "gid"), np.arange(solid.count))
    positions, _, fields = solid.snapshot()["points"]
    np.testing.assert_array_equal(fields["body"], positions[:, 0] > 1.25)
    assert len(solid.cauchy_stress()) == len(positions) == solid.count == 16 + 24


def test_boundary_particles_start_like_the_nearest_body(start):
    x = np.array([[0.9, 0.5], [1.6, 0.5]])
    bodies = [block("quadrilateral", 0.0, 1.0, velocity=(1.0, 0.0)),
              block("quadrilateral", 1.5, 3.0, linear(1e5, 0.3), velocity=(0.0, -2.0))]
    springs = Penalty(Interface(x, np.zeros((0, 2), int)), normal=(1.0, 0.0), follows=True)
    solid = start(grid_of("quadrilateral"), bodies, interface=Interface(x, np.zeros((0, 2), int)),
                  penalties=[springs])
    np.testing.assert_array_equal(solid.surface()[1], [[1.0, 0.0], [0.0, -2.0]])
    stiffness = solid.penalties[0]._stiffness
    assert stiffness[1] / stiffness[0] == pytest.approx(100.0)


@pytest.mark.parametrize("cell", ["triangle", "hexahedron"])
def test_going_back_repeats_the_run(start, cell):
    D = dim(cell)
    bodies = [block(cell, 0.0, 1.0, velocity=(3.0, 0.5, 0.1)[:D]), block(cell, 1.5, 2.0, neo_hooke(1e4, 0.3))]
    solid = start(grid_of(cell), bodies, inertia="lumped")
    for _ in range(2):
        solid.advance(0.02)
    state = solid.get_state()
    ends = []
    for _ in range(2):
        solid.set_state(state)
        for _ in range(8):
            solid.advance(0.02)
        ends.append(solid.get_state())
    assert "points.x" in ends[0] and "points1.x" in ends[0]
    for name in ends[0].keys() - {"tangent"}:
        assert ends[0][name].tobytes() == ends[1][name].tobytes(), name


@pytest.mark.parametrize("bodies, words", [([], "there is no body: give at least one"),
                                           ([block("triangle", 0.0, 1.0),
                                             block("triangle", 1.0, 2.0, thickness=0.5)],
                                            "body 1 is 0.5 m thick, body 0 1.0 m: bodies in one plane grid "
                                            "have the same thickness"),
                                           ([block("triangle", 0.0, 1.0), block("tetrahedron", 1.0, 2.0)],
                                            "body 1 has 3 dimensions, the grid 2"),
                                           ([block("triangle", 0.0, 1.0), block("triangle", 3.0, 5.0)],
                                            "the body reaches out of the grid: a material point"),])
def test_bodies_that_do_not_fit(bodies, words):
    with pytest.raises(ValueError, match=words):
        MPM(grid_of("triangle"), bodies)


def test_points_of_several_bodies_have_to_be_asked_for_one_by_one(start):
    solid = start(grid_of("triangle"), [block("triangle", 0.0, 1.0), block("triangle", 1.0, 2.0)])
    with pytest.raises(ValueError,
                       match=r"there are 2 bodies: take the points of each from bodies\[n\].points"):
        _ = solid.points


def test_a_tangent_that_cannot_be_factorised_is_not_the_end(start, options, capfd):
    """A body 1e8 times as stiff beside a soft one, with nearly empty cells: from rest the tangent is positive
    definite where it was not from the first guess. Nobody prints what CHOLMOD thinks of it."""
    bodies = [block("hexahedron", 0.0, 1.0, velocity=(1.0, 0.0, 0.0)),
              block("hexahedron", 1.25, 2.25, neo_hooke(1e11, 0.3), 10.0)]
    for more in ({}, dict(snes_lag_jacobian=1, snes_linesearch_type="bt")):
        options(**more)
        solid = start(grid_of("hexahedron"), bodies)
        for _ in range(25):
            solid.advance(0.01)
        assert np.isfinite(whole(solid, "x")).all() and solid.describe()["ghost_since"] is None
    shown = capfd.readouterr()
    assert not shown.out and "CHOLMOD" not in shown.err
