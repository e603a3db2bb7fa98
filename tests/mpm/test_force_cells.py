"""Forces on named bodies and their force cells: who has given which impulse to which part."""
import numpy as np
import pytest

from mpm_fenicsx import (
    LAWS,
    MPM,
    Balls,
    Body,
    Box,
    Cloud,
    Grid,
    Interface,
    Numerics,
    Structure,
    Support,
    linear,
)

SOIL = LAWS["mohr_coulomb"](2e5, 0.3, 30.0, 0.0, 0.0)
GRAVITY = np.array([0.0, -9.81])


def scene(E, low=0.05, high=0.2, **more):
    """Soil that flies against a plate on a foot, whose two force cells meet at a height of 0.0875 m."""
    soil = Body(Box((0.05, low), (0.3, high)), (10, round((high - low) / 0.025)), 2, SOIL, 1500.0,
                velocity=(1.5, 0.0))
    wall = Body(Box((0.3, -0.025), (0.35, 0.2)), (2, 9), 2, linear(E, 0.3), 1200.0, name="wall",
                force_cells=(1, 2))
    foot = Support(lambda x: (x[:, 1] < -0.02) & (x[:, 0] > 0.29), "xy", name="foot")
    return dict(grid=Grid(Box((-0.1, -0.05), (0.5, 0.3)), (24, 14)), body=[soil, wall], supports=[foot],
                gravity=GRAVITY, inertia="lumped", **more)


def given(solid, acts):
    """Impulse of what ``acts`` on both force cells, shape (2, 3)."""
    rows = solid.impulses_on_bodies()
    return np.array([rows[f"wall_{cell}"][acts] for cell in (1, 2)])


def momentum(solid):
    p = solid.bodies[1].points
    return solid.comm.allreduce(p.mass @ p.v), solid.comm.allreduce(p.mass.sum())


@pytest.mark.parametrize("E, numerics", [
    (5e6, Numerics()), (5e4, Numerics()),
    pytest.param(5e4, Numerics(basis="gimp"), marks=pytest.mark.validation),
    pytest.param(5e6, Numerics(basis="gimp", transfer="apic"), marks=pytest.mark.validation)])
def test_the_momentum_of_a_named_body_is_all_told(start, E, numerics):
    """Soil, foot and gravity give it, whichever of the two bodies is softer and has the springs."""
    solid = start(**scene(E, numerics=numerics))
    for _ in range(20):
        solid.advance(2e-3)
    own, mass = momentum(solid)
    soil = given(solid, "bodies")[:, :2]
    told = soil.sum(axis=0) + solid.impulses()["foot"][:2] + mass * solid.time * GRAVITY
    assert soil[1, 0] > 5.0  # [N s]
    assert own == pytest.approx(told, abs=1e-6 * soil[:, 0].sum())  # by Newton's method


@pytest.mark.parametrize("E", [5e6, 5e4])
@pytest.mark.parametrize("cell, low, high", [(0, 0.0, 0.075), (1, 0.1, 0.2)])
def test_soil_acts_on_the_cell_that_it_meets(start, E, cell, low, high):
    """Up to half a cell of the grid from where the cells meet; with its moment."""
    solid = start(**scene(E, low, high))
    for _ in range(4):
        solid.advance(2e-3)
    rows = given(solid, "bodies")
    assert rows[cell, 0] > 1.0 and not rows[1 - cell].any()
    middle = -rows[cell, 2] / rows[cell, 0]  # of the force, with little along y
    assert low < middle < high


def test_a_run_that_goes_on_has_the_same(start, tmp_path):
    """Bit for bit, from a state and from a file; the number of the cell is that of the point."""
    solid, other = start(**scene(5e6)), start(**scene(5e6))
    cells = solid.bodies[1].points.force_cell
    assert np.array_equal(cells, 1 + (solid.bodies[1].points.x[:, 1] > 0.0875))
    assert not solid.bodies[0].points.force_cell.any()
    for _ in range(6):
        solid.advance(2e-3)
    solid.save(tmp_path / "wall.h5")
    state = solid.get_state()
    for _ in range(3):
        solid.advance(2e-3)
    later = given(solid, "bodies")
    other.load(tmp_path / "wall.h5")
    solid.set_state(state)
    for one in (solid, other):
        for _ in range(3):
            one.advance(2e-3)
        np.testing.assert_array_equal(given(one, "bodies"), later)


@pytest.mark.parametrize("interface", ["particles", "balls"])
def test_forces_on_the_interface_act_on_cells(start, interface):
    """On boundary particles and on material points: the impulse is force times time, step by step."""
    if interface == "particles":
        more = dict(interface=Interface.line((0.31, 0.19), (0.31, 0.01), 6))
    else:
        more = dict(interface=Balls(0.005, bodies=(1,)))
    solid = start(**scene(5e6, 0.1, 0.15, **more))
    if interface == "balls":
        rock = np.zeros(1, [("x", float, 2), ("v", float, 2), ("radius", float)])
        rock["x"], rock["radius"] = (0.25, 0.1), 0.06
        solid.select(rock, 1e-3)
    x = solid.surface()[0]
    upper, force = x[:, 1] > 0.0875, np.zeros_like(x)
    force[:] = (1.0, -0.5)
    assert upper.any() and not upper.all()
    for _ in range(2):
        solid.advance(1e-3, force)
    rows = given(solid, "interface")
    for cell, mine in enumerate((~upper, upper)):
        assert rows[cell, :2] == pytest.approx(2e-3 * force[mine].sum(axis=0), rel=1e-10)
        moment = np.sum(x[mine, 0] * -0.5 - x[mine, 1]) * 2e-3
        assert rows[cell, 2] == pytest.approx(moment, rel=1e-3)
    assert rows.sum(axis=0) == pytest.approx(solid.impulses()["interface"], rel=1e-10)


def test_cells_by_a_function_of_places(start):
    """Also of a cloud of points, and far from zero."""
    far = 1e6
    x = far + np.array([(0.025 + 0.05 * i, 0.025 + 0.05 * j) for i in range(4) for j in range(4)])
    cloud = Cloud(x, np.full(16, 0.05**2))
    body = Body(cloud, None, None, linear(1e6, 0.3), 1e3, name="post",
                force_cells=lambda x: (x[:, 0] > far + 0.1) * 2 + (x[:, 1] > far + 0.1))
    solid = start(Grid(Box((far - 0.1,) * 2, (far + 0.3,) * 2), (8, 8)), body,
                  inertia="lumped", interface=Interface.line((far + 0.2, far + 0.15),
                                                             (far + 0.2, far + 0.02), 1))
    assert np.bincount(solid.points.force_cell).tolist() == [0, 4, 4, 4, 4]
    solid.advance(1e-3, np.array([(-1.0, 0.0), (-2.0, 0.0)]))
    rows = solid.impulses_on_bodies()
    assert list(rows) == ["post_1", "post_2", "post_3", "post_4"] and list(rows["post_1"]) == ["interface"]
    assert [rows[name]["interface"][0] for name in rows] == pytest.approx([0.0, 0.0, -2e-3, -1e-3])
    assert rows["post_4"]["interface"][2] == pytest.approx(1e-3 * (far + 0.15), rel=1e-6)


@pytest.mark.parametrize("more, sentence", [
    (dict(force_cells=(1, 2)), "force cells and no name"), (dict(name="a b"), "name of a body is 'a b'"),
    (dict(name="wall", force_cells=(1, 2, 3)), "force cells of wall"),
    (dict(name="wall", force_cells=(100, 100)), "at most 1000")])
def test_bad_cells_are_refused(more, sentence):
    with pytest.raises(ValueError, match=sentence):
        Body(Box((0.0, 0.0), (1.0, 1.0)), (2, 2), 2, linear(1e6, 0.3), 1e3, **more)


@pytest.mark.parametrize("more, sentence", [
    (dict(name="bed"), "'bed' is the name of a body"), (dict(name="gravity"), "'gravity' is the name"),
    (dict(name="wall", force_cells=lambda x: np.full(len(x), 1)), r"points are \[1\]: number them from 0"),
    (dict(name="wall", force_cells=lambda x: x[:, 0]), "give whole ones")])
def test_names_and_numbers_that_do_not_fit_are_refused(more, sentence):
    body = Body(Box((0.0, 0.0), (1.0, 1.0)), (2, 2), 2, linear(1e6, 0.3), 1e3, **more)
    grid = Grid(Box((0.0, -1.0), (2.0, 2.0)), (4, 6))
    with pytest.raises(ValueError, match=sentence):
        MPM(grid, body, structures=[Structure.plane("bed", (0.0, 0.0), "+y", grid.box)])
