"""A body starts with the state that it has in a checkpoint of another scene."""
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import mpm_dem_store as store
from mpm_fenicsx import (
    MPM,
    Body,
    Box,
    FromCheckpoint,
    Grid,
    Numerics,
    Support,
    cam_clay,
    linear,
    mohr_coulomb,
    softened,
)

SOIL = mohr_coulomb(1e6, 0.3, friction_angle=30.0, cohesion=50.0)
COLUMN, ROOM = Box((0.0, 0.0), (0.4, 0.6)), Grid(Box((0.0, 0.0), (1.0, 0.8)), (10, 8))
G = (0.0, -10.0)


def body(start=None, law=SOIL, box=COLUMN, **others):
    others = {"cells": (4, 6), "points": 2, "rho": 1500.0, "f_bar": True, **others}
    return Body(box, law=law, start=start, **others)


def held(gate):
    """Floor and wall; the gate holds the other side."""
    sides = Support(lambda x: x[:, 0] < 1e-9, "x"), Support(lambda x: x[:, 1] < 1e-9, "xy")
    return [*sides, Support(lambda x: np.abs(x[:, 0] - 0.4) < 1e-9, "x", name="gate")] if gate else sides


def scene(start=None, gate=True, law=SOIL, **others):
    return MPM(ROOM, body(start, law), held(gate), gravity=G, inertia="lumped", **others)


@pytest.fixture(scope="module")
def settled(tmp_path_factory):
    """The file of a column that has settled behind a gate, and its stress [Pa]."""
    path = tmp_path_factory.mktemp("settled") / "settled.h5"
    solid = scene(numerics=Numerics(settle=4))
    solid.save(path)
    stress = solid.cauchy_stress()
    solid.close()
    return path, stress


def test_a_settled_column_stays_behind_its_gate_and_falls_without(settled):
    path, stress = settled
    top = {}
    for gate in (True, False):
        solid = scene(FromCheckpoint(path), gate)
        np.testing.assert_array_equal(solid.cauchy_stress(), stress)
        assert solid.time == 0.0 and not solid.points.v.any()
        start = solid.points.x.copy()
        for _ in range(40):
            solid.advance(2.5e-3)
        top[gate] = np.abs(solid.points.x - start).max()
        solid.close()
    assert top[True] < 1e-4 * 0.6 and top[False] > 0.01  # free fall would be 0.05 m


@pytest.mark.parametrize("basis", ["linear", "gimp"])
def test_with_places_and_velocities_it_goes_on_as_the_other_scene(tmp_path, basis, options):
    """To round-off, with equations that are solved to that: points are all that an MPM without walls
    remembers, but for the tangent that it has."""
    options(snes_rtol=1e-14)
    solid = scene(gate=False, basis=basis)
    for _ in range(10):
        solid.advance(5e-3)
    solid.save(tmp_path / "falling.h5")
    before = SimpleNamespace(**solid.points.copy())
    other = scene(FromCheckpoint(tmp_path / "falling.h5", velocities=True), gate=False, basis=basis)
    for _ in range(10):
        solid.advance(5e-3)
        other.advance(5e-3)
    for name in ("x", "v", "F"):
        here, there = getattr(other.points, name), getattr(solid.points, name)
        assert abs(here - there).max() < 1e-11 * abs(there - getattr(before, name)).max()
    assert other.time == pytest.approx(0.05) and solid.time == pytest.approx(0.1)
    solid.close()
    other.close()


def test_places_as_stated(settled):
    path, stress = settled
    solid = scene(FromCheckpoint(path, places=False))
    stated = scene()
    np.testing.assert_array_equal(solid.points.x, stated.points.x)
    np.testing.assert_array_equal(solid.cauchy_stress(), stress)
    solid.close()
    stated.close()


def test_another_law_with_the_same_state(settled):
    """Soil that softens has settled before it does."""
    path, stress = settled
    soft = softened(SOIL, mohr_coulomb(1e6, 0.3, friction_angle=20.0), 0.1, 0.1, 0.1)
    solid = scene(FromCheckpoint(path), law=soft)
    np.testing.assert_allclose(solid.cauchy_stress(), stress, rtol=0, atol=1e-9 * abs(stress).max())
    solid.close()


def test_far_from_zero(settled, tmp_path):
    """A scene in the coordinates of a map starts where the one of its checkpoint was."""
    by = np.array([4.5e5, 5e6])
    move = lambda box: Box(tuple(box.lower + by), tuple(box.upper + by))  # noqa: E731
    floor = [Support(lambda x: x[:, 1] < by[1] + 1e-6, "xy"),
             Support(lambda x: np.abs(x[:, 0] - by[0] - 0.2) > 0.2 - 1e-6, "x")]
    far = lambda start: MPM(replace(ROOM, box=move(ROOM.box)), body(start, box=move(COLUMN)), floor,  # noqa: E731
                            gravity=G, inertia="lumped", numerics=Numerics(settle=0 if start else 2))
    one = far(None)
    one.save(tmp_path / "far.h5")
    other = far(FromCheckpoint(tmp_path / "far.h5"))
    np.testing.assert_array_equal(other.points.x, one.points.x)
    one.close()
    other.close()


RANKS = """
import sys
import numpy as np
from test_from_checkpoint import FromCheckpoint, Numerics, scene
task, path = sys.argv[1:]
solid = scene(numerics=Numerics(settle=4)) if task == "write" else scene(FromCheckpoint(path), gate=False)
if task == "write":
    solid.save(path)
else:
    for _ in range(5):
        solid.advance(2.5e-3)
    gather = lambda values: np.concatenate(solid.comm.allgather(values))
    order = np.argsort(gather(solid.points.gid))
    x = gather(solid.points.x)[order]
    if solid.comm.rank == 0:
        np.save(f"{path}.{solid.comm.size}.npy", x)
solid.close()
"""


@pytest.mark.mpi
def test_on_any_ranks(on_ranks, tmp_path):
    path = tmp_path / "settled.h5"
    for n, task in (2, "write"), (1, "read"), (2, "read"), (3, "read"):
        done = on_ranks(n, RANKS, task, path)
        assert done.returncode == 0, done.stderr[-2000:]
    one, *others = (np.load(f"{path}.{n}.npy") for n in (1, 2, 3))
    for x in others:
        np.testing.assert_allclose(x, one, rtol=0, atol=1e-12)


@pytest.mark.parametrize("keys, words", [
    (dict(cells=(4, 5)), "which has 96 points, and has 80: state the body as it was stated there"),
    (dict(box=Box((0.0, 0.0), (0.4, 0.5))), "where point 0 has a volume of 0.0025 m.3, here 0.00208333"),
    (dict(law=linear(1e6, 0.3)), "remember kirchhoff_stress, opened, plastic, "
                                 "plastic_strain, plastic_work, but its law linear remembers "
                                 "unused: give it a law like that"),
    (dict(law=cam_clay(25.0, 0.1, 0.02, 1e6, 1e5)), "but its law cam_clay remembers plastic, .*, compaction"),
    (dict(number=1), "body 0 starts with body 1 of .*, which has 1: give a number from 0 to 0"),
    (dict(file="nothing.h5"), "nothing.h5 does not exist"),
    (dict(stress=lambda x: np.zeros((len(x), 3))), "the body has a stress and a start from a checkpoint")])
def test_what_does_not_fit_is_told(settled, keys, words):
    keys = dict(keys)
    start = FromCheckpoint(settled[0].with_name(keys.pop("file", settled[0].name)), keys.pop("number", 0))
    with pytest.raises((ValueError, store.StoreError), match=words):
        MPM(ROOM, body(start, **keys), held(True), gravity=G)


@pytest.mark.parametrize("keys, words", [
    (dict(path=3), "path of the checkpoint is 3"), (dict(body=-1), "body of the checkpoint is -1"),
    (dict(places="no"), "places is 'no'")])
def test_what_cannot_be_meant_is_told(keys, words):
    with pytest.raises(ValueError, match=words):
        FromCheckpoint(**{"path": "settled.h5", **keys})


def test_another_dimension(settled):
    box, grid = Box((0.0,) * 3, (0.4, 0.6, 0.1)), Grid(Box((0.0,) * 3, (1.0, 0.8, 0.1)), (10, 8, 1))
    with pytest.raises(ValueError, match="which has 2 dimensions, and has 3: give a checkpoint of as many"):
        MPM(grid, body(FromCheckpoint(settled[0]), box=box, cells=(4, 6, 1)))


def test_a_file_of_something_else(tmp_path):
    store.write(tmp_path / "grains.h5", {"x": np.zeros(3)}, {"kind": "DEM"})
    with pytest.raises(ValueError, match="which is of something else: give a checkpoint of an MPM"):
        scene(FromCheckpoint(tmp_path / "grains.h5"))


def test_the_folder_of_a_run(settled, tmp_path):
    """Of a coupled run, whose checkpoint has a solid."""
    tree = store.read(settled[0])
    store.write(tmp_path / "checkpoint.h5", {"solid": tree, "grains": None}, {"kind": "run"})
    solid = scene(FromCheckpoint(tmp_path))
    np.testing.assert_array_equal(solid.cauchy_stress(), settled[1])
    solid.close()
