"""Load steps without inertia: equilibrium, rest afterwards, and what is said where there is none."""
import numpy as np
import pytest

from mpm_fenicsx import (
    MPM,
    Body,
    Box,
    Grid,
    GridWall,
    Interface,
    Load,
    MPMDivergedError,
    MPMError,
    Numerics,
    Penalty,
    Support,
    at_rest,
    drucker_prager,
    linear,
    mohr_coulomb,
    neo_hooke,
)
from tests.mpm.kelvin_voigt import kelvin_voigt

RHO, G, E = 1000.0, 10.0, 1e6
BOX = Box((0.0, 0.0), (1.0, 1.0))
FLOOR = Support(lambda x: x[:, 1] < 1e-9, "xy", name="floor")
SIDES = Support(lambda x: np.ones(len(x), bool), "x", name="sides")  # a column that moves up and down
TOP = Interface.top(BOX, 8)


@pytest.fixture
def make_block():
    """``make_block(**changes)``: 1 m x 1 m under gravity on the lower edge of its grid, not yet settled."""
    opened = []

    def make(law=None, supports=(FLOOR,), gravity=(0.0, -G), low=0.0, cells=(4, 4), f_bar=False, stress=None,
             **others):
        body = Body(BOX, cells, 2, law or linear(E, 0.3), RHO, f_bar=f_bar, stress=stress)
        grid = Grid(Box((-1.0, low), (2.0, 3.0)), (12, round((3.0 - low) * 4)))
        opened.append(MPM(grid, body, supports, gravity=gravity, **others))
        return opened[-1]

    yield make
    for solid in opened:
        solid.close()


def speed_after(solid, steps=5, dt=1e-3):
    """Of the fastest point [m/s] in the steps that follow."""
    fastest = 0.0
    for _ in range(steps):
        solid.advance(dt)
        fastest = max(fastest, np.abs(solid.points.v).max())
    return fastest


# ------------------------------------------------------------------ equilibrium

@pytest.mark.parametrize("inertia", ["consistent", "lumped", "ghost"])
@pytest.mark.parametrize("f_bar", [False, True])
def test_a_column_carries_its_weight_and_stays_at_rest(make_block, inertia, f_bar):
    """Without lateral strain the vertical stress is the weight above, whatever the law; without settling the
    column swings."""
    column = dict(supports=[FLOOR, SIDES], inertia=inertia, f_bar=f_bar)
    solid = make_block(**column)
    height = solid.points.x[:, 1].copy()
    settled = solid.settle(4)
    assert settled.steps == 4 and settled.shortest == 1.0 and not settled.ghost
    exact = -RHO * G * (1.0 - height)
    assert np.abs(solid.cauchy_stress()[:, 1, 1] - exact).max() < 0.08 * RHO * G  # a step of 1/4 per cell
    assert abs(solid.cauchy_stress()[:, 1, 1].mean() + 0.5 * RHO * G) < 1e-3 * RHO * G
    assert solid.time == 0.0 and solid.steps == 0
    assert speed_after(solid) < 1e-9
    swings = make_block(**column)
    assert speed_after(swings) > 1e-2


@pytest.mark.parametrize("law", [neo_hooke(E, 0.3), drucker_prager(E, 0.3, friction_angle=40.0, cohesion=2e3),
                                 mohr_coulomb(E, 0.3, friction_angle=40.0, cohesion=2e3)],
                         ids=lambda law: law.name)
def test_other_laws_and_a_free_block(make_block, law):
    """Yielding at its foot or not, it is at rest."""
    solid = make_block(law, f_bar=law.name != "neo_hooke", inertia="lumped")
    solid.settle(5)
    assert 4000.0 < -solid.cauchy_stress()[:, 1, 1].mean() < 6000.0
    assert speed_after(solid) < 1e-8


def test_the_number_of_steps_does_not_matter_to_an_elastic_body(make_block):
    """But for what the grid at rest sees of a deformed body, which falls with the length of the steps."""
    few, many, most = (make_block(supports=[FLOOR, SIDES]) for _ in range(3))
    for solid, n in ((few, 1), (many, 4), (most, 16)):
        solid.settle(n)
    difference = [np.abs(solid.points.x - most.points.x).max() for solid in (few, many)]
    sag = 1.0 - most.points.x[:, 1].max()
    assert difference[0] < 0.02 * sag and difference[1] < 0.5 * difference[0]


def test_given_stress_gives_way_to_that_of_the_loads(make_block):
    """Stress in equilibrium with the weight stays, and nothing moves but by what the grid cannot resolve."""
    law = drucker_prager(E, 0.3, friction_angle=40.0, cohesion=1e5)
    start = dict(supports=[FLOOR, SIDES], stress=at_rest(1.0, RHO, G, 0.3 / 0.7))
    solid, bare = make_block(law, **start), make_block(law, supports=[FLOOR, SIDES])
    x = solid.points.x.copy()
    solid.settle(4)
    bare.settle(4)
    moved, sag = np.abs(solid.points.x - x).max(), np.abs(bare.points.x - x).max()
    assert moved < 0.05 * sag
    assert speed_after(solid) < 1e-8


def test_settling_again_moves_nothing(make_block):
    solid = make_block()
    solid.settle(4)
    x = solid.points.x.copy()
    solid.settle(2)
    assert np.abs(solid.points.x - x).max() < 1e-8


def test_it_may_come_in_the_middle_of_a_run(make_block):
    """A swinging block comes to rest where one that never moved does; time goes on from there."""
    swings, still = make_block(), make_block()
    for _ in range(20):
        swings.advance(2e-3)
    time, steps = swings.time, swings.steps
    swings.settle(4)
    still.settle(4)
    assert (swings.time, swings.steps) == (time, steps)
    sag = 1.0 - still.points.x[:, 1].max()
    assert np.abs(swings.points.x - still.points.x).max() < 0.02 * sag
    assert speed_after(swings) < 1e-8


def test_on_step_is_told_the_load_factor(make_block):
    solid, factors = make_block(), []
    solid.settle(4, on_step=factors.append)
    assert factors == [0.25, 0.5, 0.75, 1.0]


@pytest.mark.parametrize("basis", ["ugimp", "gimp", "bspline"])
@pytest.mark.parametrize("transfer", ["newmark", "tpic", "apic"])
def test_with_a_smooth_basis_and_any_transfer(make_block, basis, transfer):
    """Domains that reach into the next cell give its nodes hardly any stiffness; the midpoint rule has forces
    in the middle of a step, but a load step ends in equilibrium. What the ghost penalty still carries at the
    rim leaves less than a thousandth of the energy of a sudden start."""
    solid = make_block(numerics=Numerics(basis=basis, transfer=transfer))
    solid.settle(4)
    assert abs(solid.cauchy_stress()[:, 1, 1].mean() + 0.5 * RHO * G) < 5e-3 * RHO * G
    alike = make_block(numerics=Numerics(basis=basis))
    alike.settle(4)
    np.testing.assert_allclose(solid.points.x, alike.points.x, rtol=0, atol=1e-12)
    sudden = make_block(numerics=Numerics(basis=basis, transfer=transfer))
    for one in (solid, sudden):
        speed_after(one)
    assert solid.energy()["kinetic"] < 1e-3 * sudden.energy()["kinetic"]


# ------------------------------------------------------------------ loads

def test_forces_pressures_and_body_forces(make_block):
    """Each carries its share of the reaction: the sum of the vertical stress over a section."""
    loads = [Load(TOP, pressure=lambda t: 2e3 * (1.0 + t), name="pressure"),
             Load(TOP, traction=(0.0, -1e3), name="traction"),
             Load(TOP, force=np.array((0.0, -1e3 / 9)), name="force")]
    solid = make_block(supports=[FLOOR, SIDES], gravity=None, loads=loads, interface=TOP,
                       body_force=lambda x, t: np.broadcast_to((0.0, -1.0), x.shape))
    solid.settle(4, force=np.full((9, 2), (0.0, -3e3 / 9)))
    exact = -(2e3 + 1e3 + 1e3 + 3e3 + 0.5 * RHO * 1.0)
    assert abs(solid.cauchy_stress()[:, 1, 1].mean() / exact - 1.0) < 1e-3


def test_a_pressure_follows_the_surface_to_the_end(make_block):
    """A cantilever bent by pressure on its upper side: at rest afterwards, as the dynamic step sees the same
    force; the pressure stays normal to the surface."""
    clamp = Support(lambda x: x[:, 0] < 1e-9, "xy")
    box = Box((0.0, 1.0), (2.0, 1.5))
    body = Body(box, (16, 4), 2, linear(E, 0.0), RHO)
    top = Interface.top(box, 16)
    solid = MPM(Grid(Box((0.0, -1.0), (3.0, 2.0)), (24, 24)), body, [clamp], top,
                loads=[Load(top, pressure=6e3)])
    solid.settle(8)
    (x, _), force = solid.surface(), solid.loads[0].points.force
    assert x[-1, 1] < 0.4 and x[-1, 0] < 1.8  # far down, and back
    edge = x[-1] - x[-2]
    end = force[-1] / np.linalg.norm(force[-1])
    assert abs(end @ edge / np.linalg.norm(edge)) < 1e-6
    assert abs(end[0]) > 0.6  # it has turned
    before = solid.energy()["strain"]
    for _ in range(5):
        solid.advance(1e-4)
    assert solid.energy()["kinetic"] < 1e-3 * before  # points have crossed cells of the linear basis
    solid.close()


def test_functions_of_time_are_taken_at_the_present(make_block):
    load = Load(TOP, pressure=lambda t: 1e3 if t == 0.0 else 7e3)
    solid = make_block(supports=[FLOOR, SIDES], gravity=None, loads=[load])
    solid.settle(2)
    assert solid.cauchy_stress()[:, 1, 1].mean() == pytest.approx(-1e3, rel=1e-3)


# ------------------------------------------------------------------ walls, hinges, rates

def test_a_block_on_a_rough_slope_sticks(make_block):
    """Friction knows the normal force of this load step, not of the last one: it holds up to its angle."""
    wall = lambda friction: GridWall(lambda x: x[:, 1] < 1e-9, "+y", friction=friction, separates=True)
    slope = dict(supports=(), gravity=(0.35 * G, -G))
    solid = make_block(penalties=[wall(0.5)], **slope)
    solid.settle(4)
    assert speed_after(solid) < 1e-8
    np.testing.assert_allclose(solid.reaction("grid wall"), (-0.35 * RHO * G, RHO * G), rtol=1e-5)
    slides = make_block(penalties=[wall(0.2)], **slope)
    with pytest.raises(MPMDivergedError, match="there is no equilibrium without inertia beyond"):
        slides.settle(4)


@pytest.mark.parametrize("contact", ["nodes", "surface"])
@pytest.mark.parametrize("basis", ["linear", "ugimp"])
def test_a_block_on_a_wall_within_the_grid(make_block, basis, contact):
    """Domains that stick out under the wall reach nodes on which it does not press: those hardly move."""
    wall = Penalty(Interface.line((-1.0, 0.0), (2.0, 0.0), 24), normal=(0.0, 1.0), friction=0.5,
                   separates=True, contact=contact, name="wall")
    solid = make_block(supports=(), low=-1.0, gravity=(0.3 * G, -G), penalties=[wall],
                       numerics=Numerics(basis=basis))
    assert solid.settle(4).shortest == 1.0
    np.testing.assert_allclose(solid.reaction("wall"), (-0.3 * RHO * G, RHO * G), rtol=1e-4)
    speed_after(solid)
    assert solid.energy()["kinetic"] < 0.02  # of 1.4 J in the first five steps of a sudden start


def test_a_hinge_holds(make_block):
    """Particles that follow the body hold it as a support does."""
    hinge = Penalty(Interface.line((0.02, 0.05), (0.98, 0.05), 8), follows=True)
    solid = make_block(supports=(), low=-1.0, penalties=[hinge])
    solid.settle(4)
    np.testing.assert_allclose(solid.reaction("penalty"), (0.0, RHO * G), rtol=1e-6, atol=1e-3)
    assert speed_after(solid) < 1e-6


def test_a_rate_dependent_law_is_told_that_no_time_passes(make_block):
    """It settles to the stress without rates, at once, whatever its viscosity."""
    still, thick = make_block(kelvin_voigt(E, 0.0)), make_block(kelvin_voigt(E, 1e9))
    for solid in (still, thick):
        solid.settle(3)
    np.testing.assert_allclose(thick.points.x, still.points.x, rtol=0, atol=1e-12)
    assert speed_after(thick) < 1e-8


# ------------------------------------------------------------------ what cannot be

@pytest.mark.parametrize("supports, gravity, what", [
    ((), (0.0, -G), "free to move along y"), ((FLOOR,), (0.0, -G), None),
    ((Support(lambda x: x[:, 1] < 1e-9, "y"),), (0.1, -G), "free to move along x"),
    ((Support(lambda x: x[:, 1] < 1e-9, "y"),), (0.0, -G), None),  # nothing pushes it along x
    ((Support(lambda x: np.abs(x).max(axis=1) < 1e-9, "xy"),), (0.0, -G), "free to turn")])
def test_a_body_that_nothing_holds(make_block, supports, gravity, what):
    solid = make_block(supports=supports, gravity=gravity)
    if what is None:
        solid.settle(2)
        assert speed_after(solid) < 1e-8
        return
    before = solid.get_state()
    with pytest.raises(MPMError, match=what):
        solid.settle(2)
    after = solid.get_state()
    assert all(np.array_equal(before[name], after[name]) for name in before if name.startswith("points"))
    solid.advance(1e-3)  # and falls


def test_one_of_two_bodies_hangs_in_the_air():
    bodies = [Body(Box((x, y), (x + 0.5, y + 0.5)), (2, 2), 2, linear(E, 0.3), RHO)
              for x, y in ((0.0, 0.0), (2.0, 1.0))]
    solid = MPM(Grid(Box((-1.0, 0.0), (3.0, 3.0)), (16, 12)), bodies, [FLOOR], gravity=(0.0, -G))
    with pytest.raises(MPMError, match=r"nothing holds the body around x = \[2.25, 1.25\] m"):
        solid.settle(2)
    solid.close()


def test_a_column_that_collapses_says_how_far_it_came(make_block):
    """A vertical cut stands up to 4 c / (rho g) tan(45 + phi/2), 57 % of this height (Coulomb's wedge); the
    floor, which holds two sides, helps a little, as do coarse cells."""
    law = mohr_coulomb(E, 0.3, friction_angle=20.0, cohesion=1e3)
    solid = make_block(law, f_bar=True, inertia="lumped")
    state = solid.get_state()
    with pytest.raises(MPMDivergedError, match=r"beyond (\d\d\.\d)% of the loads") as raised:
        solid.settle(5)
    assert 55.0 < float(str(raised.value).split("beyond ")[1].split("%")[0]) < 80.0
    assert np.array_equal(solid.points.x, state["points.x"]) and np.array_equal(solid.points.a,
                                                                                state["points.a"])


@pytest.mark.parametrize("steps", [0, -1, 2.5, "five"])
def test_load_steps_are_a_number(make_block, steps):
    with pytest.raises(ValueError, match="load_steps"):
        make_block().settle(steps)
    with pytest.raises(ValueError, match="settle"):
        Numerics(settle=steps or -3)


# ------------------------------------------------------------------ as a key, states, ranks

def test_as_a_key_it_comes_before_the_first_step(make_block):
    solid, by_hand = make_block(numerics=Numerics(settle=3)), make_block()
    by_hand.settle(3)
    again = solid.anew()
    for other in (by_hand, again):
        np.testing.assert_array_equal(solid.points.x, other.points.x)
        np.testing.assert_array_equal(solid.cauchy_stress(), other.cauchy_stress())
    again.close()


@pytest.mark.parametrize("numerics", [Numerics(settle=3), Numerics()])
def test_a_run_goes_on_bit_for_bit(make_block, numerics):
    """From the state after settling, in another MPM of the scene, whether that has settled or not."""
    load = Load(TOP, pressure=lambda t: 2e3 * np.cos(50.0 * t))
    solid = make_block(loads=[load], numerics=Numerics(settle=3))
    state = solid.get_state()
    for _ in range(5):
        solid.advance(1e-3)
    end = solid.get_state()
    other = make_block(loads=[load], numerics=numerics)
    for one in (solid, other):
        one.set_state(state)
        for _ in range(5):
            one.advance(1e-3)
        again = one.get_state()
        assert all(again[name].tobytes() == end[name].tobytes() for name in end if name != "tangent")


RANKS = """
import sys
import numpy as np
from mpm_fenicsx import *
box = Box((0.0, 0.0), (3.0, 1.0))
top = Interface.top(box, 12)
cell = sys.argv[2]
law = drucker_prager(1e6, 0.3, friction_angle=30.0, cohesion=5e3)
body = Body(box, (12, 4), 2 if cell == "quadrilateral" else 3, law, 1000.0, f_bar=True, cell=cell)
solid = MPM(Grid(Box((-1.0, 0.0), (4.0, 2.0)), (20, 8), cell), body, interface=top, gravity=(1.0, -10.0),
            inertia="lumped", loads=[Load(top, pressure=1e3)],
            penalties=[GridWall(lambda x: x[:, 1] < 1e-9, "+y", friction=0.6, separates=True)],
            numerics=Numerics(settle=4))
gather = lambda values: np.concatenate(solid.comm.allgather(values))
x, stress = gather(solid.points.x), gather(solid.cauchy_stress())
order = np.argsort(gather(solid.points.gid))
for _ in range(3):
    solid.advance(1e-3)
v = np.abs(gather(solid.points.v)).max()
free = MPM(Grid(Box((-1.0, -1.0), (4.0, 2.0)), (20, 12), cell), body, gravity=(0.0, -10.0))
try:
    free.settle(2)
except MPMError as error:
    message = str(error)
if solid.comm.rank == 0:
    np.savez(sys.argv[1], x=x[order], stress=stress[order], v=v, ranks=solid.comm.size, message=message)
"""


@pytest.mark.mpi
@pytest.mark.validation
@pytest.mark.parametrize("cell", ["quadrilateral", "triangle"])
def test_three_ranks_give_what_one_gives(on_ranks, tmp_path, cell):
    results = []
    for n in (1, 3):
        path = tmp_path / f"{n}.npz"
        done = on_ranks(n, RANKS, path, cell)
        assert done.returncode == 0, done.stderr[-2000:]
        results.append(np.load(path))
    one, three = results
    assert three["ranks"] == 3
    for name in ("x", "stress"):
        np.testing.assert_allclose(three[name], one[name], rtol=0, atol=1e-8 * np.abs(one[name]).max())
    assert three["v"] < 1e-6 and "free to move along y" in str(three["message"])
    assert str(three["message"])[:25] == str(one["message"])[:25]
