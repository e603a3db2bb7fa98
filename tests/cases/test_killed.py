"""Runs that are killed or told to stop: the last checkpoint is whole, and they go on from it."""
import json
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from coupling import checkpoint
from coupling.records.history import read

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tests/benchmarks"))
from kill_runs import Killed  # noqa: E402

SCRIPT = ROOT / "cases/beam_impact.py"


def test_killed_at_a_random_moment_a_run_ends_as_without(tmp_path):
    """Every second window writes a checkpoint; tests/benchmarks/kill_runs.py does it fifty times."""
    run, chance = Killed("beam", tmp_path), random.Random(3)
    seen = run.kill(chance)
    run.finish()
    assert run.restarts == 1 and seen > 0


def wait_for(path, process):
    while process.poll() is None and not path.exists():
        time.sleep(0.02)
    assert process.poll() is None, process.communicate()


@pytest.mark.mpi
def test_when_one_of_two_ranks_is_killed_the_others_end(start_ranks, words, tmp_path):
    """Within 10 s, with a message, and the last checkpoint is good."""
    process = start_ranks(2, SCRIPT, *words("dt=5e-8 substeps=1 checkpoint=50"))
    wait_for(tmp_path / "checkpoint_before.h5", process)
    listed = subprocess.run(["pgrep", "-f", f"{SCRIPT}.*out={tmp_path}"], capture_output=True, text=True)
    ranks = [int(number) for number in listed.stdout.split() if int(number) != process.pid]
    begin = time.monotonic()
    os.kill(ranks[-1], signal.SIGKILL)
    out, err = process.communicate(timeout=20)
    assert process.returncode != 0 and time.monotonic() - begin < 10.0 and "signal 9" in err + out
    saved = checkpoint.find(tmp_path)
    assert saved.head["window"] % 50 == 0 and len(read(tmp_path / "history.csv")["time"]) > 0


@pytest.mark.parametrize("name", ["SIGTERM", "SIGUSR1", "SIGINT"])
def test_a_signal_writes_a_checkpoint(start_process, words, tmp_path, name):
    """Where checkpoints are asked for; the run ends in order and says how to go on."""
    env = {**os.environ, "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"}
    process = start_process([sys.executable, SCRIPT, *words("dt=5e-9 substeps=1 checkpoint=end")], env)
    wait_for(tmp_path / "history.csv", process)
    process.send_signal(getattr(signal, name))
    out, err = process.communicate(timeout=10)
    assert process.returncode == 0 and err.startswith(f"warning: {name}: a checkpoint is written when "), err
    last, report = out.splitlines()[-1], json.loads((tmp_path / "report.json").read_text())
    assert last == f"{report['stopped']}: go on with restart={tmp_path}"
    where = f"after window {report['windows']}, t = "
    assert report["stopped"].startswith(f"stopped by the signal {name} {where}")
    assert checkpoint.find(tmp_path).head["window"] == report["windows"]


def test_the_walltime_ends_a_run_with_a_checkpoint(case, coarse_keys, tmp_path, capsys):
    """In this process, which has begun longer ago than that."""
    assert case.main(**coarse_keys, out=tmp_path, walltime="1s") == {}
    report = json.loads((tmp_path / "report.json").read_text())
    assert report["stopped"] == "stopped by the walltime of 1s after window 1, t = 4e-06 s"
    assert capsys.readouterr().out.endswith(f"t = 4e-06 s: go on with restart={tmp_path}\n")
    (history,) = case.main(restart=tmp_path, walltime=None).values()
    assert len(history) == 50
