"""Whatever goes wrong on one of two ranks ends both, within seconds and with one sentence."""
import json
import os
import re
import signal
import time
from pathlib import Path

import pytest
from mpi4py import MPI

OPEN_MPI_5 = MPI.Get_library_version().startswith("Open MPI v5")
CASE = Path(__file__).parents[2] / "cases/beam_impact.py"
SECONDS = 30  # from the failure to the end, on a busy machine: the patience is 5 s
FAILING = """
import importlib.util, os, signal, sys
import coupling.run
from coupling import cli
_, path, failure, *_ = sys.argv
del sys.argv[1:3]
sys.path.insert(0, os.path.dirname(path))  # as of a case that is started
signal.signal(signal.SIGINT, signal.default_int_handler)  # even where the tests run without interrupts
spec = importlib.util.spec_from_file_location("beam_impact", path)
case = importlib.util.module_from_spec(spec)
spec.loader.exec_module(case)
rank, couple = cli.MPI.COMM_WORLD.rank, coupling.run.couple

def fail(solid, grains):
    if failure == "point" and rank == 1:
        solid.points.x[3] = float("nan")
    elif failure == "liggghts" or failure == "liggghts on rank 1" and rank == 1:
        grains._instance.command("nonsense")
    elif failure == "rank 1" and rank == 1:
        raise ValueError("only here")
    elif failure == "residual of rank 1" and rank == 1:
        solid.step.equations.residual = lambda u, r: 1 / 0
    elif failure == "wait":
        open(f"{solid.folder}/rank{rank}.pid", "w").write(str(os.getpid()))

def couple_and_fail(solid, grains, mapping, scheme, on_window, last):
    solid.folder = on_window[0].out
    watched = [*on_window, lambda window: fail(solid, grains) if window.number == 5 else None]
    couple(solid, grains, mapping, scheme, watched, last)

coupling.run.couple = couple_and_fail
cli.run(case.main)
"""


def sentences(err):
    """What the program itself says: mpirun adds lines of its own when a rank ends with an error."""
    return [line for line in err.splitlines() if line.startswith("error")]


def runs(pid):
    """Whether the process is there and not just waiting to be taken note of, as orphans in a container may
    for ever."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] not in "ZX"
    except FileNotFoundError:
        return False


@pytest.mark.mpi
@pytest.mark.parametrize("failure, options, sentence",
                         [("point", "", r"error: material point \d+ left the grid at x = \[nan, nan\] m"),
                          pytest.param("nothing", "-mpm_snes_max_it 1 -mpm_snes_atol 0 -mpm_snes_rtol 1e-15",
                                       "error: Newton's method diverged in step 1",
                                       marks=pytest.mark.validation),
                          ("liggghts", "dem=liggghts", "error: LIGGGHTS: Unknown " "command: nonsense")])
def test_errors_of_all_ranks_are_one_sentence(run_ranks, words, request, tmp_path, failure, options,
                                              sentence):
    """Also that of a point on rank 1 alone, for the search asks all ranks. Nobody is aborted, the report is
    there."""
    if "liggghts" in options:
        request.getfixturevalue("liggghts")
    begin = time.monotonic()
    done = run_ranks(2, "-c", FAILING, CASE, failure, *words(options))
    assert done.returncode == 1 and time.monotonic() - begin < 2 * SECONDS
    (shown,) = sentences(done.stderr)
    assert re.match(sentence, shown), shown
    assert "MPI_ABORT" not in done.stderr and "Traceback" not in done.stderr
    assert json.loads((tmp_path / "report.json").read_text())["error"].split(": ", 1)[1] == shown.split(": ",
                                                                                                        1)[1]


@pytest.mark.mpi
@pytest.mark.parametrize("failure, sentence", [
    ("residual of rank 1", "error on rank 1: division by zero"),
    pytest.param("rank 1", "error on rank 1: only here", marks=pytest.mark.validation),
    pytest.param("liggghts on rank 1", "error on rank 1: LIGGGHTS: Unknown command: nonsense",
                 marks=pytest.mark.validation)])
def test_an_error_of_one_rank_ends_the_others(run_ranks, words, request, failure, sentence):
    """They wait somewhere, the residual's exchange included, until they are aborted."""
    if "liggghts" in failure:
        request.getfixturevalue("liggghts")
    begin = time.monotonic()
    done = run_ranks(2, "-c", FAILING, CASE, failure, *words("dem=liggghts" if "liggghts" in failure else ""))
    assert done.returncode == 1 and time.monotonic() - begin < 2 * SECONDS
    (shown,) = sentences(done.stderr)
    assert shown.startswith(sentence), done.stderr


@pytest.mark.mpi
@pytest.mark.parametrize("receiver", ["rank 0", "rank 1", "mpirun"])
def test_an_interrupt_ends_all_ranks(start_ranks, words, tmp_path, receiver):
    """One rank that is interrupted, or mpirun, which tells all ranks and kills those that are still there a
    second later."""
    process = start_ranks(2, "-c", FAILING, CASE, "wait", *words("dt=5e-9 substeps=1"))
    marks = [tmp_path / f"rank{rank}.pid" for rank in (0, 1)]
    while process.poll() is None and not all(mark.exists() and mark.read_text() for mark in marks):
        time.sleep(0.05)
    begin = time.monotonic()
    if receiver == "mpirun":
        process.send_signal(signal.SIGINT)
    else:
        os.kill(int(marks[int(receiver[-1])].read_text()), signal.SIGINT)
    _, err = process.communicate(timeout=SECONDS)
    while any(runs(int(mark.read_text())) for mark in marks) and time.monotonic() - begin < SECONDS:
        time.sleep(0.05)  # mpirun itself may be gone a moment earlier
    assert process.returncode != 0 and time.monotonic() - begin < SECONDS
    shown = sentences(err)
    if OPEN_MPI_5:  # its mpirun may end before it has passed on what the ranks say
        assert len(shown) <= 1, err
    else:
        assert len(shown) == 1 and "interrupted; what was written so far" in shown[0], err
    assert "Traceback" not in err
