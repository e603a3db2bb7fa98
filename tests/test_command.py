"""The command mpm-dem: in the source tree, and as a user has it who installed the project without one."""
import os
import shutil
import signal
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest

import mpm_dem_command as command

ROOT = Path(__file__).parents[1]
CASES = {path.stem for path in (ROOT / "cases").glob("*.py")}


def call(words, folder, program=(sys.executable, ROOT / "mpm_dem_command.py")):
    return subprocess.run([*map(str, (*program, *words))], cwd=folder, capture_output=True, text=True,
                          timeout=300, env={**os.environ, "OMP_NUM_THREADS": "1"})


def test_cases_are_listed_with_what_they_are():
    """From their docstrings, without importing them."""
    lines = call(["cases"], ROOT).stdout.splitlines()
    assert {line.split()[0] for line in lines} == CASES
    assert any(line.startswith("beam_impact") and "A steel sphere strikes" in line for line in lines)


def test_whoever_reads_the_list_may_stop():
    """As head does: the rest is not written, and nothing is said about that."""
    reading, writing = os.pipe()
    os.close(reading)
    with os.fdopen(writing, "w") as gone:
        done = subprocess.run([sys.executable, ROOT / "mpm_dem_command.py", "cases"], stdout=gone, text=True,
                              stderr=subprocess.PIPE, timeout=300)
    assert done.returncode == -signal.SIGPIPE and done.stderr == ""


@pytest.mark.parametrize("words, sentence", [
    (["run", "nothing"], "error: nothing is neither a case nor a file: give one of beam_impact, "),
    (["run"], "error: mpm-dem run needs a case: mpm-dem cases names them"),
    (["cases", "all"], "error: mpm-dem cases takes no words, it got all"),
    (["start"], "error: mpm-dem has no command start: it has run, cases, demo and doctor")])
def test_wrong_words_are_a_sentence(words, sentence, tmp_path):
    done = call(words, tmp_path)
    assert done.returncode == 2 and done.stderr.startswith(sentence) and done.stderr.count("\n") == 1


def test_a_script_of_the_user_gets_its_words(tmp_path):
    """Those for PETSc, too, and files beside it are found."""
    (tmp_path / "beside.py").write_text("value = 7\n")
    (tmp_path / "own.py").write_text("import sys, beside\nprint(__name__, beside.value, *sys.argv[1:])\n")
    done = call(["run", "own.py", "a=1", "-mpm_snes_monitor"], tmp_path)
    assert done.stdout == "__main__ 7 a=1 -mpm_snes_monitor\n", done


def test_a_package_that_is_missing_is_a_sentence(tmp_path):
    (tmp_path / "own.py").write_text("import no_such_package\n")
    done = call(["run", "own.py"], tmp_path)
    assert done.returncode == 1
    assert done.stderr == "error: No module named 'no_such_package': mpm-dem doctor says what is missing\n"


@pytest.mark.parametrize("code, said", [
    ("import no_such_package", "No module named 'no_such_package'"), ("import os; os.abort()", "signal 6"),
    ("import time; time.sleep(60)", "no answer within 1 s")])
def test_the_doctor_survives_its_patient(code, said, monkeypatch):
    """A piece that is missing, that crashes, that hangs."""
    monkeypatch.setattr(command, "PATIENCE", 1.0 if "sleep" in code else 60.0)
    found = command.examined(command.Piece("piece", code, ""))
    assert not found.works and any(said in text for text in found.wrong)


def test_the_doctor_finds_what_does_not_fit(monkeypatch, capsys):
    """A piece that imports and does not fit: cases cannot run, unless they can do without it."""
    misfit = command.Piece("mpi4py", 'say("version", 1); say("wrong", "two MPI libraries")', "take another")
    monkeypatch.setattr(command, "PIECES", [misfit])
    assert command.doctor() == 1
    told = capsys.readouterr().out
    assert "BROKEN   mpi4py      1" in told and "two MPI libraries" in told and "take another" in told
    monkeypatch.setattr(command, "PIECES", [misfit._replace(needed=False)])
    assert command.doctor() == 0
    assert "cases can run, with dem=reference; without LIGGGHTS" in capsys.readouterr().out


def test_the_doctor_sees_two_mpi_libraries(tmp_path):
    """Here a copy of the same."""
    need_one = "from mpi4py import MPI\nimport ctypes, shutil\nlibrary, = loaded('/libmpi(ch|_abi)?[.]so')\n"
    one = command.examined(command.Piece("mpi4py", need_one + "one_mpi()", ""))
    assert one.works, one
    more = f"place = shutil.copy(library, {str(tmp_path)!r})\nctypes.CDLL(place)\none_mpi()"
    two = command.examined(command.Piece("mpi4py", need_one + more, ""))
    assert two.wrong[0].startswith("two MPI libraries in one process") and f"{tmp_path}/" in two.wrong[0], two


@pytest.fixture
def installed(tmp_path):
    """``installed(*words)``: the command of an environment into which a copy of the project was installed,
    without its source tree."""
    pytest.importorskip("setuptools")
    tree, place = tmp_path / "tree", tmp_path / "venv"
    tree.mkdir()
    for name in ("coupling", "dem_liggghts", "mpm_fenicsx", "cases"):
        shutil.copytree(ROOT / name, tree / name, ignore=shutil.ignore_patterns("__pycache__", "*.so"))
    for path in (*ROOT.glob("*.py"), *ROOT.glob("*.toml"), ROOT / "README.md"):
        shutil.copy(path, tree)
    subprocess.run([sys._base_executable, "-m", "venv", "--system-site-packages", "--without-pip", place],
                   check=True)
    python = place / "bin/python"
    own = subprocess.run([python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))"], check=True,
                         capture_output=True, text=True).stdout.strip()
    here = sysconfig.get_path("purelib")  # with dolfinx, where that is a wheel
    Path(own, "neighbour.pth").write_text(here + "\n")
    subprocess.run([python, "-m", "pip", "--isolated", "install", "--no-index", "--no-deps",
                    "--no-build-isolation", "."], cwd=tree, check=True, capture_output=True, timeout=300)
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    tree.rename(tmp_path / "away")
    return lambda *words: call(words, elsewhere, [place / "bin/mpm-dem"])


@pytest.mark.validation
def test_the_project_works_without_its_source_tree(installed, tmp_path):
    listed = installed("cases")
    assert {line.split()[0] for line in listed.stdout.splitlines()} == CASES, listed

    told = installed("doctor")
    assert told.returncode == 0, told
    assert f"mpm-dem     in {tmp_path / 'venv'}" in told.stdout and "cases can run" in told.stdout

    ran = installed("run", "beam_impact", "t_end=4e-6", "dem=reference", "-mpm_snes_monitor")
    assert ran.returncode == 0 and "SNES Function norm" in ran.stdout, ran
    assert (tmp_path / "elsewhere/out/beam_impact/report.json").is_file()

    manual = installed("run", "extreme", "--help")  # imports the studies and references beside it
    assert manual.returncode == 0 and "mass_ratio=" in manual.stdout, manual
