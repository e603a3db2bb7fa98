"""What a run leaves in its folder when it is killed, refused, or replaced by another one."""
import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from coupling.records import manifest, progress
from coupling.records.history import read

ROOT = Path(__file__).parents[2]
LONG = "dt=5e-9 substeps=1 paraview=20 picture=1"  # minutes, if nobody ends it


@pytest.fixture
def start(words, start_process):
    """``start("key=value …")``: the coarse beam as a process of its own; killed at the end."""
    def begin(more="", petsc="", **keys):
        env = {**os.environ, "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1", "PETSC_OPTIONS": petsc}
        return start_process([sys.executable, ROOT / "cases/beam_impact.py", *words(more)], env, **keys)

    return begin


def wait_for(condition, process):
    while process.poll() is None and not condition():
        time.sleep(0.02)
    assert process.poll() is None, process.communicate()


def files(folder):
    return {path.name for path in folder.iterdir() if path.is_file()}


def speed_in(folder):
    """The key v0 as history and report have it: they are of one run."""
    head, report = (folder / "history.csv").read_text().split("\n")[1], folder / "report.json"
    (speed,) = [float(word[3:]) for word in head.split() if word.startswith("v0=")]
    assert not report.exists() or json.loads(report.read_text())["parameters"]["v0"] == speed
    return speed


def test_a_run_killed_on_the_way_is_replaced_whole(run, start, tmp_path):
    """kill -9 during the first window leaves the old set, later it leaves the new one, of which the next run
    removes the ParaView files that it does not write itself."""
    (tmp_path / "points_of_mine.vtu").write_text("mine")
    run(v0=0.01, paraview=5, picture=1.0)
    old, before = files(tmp_path), manifest.read(tmp_path)
    process = start(f"{LONG} v0=0.02")
    wait_for(lambda: (now := manifest.read(tmp_path)).run != before.run and now.state == "running", process)
    wait_for(lambda: (tmp_path / "points_00001.vtu").exists(), process)
    process.kill()
    process.communicate()
    found = manifest.read(tmp_path)
    assert found.state == "running" and "report.json" not in files(tmp_path) and speed_in(tmp_path) == 0.02
    assert files(tmp_path) - {"manifest.txt", "points_of_mine.vtu"} <= set(found.files)
    assert "beam_impact.png" in old - files(tmp_path)
    run(v0=0.03, t_end=2e-5)
    assert files(tmp_path) == {"beam_impact.png", "history.csv", "manifest.txt", "points_of_mine.vtu",
                               "report.json"}
    assert speed_in(tmp_path) == 0.03 and manifest.read(tmp_path).state == "complete"
    assert (tmp_path / "points_of_mine.vtu").read_text() == "mine"


@pytest.mark.parametrize("keys", [
    dict(dt=-1.0), dict(tol=0.0, iterate=1), dict(gap=-1e-4), dict(paraview=-1), dict(iterate=1, tol=1e-8)])
def test_a_failed_start_leaves_the_old_set(run, case, tmp_path, keys):
    """Also one that fails in its first window, with files for ParaView already written."""
    run(v0=0.02, t_end=2e-5)
    before = {name: (tmp_path / name).read_bytes() for name in files(tmp_path)}
    with pytest.raises((ValueError, RuntimeError)):
        run(**{"paraview": 1, **keys})
    assert {name: (tmp_path / name).read_bytes() for name in files(tmp_path)} == before
    assert [path for path in tmp_path.iterdir() if path.is_dir()] == []


def test_the_second_of_two_runs_in_one_folder_is_refused(start, tmp_path):
    first = start(LONG)
    wait_for(lambda: manifest.read(tmp_path) is not None, first)
    second = start("v0=0.02")
    out, err = second.communicate(timeout=200)
    assert second.returncode == 1 and out == "" and err.count("\n") == 1
    assert err.startswith(f"error: out={tmp_path} belongs to a run that has not ended (process {first.pid} "
                          "on ")
    assert first.poll() is None and speed_in(tmp_path) == 0.01
    first.kill()
    first.communicate()
    third = start("v0=0.02 t_end=2e-5")
    assert third.communicate(timeout=200)[1] == "" and speed_in(tmp_path) == 0.02


@pytest.mark.mpi
def test_ranks_write_one_set(run, run_ranks, words, tmp_path):
    """Two ranks replace what one has left, and name the pieces of both."""
    run(v0=0.02, paraview=10)
    done = run_ranks(2, ROOT / "cases/beam_impact.py", *words("paraview=10 t_end=8e-5"))
    assert done.returncode == 0, done.stderr
    assert files(tmp_path) - {"manifest.txt"} == set(manifest.read(tmp_path).files)
    assert {f"points_0000{time}_000{rank}.vtu" for time in (0, 1, 2) for rank in (0, 1)} <= files(tmp_path)
    assert "points_00000.vtu" not in files(tmp_path) and len(read(tmp_path / "history.csv")["time"]) == 20
    assert speed_in(tmp_path) == 0.01


def test_a_signal_is_obeyed_within_a_window_of_the_dem(start, tmp_path, backend):
    """The first window takes minutes, and is not computed to its end."""
    process = start(f"dem={backend} substeps=500000000 dt=1e-6 v0=1e-6")
    while process.poll() is None and not (tmp_path / ".run/lock").exists():
        time.sleep(0.02)
    time.sleep(1.0)  # by now it is in the window
    assert process.poll() is None, process.communicate()
    begin = time.monotonic()
    process.send_signal(signal.SIGTERM)
    _, err = process.communicate(timeout=20)
    assert process.returncode == 130 and time.monotonic() - begin < 2.0
    assert err.splitlines()[-1].startswith("error: interrupted; ")
    assert json.loads((tmp_path / "report.json").read_text())["error"] == "KeyboardInterrupt: SIGTERM"


def test_options_that_changed_a_run_are_in_its_report(start, tmp_path):
    """From the command line and PETSC_OPTIONS; one that accepts everything is warned of, one without sense
    refused."""
    process = start("t_end=8e-6 -mpm_snes_max_it 30 -mpm_snes_atol 1e6", petsc="-mpm_snes_stol 1e-30")
    _, err = process.communicate(timeout=200)
    assert process.returncode == 0 and err.count("\n") == 1, err
    assert err.startswith("warning: step 1, t = 4e-06 s was accepted with a residual of ")
    report = json.loads((tmp_path / "report.json").read_text())
    assert report["options"] == {"-mpm_snes_max_it": "30", "-mpm_snes_atol": "1e6", "-mpm_snes_stol": "1e-30"}
    process = start("t_end=8e-6", petsc="-mpm_snes_rtol nan")
    _, err = process.communicate(timeout=200)
    assert process.returncode == 1 and err.count("\n") == 1
    assert err.startswith("error: -mpm_snes_rtol is nan: give a number at least 0 and below 1, or leave the "
                          "option out")
    assert json.loads((tmp_path / "report.json").read_text())["options"]["-mpm_snes_stol"] == "1e-30"


def test_what_a_run_tells_of_itself(run, tmp_path, capsys, monkeypatch):
    """How fine the scene is before the first window; without a terminal a line every minute, here after each
    window; a figure in the summary only when there is one."""
    monkeypatch.setattr(progress, "EVERY", 0.0)
    run(t_end=2e-5)
    first, *lines = capsys.readouterr().out.splitlines()
    found = re.fullmatch(
        r"cells of (.*) x (.*) m, (.*) points per filled cell \((\d+) to (\d+)\), explicit limit of the "
        r"time step (.*) s", first)
    width, height, mean, least, most, limit = map(float, found.groups())
    assert (width, height) == pytest.approx(((0.1535 + 0.0052) / 31, 0.03 / 7), rel=1e-3)
    assert least <= mean <= most and mean == pytest.approx(2160 / (31 * 3), rel=0.3)
    assert limit == pytest.approx(height / 5942, rel=0.01)  # sqrt(E (1 - nu) / ((1 + nu) (1 - 2 nu) rho))
    report = json.loads((tmp_path / "report.json").read_text())
    assert report["explicit_limit"] == pytest.approx(limit, rel=1e-2) and report["options"] == {}
    assert len(lines) == 5 + 5 and re.fullmatch(
        r"step 3, t = 1.2e-05 s \(60.0%\): \d\.\d\d Newton iterations per step, 00:\d\d gone, 00:\d\d to go",
        lines[2])
    assert lines[-1] == f"results in {tmp_path}, figure {tmp_path / 'beam_impact.png'}"


def test_a_summary_names_no_figure_where_there_is_none(start, tmp_path):
    script = ROOT / "cases/extreme.py"
    done = subprocess.run([sys.executable, script, "windows=2", f"out={tmp_path}"], capture_output=True,
                          text=True, env={**os.environ, "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"},
                          timeout=100)
    assert done.stdout.splitlines()[-1] == f"results in {tmp_path}", done.stderr
    assert not list(tmp_path.glob("*.png"))
