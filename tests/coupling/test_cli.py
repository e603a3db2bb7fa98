"""From the words of the command line to typed keyword arguments, and from errors to one sentence."""
import os
import signal
import sys
import time
import warnings
from typing import Literal, Optional, Tuple

import pytest

from coupling import cli, origin

PRESETS = {"paper": dict(cells=(62, 13), dt=5e-8), "none": {}}


def main(
    dt: float = 1e-6,  # window [s]
    E: float = 215.82e9,  # modulus [Pa]
    cells: Tuple[int, int] = (4, 2),  # of the grid [-]
    size: Tuple[float, float] = (0.1, 0.2),  # of the box [m]
    h: Optional[float] = None,  # cell size [m], or none
    plane: Literal["stress", "strain"] = "stress",  # state
    fast: bool = False,  # skip the rest
    n: int = 3,  # number [-]
    out: str = "out",  # folder
):
    """What the case shows."""
    called.append(dict(locals()))


CASE = cli.case(main, presets=PRESETS)
called = []


@pytest.fixture(autouse=True)
def fresh(monkeypatch):
    called.clear()
    # run() replaces it: put it back afterwards
    monkeypatch.setattr(warnings, "showwarning", warnings.showwarning)


def run(monkeypatch, *words, function=CASE):
    monkeypatch.setattr(sys, "argv", ["case.py", *words])
    cli.run(function)


def test_words_become_values():
    words = ["dt=2e-6", "cells=8,3", "size=(1,2.5)", "h=1e-3", "plane=strain", "fast=yes", "n=-4", "out=a=b"]
    assert cli.parse(main, words) == dict(dt=2e-6, cells=(8, 3), size=(1.0, 2.5), h=1e-3, plane="strain",
                                          fast=True, n=-4, out="a=b")
    assert cli.parse(main, ["h=none", "fast=0"]) == dict(h=None, fast=False)
    assert cli.parse(main, []) == {}


@pytest.mark.parametrize("words", ["preset=paper dt=2e-6", "dt=2e-6 preset=paper"])
def test_explicit_keys_win_over_the_preset(words):
    assert cli.parse(CASE, words.split()) == dict(cells=(62, 13), dt=2e-6)


def test_options_of_petsc_are_left_alone():
    words = ["-mpm_snes_monitor", "dt=2e-6", "-mpm_pc_type", "lu", "n=2", "-mpm_shift", "-3", "-last"]
    assert cli.parse(main, words) == dict(dt=2e-6, n=2)


@pytest.mark.parametrize("word, text", [
    ("cels=1,2", r"unknown key 'cels' \(did you mean cells\?\); known keys: dt, E, cells, .*, out, preset$"),
    ("zzz=1", "unknown key 'zzz'; known keys: dt, E, "), ("dt", "'dt' is not key=value; known keys: dt, "),
    ("--dt=2e-6", "'--dt=2e-6' starts with a dash, .* dt=2e-6$"), ("-dt", "'-dt' starts with a dash, .* dt="),
    ("--dt", "'--dt' starts with a dash, "), ("-n=2", "'-n=2' starts with a dash, .* n=2"),
    ("dt=fast", "dt=fast cannot be read as a finite number"), ("dt=nan", "dt=nan cannot .* finite number"),
    ("E=inf", "E=inf cannot"), ("n=4.0", "n=4.0 cannot be read as a whole number"),
    ("cells=3", "cells=3 cannot be read as 2 numbers separated by commas, such as 2,2"),
    ("cells=1.5,2", "cells=1.5,2 cannot be read"),
    ("size=a,b", "size=a,b cannot be read as .* such as 0.1,0.1"),
    ("plane=bent", "plane=bent does not exist: choose one of stress, strain"),
    ("fast=perhaps", "fast=perhaps cannot be read as yes or no"),
    ("h=big", "h=big cannot be read as a finite number"),
    ("preset=papr", "preset=papr does not exist: choose one of paper, none")])
def test_wrong_words_are_named(word, text):
    with pytest.raises(cli.UsageError, match=text):
        cli.parse(CASE, [word])


def test_preset_is_unknown_where_there_is_none():
    with pytest.raises(cli.UsageError, match="unknown key 'preset'"):
        cli.parse(main, ["preset=paper"])


@pytest.mark.parametrize("word", ["--help", "-h"])
def test_manual_has_every_key_with_default_unit_and_meaning(monkeypatch, capsys, word):
    run(monkeypatch, word)  # returns: exit status 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "What the case shows." and not called
    for line in ("dt=1e-06 window [s]", "E=215820000000 modulus [Pa]", "cells=4,2 of the grid [-]",
                 "h=none cell size [m], or none",
                 "plane=stress state; one of stress, strain", "fast=False skip the rest", "out=out folder",
                 "preset=paper cells=62,13 dt=5e-08"):
        assert line in [" ".join(shown.split()) for shown in lines]


def test_run_calls_main(monkeypatch):
    run(monkeypatch, "n=2", "preset=paper", "-mpm_snes_monitor")
    assert called[0]["n"] == 2 and called[0]["cells"] == (62, 13)


@pytest.mark.parametrize("error, status, sentence", [(ValueError("dt is 0"), 1, "dt is 0"),
                                                     (RuntimeError("a\nb"), 1, "a b"),
                                                     (ImportError("get it"), 1, "get it"),
                                                     (FloatingPointError("lost"), 1, "lost"),
                                                     (OSError("disk"), 1, "disk"),
                                                     (MemoryError("too large"), 1, "too large"),
                                                     (cli.UsageError("no"), 2, "no"),
                                                     (KeyboardInterrupt(), 130,
                                                      "interrupted; what was written so far is complete")])
def test_an_error_is_one_sentence_and_a_status(monkeypatch, capsys, error, status, sentence):
    def failing():
        raise error
    with pytest.raises(SystemExit) as end:
        run(monkeypatch, function=failing)
    shown = capsys.readouterr().err
    assert end.value.code == status and shown.startswith(f"error: {sentence}") and shown.count("\n") == 1


def test_sigterm_is_an_interrupt(monkeypatch, capsys):
    """And afterwards both signals do what they did before."""
    before = [signal.getsignal(number) for number in cli.SIGNALS]
    with pytest.raises(SystemExit) as end:
        run(monkeypatch, function=lambda: os.kill(os.getpid(), signal.SIGTERM) or time.sleep(5))
    assert end.value.code == 130 and capsys.readouterr().err.startswith("error: interrupted; ")
    assert [signal.getsignal(number) for number in cli.SIGNALS] == before


def test_a_bug_shows_where_it_is(monkeypatch, capsys):
    with pytest.raises(SystemExit) as end:
        run(monkeypatch, function=lambda: cli.described(None))
    shown = capsys.readouterr().err
    assert end.value.code == 1 and "AttributeError: 'NoneType'" in shown and "error: this is a bug" in shown


@pytest.mark.parametrize("fault, sentence", [
    ("{}['missing']", "error: KeyError: 'missing' (line 6 of own.py)"),
    ("np.ones(2) + np.ones(3)",
     "error: operands could not be broadcast together with shapes (2,) (3,) (line 6 of own.py)"),
    ("Scheme(dt=0.0, t_end=1.0)", "error: dt is 0.0 s: the window must be positive (line 6 of own.py)"),
    ("np.ones(2).no",
     "error: AttributeError: 'numpy.ndarray' object has no attribute 'no' (line 6 of own.py)")])
def test_an_error_in_a_script_of_ones_own_has_its_line(run_ranks, tmp_path, fault, sentence):
    (tmp_path / "own.py").write_text(f"""import numpy as np
from coupling import Scheme, case

@case
def main():
    return {fault}

main.run()
""")
    done = run_ranks(1, tmp_path / "own.py")
    assert done.returncode == 1 and "this is a bug" not in done.stderr
    assert [line for line in done.stderr.splitlines() if line.startswith("error")] == [sentence]


def test_cases_of_the_program_have_keys_and_no_lines():
    script = str(origin.ROOT / "cases" / "beam.py")
    with pytest.raises(ValueError) as raised:
        exec(compile("raise ValueError('too long')", script, "exec"))
    assert origin.with_line(raised.value, script) == "too long" and origin.in_program(raised.value, script)


def test_a_warning_is_one_line(monkeypatch, capsys):
    def careless():
        warnings.warn("the step is long", stacklevel=2)
    with warnings.catch_warnings():
        warnings.simplefilter("always")
        run(monkeypatch, function=careless)
    assert capsys.readouterr().err == "warning: the step is long\n"


@pytest.mark.mpi
@pytest.mark.parametrize("rank, start", [("0", "error"), ("1", "error on rank 1"), ("2", "error")])
def test_an_error_on_one_rank_ends_all(run_ranks, tmp_path, rank, start):
    """The others wait for it: they are aborted after some seconds. Rank "2" means that all have the error."""
    (tmp_path / "case.py").write_text("""
from coupling import cli

def main(rank: int = 0):
    if cli.MPI.COMM_WORLD.rank == rank or rank == 2:
        raise ValueError("only here")
    cli.MPI.COMM_WORLD.Barrier()
    print("never")

cli.PATIENCE = 0.5
cli.run(main)
""")
    done = run_ranks(2, tmp_path / "case.py", f"rank={rank}")
    assert done.returncode == 1 and "never" not in done.stdout
    assert [shown for shown in done.stderr.splitlines() if "only here" in shown] == [
        f"{start}: only here (line 6 of case.py)"]
    assert rank != "2" or "MPI_ABORT" not in done.stderr
