"""The cases ``boulder_barrier`` and ``sand_on_wall``: forces on barriers, whose books close."""
import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from coupling.inside import check_inside
from coupling.records.history import read
from dem_liggghts import Material, Scene, Spheres
from mpm_fenicsx import Box

CASES = Path(__file__).parents[2] / "cases"

SMALL = dict(deposit=(0.16, 0.08, 0.12), path=0.08, height=0.08, thickness=0.08, boulder=0.02, h=0.04)


def last(history, name):
    return history[name][-1]


def test_boulders_in_the_plane_on_both_back_ends(boulder_barrier, tmp_path):
    """A disc rolls onto the barrier before the soil comes: the same force with both."""
    keys = dict(SMALL, path=0.12, dim=2, spheres=1, slope=60.0, t_end=0.16, speed=1.5)
    histories = boulder_barrier.main(**keys, dem="compare", out=tmp_path)
    one, other = histories["reference"], histories["liggghts"]
    assert one["momentum_error"].max() < 1e-10 and one["force_rock_barrier_1_x"].max() > 1.0
    for name in ("force_rock_barrier_1_x", "force_soil_barrier_1_x", "impulse_barrier_1_x"):
        assert np.abs(one[name] - other[name]).max() < 1e-6 * max(1.0, np.abs(one[name]).max())
    assert (tmp_path / "boulder_barrier.png").exists()
    pushed = sum(one[f"force_{matter}_barrier_{cell}_x"] for matter in ("soil", "rock") for cell in (1, 2))
    assert np.sum(pushed * one["window"]) == pytest.approx(
        last(one, "impulse_barrier_1_x") + last(one, "impulse_barrier_2_x"), rel=1e-9)


def test_an_elastic_barrier_in_the_plane(boulder_barrier, tmp_path):
    """Soil and a disc meet it: forces on its cells, in the words of those on a rigid one, sum to what it has
    got."""
    keys = dict(SMALL, deposit=(0.12, 0.12, 0.12), path=0.06, boulder=0.012, dim=2, spheres=1, slope=60.0,
                t_end=0.13, speed=1.0)
    history = boulder_barrier.main(**keys, barrier="elastic", cells=2, out=tmp_path)["reference"]
    of = {matter: [np.sum(history[f"force_{matter}_barrier_{cell}_x"] * history["window"]) for cell in (1, 2)]
          for matter in ("soil", "rock")}
    assert sum(of["soil"]) > 0.1 and sum(of["rock"]) > 0.1
    assert np.add(of["soil"], of["rock"]) == pytest.approx(
        [last(history, f"impulse_barrier_{cell}_x") for cell in (1, 2)], rel=1e-9)
    pushed = -np.sum(history["force_bodies_0_1_x"] * history["window"])  # by the force at the end of each
    assert sum(of["soil"]) == pytest.approx(pushed, rel=0.05)
    assert history["momentum_error"].max() < 1e-10 and (tmp_path / "boulder_barrier.png").exists()


@pytest.mark.parametrize("barrier", ["rigid", "elastic"])
def test_in_space(boulder_barrier, tmp_path, barrier):
    """Spheres before the soil and a cluster in it start on their way."""
    boulder_barrier.main(**SMALL, barrier=barrier, spheres=1, clusters=1, t_end=0.01, speed=1.5, out=tmp_path)
    report = json.loads((tmp_path / "report.json").read_text())
    assert report["deepest_ball"] < 0.1 and report["points"] > 100


def test_what_the_sand_loses_the_wall_has_got(sand_on_wall, tmp_path):
    history = sand_on_wall.main(slope=50.0, deposit=(0.2, 0.1), path=0.1, height=0.15, h=0.025, dt=2e-3,
                                t_end=0.5, out=tmp_path)["solid"]
    force = sum(history[f"force_soil_wall_{cell}_x"] for cell in (1, 2, 3))
    assert history["momentum_error"].max() < 1e-10 and force.max() > 20.0
    assert np.sum(force * history["window"]) == pytest.approx(
        sum(last(history, f"impulse_wall_{cell}_x") for cell in (1, 2, 3)), rel=1e-9)
    assert (tmp_path / "sand_on_wall.png").exists()


@pytest.mark.mpi
@pytest.mark.validation
def test_ranks_agree_before_the_impact(run_ranks, tmp_path):
    """1, 2 and 3 ranks, with rocks in and before the soil."""
    words = [f"{name}={','.join(map(str, value)) if isinstance(value, tuple) else value}"
             for name, value in dict(SMALL, spheres=1, clusters=1, t_end=0.02, dt=5e-4, substeps=16).items()]
    histories = []
    for ranks in (1, 2, 3):
        done = run_ranks(ranks, CASES / "boulder_barrier.py", *words, f"out={tmp_path / str(ranks)}",
                         "-mpm_snes_rtol", "1e-12")
        assert done.returncode == 0, done.stderr
        histories.append(read(tmp_path / str(ranks) / "history.csv"))
    one = histories[0]
    assert abs(one["impulse_grains_x"][-1]) > 1e-4
    for other in histories[1:]:
        for name in ("impulse_grains_x", "impulse_grains", "energy_solid", "energy_grains", "impulse_bed_y"):
            assert other[name] == pytest.approx(one[name], rel=1e-10, abs=1e-10 * np.abs(one[name]).max())


def test_a_rock_outside_the_grid_is_refused():
    """Where no soil can come to it."""
    grid = SimpleNamespace(box=Box((0.0, 0.0), (1.0, 1.0)))
    far = Scene(Spheres([[0.5, 2.0]], [[0.0, 0.0]], 0.1, 2600.0), material=Material(1e7, 0.3))
    with pytest.raises(ValueError, match=r"sphere 1 at \[0.5, 2.0\] m lies outside the grid of the soil"):
        check_inside(far, SimpleNamespace(grid=grid))
    check_inside(Scene(Spheres([[0.5, 1.05]], [[0.0, 0.0]], 0.1, 2600.0), material=Material(1e7, 0.3)),
                 SimpleNamespace(grid=grid))


@pytest.mark.parametrize("keys, sentence", [(dict(slope=95.0), "slope is 95.0"), (dict(h=0.0), "h is 0.0"),
                                            (dict(deposit=(0.5, -0.3)), "deposit .* -0.3")],
                         ids=["slope", "h", "deposit"])
def test_bad_input(sand_on_wall, keys, sentence, tmp_path):
    with pytest.raises(ValueError, match=sentence):
        sand_on_wall.main(**keys, out=tmp_path)
