"""Supports and walls by springs on boundary particles, against closed forms and against supports on grid
nodes."""

import numpy as np
import pytest

from mpm_fenicsx import LAWS, Box, Grid, GridWall, Interface, Load, Mesh, MPMError, Penalty, Support
from mpm_fenicsx.compiled import specialise
from mpm_fenicsx.scene.lattice import lattice
from mpm_fenicsx.terms import springs

G = 9.81
DT = 2e-3
WEIGHT = 500 * G  # of the sliding block [N]


def turned_grid(angle, cell="quadrilateral", lower=(-0.5, -1.1), upper=(2.75, 1.6), counts=(13, 11)):
    """A grid turned about the origin, which a plane along x cuts at that angle."""
    vertices, cells = lattice(Box(lower, upper), counts, cell)
    c, s = np.cos(angle), np.sin(angle)
    return Mesh(vertices @ [[c, s], [-s, c]], cells, cell)


def tilted(angle):
    """Gravity on a slope that falls along x [m/s^2]."""
    return G * np.array([np.sin(angle), -np.cos(angle)])


def surface_below(kind, mu, **others):
    """The plane y = 0 in space, or the sole of the block."""
    line = Interface.line((-0.2, 0.0), (2.2, 0.0), 48) if kind == "plane" else Interface.line((0, 1e-3),
                                                                                              (1, 1e-3), 8)
    return Penalty(line, (0, 1), mu, follows=kind == "sole", name="slope", **{"separates": True, **others})


def block(make_mpm, angle, penalties, grid=None, **others):
    """A block of 1 m x 0.5 m on the slope; its first vibration, which gravity starts, has a period of 2.7
    steps."""
    grid = turned_grid(0.35) if grid is None else grid
    return make_mpm(grid=grid, box=((0.0, 0.0), (1.0, 0.5)), body_cells=(8, 4), law=LAWS["linear"](1e8, 0.3),
                    rho=1000.0, interface=None, gravity=tilted(angle), inertia="lumped", penalties=penalties,
                    **others)


def slide(solid, steps=100):
    """Velocity along the slope [m/s] and reaction over the weight after each step, shapes (steps,) and
    (steps, 2)."""
    v, reaction = [], []
    for _ in range(steps):
        solid.advance(DT)
        v.append(solid.momentum()[0] / 500)
        reaction.append(solid.reaction("slope") / WEIGHT)
    return np.array(v), np.array(reaction)


@pytest.mark.parametrize("kind", ["plane", "sole"])
@pytest.mark.parametrize("angle, mu", [(20, 0.0), (30, 0.3), (40, 0.2), (40, 0.6)])
def test_block_slides_down_a_plane_that_cuts_the_grid(make_mpm, kind, angle, mu):
    """a = g (sin t - mu cos t). What remains is the block's own vibration, as it starts unstressed: measured
    are at most 1e-3 g, on the plane at mu 0.6, and 3e-5 g otherwise."""
    t = np.radians(angle)
    v, reaction = slide(block(make_mpm, t, [surface_below(kind, mu)]))
    exact = np.sin(t) - mu * np.cos(t)
    a = (v[-1] - v[49]) / (50 * DT) / G
    assert a == pytest.approx(exact, abs=2e-3 if mu else 1e-8)
    assert reaction[50:, 1].mean() == pytest.approx(np.cos(t), rel=2e-3)


@pytest.mark.parametrize("cell", ["hexahedron", "tetrahedron"])
@pytest.mark.parametrize("kind", ["plane", "sole", "nodes"])
def test_block_slides_in_space(make_mpm, cell, kind):
    """As above, obliquely to the grid and across the middle of its cells: a along the slope, nothing across.
    Measured: within 5e-4 g of 0.2402 g, and 7e-5 g."""
    t, mu, down = np.radians(30), 0.3, np.array([np.cos(0.4), np.sin(0.4), 0.0])
    if kind == "nodes":
        wall = GridWall(lambda x: x[:, 2] < 1e-9, "+z", mu, True, name="slope")
    elif kind == "plane":
        wall = Penalty(Interface.patch((-0.4, -0.4, 0), (2, 0, 0), (0, 1.5, 0), (20, 15)), (0, 0, 1), mu,
                       True, name="slope")
    else:
        wall = Penalty(Interface.patch((0, 0, 1e-3), (1, 0, 0), (0, 0.5, 0), (6, 3)), (0, 0, 1), mu, True,
                       follows=True, name="slope")
    bottom = 0.0 if kind == "nodes" else -0.35
    grid = Grid(Box((-0.5, -0.5, bottom), (1.75, 1.25, bottom + 1.25)), (9, 7, 5), cell)
    solid = make_mpm(cell, grid=grid, box=((0.0, 0.0, 0.0), (1.0, 0.5, 0.5)), body_cells=(6, 3, 3), points=2
                     if cell == "hexahedron" else 4, stress_state=None, law=LAWS["linear"](1e8, 0.3),
                     rho=1000.0, interface=None, gravity=G * (np.sin(t) * down - [0, 0, np.cos(t)]),
                     inertia="lumped", penalties=[wall])
    v = []
    for _ in range(60):
        solid.advance(DT)
        v.append(solid.momentum() / 250)
    a = (v[-1] - v[29]) / (30 * DT) / G
    assert a @ down == pytest.approx(np.sin(t) - mu * np.cos(t), abs=1e-3)
    assert abs(a @ [-down[1], down[0], 0.0]) < 2e-4


@pytest.mark.parametrize("kind", ["plane", "sole"])
def test_block_rests_below_the_friction_angle(make_mpm, kind):
    """It slips while the first waves lift it, then stays: the springs remember their load."""
    t = np.radians(20)
    solid = block(make_mpm, t, [surface_below(kind, 0.5)])
    v, reaction = slide(solid, 60)
    early = solid.points.x.mean(axis=0)
    later = slide(solid, 90)
    assert abs(solid.points.x.mean(axis=0) - early).max() < 3e-5
    np.testing.assert_allclose(later[1][-50:].mean(axis=0), [-np.sin(t), np.cos(t)], atol=1e-4)


@pytest.mark.parametrize("angle, mu, moves", [(30, 0.3, True), (20, 0.5, False)])
def test_wall_of_grid_nodes_has_friction(make_mpm, cell, angle, mu, moves):
    """As the plane above, on the lowest row of nodes."""
    t, grid = np.radians(angle), Grid(Box((-0.5, 0.0), (2.5, 1.0)), (12, 4), cell)
    floor = GridWall(lambda x: x[:, 1] < 1e-9, "+y", mu, separates=True, name="slope")
    v, reaction = slide(block(make_mpm, t, [floor], grid))
    a = (v[-1] - v[49]) / (50 * DT) / G
    assert a == pytest.approx((np.sin(t) - mu * np.cos(t)) * moves, abs=6e-4)
    np.testing.assert_allclose(-reaction[50:, 0].mean(), mu * np.cos(t) if moves else np.sin(t), atol=2e-3)


@pytest.mark.parametrize("wall", ["plane", "sole", "nodes"])
def test_wall_pushes_but_does_not_pull(make_mpm, wall):
    """A block thrown off at 1 m/s flies as if alone when it may separate, and is held when it may not."""
    grid = Grid(Box((-0.5, -0.5), (2.5, 1.5)), (12, 8))

    def thrown(separates):
        if wall == "nodes":
            floor = GridWall(lambda x: abs(x[:, 1]) < 1e-9, "+y", 0.3, separates, name="slope")
        else:
            floor = surface_below(wall, 0.3, separates=separates)
        solid = block(make_mpm, 0.0, [floor], grid, velocity=(0.0, 1.0))
        slide(solid, 20)
        return solid.momentum()[1] / 500
    assert thrown(True) == pytest.approx(1.0 - G * 20 * DT, rel=1e-9)
    assert thrown(False) < 0.3


def test_sole_meets_its_plane_where_it_is(make_mpm):
    """Dropped from 2 cm, the block touches after sqrt(2 s / g) and then carries its weight on the plane."""
    grid = Grid(Box((-0.5, -0.5), (1.5, 1.5)), (8, 8))
    sole = Penalty(Interface.line((0, 1e-3), (1, 1e-3), 8), (0, 1), separates=True, follows=True,
                   at=(0.0, -0.019), name="slope")
    solid = block(make_mpm, 0.0, [sole], grid)
    reaction = slide(solid, 40)[1][:, 1]
    assert np.argmax(reaction > 0) * DT == pytest.approx(np.sqrt(2 * 0.02 / G), abs=DT)
    assert solid.points.x[:, 1].min() > -0.02


def swing(make_mpm, h, steps=120):
    """A bar of 0.2 m x 1 m swings by 0.1 rad about one boundary particle: time of its turning point over the
    exact one less 1, energy lost in one period over that of the swing, and largest gap of the hinge [m]."""
    d, inertia = 0.4, (1.0 + 0.04) / 12 + 0.16
    period = 2 * np.pi * np.sqrt(inertia / (G * d)) * (1 + 0.1**2 / 16)
    hinge = Penalty(Interface(np.array([[0.1, 0.9]]), np.zeros((0, 2), int)), follows=True, name="hinge")
    solid = make_mpm(box=((0.0, 0.0), (0.2, 1.0)), h=h, margin=round(0.2 / h), law=LAWS["linear"](1e8, 0.3),
                     rho=1000.0, interface=None, gravity=tilted(0.1), penalties=[hinge], inertia="lumped")
    w, p, energy = [0.0], solid.points, sum(solid.energy().values())
    for _ in range(steps):
        solid.advance(period / steps)
        r = p.x - [0.1, 0.9]
        w.append(p.mass @ (r[:, 0] * p.v[:, 1] - r[:, 1] * p.v[:, 0]))
    turn = np.flatnonzero((np.array(w[1:-1]) > 0) & (np.array(w[2:]) <= 0))[0] + 1
    half = (turn + w[turn] / (w[turn] - w[turn + 1])) / (steps / 2)
    lost = (energy - sum(solid.energy().values())) / (200 * G * d * (1 - np.cos(0.1)))
    return half - 1, lost, abs(solid.penalties[0].points.gap).max()


def test_pendulum_swings_at_its_period(make_mpm):
    """T = 2 pi sqrt(I / (m g d)), I about the hinge. The period is too long, and energy lost, by what the
    lumped projection takes from a rotation: O(h^2). The hinge holds to 4e-6 m."""
    errors, lost, gap = np.array([swing(make_mpm, h) for h in (0.2, 0.1, 0.05)]).T
    assert 0 < errors[2] < 0.006 and 0 < lost[2] < 0.03
    np.testing.assert_allclose(np.log2(errors[:-1] / errors[1:]), 2.1, atol=0.3)
    assert gap.max() < 4e-6


def pulled(make_mpm, end, steps=40, stiffness=None):
    """A bar of 1 m x 0.5 m after one second in which it was held at x = 0 and pulled at x = 1, smoothly, by 1
    %."""
    motion = lambda t: np.array([0.005 * (1 - np.cos(np.pi * min(max(t, 0.0), 1.0))), 0.0])  # noqa: E731
    grid = Grid(Box((-0.5, -0.5), (1.5, 1.0)), (8, 6))
    supports, penalties = [Support.column("x", 0.0, grid, "x")], []
    if end == "nodes":
        supports.append(Support.column("x", 1.0, grid, "x", lambda t: motion(t)[0]))
    else:
        penalties = [Penalty(Interface.line((1.0, 0.0), (1.0, 0.5), 4), (-1, 0), motion=motion,
                             follows=end == "body", stiffness=stiffness, name="end")]
    solid = make_mpm(box=((0, 0), (1, 0.5)), grid=grid, body_cells=(8, 4), law=LAWS["linear"](1e5, 0.0),
                     rho=1.0, interface=None, supports=supports, penalties=penalties)
    for _ in range(steps):
        solid.advance(1.0 / steps)
    return solid


@pytest.mark.parametrize("end", ["space", "body"])
def test_prescribed_motion_agrees_with_grid_nodes_as_the_springs_get_stiffer(make_mpm, end):
    """The springs give by stress / k: a share of E / (k L + E) of the motion, with k from one to a hundred E
    / h. The error falls from 21 % to 0.24 %."""
    exact = pulled(make_mpm, "nodes").cauchy_stress()[:, 0, 0].mean()
    errors = []
    for k in (4e5, 4e6, 4e7):
        errors.append(1 - pulled(make_mpm, end, stiffness=k).cauchy_stress()[:, 0, 0].mean() / exact)
    np.testing.assert_allclose(errors, [1e5 / (k + 1e5) for k in (4e5, 4e6, 4e7)], rtol=0.06)


def test_moving_wall_pushes_a_block(make_mpm):
    """A wall in space that starts smoothly takes the block along to the same speed."""
    grid = Grid(Box((-0.5, -0.5), (2.5, 1.0)), (12, 6))
    motion = lambda t: np.array([0.5 * 10.0 * t**2, 0.0])  # noqa: E731
    wall = Penalty(Interface.line((0.0, -0.2), (0.0, 0.7), 18), (1, 0), separates=True, motion=motion,
                   name="wall")
    solid = make_mpm(box=((0, 0), (1, 0.5)), grid=grid, body_cells=(8, 4), law=LAWS["linear"](1e7, 0.3),
                     rho=1000.0, interface=None, penalties=[wall], inertia="lumped")
    pushed = []
    for _ in range(200):
        solid.advance(DT)
        pushed.append(solid.reaction("wall")[0] / 5000)
    np.testing.assert_allclose(solid.momentum() / 500, [4.0, 0.0], atol=0.03)
    np.testing.assert_allclose(solid.points.x.mean(axis=0) - [0.5, 0.25], [0.8, 0.0], atol=0.002)
    assert np.mean(pushed[100:]) == pytest.approx(1.0, rel=0.02)


def loaded_problem(make_mpm, grid=None, **changes):
    """All kinds of springs, pressed, sliding, sticking and open, at a random deformation."""
    grid = turned_grid(0.35) if grid is None else grid
    line, random = Interface.line((0.1, 0.1), (0.9, 0.1), 8), np.random.default_rng(4)
    penalties = [Penalty(line, name="stick", follows=True), Penalty(line, (0, 1), 0.4, name="rub"),
                 Penalty(line, (1, 2), 0.4, True, follows=True, name="rub and separate"),
                 Penalty(line, (1, -2), np.inf, True, name="stick and separate"),
                 Penalty(line, (2, 1), name="slip")]
    solid = make_mpm(grid=grid, box=((0.0, 0.0), (1.0, 0.5)), body_cells=(8, 4), interface=None,
                     penalties=penalties, **changes)
    for penalty in solid.penalties:
        penalty.points.gap[:] = random.normal(size=penalty.points.gap.shape) * 1e-2
        penalty.points.force[:] = random.normal(size=penalty.points.gap.shape) * 50
    solid.points.v += random.normal(size=solid.points.v.shape)
    return solid, random


def test_matrix_is_the_derivative_of_the_residual(make_mpm, check_matrix):
    """Away from the kinks, for all kinds of springs at once; the springs keep the matrix symmetric."""
    solid, random = loaded_problem(make_mpm)
    check_matrix(solid, random, 1e-2, 1e-3)
    kinds = np.concatenate([penalty.points.status for penalty in solid.penalties])
    assert set(kinds % springs.CLOSED).issuperset({springs.FREE, springs.STICK})
    assert kinds.max() > springs.CLOSED + 1


@pytest.mark.parametrize("D", [2, 3])
def test_spring_matrix_is_the_derivative_of_the_force(taylor_rate, D):
    """In the plane and in space, at 200 random gaps: all branches."""
    random, n, K = np.random.default_rng(1), 200, 2**D
    respond, matrix = specialise(springs.respond, D=D, K=K), specialise(springs.spring_matrix, D=D)
    cells, N = np.arange(K)[None, :], np.full((n, K), 1 / K)
    normal = random.normal(size=(n, D))
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    base, limit = random.normal(size=(n, D)), random.uniform(0, 2, n) * random.integers(0, 2, n)
    separates, du = random.integers(0, 2, n).astype(bool), random.normal(size=D)
    k = random.uniform(1, 2, n)

    def force(s):
        gap, f, status = np.empty((n, D)), np.empty((n, D)), np.empty(n, np.int8)
        u = np.tile(s * du, (K, 1))
        respond(np.zeros(n, np.int32), cells, N, u, springs.Springs(base, normal, k, limit, separates),
                springs.Answer(gap, f, status))
        return gap, f, status
    gap, f, status = force(0.0)
    slope, C = np.empty((n, D)), np.empty((D, D))
    for p in range(n):
        matrix(gap[p], normal[p], limit[p], status[p], C)
        slope[p] = -k[p] * springs.LEAD * C @ du
    smooth = (force(1e-4)[2] == status) & (force(5e-5)[2] == status)
    assert len(np.unique(status)) >= 4 * D - 2 + 2 and smooth.sum() > 0.9 * n
    if D == 3:  # in the plane every branch is linear
        assert taylor_rate(lambda s: force(s)[1][smooth], slope[smooth], h=1e-4) == pytest.approx(2.0,
                                                                                                  abs=0.05)
    else:
        np.testing.assert_allclose(force(1e-4)[1][smooth], (f + 1e-4 * slope)[smooth], rtol=0, atol=1e-14)


def busy(make_mpm):
    """A block on a slope with a load, a hinge and a moving wall."""
    hinge = Penalty(Interface(np.array([[0.9, 0.4]]), np.zeros((0, 2), int)),
                    motion=lambda t: np.array([0.1 * t, 0.0]), follows=True, stiffness=1e5, name="hinge")
    top = Interface.line((0.0, 0.45), (1.0, 0.45), 6)
    wall = Penalty(Interface.line((0.0, 0.1), (0.0, 0.4), 3), (1, 0), separates=True,
                   motion=lambda t: [20 * t**2, 0.0], name="wall")
    return block(make_mpm, 0.5, [surface_below("plane", 0.3), hinge, wall],
                 loads=[Load(top, pressure=lambda t: 1e4 * t)])


def test_state_restores_everything(make_mpm):
    """A run that goes back continues bit for bit."""
    solid = busy(make_mpm)
    for _ in range(8):
        solid.advance(DT)
    state = solid.get_state()
    ends = []
    for _ in range(2):
        for _ in range(6):
            solid.advance(DT)
        ends.append({name: values for name, values in solid.get_state().items() if name != "tangent"})
        solid.set_state(state)
    assert {"loads.force", "hinges.gap", "walls.gap", "walls.status"} < set(state)
    for name in ends[0]:
        np.testing.assert_array_equal(ends[0][name], ends[1][name], err_msg=name)


def test_a_scene_without_conditions_carries_none(make_mpm):
    solid = make_mpm()
    assert {name.split(".")[0] for name in solid.get_state() if "." in name} == {"points", "boundary"}
    assert solid.step.problem.penalties == solid.step.problem.loads == ()


PARALLEL = """
import sys
import numpy as np
from mpi4py import MPI
import conftest, test_penalty
from mpm_fenicsx import MPM
solid = test_penalty.busy(conftest.make_mpm.__wrapped__(MPM))
sums = 0.0
for _ in range(20):
    solid.advance(2e-3)
    sums = sums + np.array([solid.reaction(name) for name in ("slope", "hinge", "wall")])
parts = MPI.COMM_WORLD.gather((solid.points.gid, solid.points.x, solid.points.v))
if MPI.COMM_WORLD.rank == 0:
    gid, x, v = (np.concatenate(a) for a in zip(*parts))
    np.savez(sys.argv[1], x=x[np.argsort(gid)], v=v[np.argsort(gid)], sums=sums)
"""


@pytest.mark.mpi
def test_two_ranks_do_as_one(tmp_path, on_ranks):
    """Up to the order of sums: 2e-16 m after 20 steps, measured."""
    results = []
    for ranks in (1, 2):
        out = tmp_path / f"{ranks}.npz"
        done = on_ranks(ranks, PARALLEL, out)
        assert done.returncode == 0, done.stderr
        results.append(np.load(out))
    one, two = results
    assert (abs(one["sums"]).max(axis=1) > 10).all()
    np.testing.assert_allclose(two["x"], one["x"], rtol=0, atol=1e-10)
    np.testing.assert_allclose(two["sums"], one["sums"], rtol=1e-6)


LINE = Interface.line((0.0, 0.0), (1.0, 0.0), 4)


@pytest.mark.parametrize("arguments, message", [
    (dict(stiffness=-1.0), "stiffness of base is -1.0 Pa/m: it must be positive"),
    (dict(normal=(0, 0)), r"normal of base is \[0.0, 0.0\]: it must be finite and not zero"),
    (dict(normal=(0, 1, 0)), r"normal of base is \(0, 1, 0\): give numbers of shape \(2,\) or \(5, 2\)"),
    (dict(normal=(0, 1), friction=-0.1), "friction of base is -0.1: it must be 0 or more"),
    (dict(friction=0.1), "base sticks, as it has no normal: give one"),
    (dict(separates=True), "base sticks, as it has no normal: give one"),
    (dict(normal=(0, 1), at=(0, 0)), r"base has a plane at \(0, 0\) but stays in space"),
])
def test_penalty_says_what_is_wrong(arguments, message):
    with pytest.raises(ValueError, match=message):
        Penalty(LINE, name="base", **arguments)


@pytest.mark.parametrize("arguments, message", [
    (dict(normal="y"), "normal of floor is 'y': give a sign and an axis"),
    (dict(normal="+y", friction=-1), "friction of floor is -1: it must be 0 or more"),
    (dict(normal="+y", stiffness=0.0), "stiffness of floor is 0.0 Pa/m: it must be positive"),
])
def test_grid_wall_says_what_is_wrong(arguments, message):
    with pytest.raises(ValueError, match=message):
        GridWall(lambda x: x[:, 1] < 0, name="floor", **arguments)


@pytest.mark.parametrize("condition, message",
                         [(Penalty(Interface.line((0, 0), (9, 0), 3), name="base"),
                           r"particle 2 of base lies at \[6. 0.\] m, .* enlarge"),
                          (GridWall(lambda x: x[:, 1] < -9, "+y", name="floor"),
                           "floor holds no node of the grid: look at where"),
                          (GridWall(lambda x: x[:, 1] < 0, "+z", name="floor"),
                           "normal of floor is '\\+z', the scene has 2 dimensions"),
                          (Penalty(LINE, motion=lambda t: np.ones(2), name="base"),
                           r"motion of base at t = 0 is \[1.0, 1.0\] m: it must"),
                          (Penalty(Interface(np.zeros((1, 3)), np.zeros((0, 3), int)), name="base"),
                           "surface of base has 3 dimensions, the"),])
def test_scene_says_what_is_wrong(make_mpm, condition, message):
    with pytest.raises(ValueError, match=message):
        make_mpm(penalties=[condition])


def test_a_hinge_outside_the_body_is_refused(make_mpm):
    far = Penalty(Interface(np.array([[-0.9, 1.4]]), np.zeros((0, 2), int)), follows=True, name="hinge")
    with pytest.raises(MPMError, match="boundary particle 0 at x = .* has no material point near it at t = 0 "
                       "s"):
        make_mpm(penalties=[far]).advance(0.01)


def test_reaction_of_an_unknown_name(make_mpm):
    solid = make_mpm(penalties=[Penalty(LINE, name="base")])
    with pytest.raises(ValueError, match="there is no penalty 'bass': choose one of base"):
        solid.reaction("bass")
