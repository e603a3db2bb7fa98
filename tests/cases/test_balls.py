"""Spheres fall on soil whose material points are the interface: only those near them take part, and nothing
else changes."""
import json
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI

import dem_liggghts as dem
from coupling import Run, Scheme, couple, same
from coupling.output import Output
from coupling.records.history import read
from mpm_fenicsx import MPM, Balls, Body, Box, Grid, Support, linear, mohr_coulomb, of_points

BACKENDS = "reference", "liggghts"
R, DT, SUBSTEPS = 0.0025, 5e-4, 20


def soil(balls=True, cells=(20, 6)):
    """A layer on a floor."""
    body = Body(Box((0.0, 0.0), (0.2, 0.06)), cells, 2, mohr_coulomb(1e6, 0.3, 30.0), 1600.0)
    grid = Grid(Box((-0.02, 0.0), (0.22, 0.12)), (24, 12))
    supports = [Support(lambda x: x[:, 1] < 1e-6, "xy", name="the floor"),
                Support(lambda x: (x[:, 0] < 1e-6) | (x[:, 0] > 0.2 - 1e-6), "x")]
    return MPM(grid, body, supports, Balls(R) if balls else of_points(body), gravity=(0.0, -9.81),
               inertia="lumped")


def spheres(wall=None, v=((2.5, -1.0), (0.3, -1.0)), friction=0.4):
    rubber = dem.Material(E=1e6, nu=0.3)
    balls = dem.Spheres([[0.03, 0.075], [0.13, 0.076]], v, 0.01, 2500.0)
    return dem.Scene(balls, wall, rubber, rubber, at_wall=dem.Interaction(0.5, friction),
                     gravity=(0.0, -9.81))


def run(tmp_path, balls, backend, t_end=0.03, **keys):
    """History, and of each window the numbers of the points and the ``Window``."""
    solid, windows = soil(balls), []
    wall = None if balls else dem.Wall.discs(solid.interface.x, R)

    def observe(solid, grains):
        numbers = (lambda: solid._surface.numbers.copy()) if balls else (lambda: np.arange(solid.count))
        return [lambda window: windows.append((numbers(), window))]

    scheme = Scheme(DT, t_end, substeps=SUBSTEPS, dem=backend, **keys)
    out = Output(tmp_path / f"{backend}{int(balls)}")
    return Run("balls", solid, spheres(wall), scheme, out, observe=observe).go()[backend], windows


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("iterate", [0, 20])
def test_points_far_away_change_nothing(tmp_path, backend, iterate):
    """Force by force as with all points in the wall, while the choice changes; and momentum is exact."""
    keys = dict(iterate=iterate, tol=1e-6)
    (whole, every), (history, chosen) = (run(tmp_path, balls, backend, **keys) for balls in (False, True))
    top = max(abs(window.force).max() for _, window in every)
    for (_, a), (numbers, b) in zip(every, chosen):
        force = np.zeros_like(a.force)
        force[numbers] = b.force
        assert np.abs(force - a.force).max() < 1e-11 * top
    assert top > 0.5 and sum(window.change is not None for _, window in chosen) > 2
    assert 5 < max(len(numbers) for numbers, _ in chosen) < 0.15 * len(every[0][0])
    assert [w.iterations for _, w in chosen] == [w.iterations for _, w in every]
    together = history["impulse_grains"] + history["impulse_solid"]
    assert np.abs(together).max() < (1e-14 if iterate == 0 else 1e-6)
    for name in ("energy_solid", "energy_grains", "work_wall"):
        assert history[name][-1] == pytest.approx(whole[name][-1], rel=1e-9)


def test_refuses():
    with pytest.raises(ValueError, match="radius of the balls is -1"):
        Balls(-1.0)
    with pytest.raises(ValueError, match="points of body 1, and the numbers of the bodies end at 0"):
        body = soil().scene.body
        MPM(soil().grid, body, interface=Balls(R, bodies=(1,)))
    grains = spheres(dem.Wall.discs(np.zeros((0, 2)), 2 * R)).open("reference", DT / SUBSTEPS)
    with pytest.raises(ValueError, match="balls of radius 0.0025 m, the wall of the grains discs of 0.005"):
        couple(soil(), grains, same(), Scheme(DT, 0.05, substeps=SUBSTEPS))


@pytest.mark.parametrize("inertia", ["lumped", "consistent"])
def test_books_of_the_solid(inertia):
    """Forces on points of a block that flies: the impulse of the interface is theirs, moments too."""
    block = Body(Box((0.0, 0.0), (0.04, 0.04)), (4, 4), 2, linear(1e6, 0.3), 1000.0)
    solid = MPM(Grid(Box((-0.1, -0.1), (0.2, 0.2)), (30, 30)), block, interface=Balls(R), inertia=inertia)
    near = np.zeros(1, [("x", float, 3), ("v", float, 3), ("radius", float)])
    near["x"], near["radius"] = (0.0505, 0.03, 0.0), 0.01
    given, change = np.zeros(2), solid.select(near, 1e-3)
    assert 3 < len(change.x) < 20 and (change.was == -1).all() and solid.select(near, 1e-3) is None
    for step in range(20):
        force = np.tile([-0.1 * (step % 3), 0.02], (len(change.x), 1))
        solid.advance(1e-3, force)
        given += 1e-3 * force.sum(axis=0)
        assert solid.applied == pytest.approx(force.sum(axis=0), abs=1e-14)
    books = solid.impulses()
    assert sum(books.values())[:2] == pytest.approx(solid.momentum(), rel=1e-11)
    assert books["interface"][:2] == pytest.approx(solid.momentum(), rel=1e-6)  # Newton's tolerance
    assert np.abs(solid.momentum() - given).max() < 0.1 * np.abs(given).max()
    assert abs(books["interface"][2]) > 1e-6
    solid.close()


@pytest.mark.parametrize("backend, keys", [("reference", dict(iterate=20, relax="iqn")),
                                           ("liggghts", dict(adapt=0.05))], ids=["iqn", "adapt"])
def test_goes_on_bit_for_bit(tmp_path, backend, keys):
    """From a checkpoint in contact, after changes of the choice and before others."""
    def go(folder, **more):
        scheme = Scheme(DT, 0.02, substeps=SUBSTEPS, dem=backend, tol=1e-6, **keys)
        return Run("balls", soil(), spheres(), scheme, Output(folder, **more)).go()

    first, again = tmp_path / "first", tmp_path / "again"
    go(first, checkpoint="17")
    shutil.copytree(first, again)
    (again / "checkpoint.h5").unlink()
    go(again, restart=again)
    assert (first / "history.csv").read_bytes() == (again / "history.csv").read_bytes()


def test_states_bring_back_the_choice():
    """Of a solid and its grains, across a change of it: bit for bit."""
    solid, grains = soil(), spheres(dem.Wall.discs(np.zeros((0, 2)), R)).open("reference", DT / SUBSTEPS)

    def windows(n):
        seen = []
        couple(solid, grains, same(), Scheme(DT, solid.time + n * DT, substeps=SUBSTEPS),
               [lambda window: seen.append(window)])
        return seen

    windows(8)
    states = solid.get_state(), grains.get_state()
    first = windows(20)
    assert any(window.change is not None for window in first) and any(w.force.any() for w in first)
    solid.set_state(states[0])
    grains.set_state(states[1])
    for a, b in zip(first, windows(20)):
        assert np.array_equal(a.force, b.force) and np.array_equal(a.x, b.x)


def test_points_drop_out_without_a_force():
    """When all spheres have gone only the one that carries a force stays, and sums of loads stay."""
    solid, near = soil(), np.zeros(2, [("x", float, 3), ("v", float, 3), ("radius", float)])
    near["x"][:, 0], near["x"][:, 1], near["radius"] = (0.05, 0.15), 0.12, 0.09
    force = np.zeros_like(solid.select(near, DT).x)
    force[3, 1] = -0.1
    solid.advance(DT, force)
    near["x"][:, 1] = 1.0
    change = solid.select(near, DT)
    assert len(force) > 100 and change.was.tolist() == [3]
    loads = 2.0 * force + 1.0
    assert change.redistribute(loads).sum(axis=0) == pytest.approx(loads.sum(axis=0))
    solid.advance(DT, change.redistribute(force))
    assert solid.applied == pytest.approx([0.0, -0.1], abs=1e-15)
    solid.close()


@pytest.mark.mpi
def test_bytes_follow_the_points_that_are_near(script_on_ranks, tmp_path):
    """On two ranks, layers with four times as many points at the same places near a sphere exchange as
    much."""
    done = script_on_ranks(2, __file__, "bytes", str(tmp_path))
    assert done.returncode == 0, done.stderr
    found = json.loads((tmp_path / "found.json").read_text())
    short, long = found["bytes"]
    assert 0 < long < 0.1 * found["whole"] and abs(long - short) < 0.1 * short


@pytest.mark.mpi
@pytest.mark.validation
@pytest.mark.parametrize("backend", BACKENDS)
def test_ranks_agree(run_ranks, tmp_path, backend):
    """On two ranks as on one."""
    done = run_ranks(2, __file__, backend, str(tmp_path))
    assert done.returncode == 0, done.stderr
    history, _ = run(tmp_path / "one", True, backend, t_end=0.02)
    two = read(tmp_path / f"{backend}1" / "history.csv")
    for name in ("impulse_solid", "energy_grains", "energy_solid"):
        assert two[name] == pytest.approx(np.array(history[name]), rel=1e-9, abs=1e-12)


def count_bytes(folder):
    """For the ranks of the first of these."""
    found = {"bytes": []}
    near = np.zeros(1, [("x", float, 3), ("v", float, 3), ("radius", float)])
    near["x"], near["radius"] = (0.1, 0.0702, 0.0), 0.01
    for length in (0.2, 0.8):
        body = Body(Box((0.0, 0.0), (length, 0.06)), (round(100 * length), 6), 2, linear(1e6, 0.3), 1600.0)
        grid = Grid(Box((-0.02, 0.0), (length + 0.02, 0.12)), (round(100 * length) + 4, 12))
        solid = MPM(grid, body, [Support(lambda x: x[:, 1] < 1e-6, "xy")], Balls(R))
        for _ in range(3):
            solid.select(near, DT)
            solid.advance(DT, np.zeros_like(solid.surface()[0]))
        found["bytes"].append(solid.comm.allreduce(solid.exchanged) / 3)
        found["whole"] = solid.count * 4 * 8  # places and velocities of all, to the other rank
        solid.close()
    if MPI.COMM_WORLD.rank == 0:
        (folder / "found.json").write_text(json.dumps(found))


if __name__ == "__main__":
    what, folder = sys.argv[1:]
    del sys.argv[1:]  # no words for PETSc
    if what == "bytes":
        count_bytes(Path(folder))
    else:
        run(Path(folder), True, what, t_end=0.02)
