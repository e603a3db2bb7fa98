"""Contact between bodies that have fields of the grid of their own."""
import numpy as np
import pytest

from mpm_fenicsx import MPM, Body, Box, Grid, Interface, Support, linear


def velocity(body):
    """Mean of the points of a body [m/s]."""
    p = body.points
    return p.mass @ p.v / p.mass.sum()


def bars(v, gap, n, offset=0.0):
    """Two bars 1 m long and 1/4 m thick in body cells of 1/n m that fly along x at the velocities v [m/s],
    ``gap`` [m] apart in the middle of a grid of the same cells, moved by ``offset`` cells, E 1 MPa."""
    h = 1.0 / n
    make = lambda x, v: Body(Box((x, 0.0), (x + 1.0, 4 * h)), (n, 4), 2, linear(1e6, 0.0),  # noqa: E731
                             1000.0, velocity=np.array([v, 0.0]))
    first, second = make(offset * h - 1.0 - gap / 2, v[0]), make(offset * h + gap / 2, v[1])
    return Grid(Box((-1.5, -4 * h), (1.5, 8 * h)), (3 * n, 12)), [first, second]


def test_bodies_that_touch_part(start):
    """Both move as they did, to round-off: nothing pulls."""
    solid = start(*bars((-1.0, 1.0), 0.0, 16))
    for _ in range(200):
        solid.advance(1e-3)
    assert velocity(solid.bodies[0])[0] == pytest.approx(-1.0, abs=1e-13)
    assert velocity(solid.bodies[1])[0] == pytest.approx(1.0, abs=1e-13)


@pytest.mark.parametrize("basis", ["linear", pytest.param("gimp", marks=pytest.mark.validation)])
def test_bars_exchange_their_velocities(start, basis):
    """Of equal impedance (Saint-Venant): what strikes stops, what rests flies on, within 2 %; contact begins
    where they touch, and the energy never rises."""
    grid, bodies = bars((0.1, 0.0), 0.02, 64, 0.37)
    solid, step = start(grid, bodies, basis=basis), 0.5 / 64 / 1000.0**0.5
    energy, momentum, touch = [sum(solid.energy().values())], solid.momentum(), None
    while solid.time < 0.02 / 0.1 + 3.0 / 1000.0**0.5:
        solid.advance(step)
        energy.append(sum(solid.energy().values()))
        if touch is None and solid.reaction("bodies 0 and 1").any():
            touch = solid.time
    assert touch == pytest.approx(0.2, abs=5 * step)
    assert velocity(solid.bodies[0])[0] == pytest.approx(0.0, abs=0.002)
    assert velocity(solid.bodies[1])[0] == pytest.approx(0.1, abs=0.002)
    assert max(energy) <= energy[0] * (1 + 1e-12)
    np.testing.assert_allclose(solid.momentum(), momentum, rtol=0, atol=1e-6 * momentum[0])


def slope(start, friction, h, dim=2, **more):
    """Block of 0.4 x 0.2 (x 0.2) m on one of 2 x 0.2 (x 0.4) m that is held at its foot, under gravity at 30
    degrees to their surface, which cuts the cells of h [m]."""
    top = 0.2 + 0.4 * h
    box = lambda lower, upper: Box(lower[:dim], upper[:dim])  # noqa: E731
    make = lambda shape: Body(shape, Grid.counts(shape.size, h), 2, linear(1e7, 0.3), 1000.0,  # noqa: E731
                              friction=friction)
    ground, block = (make(box(*ends)) for ends in (((-0.4, 0.0, 0.0), (1.6, top, 0.4)),
                                                   ((0.0, top, 0.1), (0.4, top + 0.2, 0.3))))
    grid = Grid(box((-0.6, 0.0, -0.1), (1.8, 0.8, 0.5)), Grid.counts((2.4, 0.8, 0.6)[:dim], h))
    gravity = (10 * np.sin(np.pi / 6), -10 * np.cos(np.pi / 6), 0.0)[:dim]
    foot = Support(lambda x: x[:, 1] < 1e-9, "xyz"[:dim])
    return start(grid, [ground, block], [foot], gravity=gravity, inertia="lumped", **more)


@pytest.mark.parametrize("friction, h, dim", [
    (0.3, 0.05, 2), *(pytest.param(*args, marks=pytest.mark.validation) for args in [
        (0.0, 0.05, 2), (0.3, 0.025, 2), (0.3, 0.4 / 6, 3)])])
def test_a_block_slides_down_a_slope(start, friction, h, dim):
    """By Coulomb: within 2 % of g (sin - mu cos), after the first bounces."""
    solid, times, speeds = slope(start, friction, h, dim), [], []
    while solid.time < 0.3 - 1e-9:
        solid.advance(2e-3)
        times.append(solid.time)
        speeds.append(velocity(solid.bodies[1])[0])
    late = np.array(times) > 0.12
    expected = 10 * (np.sin(np.pi / 6) - friction * np.cos(np.pi / 6))
    acceleration = np.polyfit(np.array(times)[late], np.array(speeds)[late], 1)[0]
    assert acceleration == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize("basis", ["linear", "gimp"])
def test_a_block_sticks_below_the_angle_of_friction(start, basis):
    """tan 30 degrees = 0.577: it rests, with the force of its weight."""
    solid = slope(start, 0.6, 0.05, basis=basis)
    solid.settle(2)
    before = solid.bodies[1].points.x.copy()
    for _ in range(25):
        solid.advance(2e-3)
    weight = 1000.0 * 0.4 * 0.2 * 10 * np.array([np.sin(np.pi / 6), -np.cos(np.pi / 6)])
    # with a smooth basis load steps have a ghost penalty on stiffness, which lets go afterwards
    np.testing.assert_allclose(solid.reaction("bodies 0 and 1"), weight,
                               rtol=1e-4 if basis == "linear" else 0.02)
    assert abs(solid.bodies[1].points.x - before).max() < (1e-7 if basis == "linear" else 1e-4)


@pytest.mark.parametrize("offset", [0.0, 0.3])
def test_thrust_on_an_elastic_wall(start, offset):
    """Of what presses to the side as it does downwards (nu 0.4999, so K0 = 0.9996), at rest against a wall
    that is fixed at its foot: rho g h^2 / 2 within 3 %."""
    h, L = 0.05, 0.4
    x = L + offset * h
    soft = Body(Box((0.0, 0.0), (x, L)), Grid.counts((x, L), h), 2, linear(1e5, 0.4999), 1000.0, f_bar=True)
    wall = Body(Box((x, -2 * h), (x + 4 * h, L + 2 * h)), (4, 12), 2, linear(1e9, 0.2), 2500.0)
    supports = [Support(lambda x: (abs(x[:, 1]) < 1e-9) & (x[:, 0] < L + 0.5 * h), "y"),
                Support(lambda x: x[:, 0] < 1e-9, "x"), Support(lambda x: x[:, 1] < -2 * h + 1e-9, "xy")]
    solid = start(Grid(Box((0.0, -2 * h), (0.8, 0.8)), (16, 18)), [soft, wall], supports,
                  gravity=(0.0, -10.0), inertia="lumped")
    solid.settle(4)
    push = solid.reaction("bodies 0 and 1")
    assert push[0] == pytest.approx(-0.5 * 1000.0 * 10.0 * L**2, rel=0.03)
    assert abs(push[1]) < 1e-3 * abs(push[0])


def test_forces_on_both_are_equal_opposite_and_in_the_same_places(start, options):
    """Sum and moment of the forces on all nodes, in the middle of a hit off the centre, to round-off, and
    with a tangent in every iteration momentum (a kept one leaves 1e-8 of it, in contact or not); a run that
    goes back to there repeats itself bit for bit."""
    options(snes_lag_jacobian=1)
    make = lambda x, y, v: Body(Box((x, y), (x + 1.0, y + 1.0)), (4, 4), 2, linear(1e5, 0.3),  # noqa: E731
                                1000.0, velocity=np.array([v, 0.1]), friction=0.4)
    solid = start(Grid(Box((-2.0, -2.0), (3.0, 3.0)), (20, 20)),
                  [make(-1.02, -0.1, 1.0), make(0.0, 0.33, -1.0)], inertia="lumped")
    momentum = solid.momentum()
    for _ in range(15):
        solid.advance(2e-3)
    contact, = solid._contacts
    state, forces = solid.get_state(), []
    residual = contact.residual

    def look(grid, increment, R):
        before = R.copy()
        answer = residual(grid, increment, R)
        forces.append((grid.active_cells.places.copy(), R - before))
        return answer

    contact.residual = look
    for _ in range(5):
        solid.advance(2e-3)
    end, (x, f) = solid.get_state(), forces[-1]
    np.testing.assert_allclose(solid.momentum(), momentum, rtol=0, atol=1e-12 * 1000.0)
    assert abs(f).max() > 100.0
    assert abs(f.sum(axis=0)).max() < 1e-12 * abs(f).sum()
    assert abs(np.sum(x[:, 0] * f[:, 1] - x[:, 1] * f[:, 0])) < 1e-12 * abs(f).sum()
    solid.set_state(state)
    for _ in range(5):
        solid.advance(2e-3)
    again = solid.get_state()
    for name in end.keys() - {"tangent"}:
        assert end[name].tobytes() == again[name].tobytes(), name


def test_a_boundary_particle_belongs_to_the_nearest_body(start):
    """A force on the surface of the wall moves the wall, and not the soil beside it."""
    soil, wall = (Body(Box((x, 0.0), (x + 1.0, 1.0)), (4, 4), 2, linear(1e5, 0.3), 1000.0)
                  for x in (0.0, 1.0))
    face = Interface(np.array([(1.02, 0.3), (1.02, 0.7), (0.98, 0.5)]), np.zeros((0, 2), int))
    solid = start(Grid(Box((-1.0, -1.0), (3.0, 2.0)), (16, 12)), [soil, wall], interface=face,
                  inertia="lumped")
    force = np.array([(10.0, 0.0), (10.0, 0.0), (0.0, 0.0)])
    for _ in range(10):
        x, v = solid.advance(1e-3, force)
    assert velocity(solid.bodies[1])[0] == pytest.approx(20.0 * 0.01 / 1000.0, rel=1e-6)
    assert abs(velocity(solid.bodies[0])).max() < 1e-9 and abs(v[2]).max() < 1e-6
    assert (v[:2, 0] > 1e-4).all()


def test_groups_of_bonded_bodies(start):
    """Layers stick, what lies beside them does not."""
    make = lambda x, v: Body(Box((x, 0.0), (x + 1.0, 1.0)), (4, 4), 2, linear(1e5, 0.3), 1000.0,  # noqa: E731
                             velocity=np.array([v, 0.0]))
    bodies = [make(0.0, 0.0), make(1.0, 0.1), make(-1.0, -0.1)]
    solid = start(Grid(Box((-2.0, -1.0), (3.0, 2.0)), (20, 12)), bodies, bonded=[(0, 1)])
    assert solid.background.fields == 2
    for _ in range(60):
        solid.advance(2e-3)
    assert velocity(solid.bodies[2])[0] == pytest.approx(-0.1, abs=1e-9)
    assert abs(velocity(solid.bodies[0])[0] + velocity(solid.bodies[1])[0] - 0.1) < 1e-6
    assert abs(velocity(solid.bodies[0])[0] - 0.05) < 0.045


def test_a_stack(start):
    """Three blocks on each other, each in a field of its own, at rest: forces by weight, which are columns of
    the history, too. Names count the bodies as they are given, the force is that on the first one named."""
    box = lambda x, y: Box((x, y), (2.0 - x, y + 0.5))  # noqa: E731
    blocks = [Body(box(0.25 * n, 0.5 * n), (8 - 2 * n, 2), 2, linear(1e6 / (1 + n % 2), 0.0), 1000.0,
                   friction=0.5) for n in range(3)]
    floor = Support(lambda x: x[:, 1] < 1e-9, "xy")
    solid = start(Grid(Box((-1.0, 0.0), (3.0, 2.0)), (16, 8)), blocks, [floor], gravity=(0.0, -10.0),
                  inertia="lumped")
    solid.settle(2)
    solid.advance(1e-3)
    weights = [1000.0 * 10.0 * 0.5 * (2.0 - 0.5 * n) for n in range(3)]
    assert solid.reaction("bodies 1 and 2")[1] == pytest.approx(-weights[2], rel=1e-4)
    assert solid.reaction("bodies 0 and 1")[1] == pytest.approx(-weights[1] - weights[2], rel=1e-4)
    assert not solid.reaction("bodies 0 and 2").any()
    unit, meaning, value = solid.columns()["force_bodies_1_2_y"]
    assert unit == "N" and value() == solid.reaction("bodies 1 and 2")[1] and "bodies 1 and 2" in meaning


@pytest.mark.parametrize("bonded, words", [
    (1, "bonded is 1: give True or False, or groups"),
    ([(0, 2)], "give each of the bodies 0 to 1 at most once"),
    ([(0, 0)], "at most once"), ([(0, 0.5)], "number of a body in bonded is 0.5")],
    ids=["a number", "beyond", "twice", "half"])
def test_bad_groups(bonded, words):
    grid, bodies = bars((0.0, 0.0), 0.0, 4)
    with pytest.raises(ValueError, match=words):
        MPM(grid, bodies, bonded=bonded)


def test_bad_friction():
    with pytest.raises(ValueError, match="friction of the body is -0.1"):
        Body(Box((0.0, 0.0), (1.0, 1.0)), (4, 4), 2, linear(1e5, 0.3), 1000.0, friction=-0.1)


# with a kept tangent Newton's method ends anywhere within its tolerance
TIGHT = "-mpm_snes_rtol", "1e-12", "-mpm_snes_atol", "1e-9"
RUN = """
import sys
import numpy as np
from mpm_fenicsx import MPM, Body, Box, Grid, Interface, Mesh, Numerics, Soil, Support, linear
from mpm_fenicsx.grid.background import whole_mesh
path, kind = sys.argv[1:3]
D, basis = 3 if kind == "space" else 2, "gimp" if kind == "gimp" else "linear"
soil, triangles = Soil(E=1e5, nu=0.3, rho=1500.0, phi=30.0), kind in ("mesh", "f_bar")
pile = Body(Box((0.0, 0.0, 0.0)[:D], (0.6, 0.6, 0.3)[:D]), (6, 6, 3)[:D], 2, soil.material(D), 1500.0,
            velocity=(1.0, 0.0, 0.0)[:D], f_bar=kind == "f_bar", friction=0.4)
wall = Body(Box((0.68, 0.0, 0.0)[:D], (0.88, 0.9, 0.3)[:D]), (2, 9, 3)[:D], 2, linear(1e7, 0.2), 2500.0)
grid = Grid(Box((-0.5, 0.0, -0.2)[:D], (1.5, 1.2, 0.5)[:D]), (20, 12, 7)[:D],
            "triangle" if triangles else None)
if kind == "mesh":
    x, cells = whole_mesh(grid)
    inner = ((x > grid.box.lower) & (x < grid.box.upper)).all(axis=1)
    x[inner] += 0.01 * np.random.default_rng(1).uniform(-1, 1, (inner.sum(), 2))
    grid = Mesh(x, cells, "triangle")
MPM.rebalance_every = 5
top = Interface(np.array([(0.75, 0.85, 0.1), (0.3, 0.55, 0.1)])[:, :D], np.zeros((0, D), int))
solid = MPM(grid, [pile, wall], [Support(lambda x: x[:, 1] < 1e-9, "xyz"[:D])], top,
            gravity=(0.0, -10.0, 0.0)[:D], inertia="lumped", basis=basis, numerics=Numerics(rebalance=1.05))
push = []

def advance(first, last):
    for n in range(first, last):
        if n % 7 == 0:
            state = solid.get_state()
            solid.advance(4e-3)
            solid.set_state(state)
        x, v = solid.advance(4e-3, np.array([[1.0] * D, [0.0] * D]))
        push.append(solid.reaction("bodies 0 and 1"))
    return x

last = 30 if D == 3 else 45
advance(0, last - 15)
solid.save(path + ".h5")
end = advance(last - 15, last)
solid.load(path + ".h5")
again, gather = advance(last - 15, last), lambda values: np.concatenate(solid.comm.allgather(values))
fields, energy, momentum = {}, list(solid.energy().values()), solid.momentum()
for k, body in enumerate(solid.bodies):
    order = np.argsort(gather(body.points.gid))
    fields |= {f"{name}{k}": gather(getattr(body.points, name))[order] for name in ("x", "v")}
if solid.comm.rank == 0:
    np.savez(path, push=push, end=end, again=again, energy=energy, momentum=momentum,
             rebalances=len(solid.rebalances), **fields)
"""


@pytest.mark.mpi
@pytest.mark.parametrize("kind", [pytest.param(kind, marks=pytest.mark.validation) for kind in
                                  ("plane", "gimp", "f_bar", "mesh", "space")])
def test_ranks_give_what_one_gives(on_ranks, tmp_path, kind):
    """Soil that is thrown at an elastic wall, on 1, 2 and 3 ranks, with new distributions of the grid on the
    way and a checkpoint from which the run goes on."""
    found = []
    for n in (1, 2, 3):
        path = str(tmp_path / f"{n}.npz")
        done = on_ranks(n, RUN, path, kind, *TIGHT)
        assert done.returncode == 0, done.stderr[-2000:]
        found.append(np.load(path))
    assert abs(found[0]["push"]).max() > 1000.0 and found[2]["rebalances"] > 0
    for one in found:
        np.testing.assert_array_equal(one["again"], one["end"])
    for name in set(found[0].files) - {"rebalances"}:
        for other in found[1:]:
            np.testing.assert_allclose(other[name], found[0][name], rtol=0,
                                       atol=1e-10 * abs(found[0][name]).max(), err_msg=name)
