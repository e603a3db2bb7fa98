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
