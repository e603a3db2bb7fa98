"""The cases ``terrain`` and ``flume``: a flow with rocks over ground that is no plane."""
import json
from pathlib import Path

import numpy as np
import pytest

from coupling.records.history import read

CASES = Path(__file__).parents[2] / "cases"


@pytest.mark.parametrize("back_end", ["reference", "liggghts"])
def test_a_valley_on_a_map(terrain, tmp_path, back_end, request):
    """The soil starts to flow, the rocks before it begin to roll; the maps lie where the valley is."""
    if back_end == "liggghts":
        request.getfixturevalue("liggghts")
    history = terrain.main(h=4.0, cell=4.0, rocks=3, t_end=0.6, dt=0.01, substeps=32, dem=back_end,
                           out=tmp_path)[back_end]
    report = json.loads((tmp_path / "report.json").read_text())
    assert history["momentum_error"].max() < 1e-10 and report["deepest_ball"] < 0.1
    assert history["impulse_ground_rest_z"][-1] < 0.0 == history["impulse_dam_x"][-1]
    maps = report["maps"]
    assert maps["volume_released"] == pytest.approx(2.5 * 24.0 * 16.0, rel=1e-10)
    assert abs(maps["volume_error"]) < 1e-10 * maps["volume_released"]
    head = (tmp_path / "depth_max.asc").read_text().split("\n")[:6]
    assert dict(line.split() for line in head)["xllcorner"].startswith("452000")
    rocks = read(tmp_path / "rocks.csv")
    assert rocks["speed"].max() > 0.5 and abs(rocks["x"] - 452_050.0).max() < 20.0


def test_blocks_ride_on_sand_down_a_flume(flume, tmp_path):
    """The bed carries the sand, and the books close."""
    history = flume.main(h=1.0, t_end=0.1, out=tmp_path)["reference"]
    report = json.loads((tmp_path / "report.json").read_text())
    assert report["points"] == 7 * 2 * 2 * 8 and history["momentum_error"].max() < 1e-10
    weight = 28.0 * 1700.0 * 8.49281
    assert -history["impulse_bed_z"][-1] == pytest.approx(weight * 0.1, rel=0.2)  # it is compressed at first
    assert (tmp_path / "flume.png").exists()


def test_sand_slides_down_the_flume_and_strikes_the_cube(flume, tmp_path):
    """Coarse: arrivals are those of sliding without friction, up to 1.2 % early where a front in cells as
    deep as the flow pushes itself ahead (0.8 % at h = 0.4 m); the cube feels at least what comes; no energy
    is lost on the way, a smooth bed takes none, and the impact is mostly plastic."""
    history = flume.main(h=1.0, dt=0.02, t_end=5.4, blocks=False, losses=True, out=tmp_path)["solid"]
    errors = json.loads((tmp_path / "report.json").read_text())["errors"]
    for place in ("40", "60", "79.95"):
        assert -0.015 < errors[f"solid_arrival_{place}_sliding"] < 0.005
    assert errors["solid_arrival_20_hdro"] == pytest.approx(0.063, abs=0.01)
    assert history["momentum_error"].max() < 1e-10 and abs(history["energy_friction"]).max() == 0.0
    last, before = len(history["time"]) - 1, int(np.argmax(history["depth_79.95"] > 0.02))
    assert 0 < before < last and abs(history["balance_error"][before - 1]) < 0.005
    assert -0.06 < history["balance_error"][last] < 0.0
    assert errors["solid_peak_jet"] > 0.0 < history["impulse_cube_1_x"][last]


@pytest.mark.validation
def test_soft_sand_pushes_with_the_momentum_that_comes(flume, tmp_path):
    """It piles up and gives the cube what comes to its face, rho v^2 h w, where stiff sand pushes with 1.5
    times as much, see docs/flume.md: the impulse, and with cells of 20 cm (20 minutes) the peak, to 15 %."""
    flume.main(h=0.4, E=1e6, t_end=6, blocks=False, out=tmp_path)
    errors = json.loads((tmp_path / "report.json").read_text())["errors"]
    assert errors["solid_impulse_jet"] == pytest.approx(1.0, abs=0.15)
    assert abs(errors["solid_peak_jet"]) < 0.3


def test_the_flow_that_comes_to_the_cube_is_brought_there(flume):
    """Of a stream with the same speed and thrust all the time nothing but the time of travel changes; means
    keep the impulse."""
    of = flume.reference
    t = np.linspace(0.01, 4.0, 400)
    there = (t > 1.0) & (t < 2.0)
    rows = {"time": t, "window": np.full(400, 0.01), "speed_75": np.where(there, 20.0, 0.0),
            "thrust_75": np.where(there, 1e5, 0.0)}
    jet, g = of.jet(rows), of.GRAVITY[0]
    faster = np.sqrt(20.0**2 + 10.0 * g)
    assert jet.max() == pytest.approx(1e5 * (faster / 20.0) ** 2, rel=1e-9)
    late = t[np.argmax(jet > 0.0)] - 1.01
    assert late == pytest.approx((faster - 20.0) / g, abs=0.011)
    assert of.smooth(rows, jet).sum() == pytest.approx(jet.sum(), rel=1e-9)


@pytest.mark.mpi
@pytest.mark.validation
def test_ranks_agree_in_the_valley(run_ranks, tmp_path):
    """1, 2 and 3 ranks, before anything is chaotic: places of rocks and forces on the ground."""
    histories = []
    for ranks in (1, 2, 3):
        done = run_ranks(ranks, CASES / "terrain.py", "h=4", "cell=4", "rocks=3", "t_end=0.3", "dt=0.01",
                         "substeps=32", f"out={tmp_path / str(ranks)}", "-mpm_snes_rtol", "1e-12")
        assert done.returncode == 0, done.stderr
        histories.append(read(tmp_path / str(ranks) / "history.csv"))
    one = histories[0]
    for other in histories[1:]:
        for name in ("impulse_ground_rest_x", "impulse_ground_rest_z", "energy_solid", "energy_grains"):
            assert np.abs(other[name] - one[name]).max() <= 1e-10 * np.abs(one[name]).max()
