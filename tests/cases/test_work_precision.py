"""Sweeps: a pendulum as the case, the modal beam as somebody else's program, and the beam itself once."""
import csv
import json
import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from coupling import cli
from coupling.pictures import figure
from studies import sweep, work_precision

CASES = Path(__file__).parents[2] / "cases"
PENDULUM = '''
import json, math, os, sys, time
keys = {"dt": "0.1", "scheme": "leapfrog", "size": "1,1", **dict(word.split("=", 1) for word in sys.argv[1:])}
dt, x, v = float(keys["dt"]), 1.0, 0.0
if dt <= 0:
    sys.exit(print("error: dt is %g s: it must be positive" % dt, file=sys.stderr) or 1)
if dt > 0.05:
    print("warning: dt is coarse", file=sys.stderr)
if keys["scheme"] == "sleep":
    time.sleep(60)
if keys["scheme"] == "crash":
    os.abort()
begin = time.perf_counter()
for _ in range(round(1 / dt)):
    half = v - 0.5 * dt * x if keys["scheme"] == "leapfrog" else v
    x, v = x + dt * half, (half - 0.5 * dt * (x + dt * half) if keys["scheme"] == "leapfrog" else v - dt * x)
seconds = time.perf_counter() - begin
width, height = keys["size"].split(",")
json.dump({"wall_s": seconds + 0.5, "startup_s": 0.5, "window_s": seconds, "peak_mb": [10.0, 12.0],
           "windows": 3,
           "errors": {"x": abs(x / math.cos(1.0) - 1), "v": abs(v / math.sin(1.0) + 1)}},
          open(os.path.join(keys["out"], "report.json"), "w"))
with open(os.path.join(os.path.dirname(sys.argv[0]), "calls.txt"), "a") as file:
    file.write(keys["dt"] + " " + width + "\\n")
'''
MODAL = '''
import argparse, json, sys
sys.path[:0] = [ROOT, ROOT + "/cases"]
from references import beam_theory
parser = argparse.ArgumentParser()
for name in ("work", "csv", "summary", "modes"):
    parser.add_argument("--" + name)
for name in "steps dt length radius E nu rho v0".split():
    parser.add_argument("--" + name, type=float)
a = parser.parse_args()
h = beam_theory.impact(a.length, 0.01, 0.01, a.radius, a.v0, a.E, a.nu, a.rho, a.steps * a.dt,
                       modes=int(a.modes), dt=a.dt)
with open(a.csv, "w") as file:
    file.write("t_s,contact_force_dem_N,interface_mid_disp_m,sphere_vel_m_s\\n")
    file.writelines("%.9g,%.9g,%.9g,%.9g\\n" % row for row in zip(h.time, h.force, h.u_beam, h.v_sphere))
json.dump({"median_s": {"total": 0.002}}, open(a.summary, "w"))
'''


@pytest.fixture
def pendulum(tmp_path):
    """Path of a case script that takes no time, beside a list of its calls."""
    path = tmp_path / "pendulum.py"
    path.write_text(PENDULUM)
    return path


def calls(pendulum):
    return (pendulum.parent / "calls.txt").read_text().split("\n")[:-1]


def rows(folder):
    with open(folder / "work_precision.csv", newline="") as file:
        return list(csv.DictReader(file))


def test_words_of_a_sweep():
    words = ["dt=1,2", "cells=62x13,31x7", "size=2e-3x1.5", "h=none", "dem=liggghts", "out=here",
             "peer_dt=1,2", "-mpm_snes_rtol", "1e-8"]
    swept, fixed, own = sweep.parse(words, ("out", "peer_"))
    assert swept == {"dt": ["1", "2"], "cells": ["62x13", "31x7"]}
    assert fixed == ["size=2e-3,1.5", "h=none", "dem=liggghts", "-mpm_snes_rtol", "1e-8"]
    assert own == {"out": "here", "peer_dt": "1,2"}
    assert sweep.combinations(swept)[1] == {"dt": "1", "cells": "31x7"}
    assert [sweep.as_typed(text) for text in ("62x13x7", "x", "hexahedron", "1x", "box2x2")] == [
        "62,13,7", "x", "hexahedron", "1x", "box2x2"]


@pytest.mark.parametrize("word", ["dt", "dt=", "dt=1,,2"])
def test_a_word_that_is_no_key(word):
    with pytest.raises(cli.UsageError, match=word):
        sweep.parse([word])


def test_front_and_speed_up():
    times, errors = [1, 2, 3, 2.5, 0.5], [0.1, 0.05, 0.06, 0.01, 0.3]
    assert figure.front(times, errors) == [4, 0, 1, 3]
    assert work_precision.speed_up([1, 2], [0.1, 0.02], [10, 30, 50], [0.2, 0.05, 0.01]) == [(0.2, 10),
                                                                                             (0.05, 15)]


def test_a_sweep_and_its_table(pendulum, tmp_path, capsys):
    out = tmp_path / "sweep"
    words = [str(pendulum), "scheme=leapfrog,euler", "dt=0.1,0.01,-1", "size=3x2", f"out={out}", "repeat=2"]
    assert work_precision.main(words) == 0
    table = rows(out)
    assert list(table[0]) == ["scheme", "dt", "window_s", "wall_s", "peak_mb", "status", "warnings",
                              "error_x", "error_v"]
    by_key = {(row["scheme"], float(row["dt"])): row for row in table}
    assert len(table) == 6 and by_key["euler", 0.01]["peak_mb"] == "12.0"
    error = {key: float(row["error_x"]) for key, row in by_key.items() if row["status"] == "ok"}
    assert error["leapfrog", 0.1] / error["leapfrog", 0.01] == pytest.approx(100, rel=0.02)
    assert error["euler", 0.1] / error["euler", 0.01] == pytest.approx(10, rel=0.15)
    failed = by_key["euler", -1.0]
    assert failed["status"] == "dt is -1 s: it must be positive" and failed["error_x"] == failed[
        "window_s"] == ""
    assert calls(pendulum) == 2 * ["0.1 3"] + 2 * ["0.01 3"] + 2 * ["0.1 3"] + 2 * ["0.01 3"]
    text = (out / "work_precision.md").read_text()
    assert text.count("dt is -1 s: it must be positive |") == 2 and "| **leapfrog** | **0.01** |" in text
    assert (out / "work_precision.png").stat().st_size > 10_000
    said = capsys.readouterr().out
    assert "6/6 scheme=euler dt=-1: dt is -1 s" in said and said.count("warning: dt is coarse") == 2
    assert {key for key, row in by_key.items() if row["warnings"] == "dt is coarse"} == {("leapfrog", 0.1),
                                                                                         ("euler", 0.1)}
    assert "scheme=euler dt=0.1 warns: dt is coarse\n" in text


def test_a_curve_for_each_value_of_a_key(pendulum, tmp_path, monkeypatch):
    drawn = {}
    monkeypatch.setattr(figure, "draw_work", lambda path, xlabel, panels: drawn.update(panels))
    words = [str(pendulum), "scheme=leapfrog,euler", "dt=0.1,0.05", f"out={tmp_path / 'sweep'}", "show=x"]
    assert work_precision.main([*words, "curve=scheme"]) == 0
    (label, times, errors, notes), euler = drawn["error: x"]
    assert label == "pendulum, scheme=leapfrog" and euler[0] == "pendulum, scheme=euler"
    assert notes == ("dt=0.1", "dt=0.05") and len(times) == 2 and errors[0] > errors[1]


def test_a_sweep_goes_on_where_it_stopped(pendulum, tmp_path):
    out = tmp_path / "sweep"
    work_precision.main([str(pendulum), "dt=0.1,-1", f"out={out}"])
    assert calls(pendulum) == ["0.1 1"]
    work_precision.main([str(pendulum), "dt=0.1,0.05,-1", f"out={out}"])
    assert calls(pendulum) == ["0.1 1", "0.05 1"] and [row["status"] for row in rows(out)][:2] == ["ok", "ok"]
    (out / "runs" / "dt=0.05" / sweep.DONE).unlink()  # as of a run that was stopped
    work_precision.main([str(pendulum), "dt=0.1,0.05,-1", f"out={out}"])
    assert calls(pendulum) == ["0.1 1", "0.05 1", "0.05 1"]
    # other words: other runs
    work_precision.main([str(pendulum), "dt=0.1,0.05,-1", f"out={out}", "size=2x1"])
    assert calls(pendulum)[3:] == ["0.1 2", "0.05 2"]


def test_runs_that_crash_or_hang_are_rows(pendulum, tmp_path):
    out = tmp_path / "sweep"
    work_precision.main([str(pendulum), "scheme=leapfrog,crash,sleep", f"out={out}", "timeout=1"])
    assert [row["status"] for row in rows(out)] == ["ok", "killed by SIGABRT", "stopped after 1 s"]


def test_an_interrupt_ends_the_run_below(pendulum, tmp_path):
    # a shell's background job ignores the signal
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    threading.Timer(0.5, os.kill, [os.getpid(), signal.SIGINT]).start()
    begin = time.monotonic()
    try:
        with pytest.raises(KeyboardInterrupt):
            sweep.run(pendulum, {"scheme": "sleep"}, [], tmp_path / "runs")
    finally:
        signal.signal(signal.SIGINT, before)
    assert time.monotonic() - begin < 5 and not list(tmp_path.rglob(sweep.DONE))


@pytest.mark.parametrize("words, error, sentence", [
    (["nothing.py"], cli.UsageError, "'nothing.py' is not a file"),
    (["CASE", "repeat=0"], cli.UsageError, "repeat is 0: give a whole number of at least 1"),
    (["CASE", "dt=0.1,0.2", "dt=0.3,0.4"], cli.UsageError, "dt=0.3,0.4 repeats the key dt: give it once"),
    (["CASE", "dt=0.1", "dt=0.2"], cli.UsageError, "dt=0.2 repeats the key dt"),
    (["CASE", "dt=0.1,0.2,0.1"], cli.UsageError, "'dt=0.1,0.2,0.1' has a value twice"),
    (["CASE", "dt=0.1", "show=y"], cli.UsageError, "show=y: the case has the errors x, v"),
    (["CASE", "dt=-1,-2"], RuntimeError, "no run of the sweep came to its end; the first: dt is -1 s"),
    (["CASE", "overlay=nothing.csv"], cli.UsageError, "overlay=nothing.csv cannot be read"),
    (["CASE", "peer=python3"], cli.UsageError, "peer=INTERPRETER and script=FILE"),
    (["CASE", "dt=0.1,0.2", "curve=scheme"], cli.UsageError, "curve is 'scheme': choose one of dt"),
    (["CASE", "timeout=soon"], cli.UsageError, "timeout=soon cannot be read as a finite number"),
])
def test_what_a_user_can_get_wrong(pendulum, tmp_path, words, error, sentence):
    words = [str(pendulum) if word == "CASE" else word for word in words]
    with pytest.raises(error, match=sentence):
        work_precision.main([*words, f"out={tmp_path}/sweep"])


def test_others_beside_the_case(pendulum, tmp_path):
    """The modal beam with few modes, as another program, and a table of results; the case is the beam
    itself."""
    script, overlay, out = tmp_path / "modal.py", tmp_path / "others.csv", tmp_path / "sweep"
    script.write_text(MODAL.replace("ROOT", repr(str(CASES.parent))))
    overlay.write_text("# from nowhere\nlabel,time_s,error_force,error_u_beam\nothers: fine,100,0.5,0.2\n")
    coarse = ["cells=31x7", "body=60x4", "points=3", "segments=30", "substeps=80"]
    words = [str(CASES / "beam_impact.py"), *coarse, "dt=4e-6", "t_end=4e-5", f"out={out}",
             f"overlay={overlay}"]
    words += [f"peer={sys.executable}", f"script={script}", "peer_dt=1e-7", "peer_modes=20"]
    assert work_precision.main(words) == 0
    table = rows(out)
    assert [row["status"] for row in table] == ["ok"]
    text = (out / "work_precision.md").read_text()
    assert "| others: fine | 100 | 50.00% | 20.00% |" in text and "| peer: dt=1e-7 modes=20 | 8 | 0.0" in text
    assert "error in force of others's best runs (50.00%) the case is" in text
    report = json.loads((out / "runs/run/report.json").read_text())
    assert 0 < float(table[0]["window_s"]) < float(table[0]["wall_s"]) and report["window_cpu_s"] > 0


@pytest.mark.parametrize("error, status, says", [(cli.UsageError("no such key"), 2, "error: no such key"),
                                                 (ValueError("no such place"), 1, "error: no such place"),
                                                 (KeyboardInterrupt(), 130, "interrupted; the same command "
                                                  "goes on from here")])
def test_a_tool_ends_with_one_sentence_and_its_status(capsys, error, status, says):
    def main(words):
        raise error

    with pytest.raises(SystemExit) as ended:
        sweep.end(main)
    assert ended.value.code == status and capsys.readouterr().err == says + "\n"


@pytest.mark.parametrize("study", ["stability", "work_precision"])
def test_a_study_without_a_checkout_is_a_sentence(study, tmp_path):
    """The package alone, as it is installed: its words find no cases beside it."""
    shutil.copytree(CASES.parent / "coupling", tmp_path / "coupling")
    for file in CASES.parent.glob("mpm_dem_*.py"):
        shutil.copy(file, tmp_path)
    done = subprocess.run([sys.executable, "-m", f"coupling.{study}"], cwd=tmp_path, capture_output=True,
                          text=True)
    assert done.returncode == 1 and done.stderr.count("\n") == 1
    assert "the studies belong to the cases, run this in a checkout of the project" in done.stderr
