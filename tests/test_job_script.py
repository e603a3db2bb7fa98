"""The job script of docs/cluster.md takes a run to its end in several jobs, here with stand-ins for Slurm's
two commands."""
import os
import subprocess
from pathlib import Path

import pytest

from coupling.records import manifest
from coupling.records.history import read

ROOT = Path(__file__).parents[1]
KEYS = ["h=5e-3", "dt=4e-6", "t_end=1.2e-3"]  # 300 windows
# Starts the command with one rank. In the first job it is the queue, too, whose time is over.
SRUN = """#!/bin/bash
while [[ $1 == --* ]]; do shift; done
"$@" & run=$!
if [[ ! -e $SLURM_STAND_IN/requeued ]]; then
    until [[ $(wc -l 2>/dev/null <"$HISTORY") -gt 50 ]]; do kill -0 $run || break; sleep 0.02; done
    kill -USR1 $run
fi
wait $run
"""
SCONTROL = """#!/bin/bash
echo "$@" >>"$SLURM_STAND_IN/requeued"
"""


@pytest.fixture
def submit(tmp_path):
    """``submit(key=value, …)``: one job of the beam with results in ``tmp_path/out``."""
    for name, text in ("srun", SRUN), ("scontrol", SCONTROL):
        (tmp_path / name).write_text(text)
        (tmp_path / name).chmod(0o755)
    env = {**os.environ, "PATH": f"{tmp_path}:{os.environ['PATH']}", "SLURM_JOB_ID": "17",
           "SLURM_STAND_IN": str(tmp_path), "HISTORY": str(tmp_path / "out/history.csv")}
    env.pop("IMAGE", None)

    def job(*keys):
        return subprocess.run(["bash", "docs/job.sh", tmp_path / "out", "cases/beam_impact.py", *KEYS, *keys],
                              cwd=ROOT, env=env, capture_output=True, text=True, timeout=120)

    return job


@pytest.mark.validation
def test_a_run_goes_on_in_the_next_job_until_it_is_complete(submit, tmp_path):
    first = submit()
    assert "job.sh: the run goes on in the next job" in first.stdout, first
    assert (tmp_path / "requeued").read_text() == "requeue 17\n"
    assert manifest.read(tmp_path / "out").state == "stopped"
    begun = len(read(tmp_path / "out/history.csv")["time"])
    assert 0 < begun < 300

    second = submit()
    assert "job.sh: the run is complete" in second.stdout and second.returncode == 0, second
    assert (tmp_path / "requeued").read_text() == "requeue 17\n"  # not once more
    found = read(tmp_path / "out/history.csv")

    command = ["./dev", "run", "python", "cases/beam_impact.py", *KEYS, f"out={tmp_path / 'whole'}"]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True, timeout=120)
    whole = read(tmp_path / "whole/history.csv")
    assert {name: list(column) for name, column in found.items()} == {
        name: list(column) for name, column in whole.items()}


def test_a_job_that_fails_does_not_come_back(submit, tmp_path):
    """Nor does it take the results of another run, which are complete, for its own."""
    (tmp_path / "out").mkdir()
    (tmp_path / "out/manifest.txt").write_text("state: complete\n")
    job = submit("E=-1")
    assert job.returncode == 1 and "job.sh: the run has failed, look above" in job.stderr, job
    assert "error: E is -1" in job.stderr and "complete" not in job.stdout
    assert not (tmp_path / "requeued").exists()
