"""When a plastic body keeps its tangent, and an elastic one gives it up; and that the end of a step does not
depend on it."""
from typing import NamedTuple

import numpy as np
import pytest
from petsc4py import PETSc

from mpm_fenicsx import LAWS, MPM, Body, Box, Grid, Support
from mpm_fenicsx.solve.tangents import ENOUGH, MORE, PATIENCE, SLIGHT, SLOW, Tangent, Tangents


class Iteration(NamedTuple):
    """What is asked of PETSc's SNES: the iteration that begins, and its residual [N]; it stops at 1 N."""

    number: int
    residual: float
    ksp: PETSc.KSP

    def getIterationNumber(self):
        return self.number

    def getFunctionNorm(self):
        return self.residual

    def getTolerances(self):
        return 0.0, 1.0, 0.0, 25

    def getKSP(self):
        return self.ksp


def begin(dim, plastic=True, stiffness=1.0, **more):
    """With a tangent that has just been made for steps of 1 s. stiffness: over inertia."""
    tangents = Tangents(dim, plastic, watched=False, **more)
    assert tangents.start(1.0)
    tangents.made(Tangent(1.0, 1.0, 1.0, stiffness))
    return tangents


def asked(tangents, *residuals, method="gmres"):
    """Whether each iteration of a step asks for a tangent, at these residuals; method: of the linear
    solver."""
    found, ksp = [], PETSc.KSP().create(PETSc.COMM_SELF)
    ksp.setType(method)
    for number, residual in enumerate(residuals):
        found.append(tangents.wanted(False, Iteration(number, residual, ksp)))
        if found[-1]:
            tangents.made(tangents.now)
    tangents.solved(len(residuals))
    return found


@pytest.mark.parametrize("stiffness, method", [(1.0, "gmres"), (0.5 * SLIGHT, "gmres"), (1.0, "preonly")])
@pytest.mark.parametrize("dim", ENOUGH)
def test_a_tangent_is_kept_while_few_iterations_with_it_will_do(dim, stiffness, method):
    """The last iteration's part of the residual, and twice that after a tangent of its own; more of them
    where they are cheap."""
    n = ENOUGH[dim] + (MORE[dim] if stiffness < SLIGHT or method == "preonly" else 0)
    tangents = begin(dim, stiffness=stiffness)
    few, more = 0.9 * 100.0**n, 1.1 * 100.0**n
    assert asked(tangents, 100.0 * more, more, method=method) == [False, True]
    tangents.drop()
    assert asked(tangents, 100.0 * few, few, 0.01 * few, method=method) == [True, True, False]
    tangents.drop()
    assert asked(tangents, 200.0 * few, few, method=method) == [True, False]


def test_a_tangent_that_is_of_use_goes_on_to_the_next_step_in_space():
    good, bad = (1e6, 1e4, 1e2), (1e6, 5e5, 1e2)
    for dim, residuals, kept in ((3, good, True), (3, bad, False), (2, good, False)):
        tangents = begin(dim)
        asked(tangents, *residuals)
        assert tangents.holds == kept
        assert not tangents.start(1.0) and asked(tangents, 1e6)[0] != kept
    tangents = begin(3)
    assert not tangents.start(2.0) and asked(tangents, 1e6) == [True]  # another dt


def test_it_is_known_whether_an_iteration_kept_its_tangent():
    """Else an attempt with a new one in every iteration would repeat the one before."""
    tangents = begin(2)
    asked(tangents, 1e6, 1e5)
    assert tangents.kept_one  # in the first iteration
    tangents.drop()
    tangents.start(1.0)
    assert asked(tangents, 1e6, 9e5, 8e5) == 3 * [True] and not tangents.kept_one
    assert begin(2, plastic=False).kept_one  # where Newton's method never asks


def test_load_steps_and_users_have_their_way(options):
    assert asked(begin(3, plastic=False, anew=True), 1e3, 1.0) == [True, True]
    options(snes_lag_jacobian=1)
    assert asked(begin(3), 1e3, 1.0) == [True, True]


@pytest.mark.parametrize("dim", PATIENCE)
def test_an_elastic_body_gives_up_its_tangent_when_that_has_cost_as_much_as_a_new_one(dim):
    tangents, steps = begin(dim, plastic=False), 0
    while tangents.holds:
        assert not tangents.start(1.0)
        tangents.solved(SLOW + 1)
        steps += 1
    assert steps == PATIENCE[dim] + 1 and tangents.start(1.0)


def block(dim):
    """Soil thrown down on its floor, with steps of which many yield."""
    top = (0.4, 0.2, 0.2)[:dim]
    body = Body(Box((0.0,) * dim, top), (4, 2, 2)[:dim], 2, LAWS["mohr_coulomb"](1e6, 0.3, 20.0), 1800.0,
                velocity=(1.0, -2.0, 0.5)[:dim])
    floor = Support(lambda x: x[:, 1] < 1e-9, "xyz"[:dim])
    grid = Grid(Box((-0.2,) + (0.0,) * (dim - 1), (0.8, 0.3, 0.3)[:dim]), (10, 3, 3)[:dim])
    return MPM(grid, body, [floor], gravity=(0.0, -9.81, 0.0)[:dim], inertia="lumped")


@pytest.mark.parametrize("dim", ENOUGH)
def test_kept_tangents_lead_to_the_same_motion(options, dim):
    ends, made = [], []
    for lag in ({}, {"snes_lag_jacobian": 1}):
        options(**lag, snes_rtol=1e-8)
        solid = block(dim)
        for _ in range(20):
            solid.advance(5e-4)
        ends.append(solid.points.x - solid.points.x.mean(axis=0))
        made.append(solid.step.tangents.count)
        assert (solid.points.state["plastic_strain"] > 1e-4).any()
        solid.close()
    assert made[0] < made[1]
    np.testing.assert_allclose(ends[0], ends[1], rtol=0, atol=1e-8)
