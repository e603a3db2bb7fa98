"""Walls that meet the surface of a body, against closed forms and against what the springs of nodes do."""
import numpy as np
import pytest

from mpm_fenicsx import LAWS, MPM, Body, Box, Grid, GridWall, Interface, Numerics, Penalty, Support
from mpm_fenicsx.terms import springs
from tests.mpm.travelling import on_one_and_more

G = 9.81
DT = 2e-3
SURFACE = dict(separates=True, contact="surface")
SOIL = LAWS["mohr_coulomb"](2e5, 0.3, 20.0, 0.0, 0.0)


def floor(mu=0.3, y=0.0, axis=1, **others):
    """Of nodes; as a surface for the points."""
    return GridWall(lambda x: abs(x[:, axis] - y) < 1e-9, "+" + "xyz"[axis], mu, name="slope",
                    **{**SURFACE, **others})


def tilted(angle):
    """Gravity on a slope that falls along x [m/s^2]."""
    return G * np.array([np.sin(angle), -np.cos(angle)])


def slide(solid, steps=100):
    """Velocity along the slope [m/s] and reaction over the weight after each step, shapes (steps,) and
    (steps, 2)."""
    v, reaction = [], []
    for _ in range(steps):
        solid.advance(DT)
        v.append(solid.momentum()[0] / 500)
        reaction.append(solid.reaction("slope") / (500 * G))
    return np.array(v), np.array(reaction)


def block(make_mpm, angle, wall, lift=0.0, cell="quadrilateral", basis="linear", **others):
    """1 m x 0.5 m on a slope in the plane y = 0, which cuts the cells unless it is one of nodes."""
    bottom = 0.0 if isinstance(wall, GridWall) else -0.37 * 0.25
    grid = Grid(Box((-0.5, bottom), (2.5, bottom + 1.25)), (12, 5), cell)
    return make_mpm(cell, grid=grid, box=((0.0, lift), (1.0, 0.5 + lift)), body_cells=(8, 4),
                    law=LAWS["linear"](1e8, 0.3), rho=1000.0, interface=None, gravity=tilted(angle),
                    inertia="lumped", penalties=[wall], numerics=Numerics(basis=basis), **others)


def plane(mu=0.3, **others):
    return Penalty(Interface.line((-0.45, 0.0), (2.45, 0.0), 5), (0, 1), mu, name="slope",
                   **{**SURFACE, **others})


BASES = [("quadrilateral", "linear"), ("triangle", "linear"), ("quadrilateral", "ugimp"),
         ("quadrilateral", "bspline")]


@pytest.mark.parametrize("cell, basis", BASES)
@pytest.mark.parametrize("make", [floor, plane])
@pytest.mark.parametrize("angle, mu", [(30, 0.3), (20, 0.5)])
def test_block_slides_or_rests(make_mpm, cell, basis, make, angle, mu):
    """a = g (sin t - mu cos t), or nothing, with the block's own vibration: measured within 1.5e-4 g."""
    t = np.radians(angle)
    v, reaction = slide(block(make_mpm, t, make(mu), cell=cell, basis=basis))
    a = (v[-1] - v[49]) / (50 * DT) / G
    assert a == pytest.approx(max(np.sin(t) - mu * np.cos(t), 0.0), abs=3e-4)
    assert reaction[50:, 1].mean() == pytest.approx(np.cos(t), rel=4e-4)


@pytest.mark.parametrize("cell, basis", [("hexahedron", "linear"), ("tetrahedron", "linear"),
                                         ("hexahedron", "ugimp")])
@pytest.mark.parametrize("kind", ["floor", "patch"])
def test_block_slides_in_space(make_mpm, cell, basis, kind):
    """As above, obliquely to the grid: nothing across."""
    t, mu, down = np.radians(30), 0.3, np.array([np.cos(0.4), np.sin(0.4), 0.0])
    bottom = 0.0 if kind == "floor" else -0.1
    wall = floor(mu, axis=2) if kind == "floor" else Penalty(
        Interface.patch((-0.4, -0.4, 0), (2, 0, 0), (0, 1.5, 0), (2, 1)), (0, 0, 1), mu, name="slope",
        **SURFACE)
    grid = Grid(Box((-0.5, -0.5, bottom), (1.75, 1.25, bottom + 1.0)), (9, 7, 4), cell)
    solid = make_mpm(cell, grid=grid, box=((0.0, 0.0, 0.0), (1.0, 0.5, 0.5)), body_cells=(6, 3, 3), points=2
                     if cell == "hexahedron" else 4, stress_state=None, law=LAWS["linear"](1e8, 0.3),
                     rho=1000.0, interface=None, gravity=G * (np.sin(t) * down - [0, 0, np.cos(t)]),
                     inertia="lumped", penalties=[wall], numerics=Numerics(basis=basis))
    v = []
    for _ in range(60):
        solid.advance(DT)
        v.append(solid.momentum() / 250)
    a = (v[-1] - v[29]) / (30 * DT) / G
    assert a @ down == pytest.approx(np.sin(t) - mu * np.cos(t), abs=5e-4)
    assert abs(a @ [-down[1], down[0], 0.0]) < 2e-4


@pytest.mark.parametrize("cut", [0.0, 0.02])
@pytest.mark.parametrize("basis", ["linear", "gimp"])
def test_a_layer_presses_on_its_lowest_cell_with_all_its_weight(cut, basis):
    """Between smooth walls, on a floor along sides of cells and through them: the mean stress across of the
    points below a height is the weight above."""
    body = Body(Box((0.0, cut), (0.4, 0.2 + cut)), (8, 4), 2, LAWS["linear"](1e6, 0.3), 1000.0)
    held = [Support(lambda x, a=a: abs(x[:, 0] - a) < 1e-9, "x") for a in (0.0, 0.4)]
    base = Penalty(Interface.line((-0.01, cut), (0.41, cut), 1), (0, 1), 0.5, name="base", **SURFACE)
    solid = MPM(Grid(Box((0.0, -0.05), (0.4, 0.3)), (8, 7)), body, held, penalties=[base],
                gravity=(0.0, -G), inertia="lumped", basis=basis)
    height = solid.points.x[:, 1] - cut
    solid.settle(2)
    stress = solid.cauchy_stress()[:, 1, 1]
    lowest = height < 0.051
    assert stress[lowest].mean() == pytest.approx(-1000.0 * G * 0.175, rel=0.06)
    assert stress.mean() == pytest.approx(-1000.0 * G * 0.1, rel=0.02)
    solid.close()


@pytest.mark.parametrize("cut", [0.0, 0.02])
@pytest.mark.parametrize("angle", [25.0, 35.0])
def test_a_rough_floor_bears_as_much_shear_as_the_soil(angle, cut):
    """Where the floor is rougher than sand, sand shears, and with psi = 0 slides from the slope of sin phi
    on, 29.8 degrees for phi = 35, with the friction of sin phi."""
    t = np.radians(angle)
    sand = LAWS["mohr_coulomb"](1e6, 0.3, 35.0, 0.0, 0.0)
    body = Body(Box((0.0, cut), (3.0, 0.2 + cut)), (60, 4), 2, sand, 1000.0, f_bar=True)
    grid = Grid(Box((-0.5, -0.05), (5.0, 0.4)), (110, 9))
    base = Penalty(Interface.line((-0.49, cut), (4.99, cut), 1), (0, 1), 1.5, name="base", **SURFACE)
    solid = MPM(grid, body, penalties=[base], gravity=tilted(t), inertia="lumped")
    x, v = solid.points.x, []
    above = (abs(x[:, 0] - 1.2) < 0.3) & (x[:, 1] > 0.1 + cut)
    for _ in range(150):
        solid.advance(DT)
        v.append(solid.points.v[above, 0].mean())
    found = np.polyfit(DT * np.arange(75), v[75:], 1)[0]
    wanted = G * max(np.sin(t) - np.sin(np.radians(35.0)) * np.cos(t), 0.0)
    assert found == pytest.approx(wanted, abs=0.005 * G)
    solid.close()


def test_block_settles_on_a_slope_and_stays(make_mpm):
    """Load steps without inertia: friction and normal force are those of the weight, and nothing moves."""
    t = np.radians(15)
    solid = block(make_mpm, t, floor(0.5))
    solid.settle(4)
    np.testing.assert_allclose(solid.reaction("slope") / (500 * G), [-np.sin(t), np.cos(t)], atol=1e-8)
    v, _ = slide(solid, 50)
    assert abs(v).max() < 1e-6


@pytest.mark.parametrize("cell, basis", BASES)
def test_contact_begins_at_the_surface(make_mpm, cell, basis):
    """Dropped from 0.1 m in cells of 0.25 m, the block touches after sqrt(2 s / g), loses nothing before, and
    comes to rest where its points' share of the body ends; the nodes of a wall stop it from the start."""
    solid = block(make_mpm, 0.0, floor(), lift=0.1, cell=cell, basis=basis)
    lowest = solid.points.x[:, 1].min() - 0.1
    touched = slide(solid, 250)[1][:, 1]
    first = np.argmax(touched > 0) + 1
    assert first * DT == pytest.approx(np.sqrt(2 * 0.1 / G), abs=DT)
    slide(solid, 250)
    assert solid.points.x[:, 1].min() == pytest.approx(lowest, abs=2e-4)
    early = slide(block(make_mpm, 0.0, floor(contact="nodes"), lift=0.1, cell=cell, basis=basis), 5)[1][:, 1]
    assert early.max() > 0.0


def test_block_separates_and_comes_back(make_mpm):
    """Thrown down at 1 m/s it returns, flies as if alone and comes back; all that the wall gives is momentum:
    by the mean of its forces at the ends of each step."""
    solid = block(make_mpm, 0.0, floor(0.0), lift=0.02, velocity=(0.3, -1.0))
    F, p = [np.zeros(2)], [solid.momentum()]
    for _ in range(400):
        solid.advance(DT)
        F.append(solid.reaction("slope"))
        p.append(solid.momentum())
    F, p = np.array(F), np.array(p)
    impulse = np.cumsum(0.5 * DT * (F[1:] + F[:-1]), axis=0)
    fallen = np.outer(DT * np.arange(1, 401), [0.0, -500 * G])
    np.testing.assert_allclose(p[1:], p[0] + impulse + fallen, rtol=0, atol=1e-2)
    hits = np.flatnonzero((F[1:, 1] > 0) & (F[:-1, 1] == 0))
    assert len(hits) >= 2 and 0.0 < p[:, 1].max() < 500.0
    np.testing.assert_allclose(p[:, 0], 150.0, rtol=0, atol=1e-3)


def test_moving_wall_pushes_a_block(make_mpm):
    """A wall in space that starts smoothly takes the block along to the same speed. The force swings slowly
    about the block's inertia, by 2 % over the second half, as it does at nodes."""
    grid = Grid(Box((-0.5, -0.5), (2.5, 1.0)), (12, 6))
    wall = Penalty(Interface.line((0.0, -0.2), (0.0, 0.7), 3), (1, 0), name="wall",
                   motion=lambda t: np.array([0.5 * 10.0 * t**2, 0.0]), **SURFACE)
    solid = make_mpm(box=((0, 0), (1, 0.5)), grid=grid, body_cells=(8, 4), law=LAWS["linear"](1e7, 0.3),
                     rho=1000.0, interface=None, penalties=[wall], inertia="lumped")
    pushed = []
    for _ in range(200):
        solid.advance(DT)
        pushed.append(solid.reaction("wall")[0] / 5000)
    np.testing.assert_allclose(solid.momentum() / 500, [4.0, 0.0], atol=0.03)
    np.testing.assert_allclose(solid.points.x.mean(axis=0) - [0.5, 0.25], [0.8, 0.0], atol=0.002)
    assert np.mean(pushed[100:]) == pytest.approx(1.0, rel=0.03) and solid.driven


def test_a_belt_takes_a_block_along_by_friction(make_mpm):
    """A floor that moves along itself: a = mu g until the block has its speed."""
    belt = Penalty(Interface.line((-0.45, 0.0), (2.45, 0.0), 5), (0, 1), 0.3, name="slope",
                   motion=lambda t: np.array([0.4 * t, 0.0]), **SURFACE)
    v, _ = slide(block(make_mpm, 0.0, belt), 150)
    assert v[60] - v[30] == pytest.approx(0.3 * G * 30 * DT, rel=0.01)
    assert v[100:].mean() == pytest.approx(0.4, rel=0.01)


def loaded(make_mpm, basis="linear", cell="quadrilateral"):
    """Points that press, stick, slide and are open, in two walls at once."""
    random = np.random.default_rng(4)
    walls = [floor(0.4), Penalty(Interface.line((0.01, 0.9), (0.01, -0.05), 2), (1, 0), 0.4, name="side",
                                 **SURFACE)]
    solid = block(make_mpm, 0.2, walls[0], lift=1e-3, cell=cell, basis=basis) if basis is None else make_mpm(
        cell, grid=Grid(Box((-0.5, 0.0), (2.5, 1.25)), (12, 5), cell), box=((0.0, 0.0), (1.0, 0.5)),
        body_cells=(8, 4), interface=None, penalties=walls, numerics=Numerics(basis=basis))
    p = solid.points
    p.wall_side[:, 1] = 1
    p.sunk[:] = 0.0
    p.x[:] += random.normal(size=p.x.shape) * 5e-3
    p.v[:] += random.normal(size=p.v.shape)
    p.wall_gap[:] = random.normal(size=p.wall_gap.shape) * 1e-2
    p.wall_force[:] = random.normal(size=p.wall_force.shape) * 50
    return solid, random


@pytest.mark.parametrize("cell, basis", BASES)
def test_matrix_is_the_derivative_of_the_residual(make_mpm, check_matrix, cell, basis):
    """Away from the kinks, for all that a point can do; the springs keep the matrix symmetric."""
    solid, random = loaded(make_mpm, basis, cell)
    check_matrix(solid, random, 1e-3, 1e-4)
    kinds = solid.points.wall_status
    assert set(np.unique(kinds % springs.CLOSED)) >= {springs.FREE, springs.STICK}
    assert kinds.max() > springs.CLOSED + 1 and (kinds.max(axis=0) > 0).all()


@pytest.mark.parametrize("cell, basis", BASES)
def test_forces_reach_the_nodes_with_momentum_and_moment(make_mpm, cell, basis):
    """Those of all feet: as if they acted there."""
    solid, _ = loaded(make_mpm, basis, cell)
    solid._locate()
    step = solid.step
    step.begin(0.02, 0.0, np.zeros((0, 2)))
    contact, = solid._contacts
    x = solid.background.x[step.active_cells.node]
    feet, _ = contact._find_feet()
    place = solid.points.x[feet.point] - feet.reach[:, None] * feet.normal
    at_nodes = np.zeros_like(x)
    answer = contact.residual(step.grid, step.equations.increment(np.zeros_like(x)), at_nodes)
    assert np.count_nonzero(answer.force.any(axis=1)) > 5
    np.testing.assert_allclose(-at_nodes.sum(axis=0), answer.force.sum(axis=0), rtol=1e-12)
    moment = lambda at, f: np.sum(at[:, 0] * f[:, 1] - at[:, 1] * f[:, 0])
    assert -moment(x, at_nodes) == pytest.approx(moment(place, answer.force), rel=1e-10)


def thrown(walls, velocity=(2.0, -1.0), **others):
    """Soil thrown into a corner."""
    body = Body(Box((0.1, 0.05), (0.4, 0.25)), (6, 4), 2, SOIL, 1000.0, velocity=velocity)
    grid = Grid(Box((-0.6, -0.3), (0.8, 1.1)), (14, 14))
    return MPM(grid, body, inertia="lumped", penalties=walls, gravity=(0.0, -G), **others)


def corner():
    """The wall and the floor that the soil is thrown against."""
    return [GridWall(lambda x: abs(x[:, 0] - 0.5) < 1e-9, "-x", name="wall", **SURFACE),
            Penalty(Interface.line((-0.55, 0.01), (0.55, 0.01), 1), (0, 1), 0.4, name="floor", **SURFACE)]


@pytest.mark.parametrize("basis", ["linear", "ugimp"])
def test_nothing_passes_a_corner(basis, recwarn):
    """Of a wall of nodes and a floor of one segment across the cells; what is left lies on the floor."""
    solid = thrown(corner(), basis=basis)
    for _ in range(120):
        solid.advance(2.5e-3)
    assert not recwarn and sum(solid.behind().values()) == 0
    assert solid.points.x[:, 0].max() < 0.5 and solid.points.x[:, 1].min() > 0.01


@pytest.mark.parametrize("basis", ["linear", "ugimp"])
def test_soil_that_flows_over_a_floor_only_loses_energy(basis):
    """A column that collapses; it slides by mu times the normal force where it flows."""
    soil = Body(Box((0.0, 0.0), (0.2, 0.4)), (8, 16), 2, SOIL, 1500.0, f_bar=True)
    grid = Grid(Box((0.0, 0.0), (1.0, 0.5)), (20, 10))
    solid = MPM(grid, soil, [Support(lambda x: x[:, 0] < 1e-9, "x")], gravity=(0.0, -G), inertia="lumped",
                penalties=[floor(0.3)], basis=basis)
    energy, force = [sum(solid.energy().values())], []
    for _ in range(150):
        solid.advance(2e-3)
        energy.append(sum(solid.energy().values()))
        force.append(solid.reaction("slope"))
    force, weight = np.array(force), 0.08 * 1500 * G
    assert np.diff(energy).max() < 0.0 and energy[-1] < 0.7 * energy[0]
    assert force[50:, 1].mean() == pytest.approx(weight, rel=0.15)
    assert solid.points.x[:, 1].min() > 0.0 and solid.points.x[:, 0].max() > 0.4
    assert (-force[:, 0] <= 0.3 * force[:, 1] + 0.02 * weight).all()


def test_state_continues_bit_for_bit():
    """In the middle of a hit."""
    solid = thrown(corner())
    for _ in range(30):
        solid.advance(2.5e-3)
    assert solid.reaction("wall").any() and solid.reaction("floor").any()
    state, ends = solid.get_state(), []
    for _ in range(2):
        for _ in range(20):
            solid.advance(2.5e-3)
        ends.append((solid.points.x.copy(), solid.points.v.copy(), solid.points.wall_force.copy()))
        solid.set_state(state)
    for one, other in zip(*ends):
        np.testing.assert_array_equal(one, other)
    with pytest.raises(ValueError, match="interface, loads and walls differ"):
        thrown(corner()[:1]).set_state(state)


RANKS = """
import sys
import test_surface_contact
from tests.mpm.travelling import travel

basis = sys.argv[2]
travel(sys.argv[1], lambda: test_surface_contact.thrown(test_surface_contact.corner(), basis=basis), 40,
       look=lambda solid: [solid.reaction("wall"), solid.reaction("floor")], basis=basis)
"""


@pytest.mark.mpi
@pytest.mark.validation
@pytest.mark.parametrize("basis", ["linear", "ugimp"])
def test_ranks_change_nothing(tmp_path, on_ranks, basis):
    one, three = on_one_and_more(on_ranks, tmp_path, RANKS, 3, basis)
    assert (abs(one["looks"]).max(axis=(0, 2)) > 10).all()
    np.testing.assert_allclose(three["looks"], one["looks"], rtol=1e-6, atol=1e-6)


LINE = Interface.line((0.0, 0.0), (1.0, 0.0), 4)


@pytest.mark.parametrize("make, message", [
    (lambda: Penalty(LINE, (0, 1), contact="surface", name="base"), "base has contact=\"surface\" but does "
     "not separate: .* give separates=True"),
    (lambda: floor(contact="points"), "contact of slope is 'points'"),
    (lambda: Penalty(LINE, (0, 1), follows=True, name="base", **SURFACE), "base follows the body, contact="),
    (lambda: Penalty(Interface(LINE.x, np.zeros((0, 2), int)), (0, 1), name="base", **SURFACE),
     "base has contact=.* no segments or triangles: give one of Interface.line"),
])
def test_it_says_what_is_wrong(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_a_wall_of_one_node_has_no_side_to_meet(make_mpm):
    with pytest.raises(ValueError, match="dot has contact=\"surface\" but no side that bodies can meet"):
        make_mpm(penalties=[GridWall(lambda x: np.hypot(*x.T) < 1e-9, "+y", name="dot", **SURFACE)])
