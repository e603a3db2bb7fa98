"""ParaView series, figure and the times of the report."""
import sys
import time
from types import SimpleNamespace
from xml.etree import ElementTree

import matplotlib.image
import meshio
import numpy as np
import pytest

from coupling.pictures import figure
from coupling.records import report
from coupling.records.paraview import Series


def test_series_is_read_back(tmp_path):
    series, rng = Series(tmp_path, "wall"), np.random.default_rng(0)
    x, v, F = rng.normal(size=(3, 2)), rng.normal(size=(3, 2)), rng.normal(size=(3, 2, 2))
    for k in range(3):
        series.add(0.1 * k, x + k, {"line": [[0, 1], [1, 2]]}, {"v": v, "F": F, "mass": np.arange(3.0)})
        entries = ElementTree.parse(tmp_path / "wall.pvd").findall("Collection/DataSet")
        assert [float(entry.get("timestep")) for entry in entries] == pytest.approx(0.1 * np.arange(k + 1))
    mesh = meshio.read(tmp_path / entries[2].get("file"))
    assert mesh.points == pytest.approx(np.column_stack([x + 2, np.zeros(3)]))
    assert mesh.cells_dict["line"].tolist() == [[0, 1], [1, 2]]
    assert mesh.point_data["v"] == pytest.approx(np.column_stack([v, np.zeros(3)]))
    tensor = mesh.point_data["F"].reshape(3, 3, 3)
    assert tensor[:, :2, :2] == pytest.approx(F) and not tensor[:, 2].any() and not tensor[:, :, 2].any()
    assert mesh.point_data["mass"].tolist() == [0, 1, 2]
    assert sorted(p.name for p in tmp_path.iterdir()) == ["wall.pvd",
                                                          *(f"wall_0000{k}.vtu" for k in range(3))]


def test_figure_has_a_curve_of_every_style(tmp_path):
    x = np.linspace(0, 1, 20)
    force = [(x, x, "run", "run"), (x, x**2, "old", "under"), (x, x**3, None, "reference")]
    figure.draw(tmp_path / "f.png", "time [s]", {"force [N]": force, "u [m]": [(x, x, "u", "run")]})
    picture = matplotlib.image.imread(tmp_path / "f.png")
    assert picture.shape[0] > 500 and picture.shape[1] > 700
    blue = (abs(picture[..., :3] - np.array([31, 119, 180]) / 255) < 0.02).all(axis=2)
    assert blue[:360].any() and blue[360:].any()  # the first colour, in both panels


def test_timing_adds_up():
    solid = SimpleNamespace(phases={"solve": 1.0})
    timing = report.Timing(solid)
    for _ in range(3):
        time.sleep(0.002)
        solid.phases["solve"] += 0.0005
        timing(SimpleNamespace(seconds={"DEM": 0.0003, "mapping": 0.0002, "MPM": 0.0007}))
    figures = timing.figures()
    assert figures["window_ms"]["median"] >= 2 and figures["window_ms"]["p90"] >= figures["window_ms"][
        "median"]
    assert figures["phases_ms"]["solve"] == pytest.approx(0.5) and figures["phases_ms"][
        "rest"] == pytest.approx(0.2)
    window, *phases = (timing.rows.column(k)[0] for k in range(1 + len(timing.names)))
    assert sum(phases) == pytest.approx(window) and timing.spent == pytest.approx(timing.rows.column(0).sum())
    assert figures["wall_s"] >= figures["startup_s"] > 0
    # of a later run, long after the import
    assert report.Timing(solid, began=time.perf_counter()).startup < 0.1


def test_versions_load_nothing():
    before = set(sys.modules)
    found = report.versions()
    assert set(sys.modules) == before and {"python", "numpy", "mpi4py"} <= set(found)


def test_relative_l2():
    assert report.relative_l2([3.0, 5.0], np.array([3.0, 4.0])) == pytest.approx(0.2)
    assert report.relative_l2([3.0, 4.0], np.zeros(2)) == 5.0
