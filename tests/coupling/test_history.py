"""history.csv: what is written can be read, also while it is being written."""
import os
import resource
import tracemalloc
from types import SimpleNamespace

import numpy as np
import pytest

from coupling import History
from coupling.records import report, rows
from coupling.records.history import read

COLUMNS = {"time": ("s", "end of the window"), "force": ("N", "on the\nsphere")}


def test_written_values_come_back(tmp_path):
    history = History(tmp_path / "history.csv", COLUMNS, ["beam", "dt=1 out=a\nb"])
    values = np.random.default_rng(0).normal(size=(5, 2)) * 1e-7
    for time, force in values:
        history.add({"force": force, "time": time})
    history.close()
    lines = (tmp_path / "history.csv").read_text().splitlines()
    assert lines[:5] == ["# beam", "# dt=1 out=a b", "# time [s]: end of the window",
                         "# force [N]: on the sphere", "time,force"]
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


def test_rows_come_back_as_they_were(tmp_path):
    """Also those that are on disk already, in any number, and while others are added."""
    values = np.random.default_rng(1).normal(size=(3 * rows.BLOCK + 5, 3))
    for folder in (tmp_path, None):
        kept = rows.Rows(3, folder)
        for n, row in enumerate(values):
            if n in (0, 1, rows.BLOCK - 1, rows.BLOCK, rows.BLOCK + 1, 2 * rows.BLOCK):
                assert len(kept) == n and all((kept.column(k) == values[:n, k]).all() for k in range(3))
            kept.add(row)
        assert all((kept.column(k) == values[:, k]).all() for k in range(3))
    assert not list(tmp_path.iterdir())  # the file has no name


def test_memory_does_not_grow_with_the_rows(tmp_path):
    """Of history and timing: 8,000 windows take no more than 1,000."""
    solid = SimpleNamespace(phases={"solve": 1.0})
    window = SimpleNamespace(seconds={"DEM": 0.0, "mapping": 0.0, "MPM": 0.0})
    columns = {f"c{k}": ("1", "a number") for k in range(30)}
    history, timing, row = History(tmp_path / "h.csv", columns), report.Timing(solid,
                                                                               tmp_path), dict.fromkeys(
        columns, 0.1)
    tracemalloc.start()
    for n in range(8_000):
        if n == 1000:
            before = tracemalloc.get_traced_memory()[0]
        history.add(row)
        timing(window)
    grown = tracemalloc.get_traced_memory()[0] - before
    tracemalloc.stop()
    assert grown < 10_000 and len(history) == 8_000 and (history["c29"] == 0.1).all()
    history.close()
    assert (read(tmp_path / "h.csv")["c7"] == 0.1).all()
    assert timing.figures()["window_ms"]["p90"] > 0


def test_full_disk_loses_no_row_before(tmp_path):
    """A limit of the size of a file, in the middle of the second block."""
    kept = rows.Rows(2, tmp_path)
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (5000, hard))
    try:
        with pytest.raises(OSError, match="File too large"):
            for n in range(2 * rows.BLOCK):
                kept.add((n, -n))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert kept.column(0).tolist() == list(range(2 * rows.BLOCK - 1))
    kept.add((n, -n))
    assert kept.column(1).tolist() == [-n for n in range(2 * rows.BLOCK)]


def test_an_interrupt_right_after_a_write_has_no_row_written_twice(tmp_path, monkeypatch):
    history = History(tmp_path / "history.csv", COLUMNS)
    for n in range(3):
        history.add({"time": n, "force": 0.0})
    write = os.pwrite

    def interrupted(*given):
        write(*given)
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "pwrite", interrupted)
    with pytest.raises(KeyboardInterrupt):
        history.sync()
    monkeypatch.undo()
    history.add({"time": 3, "force": 0.0})
    history.close()
    assert read(tmp_path / "history.csv")["time"].tolist() == [0, 1, 2, 3] and len(history) == 4
