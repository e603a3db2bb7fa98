"""The case ``sphere_drop``: windows that it chooses, both back ends, what settles with the grid."""
import json

import numpy as np
import pytest


@pytest.mark.parametrize("dim", [2, 3])
def test_both_back_ends_stop_it_alike(sphere_drop, dim, tmp_path):
    histories = sphere_drop.main(dim=dim, h=0.04, t_end=0.006, dem="compare", out=tmp_path)
    one, other = histories["reference"], histories["liggghts"]
    assert 0.0 < one["deepest_ball"].max() < 0.1 and one["force"].max() > 0.0
    assert np.abs(one["depth"] - other["depth"]).max() < 1e-6 * one["depth"].max()
    report = json.loads((tmp_path / "report.json").read_text())
    assert report["deepest_ball"] == pytest.approx(one["deepest_ball"].max())
    assert report["parameters"]["dt"] > 1e-4 and (tmp_path / "sphere_drop.png").exists()
