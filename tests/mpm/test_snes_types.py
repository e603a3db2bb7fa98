"""The accepted state is that of the solution whatever SNES finds it, not of the last evaluation."""
import numpy as np
import pytest

from mpm_fenicsx import LAWS, Box, Grid, Structure, Support, mohr_coulomb
from mpm_fenicsx.solve.step import Step

# one iteration of Newton's method as preconditioner
NEWTON = dict(npc_snes_type="newtonls", npc_snes_max_it=1)
TYPES = {"newtonls": {}, "newtontr": {}, "qn": dict(snes_qn_scale_type="jacobian"),
         "anderson": NEWTON, "ngmres": NEWTON}


@pytest.fixture
def elastic(make_mpm):
    """A neo-Hookean cantilever that bends by a tenth of its height within the steps of the test."""
    return lambda: make_mpm(
        "quadrilateral", box=((0.0, 0.0), (2.0, 0.5)), body_cells=(16, 4), law=LAWS["neo_hooke"](1e4, 0.3),
        grid=Grid(Box((-0.5, -1.0), (2.5, 1.5)), (12, 10)), gravity=(0.0, -20.0), interface=None,
        supports=[Support(lambda x: x[:, 0] < 0.1, "xy")])


@pytest.fixture
def plastic(make_mpm):
    """A heap of soil with little cohesion that yields under its weight from the first step on."""
    return lambda: make_mpm(
        "quadrilateral", box=((0.0, 0.0), (1.0, 1.0)), body_cells=(10, 10), rho=100.0, inertia="lumped",
        law=mohr_coulomb(1e5, 0.3, 30.0, 0.0, cohesion=1.0), grid=Grid(Box((-0.2, 0.0), (2.2, 1.2)), (12, 6)),
        gravity=(0.0, -10.0), interface=None, supports=[Support(lambda x: x[:, 1] < 0.01, "xy")])


@pytest.fixture(params=["elastic", "plastic"])
def run(request, options):
    """``run(steps, **options)``: the body after some steps."""
    make = request.getfixturevalue(request.param)

    def advance(steps, **given):
        options(snes_rtol=0.0, snes_atol=1e-8, snes_max_it=100, **given)
        solid = make()
        for _ in range(steps):
            solid.advance(0.01)
        return solid
    return advance


@pytest.mark.parametrize("kind", TYPES)
def test_every_snes_gives_the_same_state(run, kind):
    expected, solid = run(4, snes_lag_jacobian=1), None
    solid = run(4, snes_type=kind, **TYPES[kind])
    p, q = solid.points, expected.points
    assert kind in solid.step.newton.describe() and np.abs(q.v).max() > 0.1
    np.testing.assert_allclose(p.x, q.x, rtol=0, atol=1e-10)
    np.testing.assert_allclose(p.F, q.F, rtol=0, atol=1e-8)
    for name in p.state.dtype.names:
        size = max(1.0, np.abs(q.state[name]).max())  # of stress, others are strains
        np.testing.assert_allclose(p.state[name], q.state[name], rtol=0, atol=1e-8 * size)


def evaluations(step):
    """Displacements at which the step's residual is evaluated from now on, a list that grows."""
    evaluate, seen = step.equations.residual, []

    def residual(u, r):
        seen.append(u.copy())
        return evaluate(u, r)
    step.equations.residual = residual
    return seen


def test_newton_evaluates_no_residual_twice(run):
    """With a line search that takes full steps: one at the guess and one per iteration."""
    solid = run(1)
    seen = evaluations(solid.step)
    solid.advance(0.01)
    assert len(seen) == solid.iterations + 1


@pytest.fixture
def resting(make_mpm):
    """A block on a floor, which springs make, from its first step on."""
    return lambda: make_mpm(
        "quadrilateral", box=((0.0, 0.0), (1.0, 0.5)), body_cells=(8, 4), gravity=(0.0, -10.0),
        interface=None, grid=Grid(Box((-0.5, -0.5), (1.5, 1.0)), (8, 6)),
        structures=[Structure.plane("floor", (0.0, 0.0), "+y", Box((-0.5, -0.5), (1.5, 1.0)))])


def test_contact_ends_with_a_looser_tolerance_late(resting, monkeypatch, options):
    """From the iterations ``late`` on; not where the user has said how far to go."""
    def residuals(late, looser=1e-4, **given):
        monkeypatch.setattr(Step, "late", {late: looser})
        options(**given)
        solid, left = resting(), []
        solid.step.newton.snes.setMonitor(lambda snes, n, norm: left.append(snes.getTolerances()[1]))
        solid.advance(0.01)
        return [*left, solid.step.newton.snes.getTolerances()[1]]
    strict, loose, looser, by_user = (residuals(10), residuals(1), residuals(1, 1e-2),
                                      residuals(1, snes_rtol=1e-12))
    assert len(strict) > 2 and len(set(strict)) == 1 and loose[0] == strict[0]
    assert by_user == pytest.approx([1e-6 * strict[0]] * len(by_user))
    assert (loose[-1], looser[-1]) == pytest.approx((100.0 * strict[0], 1e4 * strict[0]))


def test_a_line_search_that_full_steps_please_costs_nothing(resting):
    """Contact has line search cp, which of its own accord evaluates five residuals and the last one twice."""
    solid = resting()
    solid.advance(0.01)
    seen, iterations = evaluations(solid.step), 0
    for _ in range(5):
        solid.advance(0.01)
        iterations += solid.iterations
    assert iterations >= 5 and len(seen) == iterations + 5


def test_a_trial_of_another_place_is_not_taken(run):
    """Where the last evaluation was not at the solution, it is evaluated there once more."""
    solid = run(1)
    step, newton = solid.step, solid.step.newton
    step.begin(0.01, solid.time, np.zeros((0, 2)))
    trial, _ = step.solve("a test")
    solution, kept = trial.u.copy(), trial.of_terms[0].new.F.copy()
    assert newton._trial_at(newton.u) is trial
    newton._trial = step.equations.residual(0.5 * solution, np.empty_like(solution))
    again = newton._trial_at(newton.u)
    np.testing.assert_array_equal(again.u, solution)
    np.testing.assert_array_equal(again.of_terms[0].new.F, kept)
