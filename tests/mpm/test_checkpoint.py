"""A run goes on from a file: bit for bit on as many ranks, to round-off on others."""
import numpy as np
import pytest

from mpm_fenicsx import LAWS, MPM, Body, Box, Grid, Interface, Load, Numerics, Penalty, Support

SOFT, BENDS = LAWS["linear"](1e3, 0.3), LAWS["neo_hooke"](1e3, 0.3)
SOIL = LAWS["mohr_coulomb"](1e5, 0.3, friction_angle=30.0, cohesion=10.0)


def scene(box=((0.0, 0.0), (2.0, 1.0)), h=0.5, cell="quadrilateral", law=SOFT, rho=1.0, velocity=0.0,
          f_bar=False, margin=2, points=2, **others):
    """A block, ``margin`` cells away from the edges of its grid."""
    box = Box(*box)
    lower, upper = np.subtract(box.lower, margin * h), np.add(box.upper, margin * h)
    grid = Grid(Box(tuple(lower), tuple(upper)), Grid.counts(upper - lower, h), cell)
    body = Body(box, Grid.counts(box.size, h), points, law, rho, cell=cell, velocity=velocity, f_bar=f_bar)
    return MPM(grid, body, **others)


def floor(**more):
    """Under the block, which slides on it."""
    return Penalty(Interface.line((-1.0, 0.0), (3.0, 0.0), 16), normal=(0.0, 1.0), friction=0.3,
                   separates=True, name="floor", **more)


def swing(t):
    return 0.1 * np.sin(20.0 * t)


TOP = Interface.top(Box((0.0, 0.0), (2.0, 1.0)), 4, 0.1)
FALLS = dict(gravity=(0.0, -10.0), rho=10.0)
CUBE = dict(box=((0.0, 0.0, 0.0), (1.0, 0.5, 0.5)), velocity=(3.0, 1.0, 0.5), margin=4, inertia="lumped")
FLIES = dict(velocity=(4.0, 1.0), margin=5, inertia="lumped")
SLIDES = dict(FALLS, velocity=(1.0, -0.1), inertia="lumped")
LEAVES = dict(velocity=(6.0, 0.0), margin=1, inertia="lumped", interface=TOP, steps=24)
SCENES = {
    "kept tangent": dict(interface=TOP, dt=0.02),
    "crossing": dict(FLIES, interface=TOP, law=BENDS),
    "in space": dict(CUBE, cell="hexahedron", law=BENDS),
    "tetrahedra": dict(CUBE, cell="tetrahedron", points=4),
    "soil": dict(FLIES, law=SOIL, rho=1000.0, f_bar=True, loads=[Load(TOP, pressure=lambda t: 1e3 * t)]),
    "gimp": dict(FLIES, inertia="consistent", basis="gimp", interface=TOP),
    "apic": dict(FLIES, numerics=Numerics(transfer="apic", basis="gimp", losses=True)),
    "tpic in space": dict(CUBE, cell="hexahedron", numerics=Numerics(transfer="tpic")),
    "sliding": dict(SLIDES, penalties=[floor(motion=lambda t: (0.0, swing(t)))]),
    "surface": dict(SLIDES, penalties=[floor(contact="surface")]),
    "hinges": dict(FALLS, penalties=[Penalty(Interface.line((0.1, 0.1), (0.1, 0.9), 4), follows=True)]),
    "hold": dict(LEAVES, outflow={"+x": "hold"}),
    "remove": dict(LEAVES, outflow={"+x": "remove"}),
    "settled": dict(FALLS, supports=[Support(lambda x: x[:, 1] < 1e-9, "xy")], numerics=Numerics(settle=2)),
    "ghost": dict(FLIES, inertia="ghost"),
    "moving support": dict(supports=[Support(lambda x: x[:, 0] < 1e-9, "x", lambda t: (swing(t),))]),
}


def force(solid, n):
    """On the interface in step n [N]."""
    interface = solid.interface
    return interface and 0.3 * np.sin(n + np.arange(interface.x.size)).reshape(-1, solid.dim)


def advance(solid, first, last, dt=0.01):
    for n in range(first, last):
        solid.advance(dt, force(solid, n))


def assert_same_state(state, other):
    """Bit for bit; the tangent but for the time of day at which it was made."""
    assert state.keys() == other.keys() and state["tangent"][1] == other["tangent"][1]
    for name in state.keys() - {"tangent"}:
        assert state[name].dtype == other[name].dtype and state[name].tobytes() == other[name].tobytes(), name


def assert_same(one, other):
    """All that two partitions have."""
    assert_same_state(one.get_state(), other.get_state())
    assert (one.time, one.steps, one.helped) == (other.time, other.steps, other.helped)
    assert one.removed["count"] == other.removed["count"] and one.rebalances == other.rebalances


@pytest.mark.parametrize("name", SCENES)
def test_a_run_goes_on_from_its_file(name, tmp_path):
    """Over changes of the active cells where the body flies; so it does from its state in memory."""
    stated = {"dt": 0.01, "steps": 20, **SCENES[name]}
    dt, steps = stated.pop("dt"), stated.pop("steps")
    solid, other, half = scene(**stated), scene(**stated), steps // 2
    advance(solid, 0, half, dt)
    solid.save(tmp_path / "state.h5")
    other.load(tmp_path / "state.h5")
    assert_same(solid, other)
    state = solid.get_state()
    for n in range(half, steps):
        advance(solid, n, n + 1, dt)
        advance(other, n, n + 1, dt)
        assert_same(solid, other)
    if TOP in stated.values():
        assert solid.applied.tobytes() == other.applied.tobytes()
    other.set_state(state)
    advance(other, half, steps, dt)
    assert_same_state(solid.get_state(), other.get_state())
    solid.close()
    other.close()
