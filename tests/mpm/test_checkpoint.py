"""A run goes on from a file: bit for bit on as many ranks, to round-off on others."""
import numpy as np
import pytest
from petsc4py import PETSc

import mpm_dem_store as store
from mpm_fenicsx import (
    LAWS,
    MPM,
    Body,
    Box,
    Grid,
    Inflow,
    Interface,
    Load,
    Mesh,
    MPMError,
    Numerics,
    Outflow,
    Penalty,
    Support,
)
from mpm_fenicsx.grid.background import whole_mesh

SOFT, BENDS = LAWS["linear"](1e3, 0.3), LAWS["neo_hooke"](1e3, 0.3)
SOIL = LAWS["mohr_coulomb"](1e5, 0.3, friction_angle=30.0, cohesion=10.0)


def scene(box=((0.0, 0.0), (2.0, 1.0)), h=0.5, cell="quadrilateral", law=SOFT, rho=1.0, velocity=0.0,
          f_bar=False, margin=2, points=2, mesh=False, **others):
    """A block, ``margin`` cells away from the edges of its grid, or of a mesh of its cells shuffled."""
    box = Box(*box)
    lower, upper = np.subtract(box.lower, margin * h), np.add(box.upper, margin * h)
    grid = Grid(Box(tuple(lower), tuple(upper)), Grid.counts(upper - lower, h), cell)
    if mesh:
        vertices, cells = whole_mesh(grid)
        grid = Mesh(vertices, np.random.default_rng(1).permutation(cells), cell)
    body = Body(box, Grid.counts(box.size, h), points, law, rho, cell=cell, velocity=velocity, f_bar=f_bar)
    beside = Body(Box(np.add(box.lower, 3.0), np.add(box.lower, 4.0)), Grid.counts(np.ones(box.dim), h),
                  points, SOFT, 1.0, cell=cell)
    return MPM(grid, [body, beside] if mesh else body, **others)


def floor(**more):
    """Under the block, which slides on it."""
    return Penalty(Interface.line((-1.0, 0.0), (3.0, 0.0), 16), normal=(0.0, 1.0), friction=0.3,
                   separates=True, name="floor", **more)


def swing(t):
    return 0.1 * np.sin(20.0 * t)


TOP = Interface.top(Box((0.0, 0.0), (2.0, 1.0)), 4, 0.1)
FALLS = dict(gravity=(0.0, -10.0), rho=10.0)
CUBE = dict(box=((0.0, 0.0, 0.0), (1.0, 0.5, 0.5)), velocity=(3.0, 1.0, 0.5), margin=4, inertia="lumped")
FLIES = dict(velocity=(10.0, 2.0), margin=5, inertia="lumped")
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
    "sliding": dict(SLIDES, steps=40, penalties=[floor(motion=lambda t: (0.0, swing(t)))]),
    "surface": dict(SLIDES, penalties=[floor(contact="surface")]),
    "hinges": dict(FALLS, penalties=[Penalty(Interface.line((0.1, 0.1), (0.1, 0.9), 4), follows=True)]),
    "hold": dict(LEAVES, outflow={"+x": "hold"}),
    "remove": dict(LEAVES, outflow={"+x": "remove"}),
    "inflow": dict(FLIES, law=SOIL, rho=1000.0, gravity=(3.0, -10.0), openings=[
        Inflow("inlet", (0.0, 0.0), "+x", depth=1.0, speed=10.0), Outflow("weir", (2.6, 0.0), "+x")]),
    "settled": dict(FALLS, supports=[Support(lambda x: x[:, 1] < 1e-9, "xy")], numerics=Numerics(settle=2)),
    "ghost": dict(FLIES, inertia="ghost"),
    "two on a mesh": dict(FLIES, margin=8, cell="triangle", points=3, mesh=True, interface=TOP),
    "in a large grid": dict(interface=TOP, margin=120, steps=4),
    "far from zero": dict({**FLIES, "box": ((4.5e5, 0.0), (4.5e5 + 2.0, 1.0))}),
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


@pytest.mark.parametrize("name, leaves", [("hold", True), ("remove", True), ("crossing", False)])
def test_scenes_do_what_their_names_say(name, leaves):
    """Points leave in the first half of the run and in the second; others cross cells."""
    stated = dict(SCENES[name])
    steps = stated.pop("steps", 20)
    solid = scene(**stated)
    gone, filled = [], solid.step.filled.copy()
    for first in (0, steps // 2):
        advance(solid, first, first + steps // 2)
        gone.append(solid.removed["count"])
    assert (0 < gone[0] < gone[1] < 32) if leaves else not np.array_equal(filled, solid.step.filled)
    solid.close()


def test_what_helped_before_helps_on(tmp_path):
    """After a fall back to the ghost penalty on inertia."""
    solid, other = scene(**{**FLIES, "inertia": "consistent"}), scene(**{**FLIES, "inertia": "consistent"})
    advance(solid, 0, 3)
    with pytest.warns(UserWarning, match="succeeds with the ghost penalty on inertia"):
        assert solid.fall_back() == "the ghost penalty on inertia"
        advance(solid, 3, 8)
    solid.save(tmp_path / "state.h5")
    other.load(tmp_path / "state.h5")
    assert other.ghost_since == solid.ghost_since and other.helped == solid.helped != {}
    for n in range(8, 16):
        advance(solid, n, n + 1)
        advance(other, n, n + 1)
        assert_same(solid, other)
    solid.close()
    other.close()


def test_a_surface_made_anew_goes_on(tmp_path):
    """It has other particles than the one stated."""
    box = Box((0.0, 0.0), (1.0, 1.0))
    body = Body(box, (4, 4), 2, SOFT, 1e3, velocity=lambda x: np.column_stack([16.0 * x[:, 0], -x[:, 1]]))
    grid = Grid(Box((-1.0, -1.0), (7.0, 2.0)), (32, 12))
    solid, other = (MPM(grid, body, interface=Interface.around(body, inset=0.1), inertia="lumped")
                    for _ in range(2))
    before = len(solid.boundary)
    for n in range(20):
        solid.advance(0.01)
        solid.resample()
        if n == 9:
            before, stated = len(solid.boundary), before
            assert before != stated
            solid.save(tmp_path / "state.h5")
            other.load(tmp_path / "state.h5")
        elif n > 9:
            other.advance(0.01)
            other.resample()
            assert_same(solid, other)
    assert len(solid.boundary) != before
    solid.close()
    other.close()


@pytest.mark.parametrize("solver", ["cg", "multigrid", "gamg", pytest.param("hypre", marks=pytest.mark.skipif(
    not PETSc.Sys.hasExternalPackage("hypre"), reason="this PETSc has no hypre"))])
def test_a_preconditioner_goes_on(solver, tmp_path):
    """Multigrid too, which remembers earlier matrices."""
    stated = dict(SCENES["settled"], law=BENDS, numerics=Numerics(solver=solver))
    solid, other = scene(**stated), scene(**stated)
    advance(solid, 0, 12)
    assert solid.step.tangents.count > 1
    solid.save(tmp_path / "state.h5")
    other.load(tmp_path / "state.h5")
    for n in range(12, 24):
        advance(solid, n, n + 1)
        advance(other, n, n + 1)
        assert_same(solid, other)
    solid.close()
    other.close()


# ---------------------------------------------------------------- other scenes, other files

@pytest.mark.parametrize("change, words", [
    (dict(h=0.25), "number of material points is 32, here it is 128"),
    (dict(margin=3), "grid differ from those here"),
    (dict(law=BENDS), "laws differ from those here"),
    (dict(interface=None), "interface, loads and walls differ from those here"),
    (dict(outflow="hold"), "outflow differ from those here"),
])
def test_a_checkpoint_of_another_scene_is_refused(change, words, tmp_path):
    solid, other = scene(interface=TOP), scene(**{"interface": TOP, **change})
    advance(solid, 0, 1)
    solid.save(tmp_path / "state.h5")
    before = other.get_state()
    with pytest.raises(ValueError, match=f"the checkpoint belongs to another scene: its {words}; give a "
                       "checkpoint of this scene"):
        other.load(tmp_path / "state.h5")
    assert_same_state(before, other.get_state())
    solid.close()
    other.close()


def test_supports_elsewhere_are_refused(tmp_path):
    """Their functions cannot be compared, what they hold can."""
    solid, other = (scene(supports=[Support(lambda x, at=at: x[:, 0] < at, "xy")]) for at in (1e-9, 0.6))
    advance(solid, 0, 1)
    solid.save(tmp_path / "state.h5")
    with pytest.raises(ValueError, match="other nodes are held in the step of this checkpoint than here"):
        other.load(tmp_path / "state.h5")
    solid.close()
    other.close()


def test_files_of_others(tmp_path):
    """That of a coupled run has the solid's part; all else is refused in a sentence."""
    solid, other, path = scene(), scene(), tmp_path / "state.h5"
    advance(solid, 0, 2)
    store.write(path, {"solid": solid.get_checkpoint(), "grains": {}}, {"kind": "run"}, solid.comm)
    other.load(path)
    assert_same(solid, other)
    store.write(path, {"time": 0.0}, {"kind": "DEM reference"}, solid.comm)
    with pytest.raises(ValueError, match="is a checkpoint of kind 'DEM reference': give one of an MPM"):
        other.load(path)
    with pytest.raises(ValueError, match=r"this is no checkpoint of an MPM: give what get_checkpoint\(\)"):
        other.set_checkpoint(solid.get_state())
    assert_same(solid, other)
    solid.close()
    other.close()


def test_no_checkpoint_between_load_steps(tmp_path):
    solid = scene(**{**SCENES["settled"], "numerics": Numerics()})
    with pytest.raises(MPMError, match="no checkpoints between the load steps of settle: save before"):
        solid.settle(2, on_step=lambda factor: solid.save(tmp_path / "state.h5"))
    solid.save(tmp_path / "state.h5")
    solid.close()


# ---------------------------------------------------------------- several ranks

RUN = """
import sys
import numpy as np
from mpm_fenicsx import MPM, Body, Box, Grid, Interface, Numerics, Penalty, neo_hooke
_, task, path, cell, basis = sys.argv
D = 2 if cell in ("quadrilateral", "triangle") else 3
points = {"quadrilateral": 2, "triangle": 3, "hexahedron": 2, "tetrahedron": 4}[cell]
body = Body(Box((0.3, 0.5, 0.5)[:D], (1.8, 1.5, 1.0)[:D]), (12, 8, 4)[:D], points, neo_hooke(1e3, 0.3), 1.0,
            cell=cell, velocity=(2.0, 0.0, 0.1)[:D], f_bar=basis == "f_bar")
top = np.column_stack([np.linspace(0.4, 1.7, 7), np.full(7, 1.4), np.full(7, 0.8)])[:, :D]
wall = Penalty(Interface.line((3.0, 0.0), (3.0, 2.0), 8), normal=(-1.0, 0.0), separates=True, friction=0.3,
               contact="surface" if basis == "gimp" else "nodes")
solid = MPM(Grid(Box((0, 0, 0)[:D], (5, 2, 2)[:D]), (20, 8, 8)[:D], cell), body,
            interface=Interface(top, np.zeros((0, D), int)), penalties=[wall] if D == 2 else (),
            inertia="ghost" if basis == "linear" else "lumped",
            numerics=Numerics(rebalance=1.1, basis="gimp" if basis == "gimp" else "linear"))
solid.rebalance_every = 5 if task != "elsewhere" else 10**9
def advance(first, last):
    for n in range(first, last):
        solid.advance(0.03, np.outer(np.cos(0.3 * n + np.arange(7)), (0.1, -0.05, 0.02)[:D]))
def fields():
    gather = lambda values: np.concatenate(solid.comm.allgather(values))
    order = np.argsort(gather(solid.points.gid))
    return {name: gather(getattr(solid.points, name))[order] for name in ("x", "v", "F")}
found, lists = {}, [[]]
if task == "straight":
    advance(0, 18)
    solid.save(path)
    lists = [list(solid.rebalances)]
    state = solid.get_state()
    advance(18, 40)
    found = fields()
    solid.set_state(state)  # over another distribution, and on without a new one
    solid.load(path)
    solid.rebalance_every = 10**9
    advance(18, 40)
    found |= {"still " + name: values for name, values in fields().items()}
else:
    solid.load(path)
    lists = [list(solid.rebalances)]
    advance(18, 40)
    found = fields()
if solid.comm.rank == 0:
    np.savez(path + "." + task, **found, loaded=np.array(lists[0]), at_end=np.array(solid.rebalances),
             ranks=solid.comm.size)
"""


@pytest.fixture
def run(on_ranks, tmp_path):
    """``run(ranks, task, *words)``: what the program above found."""
    def call(ranks, task, *words):
        path = tmp_path / "state.h5"
        done = on_ranks(ranks, RUN, task, path, *words)
        assert done.returncode == 0, done.stderr[-2000:]
        with np.load(f"{path}.{task}.npz") as found:
            return dict(found)

    return call


@pytest.mark.mpi
@pytest.mark.validation  # a coupled run does so among the tests that always run
@pytest.mark.parametrize("cell, basis", [
    ("quadrilateral", "linear"), ("quadrilateral", "gimp"), ("triangle", "f_bar"), ("triangle", "linear"),
    ("hexahedron", "linear"), ("hexahedron", "gimp"), ("tetrahedron", "f_bar")])
def test_a_run_goes_on_on_other_ranks(run, cell, basis):
    """On two ranks as before, over new distributions; on one and on three to round-off, while nobody makes
    the tangent anew."""
    straight = run(2, "straight", cell, basis)
    same = run(2, "same", cell, basis)
    assert len(same["loaded"]) > 0 and same["loaded"].tolist() == straight["loaded"].tolist()
    assert same["at_end"].tolist() != same["loaded"].tolist()
    for name in ("x", "v", "F"):
        assert same[name].tobytes() == straight[name].tobytes(), name
    for ranks in (1, 3):
        other = run(ranks, "elsewhere", cell, basis)
        assert other["ranks"] == ranks and other["at_end"].tolist() == straight["loaded"].tolist()
        for name in ("x", "v", "F"):
            still = straight[f"still {name}"]
            np.testing.assert_allclose(other[name], still, rtol=0, atol=1e-10 * abs(still).max(),
                                       err_msg=name)
