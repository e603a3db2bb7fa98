"""The books of momentum close in every step: what the points gain is what named things have given."""
import numpy as np
import pytest

from mpm_fenicsx import (
    LAWS,
    MPM,
    Body,
    Box,
    Grid,
    GridWall,
    Interface,
    Load,
    Numerics,
    Penalty,
    Structure,
    Support,
    at_rest,
)

SOIL = LAWS["mohr_coulomb"](2e5, 0.3, 30.0, 0.0, 0.0)
SOFT = LAWS["neo_hooke"](1e5, 0.3)
PULL = (1.0, -9.81, 0.5)


def box(dim, size=0.4, at=0.2):
    return Box((at,) * dim, (at + size,) * dim)


def room(dim, cells=8):
    return Grid(Box((0.0,) * dim, (0.8,) * dim), (cells,) * dim)


def sides(dim):
    """An elastic block between a floor that holds it, a wall that is moved, and a load on its top."""
    body = Body(box(dim), (4,) * dim, 2, SOFT, 1000.0, velocity=PULL[:dim])
    floor = Support(lambda x: x[:, 1] < 0.2 + 1e-6, "xyz"[:dim], name="floor")
    wall = Support(lambda x: x[:, 0] > 0.6 - 1e-6, "x", motion=lambda t: [-0.5 * t**2], name="wall")
    load = Load(top(dim), traction=lambda t: np.r_[50.0 * t, -20.0, 0.0][:dim], name="weight")
    return MPM, room(dim), body, [floor, wall], dict(loads=[load], gravity=PULL[:dim])


def top(dim):
    if dim == 2:
        return Interface.line((0.25, 0.55), (0.55, 0.55), 3)
    return Interface.patch((0.25, 0.55, 0.25), (0.3, 0.0, 0.0), (0.0, 0.0, 0.3), (2, 2))


def sliding(dim):
    """A column of soil that falls on a wall of nodes with friction."""
    body = Body(box(dim), (4,) * dim, 2, SOIL, 1000.0, velocity=(1.0, -0.5, 0.3)[:dim])
    floor = GridWall(lambda x: x[:, 1] < 0.2 + 1e-6, "+y", friction=0.4, separates=True, name="floor")
    return MPM, room(dim), body, [], dict(penalties=[floor], gravity=PULL[:dim])


def plane(dim):
    """An elastic block on a plane that cuts the grid, and that its points meet."""
    body = Body(box(dim), (4,) * dim, 2, SOFT, 1000.0, velocity=(1.0, -0.5, 0.3)[:dim])
    if dim == 2:
        surface = Interface.line((0.75, 0.17), (0.05, 0.13), 4)
    else:
        surface = Interface.patch((0.05, 0.14, 0.05), (0.0, 0.0, 0.7), (0.7, 0.04, 0.0), (2, 2))
    slope = Penalty(surface, (-0.04, 0.7, 0.0)[:dim], friction=0.3, separates=True, contact="surface",
                    name="slope")
    return MPM, room(dim), body, [], dict(penalties=[slope], gravity=PULL[:dim])


def struck(dim):
    """A column of soil and a structure of two force cells that is driven into it."""
    body = Body(box(dim), (4,) * dim, 2, SOIL, 1000.0, velocity=(0.2, -0.1, 0.1)[:dim])
    floor = Support(lambda x: x[:, 1] < 0.2 + 1e-6, "y", name="floor")
    place = Box((0.58, 0.1, 0.1)[:dim], (0.7, 0.7, 0.7)[:dim])
    hammer = Structure.box("hammer", place, cells=(1, 2, 1)[:dim], friction=0.4,
                           motion=lambda t: (-2.0 * t, 0.0, 0.0)[:dim])
    return MPM, room(dim), body, [floor], dict(structures=[hammer], gravity=PULL[:dim])


SCENES = {"supports": sides, "nodes": sliding, "surface": plane, "struck": struck}


def steps(solid, count, dt, force=None):
    """Largest error of the linear and of the angular books in a step, relative to the largest impulse."""
    errors, scale = np.zeros(2), np.full(2, 1e-300)
    before = books(solid)
    for n in range(count):
        if force is None:
            solid.advance(dt)
        else:
            solid.advance(dt, force(n))
        now = books(solid)
        change, given = now[0] - before[0], now[1] - before[1]
        D = solid.dim
        for k, part in enumerate((slice(D), slice(D, None))):
            errors[k] = max(errors[k], np.abs(change - given.sum(axis=0))[part].max())
            scale[k] = max(scale[k], np.abs(given[:, part]).max())
        before = now
    return errors / scale


def books(solid):
    """Momentum, linear and angular, with that of what has left, and impulses by name."""
    momentum = np.concatenate([solid.momentum(), np.ravel(solid.angular_momentum())])
    return momentum, np.array([*solid.impulses().values()])


QUICK = {(2, "nodes", "linear", "newmark", "consistent"), (2, "supports", "gimp", "apic", "lumped"),
         (2, "surface", "linear", "tpic", "consistent"), (3, "supports", "linear", "newmark", "lumped"),
         (3, "surface", "gimp", "newmark", "lumped"), (2, "struck", "gimp", "newmark", "lumped")}
WAYS = [("linear", "newmark"), ("linear", "tpic"), ("gimp", "newmark"), ("gimp", "apic"), ("gimp", "tpic")]
ALL = [pytest.param(*one, marks=[] if one in QUICK else pytest.mark.validation, id="-".join(map(str, one)))
       for one in sorted((dim, scene, *way, inertia) for dim in (2, 3) for scene in SCENES for way in WAYS
                         for inertia in ("consistent", "lumped"))]


@pytest.mark.filterwarnings("ignore:Newton's method failed")
@pytest.mark.parametrize("dim, scene, basis, transfer, inertia", ALL)
def test_momentum_is_booked(dim, scene, basis, transfer, inertia, options):
    """In every step, by every transfer, with every basis and inertia, under supports, a moved one, loads that
    jump, walls with friction on nodes and on points."""
    options(snes_rtol=1e-6)  # of soil's inertia, too, that it leaves little
    make, grid, body, supports, more = SCENES[scene](dim)
    solid = make(grid, body, supports, inertia=inertia, numerics=Numerics(transfer=transfer, basis=basis),
                 **more)
    errors = steps(solid, 6, 5e-3)
    given = solid.impulses()
    solid.close()
    assert errors.max() < 1e-12
    largest = np.abs(np.array([*given.values()])).max(axis=0)
    assert (np.abs(given["numerical"])[:dim] < 1e-5 * largest[:dim].max()).all()  # Newton's tolerance
    if scene == "struck":
        assert given["hammer_1"][0] < 0.0 and given["hammer_2"][0] < 0.0
    if (transfer, inertia, scene) == ("apic", "lumped", "supports"):  # which keeps angular momentum
        assert (np.abs(given["numerical"])[dim:] < 1e-5 * largest[dim:].max()).all()


def test_what_leaves_is_booked():
    """A block flies out of the grid, far from zero."""
    far = np.array([3e4, 0.0])
    body = Body(Box((0.2 + far[0], 0.2), (0.6 + far[0], 0.6)), (4, 4), 2, SOFT, 1000.0, velocity=(4.0, 3.0))
    grid = Grid(Box(tuple(far), tuple(far + 0.8)), (8, 8))
    solid = MPM(grid, body, gravity=(0.0, -9.81), outflow={"+x": "remove", "+y": "hold"}, inertia="lumped")
    start = books(solid)[0]
    errors = steps(solid, 15, 5e-3)
    given, left = solid.impulses(), solid.removed
    change = books(solid)[0] - start
    assert 0 < left["count"] < 64 and errors.max() < 1e-12
    np.testing.assert_allclose(change[:2], sum(given.values())[:2], atol=1e-10)
    np.testing.assert_allclose(given["outflow"][:2], -left["momentum"], rtol=0.1)
    solid.close()


def test_books_go_back_with_the_state():
    """Steps that are repeated are booked once; another MPM goes on from a checkpoint."""
    make, grid, body, supports, more = sides(2)
    top_of_it = Interface(np.array([(0.3, 0.5), (0.4, 0.5)]), np.zeros((0, 2), int))
    solid = make(grid, body, supports, top_of_it, inertia="lumped", **more)

    def force(n):
        return np.array([(3.0, -2.0), (1.0, 5.0 * n)])

    assert steps(solid, 3, 5e-3, force).max() < 1e-12
    state, tree = solid.get_state(), solid.get_checkpoint()
    solid.advance(5e-3, force(7))
    after = solid.impulses()
    solid.set_state(state)
    solid.advance(5e-3, force(7))
    other = solid.anew()
    other.set_checkpoint(tree)
    other.advance(5e-3, force(7))
    for name, row in after.items():
        assert np.array_equal(solid.impulses()[name], row) and np.array_equal(other.impulses()[name], row)
    exchanged = 5e-3 * sum(force(n).sum(axis=0) for n in (0, 1, 2, 7))
    np.testing.assert_allclose(after["interface"][:2], exchanged, rtol=1e-12)
    solid.close()
    other.close()


def test_shorter_steps_are_booked(options):
    """Where Newton's method fails, with the ladder's ghost penalty and parts of steps."""
    options(snes_max_it=2)
    make, grid, body, supports, more = sliding(2)
    solid = make(grid, body, supports, **more)
    with pytest.warns(UserWarning, match="Newton's method failed"):
        errors = steps(solid, 8, 8e-3)
    assert solid.helped and errors.max() < 1e-11
    solid.close()


@pytest.mark.parametrize("transfer", ["newmark", "tpic"])
def test_books_of_a_body_that_starts_under_stress_close_from_the_first_step(transfer):
    """What holds it at the start is not known: half of its weight over the first step is numerical."""
    stress = at_rest(0.6, 1000.0, 9.81, 0.5)
    body = Body(box(2), (4, 4), 2, SOIL, 1000.0, stress=stress)
    floor = Support(lambda x: x[:, 1] < 0.2 + 1e-6, "xy", name="floor")
    solid = MPM(room(2), body, [floor], gravity=(0.0, -9.81), inertia="lumped",
                numerics=Numerics(transfer=transfer))
    assert steps(solid, 1, 1e-3).max() < 1e-12 and steps(solid, 5, 1e-3).max() < 1e-12
    weight = 9.81 * 1000.0 * 0.4**2 * 1e-3
    first = solid.impulses()["numerical"][1] / weight
    assert first == pytest.approx(0.5 if transfer == "newmark" else 0.0, abs=1e-6)
    solid.close()


def test_a_column_at_rest_is_held_by_its_supports():
    """After ``settle`` the supports give in every step what gravity takes."""
    body = Body(box(2), (4, 4), 2, SOFT, 1000.0)
    held = [Support(lambda x: x[:, 1] < 0.2 + 1e-6, "y", name="floor"),
            Support(lambda x: abs(x[:, 0] - 0.2) < 1e-6, "x", name="left"),
            Support(lambda x: abs(x[:, 0] - 0.6) < 1e-6, "x", name="right")]
    solid = MPM(room(2), body, held, gravity=(0.0, -9.81), inertia="lumped", numerics=Numerics(settle=1))
    assert steps(solid, 4, 1e-3).max() < 1e-12
    given, weight = solid.impulses(), 160.0 * 9.81 * 4e-3
    assert given["gravity"][1] == pytest.approx(-weight, rel=1e-12)
    assert given["floor"][1] == pytest.approx(weight, rel=1e-3)
    assert given["left"][0] == pytest.approx(-given["right"][0], rel=1e-6) and given["left"][0] > 0
    solid.close()


RANKS = """
import sys
import numpy as np
from mpm_fenicsx import LAWS, MPM, Body, Box, Grid, GridWall, Interface, Numerics, Support
body = Body(Box((0.2, 0.2), (0.6, 0.6)), (6, 6), 2, LAWS["neo_hooke"](1e5, 0.3), 1000.0, velocity=(4.0, 1.0))
floor = GridWall(lambda x: x[:, 1] < 0.2 + 1e-6, "+y", friction=0.4, separates=True, name="floor")
wall = Support(lambda x: x[:, 0] > 0.7 - 1e-6, "x", name="wall")
solid = MPM(Grid(Box((0.0, 0.0), (0.8, 0.8)), (8, 8)), body, [wall], penalties=[floor], gravity=(0.0, -9.81),
            numerics=Numerics(basis=sys.argv[2], rebalance=1.0), inertia="lumped")
solid.rebalance_every = 5
start = np.append(solid.momentum(), solid.angular_momentum())
for n in range(12):
    solid.advance(5e-3)
given = solid.impulses()
change = np.append(solid.momentum(), solid.angular_momentum()) - start
assert np.abs(change - sum(given.values())).max() < 1e-11 * np.abs(list(given.values())).max()
if solid.comm.rank == 0:
    np.savez(sys.argv[1], **given)
"""


@pytest.mark.mpi
@pytest.mark.parametrize("basis", ["gimp", pytest.param("linear", marks=pytest.mark.validation)])
def test_ranks_book_the_same(basis, on_ranks, tmp_path):
    """The books close on two ranks while points travel and the grid is distributed anew, and are those of one
    to round-off."""
    path, one = tmp_path / "two.npz", {"__name__": "one"}
    done = on_ranks(2, RANKS, path, basis)
    assert done.returncode == 0, done.stderr[-2000:]
    exec(RANKS.replace("sys.argv", f"[None, {str(tmp_path / 'one.npz')!r}, {basis!r}]"), one)
    one["solid"].close()
    two = np.load(path)
    for name, row in one["given"].items():
        np.testing.assert_allclose(two[name], row, atol=1e-9 * np.abs(one["given"]["gravity"]).max())


def test_bodies_that_meet_give_each_other_nothing_in_sum():
    """Two blocks with fields of their own, one thrown on the other."""
    lower = Body(Box((0.2, 0.2), (0.6, 0.4)), (4, 2), 2, SOFT, 1000.0)
    upper = Body(Box((0.2, 0.42), (0.6, 0.6)), (4, 2), 2, SOFT, 1000.0, velocity=(0.5, -2.0), friction=0.4)
    floor = Support(lambda x: x[:, 1] < 0.2 + 1e-6, "xy", name="floor")
    solid = MPM(room(2), [lower, upper], [floor], gravity=(0.0, -9.81), inertia="lumped")
    assert steps(solid, 12, 2e-3).max() < 1e-12
    assert np.abs(solid.reaction("bodies 0 and 1")).max() > 0.0
    solid.close()
