"""Free bodies with the default inertia: where Newton's method fails the loop asks for the ghost penalty, then
takes shorter steps, and says what is left."""
import numpy as np
import pytest

from coupling import Steps, march
from mpm_fenicsx import LAWS, MPM, Body, Box, Cloud, Grid, Interface, MPMDivergedError, Support
from mpm_fenicsx.grid import compat

ELASTIC, DRY = LAWS["neo_hooke"](1e6, 0.3), LAWS["mohr_coulomb"](5e4, 0.4, 22.0)
SOIL = LAWS["mohr_coulomb"](1e6, 0.3, 30.0, cohesion=3e4)  # yields: the discs meet with rho c v = 1.4e5 Pa


def disc(centre, velocity, law=ELASTIC, radius=0.15, spacing=0.0217):
    """Points on a lattice that does not fit the grid's."""
    side = np.arange(-radius, radius, spacing) + 0.13 * spacing
    x = np.array([(a, b) for a in side for b in side if a * a + b * b < radius**2])
    return Body(Cloud(x + centre, np.full(len(x), spacing**2)), None, None, law, 1000.0,
                velocity=velocity)


def spin(x):
    return 40.0 * np.column_stack([0.5 - x[:, 1], x[:, 0] - 0.5])


def scene(name, **more):
    """A free bar that turns, two bodies that meet in the middle or off it, or a dry column that collapses.

    The column is for what does not depend on the step: whether and where Newton's method fails in it hangs on
    round-off. In the others it fails in the same step when all velocities change by 1e-5, that of soil where
    Newton's method goes on to 1e-6 of its inertia."""
    grid = Grid(Box((0.0, 0.0), (1.0, 1.0)), (20, 20))
    if name == "turning bar":
        return MPM(grid, Body(Box((0.35, 0.45), (0.65, 0.55)), (12, 4), 2, ELASTIC, 1000.0, velocity=spin),
                   **more)
    if name == "column":
        column = Body(Box((0.0, 0.0), (0.1, 0.2)), (10, 20), 3, DRY, 1300.0, cell="triangle")
        held = [Support(lambda x, d=d: x[:, d] < 1e-9, fix) for d, fix in ((1, "xy"), (0, "x"))]
        return MPM(Grid(Box((0.0, 0.0), (0.6, 0.3)), (30, 15)), column, held, gravity=(0.0, -9.81), **more)
    off, law = {"hit": (0.0, ELASTIC), "off-centre hit": (0.08, ELASTIC), "hit of soil": (0.08, SOIL)}[name]
    return MPM(grid, [disc((0.3, 0.3), (4.0, 4.0), law), disc((0.62 + off, 0.62 - off), (-4.0, -4.0), law)],
               bonded=True, **more)


# and their steps
SCENES = {"turning bar": 60, "hit": 90, "off-centre hit": 90, "hit of soil": 50}


@pytest.mark.parametrize("name", SCENES)
def test_free_bodies_run_by_themselves(name, options):
    """With consistent inertia alone Newton's method fails before the end. (Its energy rises at first in the
    bar, by 14 %: the transfers between points and grid are made for lumped inertia.)"""
    options(snes_rtol=1e-6)
    solid, steps = scene(name), []
    momentum, energies = [solid.momentum()], [sum(solid.energy().values())]

    def look(step):
        steps.append(step)
        momentum.append(solid.momentum())
        energies.append(sum(solid.energy().values()))

    march(solid, Steps(1e-3, SCENES[name] * 1e-3), [look])
    said = solid.describe()
    solid.close()
    assert len(steps) == SCENES[name] and sum(step.failed for step in steps) == 1
    assert 0.0 < said["ghost_since"] < SCENES[name] * 1e-3
    assert max(energies) < 1.2 * energies[0]
    mass = sum(part.points.mass.sum() for part in solid.bodies)
    assert np.abs(momentum[-1] - momentum[0]).max() < 1e-6 * mass


def positions(solid):
    """Of all points [m], in the order of their numbers."""
    return np.concatenate([part.points.x[np.argsort(part.points.gid)] for part in solid.bodies])


def test_states_know_the_rung(options):
    """Before the penalty came, and after: both go on bit for bit."""
    options(snes_rtol=1e-6)
    solid, states, ends = scene("hit of soil"), [], []

    def keep(step):
        if step.number in (10, 40):
            states.append(solid.get_state())

    march(solid, Steps(1e-3, 0.05), [keep])
    end = positions(solid)
    for state, steps in zip(states, (40, 10)):
        solid.set_state(state)
        assert (solid.describe()["ghost_since"] is None) == (steps == 40)
        march(solid, Steps(1e-3, 0.05))
        ends.append(positions(solid))
    assert all(np.array_equal(end, again) for again in ends)
    solid.close()


@pytest.mark.parametrize("inertia, adapt, tried, remains", [
    ("consistent", 0.0, "tried before: the ghost penalty on inertia, steps down to 0.00125 s", "$"),
    ("consistent", None, "tried before: the ghost penalty on inertia", "; left to try: shorter steps"),
    ("ghost", 0.0, "tried before: steps down to 0.00125 s", "$"),
    ("lumped", None, "left to try: shorter steps", r" where one fails \(adapt=0\)$")])
def test_the_end_of_the_ladder_says_what_was_tried_and_what_remains(options, inertia, adapt, tried, remains):
    options(snes_max_it=1)
    solid = scene("column", inertia=inertia)
    other = ', or inertia="lumped"' if inertia != "lumped" else ""
    parts = "; nor did 2, 4 or 8 shorter steps in its place" if adapt is None else ""
    # a repeated step has a tangent at the guess, the first one that of the bodies as they are
    news = "new tangents, " if adapt is None else ""
    with pytest.raises(MPMDivergedError, match=rf"step 1, t = .*\); {news}a start from rest, full "
                       rf"Newton steps did not help{parts}: .*-mpm_snes_max_it 100{other}; {tried}"
                       rf"{remains}"):
        march(solid, Steps(4e-2, 8e-2, adapt))
    assert solid.time == 0.0
    solid.close()


@pytest.mark.parametrize("package", ["mumps", "umfpack"])
def test_a_factor_that_fails_is_not_used_again(options, package):
    """One point in the middle of a cell has one mass for four nodes: the tangent is singular in exact
    numbers, too."""
    if not compat.factorises(package, "lu"):
        pytest.skip(f"this PETSc has no {package}")
    options(pc_type="lu", pc_factor_mat_solver_type=package)
    solid = MPM(Grid(Box((0.0, 0.0), (1.0, 1.0)), (8, 8)),
                Body(Cloud(np.array([[0.3125, 0.3125]]), np.array([0.01])), None, None,
                     LAWS["linear"](1e-30, 0.0), 1000.0),
                interface=Interface.line((0.28, 0.32), (0.34, 0.32), 2))
    with pytest.raises(MPMDivergedError, match="new tangents, a start from rest, full Newton steps"):
        solid.advance(1e-3, np.ones_like(solid.interface.x))
    solid.close()


def test_held_bodies_do_not_need_it(make_mpm):
    solid = make_mpm(supports=[Support(lambda x: x[:, 0] < 1e-9, "xy")], gravity=(0.0, -1.0))
    failed = []
    march(solid, Steps(0.01, 0.05), [lambda step: failed.append(step.failed)])
    assert not any(failed) and solid.describe()["ghost_since"] is None


def test_rungs_depend_on_inertia_and_law(make_mpm):
    stiffness = "the ghost penalty on stiffness"
    for inertia in ("lumped", "ghost"):
        solid = make_mpm(inertia=inertia)
        assert [solid.fall_back(), solid.fall_back()] == [stiffness, ""]
        assert make_mpm(inertia=inertia, law=DRY).fall_back() == ""
    solid = make_mpm()
    assert solid.fall_back() == "the ghost penalty on inertia" and solid.describe()["ghost_since"] == 0.0
    assert [solid.fall_back(), solid.fall_back()] == [stiffness, ""]
