"""What ``MPM.advance`` tries by itself where Newton's method fails: each rung helps, is told once, and is
left again; states and several ranks know of it."""
import warnings

import numpy as np
import pytest

from mpm_fenicsx import LAWS, MPM, Body, Box, Cloud, Grid, GridWall, Interface, MPMDivergedError, Support
from mpm_fenicsx.grid import compat
from mpm_fenicsx.solve.divergence import ANY_SIGN

INERTIA, STIFFNESS = "the ghost penalty on inertia", "the ghost penalty on stiffness"
ELASTIC = LAWS["neo_hooke"](12e6, 0.2)


def cantilever(basis, force=4e5, **more):
    """10 m x 1 m in cells of 0.5 m, bent down by a force [N] that grows over 5 s on its last half metre."""
    body = Body(Box((0.0, 0.0), (10.0, 1.0)), (20, 2), 2, ELASTIC, 1000.0)
    pull = lambda x, t: np.column_stack([np.zeros(len(x)), np.where(x[:, 0] > 9.5, -force * t / 2500, 0.0)])
    return MPM(Grid(Box((-3.0, -14.0), (14.0, 4.0)), (34, 36)), body,
               [Support(lambda x: x[:, 0] < 1e-9, "xy")], body_force=pull, basis=basis, **more)


def turning(inertia="consistent", basis="linear", rate=10.0):
    """A square of 0.4 m that turns."""
    body = Body(Box((0.3, 0.3), (0.7, 0.7)), (8, 8), 2, LAWS["neo_hooke"](1e5, 0.3), 1000.0,
                velocity=lambda x: rate * np.column_stack([0.5 - x[:, 1], x[:, 0] - 0.5]))
    return MPM(Grid(Box((0.0, 0.0), (1.0, 1.0)), (20, 20)), body, inertia=inertia, basis=basis)


def soil(**more):
    """A column of 10 cm x 20 cm that collapses."""
    body = Body(Box((0.0, 0.0), (0.1, 0.2)), (8, 16), 2, LAWS["mohr_coulomb"](5e4, 0.4, 22.0), 1300.0)
    held = [Support(lambda x, d=d: x[:, d] < 1e-9, fix) for d, fix in ((1, "xy"), (0, "x"))]
    return MPM(Grid(Box((0.0, 0.0), (0.4, 0.3)), (16, 12)), body, held, gravity=(0.0, -9.81),
               inertia="lumped", **more)


@pytest.fixture
def advanced():
    """``advanced(solid, dt, steps, force)``: the solid after so many steps, and the texts of its warnings."""
    opened = []

    def advance(solid, dt, steps, *force):
        opened.append(solid)
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always")
            for _ in range(steps):
                solid.advance(dt, *force)
        return solid, [str(one.message) for one in told]

    yield advance
    for solid in opened:
        solid.close()


def points(solid):
    return {name: values for name, values in solid.get_state().items() if name.startswith("points")}


def same(states):
    first, second = states
    return all(np.array_equal(values, second[name]) for name, values in first.items())


# ---------------------------------------------------------------- each rung


# The Cholesky factors of MUMPS, which takes CHOLMOD's place where PETSc has no SuiteSparse, bear any sign.
NEEDS_CHOLMOD = pytest.mark.skipif(not compat.factorises("cholmod", "cholesky"), reason="no CHOLMOD in PETSc")


@NEEDS_CHOLMOD
def test_a_tangent_that_is_not_positive(advanced):
    """A bent beam in steps so long that stiffness decides: Cholesky fails, LU does not, and the next step
    tries Cholesky again."""
    solid, told = advanced(cantilever("ugimp", inertia="lumped"), 0.5, 10)
    assert solid.time == pytest.approx(5.0) and list(solid.helped) == [ANY_SIGN]
    assert 0 < solid.helped[ANY_SIGN][1] < 10 and solid.ghost_since is None
    assert len(told) == 1 and ANY_SIGN in told[0]
    assert "cholesky" in solid.describe()["solver"]


@NEEDS_CHOLMOD
def test_options_are_the_users(advanced, options):
    """With -mpm_pc_type cholesky there is no other solver, so that a later rung has to help."""
    options(pc_type="cholesky")
    solid, _ = advanced(cantilever("ugimp", inertia="lumped"), 0.5, 3)
    assert ANY_SIGN not in solid.helped and solid.helped


def test_a_loop_of_ones_own_gets_ghost_inertia(advanced):
    """Consistent inertia alone fails, round-off decides when (0.46 to 0.84 s were seen); the ghost penalty
    is told once and stays."""
    solid, told = advanced(turning(), 5e-3, 200)
    since, steps = solid.helped[INERTIA]
    assert 0.0 < solid.ghost_since < since < 1.0 and len(told) == 1 and INERTIA in told[0]
    assert steps == 1 and list(solid.describe()["helped"]) == [INERTIA]
    plain, told = advanced(turning("ghost"), 5e-3, 200)
    assert not told and plain.helped == {}


def test_ghost_stiffness_in_long_steps(advanced):
    """Lumped inertia has no ghost penalty, and in long steps inertia does not hold the rim; the end is that
    of steps a tenth as long, within 2 %."""
    solid, told = advanced(cantilever("linear", inertia="lumped"), 0.5, 10)
    assert STIFFNESS in solid.helped and any(STIFFNESS in text for text in told)
    fine, _ = advanced(cantilever("linear", inertia="lumped"), 0.05, 100)
    assert solid.points.x[:, 1].min() == pytest.approx(fine.points.x[:, 1].min(), rel=0.02)


def test_shorter_steps(advanced, options):
    """Two iterations are not always enough for 4 ms; shorter steps in place of one end where others do, and
    the long ones come back."""
    options(snes_max_it=2)
    solid, told = advanced(soil(basis="gimp"), 4e-3, 12)
    assert list(solid.helped) == ["shorter steps"] and len(told) == 1
    assert solid.steps > 12 and solid.time == pytest.approx(0.048, rel=1e-12)
    options(snes_max_it=25)
    plain, _ = advanced(soil(basis="gimp"), 4e-3, 12)
    assert plain.steps == 12 and plain.helped == {}
    moved = np.abs(plain.points.x - soil(basis="gimp").points.x).max()
    assert np.abs(solid.points.x - plain.points.x).max() < 0.01 * moved
    steps = solid.steps
    advanced(solid, 4e-3, 25)
    assert solid.steps == steps + 25 or solid.steps - steps < 4 * 25


def test_all_rungs_in_vain_leave_the_points(advanced, options):
    options(snes_max_it=1)
    solid = soil()
    before = points(solid)
    with pytest.raises(MPMDivergedError, match="step 1, t = 0.04 s .*; nor did 2, 4 or 8 shorter steps in"):
        advanced(solid, 4e-2, 1)
    assert solid.time == 0.0 and solid.steps == 0 and same([before, points(solid)])


# ---------------------------------------------------------------- what others see of a step in parts


def pushed(**more):
    """A block of soil under forces on its top [N], and these."""
    body = Body(Box((0.0, 0.0), (0.1, 0.1)), (4, 4), 2, LAWS["mohr_coulomb"](5e4, 0.4, 22.0), 1300.0)
    top = Interface(np.column_stack([np.linspace(0.01, 0.09, 5), np.full(5, 0.09)]), np.zeros((0, 2), int))
    solid = MPM(Grid(Box((-0.1, -0.1), (0.2, 0.2)), (12, 12)), body, interface=top, inertia="lumped", **more)
    return solid, np.tile([1.0, -40.0], (5, 1))


def test_impulse_of_a_step_in_parts(advanced, options):
    """The force is constant over all parts, and a free block takes up its impulse exactly."""
    options(snes_max_it=2)
    (solid, force), dt, before = pushed(), 4e-3, 0.0
    for _ in range(6):
        advanced(solid, dt, 1, force)
        assert solid.applied == pytest.approx(force.sum(axis=0), rel=1e-10)
        assert solid.momentum() - before == pytest.approx(dt * force.sum(axis=0), rel=1e-6)
        before = solid.momentum()
    assert "shorter steps" in solid.helped and solid.steps > 6


def test_reaction_of_a_step_in_parts(advanced, options):
    """It is the mean of those of the parts, where a floor holds the block."""
    options(snes_max_it=2)
    floor = GridWall(lambda x: np.abs(x[:, 1]) < 1e-9, "+y", separates=True, name="floor")
    (solid, force), of_parts = pushed(penalties=[floor]), []
    once = solid.attempt_once

    def attempt_once(*args):
        if solid.time == before:  # a new attempt at the step
            of_parts.clear()
        once(*args)
        of_parts.append(solid.reaction("floor"))

    solid.attempt_once = attempt_once
    for _ in range(6):
        before = solid.time
        advanced(solid, 4e-3, 1, force)
        assert solid.reaction("floor") == pytest.approx(np.mean(of_parts, axis=0), rel=1e-12)
        if len(of_parts) > 1:
            assert np.ptp(of_parts, axis=0).max() > 0.0
            return
    pytest.fail("all steps were done in one")


def test_states_know_the_parts(advanced, options):
    """From a state in the middle of shorter steps it goes on bit for bit."""
    options(snes_max_it=2)
    solid, ends = soil(), []
    while not solid.helped:
        advanced(solid, 4e-3, 1)
    state = solid.get_state()
    for _ in range(2):
        advanced(solid, 4e-3, 5)
        ends.append({**points(solid), "time": np.array([solid.time, solid.steps])})
        solid.set_state(state)
    assert same(ends)


def test_states_know_ghost_stiffness(advanced):
    solid, ends = cantilever("linear", inertia="lumped"), []
    while not solid.helped:
        advanced(solid, 0.5, 1)
    state = solid.get_state()
    for _ in range(2):
        advanced(solid, 0.5, 3)
        ends.append(points(solid))
        solid.set_state(state)
    other = cantilever("linear", inertia="lumped")
    other.set_state(state)
    advanced(other, 0.5, 3)
    assert same(ends) and same([ends[0], points(other)])


# ---------------------------------------------------------------- nodes without mass


@pytest.mark.parametrize("inertia", ["consistent", "lumped"])
@pytest.mark.parametrize("velocity", [(0.125, 0.0), (0.1, 0.1), (-0.1, 0.05)])
def test_points_on_the_edges_of_cells(inertia, velocity):
    """A block flies so that its points come to lie on the edges of cells, up to round-off: nodes across have
    no mass, but the points' gradients, and must fly with them."""
    x = 0.25 + 0.025 * np.stack(np.meshgrid(*[np.arange(8)] * 2), axis=-1).reshape(-1, 2)
    body = Body(Cloud(x, np.full(64, 0.025**2)), None, None, LAWS["neo_hooke"](1e3, 0.3), 1000.0,
                velocity=velocity)
    solid = MPM(Grid(Box((0.0, 0.0), (1.0, 1.0)), (20, 20)), body, inertia=inertia)
    for _ in range(40):
        solid.advance(0.025)
    assert solid.energy()["strain"] < 1e-20 and solid.helped == {}
    assert solid.points.v == pytest.approx(np.tile(velocity, (64, 1)), abs=1e-12)
    solid.close()


# ---------------------------------------------------------------- the penalty on stiffness


def turned(inertia):
    """The square after a quarter of a turn: cells at its rim are filled unevenly."""
    solid = turning(inertia)
    for _ in range(30):
        solid.advance(5e-3)
    return solid


@pytest.mark.parametrize("inertia", ["lumped", "ghost"])
def test_tangent_with_ghost_stiffness(inertia):
    """It is the derivative of the residual."""
    solid = turned(inertia)
    assert solid.fall_back() == STIFFNESS
    step = solid.step
    step.begin(0.2, solid.time, np.zeros((0, 2)), stiff=True)
    assert (step.ghost.weight > 0.0).any() and step.ghost.of_u > 0.0
    rng, base = np.random.default_rng(1), np.zeros((step.active_cells.owned, 2))
    idle = step.equations.known.idle
    du = np.where(idle, 0.0, rng.normal(size=base.shape))
    ends = [np.empty_like(base) for _ in range(2)]
    for sign, end in zip((1.0, -1.0), ends):
        step.equations.residual(base + sign * 1e-8 * du, end)
    step.newton.make_tangent(step.equations.residual(base, np.empty_like(base)))
    vec, out = step.active_cells.vector(2), step.active_cells.vector(2)
    vec.array_w[:] = du.ravel()
    step.active_cells.matrix.mult(vec, out)
    change, tangent = (ends[0] - ends[1]) / 2e-8, out.array_r.reshape(base.shape)
    assert tangent[~idle] == pytest.approx(change[~idle], abs=1e-5 * np.abs(change).max())
    solid.close()


def test_linear_fields_have_no_ghost_stiffness():
    """A stretch of the whole body costs what it costs without the penalty; a rough field does not."""
    solid, forces = turned("lumped"), {}
    solid.fall_back()
    for stiff in (False, True):
        solid.step.begin(0.2, 0.0, np.zeros((0, 2)), stiff=stiff)
        x = solid.step.active_cells.places[:solid.step.active_cells.owned]
        rough = np.random.default_rng(1).normal(size=x.shape)
        for name, u in (("linear", x @ [[1.0, 0.3], [-0.2, 0.5]]), ("rough", rough)):
            out = forces[name, stiff] = np.empty_like(u)
            solid.step.equations.residual(1e-3 * u, out)
    assert (solid.step.ghost.weight > 0.0).any()
    for name, limits in (("linear", (0.0, 1e-12)), ("rough", (1e-3, 1.0))):
        change = np.abs(forces[name, True] - forces[name, False]).max() / np.abs(forces[name, False]).max()
        assert limits[0] <= change <= limits[1]
    solid.close()


# ---------------------------------------------------------------- several ranks

RANKS = """
import sys, warnings
import numpy as np
from mpm_fenicsx import LAWS, MPM, Body, Box, Grid, Support
warnings.simplefilter("error" if int(sys.argv[2]) else "ignore")
body = Body(Box((0.0, 0.0), (10.0, 1.0)), (20, 2), 2, LAWS["neo_hooke"](12e6, 0.2), 1000.0)
pull = lambda x, t: np.column_stack([np.zeros(len(x)), np.where(x[:, 0] > 9.5, -160.0 * t, 0.0)])
solid = MPM(Grid(Box((-3.0, -14.0), (14.0, 4.0)), (34, 36)), body, [Support(lambda x: x[:, 0] < 1e-9, "xy")],
            body_force=pull, inertia="lumped")
for _ in range(10):
    solid.advance(0.5)
x, gid = (np.concatenate(solid.comm.allgather(getattr(solid.points, name))) for name in ("x", "gid"))
assert all(helped == solid.helped for helped in solid.comm.allgather(solid.helped))
if solid.comm.rank == 0:
    np.savez(sys.argv[1], x=x[np.argsort(gid)], helped=sorted(solid.helped), time=solid.time)
"""


def test_ranks_decide_together(tmp_path, on_ranks):
    ends = []
    for ranks in (1, 2):
        done = on_ranks(ranks, RANKS, tmp_path / f"{ranks}.npz", 0)
        assert done.returncode == 0, done.stderr
        ends.append(np.load(tmp_path / f"{ranks}.npz"))
    one, two = ends
    assert STIFFNESS in one["helped"] and STIFFNESS in two["helped"] and two["time"] == one["time"]
    assert two["x"] == pytest.approx(one["x"], abs=0.05)
