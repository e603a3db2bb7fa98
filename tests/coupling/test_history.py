"""history.csv: what is written can be read, also while it is being written."""
import numpy as np
import pytest

from coupling import History
from coupling.history import read

COLUMNS = {"time": ("s", "end of the window"), "force": ("N", "on the\nsphere")}


def test_written_values_come_back(tmp_path):
    history = History(tmp_path / "history.csv", COLUMNS, ["beam", "dt=1 out=a\nb"])
    values = np.random.default_rng(0).normal(size=(5, 2)) * 1e-7
    for time, force in values:
        history.add({"force": force, "time": time})
    history.close()
    lines = (tmp_path / "history.csv").read_text().splitlines()
    assert lines[:5] == ["# beam", "# dt=1 out=a b", "# time [s]: end of the window", "# force [N]: on the sphere",
                         "time,force"]
    columns = read(tmp_path / "history.csv")
    assert list(columns) == ["time", "force"] and len(history) == 5
    for name in columns:
        assert columns[name] == pytest.approx(history[name], rel=1e-14, abs=0)
    assert (history["force"] == values[:, 1]).all()


def test_head_is_on_disk_at_once_and_rows_soon(tmp_path):
    history = History(tmp_path / "history.csv", COLUMNS)
    assert read(tmp_path / "history.csv")["time"].shape == (0,)
    history._flushed -= 1.0  # as if a second had gone by
    history.add({"time": 1, "force": 2})
    assert read(tmp_path / "history.csv")["force"] == [2]


def test_half_a_line_is_left_out(tmp_path):
    path = tmp_path / "history.csv"
    path.write_text("# note\ntime,force\n1,10\n2,20\n3,3")  # of 30
    assert read(path)["force"].tolist() == [10, 20]
    path.write_text("# note\ntime,for")
    with pytest.raises(ValueError, match="history.csv has no line with the names of its columns"):
        read(path)


def test_in_memory_only():
    history = History(None, COLUMNS)
    assert history["time"].shape == (0,)
    history.add({"time": 1, "force": 2})
    history.close()
    assert history["force"].tolist() == [2]


def test_missing_value_is_an_error():
    with pytest.raises(KeyError, match="force"):
        History(None, COLUMNS).add({"time": 1})
