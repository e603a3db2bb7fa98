"""Material that comes into a scene: as one piece, as much as the hydrograph says, booked, on any ranks."""

import numpy as np
import pytest
from scipy.integrate import trapezoid

from mpm_fenicsx import (
    MPM,
    Body,
    Box,
    Grid,
    GridWall,
    Inflow,
    Numerics,
    Outflow,
    Soil,
    Structure,
    at_rest,
    linear,
)

STIFF = linear(1e5, 0.3)
PLUGS = {
    "along x": ((-0.4, -0.2), (1.2, 0.5), (0.0, 0.0), "+x", 2, {}),
    "falling": ((-0.2, -0.8), (0.5, 0.4), (0.0, 0.0), "-y", 2, {}),
    "in space": ((-0.8, -0.2, -0.3), (0.4, 0.4, 0.3), (0.0, 0.0, 0.0), "-x", 3, {}),
    "gimp": ((-0.4, -0.2), (1.2, 0.5), (0.0, 0.0), "+x", 2, dict(basis="gimp")),
    "tpic": ((-0.4, -0.2), (1.2, 0.5), (0.0, 0.0), "+x", 2, dict(numerics=Numerics(transfer="tpic")))}


def plug(lower, upper, at, normal, dim, more):
    """A block 0.3 m thick that goes on growing out of the inlet at 1 m/s."""
    axis, sign = "xyz".index(normal[1]), 1.0 if normal[0] == "+" else -1.0
    low, high = np.array(at), np.array(at) + 0.3
    low[axis], high[axis] = sorted([0.0, 0.2 * sign])
    if dim == 3:
        low[2], high[2] = -0.1, 0.1
    velocity = np.eye(dim)[axis] * sign
    body = Body(Box(tuple(low), tuple(high)), Grid.counts(high - low, 0.1), 2, STIFF, 1000.0,
                velocity=tuple(velocity))
    grid = Grid(Box(lower, upper), Grid.counts(np.subtract(upper, lower), 0.1))
    inlet = Inflow("the inlet", at, normal, depth=0.3, speed=1.0, width=0.2 if dim == 3 else None)
    return MPM(grid, body, openings=[inlet], **more), velocity


@pytest.mark.parametrize("name", PLUGS)
def test_a_plug_moves_as_a_rigid_body(name):
    """It comes in without stress, force or rotation, and all that comes is booked."""
    solid, velocity = plug(*PLUGS[name])
    start = solid.momentum()
    volume = solid.columns()["volume_the_inlet"][2]
    area = 0.3 * (0.2 if solid.dim == 3 else 1.0)
    for _ in range(20):
        solid.advance(0.02)
    p, came = solid.points, solid.entered
    assert abs(solid.cauchy_stress()).max() < 1e-8 * 1e5 and abs(p.v - velocity).max() < 1e-9
    assert abs(p.F - np.eye(solid.dim)).max() < 1e-12 and len(set(p.gid)) == len(p) == solid.count
    assert volume() == pytest.approx(0.4 * area, rel=1e-12)
    made = 0.55  # [m], with the column of two cells, before the last step
    assert came["mass"] == pytest.approx(1000.0 * made * area, rel=1e-12)
    assert came["energy"] == pytest.approx(0.5 * came["mass"], rel=1e-12)
    given = sum(solid.impulses().values())[:solid.dim]
    np.testing.assert_allclose(solid.momentum() - start, given, rtol=0, atol=1e-10 * came["mass"])
    assert abs(solid.impulses()["the inlet"]).max() < 1e-9 * came["mass"]
    solid.close()


DEPTH, SPEED = ([0.0, 0.1, 0.2, 0.4], [0.3, 0.4, 0.2, 0.1]), ([0.0, 0.1, 0.4], [1.0, 1.5, 0.0])
SLOPE = 4.9, -8.5


def flood(**more):
    """Soil down a chute with friction."""
    soil, h = Soil(E=1e6, nu=0.3, rho=1500.0, phi=30.0), 0.1
    body = Body(Box((0.0, 0.0), (0.2, 0.3)), (2, 3), 2, soil.material(2), soil.rho, velocity=(1.0, 0.0),
                stress=at_rest(0.3, soil.rho, SLOPE, 0.43, 30.0))
    floor = GridWall(lambda x: np.abs(x[:, 1]) < 0.25 * h, "+y", 0.4, name="floor")
    inlet = Inflow("inlet", (0.0, 0.0), "+x", depth=DEPTH, speed=SPEED)
    return MPM(Grid(Box((-0.4, 0.0), (1.4, 0.6)), (18, 6)), body, penalties=[floor],
               openings=[inlet, Outflow("weir", (0.5, 0.0), "+x")], gravity=SLOPE, inertia="lumped",
               outflow="remove", **more)


def test_what_comes_is_what_the_hydrograph_says():
    """At any time within the volume of a point, and at its end; momentum and energy are in the books."""
    solid, point = flood(numerics=Numerics(losses=True)), 0.05**2
    flow = Inflow("inlet", (0.0, 0.0), "+x", depth=DEPTH, speed=SPEED).hydrograph(1.0)
    volume, start, before = solid.columns()["volume_inlet"][2], solid.momentum(), sum(solid.energy().values())
    inside = before - solid.energy()["kinetic"]
    times = np.linspace(0.0, 0.4, 40001)
    whole = trapezoid(np.interp(times, *DEPTH) * np.interp(times, *SPEED), times)
    for _ in range(45):
        solid.advance(0.01)
        assert abs(volume() - flow.discharged(solid.time)) < point
    assert volume() == pytest.approx(whole, rel=1e-5) == flow.volume[-1]
    assert solid.entered["mass"] == pytest.approx(1500.0 * whole, rel=1e-5)
    assert sum(b.points.mass.sum() for b in solid.bodies) + solid.removed["mass"] == pytest.approx(
        1500.0 * (whole + 0.06), rel=1e-5)
    given = sum(solid.impulses().values())[:2]
    np.testing.assert_allclose(solid.momentum() - start, given, rtol=0, atol=1e-10 * abs(given).max())
    works, energy, left = solid.works(), solid.energy(), solid.removed["energy"]
    inner = energy["strain"] + energy["potential"] + works["springs"] + works["left"]
    plastic = inside - inner - works["nodes"] + works["supports"] - works["friction"]
    explained = works["supports"] - works["friction"] - plastic + solid.entered["energy"] - left
    # what is left of the balance is what transfers and held nodes have made
    made = sum(energy.values()) + works["springs"] - before - explained
    scheme = sum(way["kinetic_energy"] for way in solid.transfer_losses.values()) - works["nodes"]
    assert plastic > 0.0 and made == pytest.approx(scheme, abs=1e-10 * solid.entered["energy"])
    solid.close()


def test_soil_comes_with_the_stress_of_its_depth():
    solid = flood()
    solid.advance(1e-4)
    p, stress = solid.points, solid.cauchy_stress()
    fed = p.x[:, 0] < 0.0
    flow = Inflow("inlet", (0.0, 0.0), "+x", depth=DEPTH, speed=SPEED).hydrograph(1.0)
    surface = np.interp([flow.when(-x) for x in p.x[fed, 0]], *DEPTH)  # when it passes the plane
    depth = surface - p.x[fed, 1]
    # a layer has a mean depth
    np.testing.assert_allclose(stress[fed, 1, 1], -1500.0 * 8.5 * depth, rtol=0, atol=200.0)
    assert fed.sum() > 20 and (stress[fed, 0, 1] > 0.0).all() and (p.a[fed, 1] == 0.0).all()
    solid.close()


RANKS = """
import sys
import numpy as np
from test_inflow import *
solid = flood()
solid.rebalance_every, state = 7, None
for n in range(30):
    if n == 12:
        state = solid.get_state()
    solid.advance(0.01)
gather = lambda name: np.concatenate(solid.comm.allgather(getattr(solid.points, name)))
def fields():
    order = np.argsort(gather("gid"))
    return {name: gather(name)[order] for name in ("gid", "x", "v", "F", "mass")}
end = fields()
solid.set_state(state)
for n in range(12, 30):
    solid.advance(0.01)
again = fields()
assert all(np.abs(again[name] - end[name]).max() < 1e-9 for name in end)
volume = solid.columns()["volume_inlet"][2]()
if solid.comm.rank == 0:
    np.savez(sys.argv[1], **end, volume=volume, momentum=solid.momentum())
else:
    solid.momentum()
"""


@pytest.mark.mpi
@pytest.mark.parametrize("many", [2, pytest.param(3, marks=pytest.mark.validation)])
def test_ranks_give_what_one_gives(on_ranks, tmp_path, many):
    """Points come on whichever rank has their cells, and travel on; a state from half way goes on."""
    found = []
    for ranks in (1, many):
        path = tmp_path / f"{ranks}.npz"
        done = on_ranks(ranks, RANKS, path, "-mpm_snes_rtol", "1e-11", "-mpm_snes_atol", "1e-9")
        assert done.returncode == 0, done.stderr[-2000:]
        found.append(np.load(path))
    one, more = found
    np.testing.assert_array_equal(more["gid"], one["gid"])
    for name in ("x", "v", "F", "mass", "volume"):
        np.testing.assert_allclose(more[name], one[name], rtol=0, atol=1e-9 * abs(one[name]).max())


def inlet(**more):
    """Of a flow with one of its words changed."""
    words = {**dict(name="inlet", at=(0.0, 0.0), normal="+x", depth=0.3, speed=1.0), **more}
    solid, _ = plug(*PLUGS["along x"])
    solid.close()
    scene = vars(solid.scene)
    return MPM(**{**scene, "openings": [Inflow(**words)]})


@pytest.mark.parametrize("words, sentence", [
    (dict(at=(5.0, 0.0)), r"inlet does not fit .*: along x its points come .* from 4.8 to 5 m, and"),
    (dict(at=(-0.3, 0.0)), "along x its points come from a column upstream from -0.5 to -0.3 m, and"),
    (dict(depth=0.6), "inlet does not fit into the grid: along y it is deep from 0 to 0.6"),
    (dict(speed=-1.0), "the speed of inlet is -1 m/s at t = 0 s: what flows in is 0 or positive, turn"),
    (dict(speed=None, discharge=([0, 1], [1, -1])), "the discharge of inlet is -1 m.3/s at"),
    (dict(speed=([0, 2, 2], [1, 1, 1])), "the times of the speed of inlet do not increase: 2 s comes after"),
    (dict(speed=([0, 2], [1, 1, 1])), "the speed of inlet has 2 times and 3 values: give as many of both"),
    (dict(speed=lambda t: 1.0), "inlet has a function of time and no end: give until"),
    (dict(speed=None), "inlet has depth: give two of depth, speed and discharge"),
    (dict(speed=([0, 1], [1, 0]), depth=None, discharge=0.3), "discharge of inlet is 0.3 m"),
    (dict(width=0.3), "the width of inlet is 0.3: give one in space, and none in the plane"),
    (dict(at=(0.0, 0.0, 0.0), width=0.1), "inlet has 3 dimensions, the grid 2: give both the same"),
    (dict(body=1), "body of inlet is 1: give a number from 0 to 0"),
    (dict(name="gravity"), "'gravity' is the name of an opening, and of something else in the books"),
    (dict(normal="up"), "normal of inlet is 'up': choose one of")])
def test_what_is_no_inflow_is_refused(words, sentence):
    with pytest.raises(ValueError, match=sentence):
        inlet(**words)


def test_an_inlet_wider_than_the_grid_is_refused():
    lower, upper, at, normal, dim, more = PLUGS["in space"]
    solid, _ = plug(lower, upper, at, normal, dim, more)
    solid.close()
    wide = Inflow("inlet", at, normal, depth=0.3, speed=1.0, width=0.8)
    with pytest.raises(ValueError, match="along z it is wide from -0.4 to 0.4 m, and the grid covers -0.3"):
        MPM(**{**vars(solid.scene), "openings": [wide]})


def down_a_channel(length, end):
    """Discharge over that of the inlet in slices of half a metre, mean of the last half second; per metre."""
    h, q, v, phi, mu = 0.1, 0.6, 2.0, np.radians(25.0), 0.4
    gravity = 9.81 * np.array([np.sin(phi), -np.cos(phi)])
    soil = Soil(E=2e6, nu=0.3, rho=1600.0, phi=30.0)
    body = Body(Box((0.0, 0.0), (0.2, 0.3)), (2, 3), 2, soil.material(2), soil.rho, velocity=(v, 0.0),
                stress=at_rest(0.3, soil.rho, gravity, 0.43, 30.0), f_bar=True)
    floor = GridWall(lambda x: np.abs(x[:, 1]) < 0.25 * h, "+y", mu, name="floor")
    solid = MPM(Grid(Box((-0.2, -0.2), (length, 0.6)), Grid.counts((length + 0.2, 0.8), h)), body,
                penalties=[floor], openings=[Inflow("inlet", (0.0, 0.0), "+x", speed=v, discharge=q)],
                gravity=gravity, inertia="lumped", outflow={"+x": "remove"})
    slices, found = np.arange(0.0, length - 0.4, 0.5), []
    while solid.time < end - 1e-9:
        solid.advance(5e-3)
        if solid.time > end - 0.5:
            p = solid.points
            found.append([np.histogram(p.x[:, 0], slices, weights=p.mass / soil.rho * w)[0] / 0.5
                          for w in (p.v[:, 0], 1.0)])
    solid.close()
    flow, depth = np.mean(found, axis=0)
    middle = 0.5 * (slices[1:] + slices[:-1])
    slides = np.sqrt(v**2 + 2.0 * middle * (gravity[0] + mu * gravity[1]))  # a block on the slope
    return flow / q, flow / depth / slides


@pytest.mark.parametrize("length, end", [
    (1.5, 1.3), pytest.param(4.0, 3.5, marks=pytest.mark.validation)])
def test_a_channel_carries_the_same_discharge_everywhere(length, end):
    flow, speed = down_a_channel(length, end)
    assert abs(flow - 1.0).max() < 0.02 and abs(speed - 1.0).max() < 0.05


def test_it_flows_over_a_structure_and_pushes_a_body():
    """New points meet walls and bodies with springs like the others; the books close."""
    soil, grid = Soil(E=1e6, nu=0.3, rho=1600.0, phi=30.0), Grid(Box((-0.5, -0.2), (3.0, 1.0)), (35, 12))
    bed = Structure.plane("bed", (0.0, 0.0), "+y", Box((-0.5, -0.2), (3.0, 1.0)), friction=0.3)
    sand = Body(Box((0.6, 0.0), (0.8, 0.2)), (2, 2), 2, soil.material(2), 1600.0, f_bar=True)
    block = Body(Box((0.9, 0.0), (1.1, 0.4)), (2, 4), 2, linear(1e6, 0.3), 1600.0)
    inlet = Inflow("the inlet", at=(0.0, 0.0), normal="+x", depth=0.2, speed=2.0, until=0.6)
    solid = MPM(grid, [sand, block], gravity=(0.0, -9.81), inertia="lumped", structures=[bed],
                openings=[inlet])
    hit = 0.0
    for _ in range(100):
        solid.advance(5e-3)
        hit = min(hit, solid.reaction("bodies 0 and 1")[0])
    p, other = (body.points for body in solid.bodies)
    assert np.unique(p.wall_stiffness.round(3)).size == np.unique(p.meet_stiffness.round(3)).size == 1
    assert p.x[:, 1].min() > 0.0 and hit < -500.0 and other.x[:, 0].mean() > 1.02
    given, came = sum(solid.impulses().values())[:2], solid.entered["mass"]
    np.testing.assert_allclose(solid.momentum(), given, rtol=0, atol=1e-10 * came)
    solid.close()
