"""What a user can get wrong, through the real command line: one clear sentence, exit status, readable
files."""
import contextlib
import json
import os
import select
import signal
import subprocess
import sys
import time
import warnings
from pathlib import Path

import pytest

from coupling import cli
from coupling.records.history import read

ROOT = Path(__file__).parents[2]


@pytest.fixture
def call(case, words, monkeypatch, capsys):
    """``call("key=value …")`` runs the script's last line in this process; returns exit status, stdout and
    stderr."""
    # run() replaces it: put it back afterwards
    monkeypatch.setattr(warnings, "showwarning", warnings.showwarning)

    def begin(more):
        monkeypatch.setattr(sys, "argv", ["beam_impact.py", *words(more)])
        status = 0
        with warnings.catch_warnings():
            warnings.simplefilter("always", UserWarning)
            try:
                cli.run(case.main)
            except SystemExit as end:
                status = end.code
        return (status, *capsys.readouterr())

    return begin


def start(*words, stderr=subprocess.PIPE, **keys):
    """The script as a process of its own."""
    env = {**os.environ, "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"}
    return subprocess.Popen([sys.executable, ROOT / "cases/beam_impact.py", *words], stdout=subprocess.PIPE,
                            stderr=stderr, env=env, text=True, **keys)


def script(*words):
    """The script as a process of its own that ended."""
    process = start(*words)
    out, err = process.communicate(timeout=60)
    return subprocess.CompletedProcess(words, process.returncode, out, err)


@pytest.mark.parametrize("given, status, sentence",
                         [("raduis=1", 2, "unknown key 'raduis' (did you mean "
                           "radius?); known keys: dim, length, height, width, " "E, nu, rho, h, "),
                          ("dt=fast", 2, "dt=fast cannot be read as a finite number"),
                          ("dem=lammps", 2, "dem=lammps does " "not exist: choose " "one of reference, "
                           "liggghts, compare"), ("dt=0", 1, "dt is 0.0 s: "),
                          ("dt=-1e-6", 1, "dt is -1e-06 s: "),
                          ("t_end=0.0002003", 1, "t_end is 0.0002003 s, which is not a "
                           "multiple of dt = 4e-06 s: take " "t_end=0.0002"),
                          ("t_end=-1e-4", 1, "t_end is -0.0001 s: it " "must lie after the start"),
                          ("substeps=0", 1, "substeps is 0: "), ("nu=0.5", 1, "nu is 0.5: give"),
                          ("nu=-1.2", 1, "nu is -1.2: give"),
                          ("radius=-0.01", 1, "radius is -0.01: it must be a positive"),
                          ("rho=-1", 1, "rho is -1.0: it " "must be a " "positive"),
                          ("E=0", 1, "E is 0.0: it must " "be a positive"),
                          ("length=-1", 1, "length is -1.0: it must be a " "positive"),
                          ("v0=0", 1, "v0 is 0.0: it " "must be a " "positive"),
                          ("cells=0,13", 1, "cells of the grid is " "(0, 13): give 2 whole "
                           "numbers, each at least 1"), ("body=4,-2", 1, "body (its cells) is (4, -2): "),
                          ("segments=0", 1, "segments is 0: "),
                          ("wall_segments=-1", 1, "wall_segments is -1: "),
                          ("points=7", 1, "points is 7: choose one of " "1, 2, 3, 4, 5, 6 (per "
                           "direction)"), ("dim=4", 2, "dim=4 does not exist: choose one of 2, 3"),
                          ("cells=31,x", 2, "cells=31,x cannot be read as numbers "),
                          ("dim=3", 1, "cells of the grid " "is (31, 7): give 3 " "whole numbers, "
                           "each at least 1"), ("dim=3 cells=31,7,4", 1, "body (its cells) is (60, 4): give "
                                                "3 whole numbers, each at least 1"),
                          ("dim=3 cells=31,7,4 body=60,4,4", 1, "segments is (30,): give 2 whole numbers, "
                           "each at least 1"), ("dim=3 cells=31,7,4 cell=triangle", 1,
                                                "cell of the grid is 'triangle': choose one of hexahedron, "
                                                "tetrahedron"),
                          ("cell=tetrahedron", 1, "cell of the grid is 'tetrahedron': "
                           "choose one of quadrilateral, triangle"),
                          ("segments=30,4", 1, "segments is (30, 4): give one whole " "number of at least 1"),
                          ("cell=triangle points=4", 1, "points is 4: choose one of 1, 3, 6, 7, 12 (per "
                           "triangle)"), ("gap=-1e-4", 1, "gap is -0.0001 m: give 0 or a positive number"),
                          ("shift=-1e-3", 1, "shift is -0.001 m: "),
                          ("shift=0.02", 1, "shift is 0.02 m: it must lie between"),
                          ("h=-1e-3", 1, "h is -0.001 m: the " "cell size must lie " "between 0 and the "
                           "beam's height"), ("h=0", 1, "h is 0.0 m: "), ("h=0.02", 1, "h is 0.02 m: "),
                          ("restitution=-0.1", 1, "restitution is -0.1: give a value from 0 to 1"),
                          ("friction=-0.1", 1, "friction is -0.1: "),
                          ("rebalance=0.5", 1, "rebalance is 0.5: an imbalance is " "never below 1"),
                          ("paraview=-1", 1, "paraview is -1: "),
                          ("rho_sphere=0", 1, "rho_sphere is 0.0 kg/m^3: give a " "positive"),
                          ("iterate=-1", 1, "iterate is -1: give the most repetitions of a window, or 0 for "
                           "weak coupling"), ("iterate=1 tol=0", 1, "tol is 0.0: give a part of the force "
                                              "between 0 and 1"), ("adapt=-1", 1, "adapt is -1.0: "),
                          ("relax=newton", 2, "relax=newton does not exist: choose one of aitken, constant, "
                           "iqn"), ("adapt=often", 2, "adapt=often cannot be read as a finite number"),
                          ("iterate=1 tol=1e-8", 1, "the coupling did not converge in window 1, which ends "
                           "at t = "), ("out=/dev/null/x", 1, "out=/dev/null/x cannot be written (Not a "
                                        "directory): choose another folder"),
                          ("out=/dev/null", 1, "out=/dev/null cannot be " "written (File exists): "
                           "choose another folder"),])
def test_one_sentence_and_a_status(call, given, status, sentence):
    code, out, err = call(given)
    assert code == status and err.startswith(f"error: {sentence}") and err.count("\n") == 1 and out.count(
        "\n") == ("window 1," in sentence), err


def test_missing_liggghts_names_the_package(call, monkeypatch, tmp_path):
    backend = pytest.importorskip("dem_liggghts.liggghts.backend")
    monkeypatch.setattr(backend, "SHIM", tmp_path / "nowhere.so")
    code, _, err = call("dem=liggghts")
    assert code == 1 and err.count("\n") == 1 and err.startswith("error: LIGGGHTS is not available: install "
                                                                 "it with")
    assert "dem=reference" in err and call("dem=reference")[0] == 0


def test_dem_step_too_long_is_one_line(call):
    """The limit for this sphere is 2.1e-6 s."""
    code, _, err = call("substeps=1 t_end=4e-6")
    assert code == 0 and err.count("\n") == 1
    assert err.startswith("warning: DEM time step 4e-06 s exceeds the limit 2.1e-06 s (Rayleigh 2.1e-06 s, "
                          "Hertz ")


def test_supports_that_hold_nothing_are_named(call):
    """One material point in the middle of the beam, far from its ends and from the interface."""
    code, _, err = call("body=1,1 points=1")
    assert code == 1 and err.splitlines()[-1].startswith("error: boundary particle 0 at x = ")
    assert "warning: support of the left end (fix 'y') holds no grid node of the body at t = 0 s" in err


@pytest.mark.parametrize("failure", ["force", "disk"])
def test_files_so_far_are_readable_after_an_error(call, case, monkeypatch, tmp_path, failure):
    """In the eleventh window a number gets lost, or the disk is full."""
    opened = case.Scene.open

    def failing(*arguments):
        grains = opened(*arguments)
        advance, calls = grains.advance, []

        def fails_later(*window):
            calls.append(window)
            if len(calls) < 11:
                return advance(*window)
            if failure == "disk":
                raise OSError(28, "No space left on device")
            return advance(*window) * float("nan")

        grains.advance = fails_later
        return grains

    monkeypatch.setattr(case.Scene, "open", failing)
    code, out, err = call("paraview=5")
    report = json.loads((tmp_path / "report.json").read_text())
    assert code == 1 and out.count("\n") == 1 and err.count("\n") == 1
    if failure == "force":
        assert err.startswith("error: the force on the wall is not a finite number in window 11, which ends "
                              "at t = ")
        assert report["error"].startswith("FloatingPointError: the force on the wall")
    else:
        assert "No space left on device" in err and "No space left" in report["error"]
    assert read(tmp_path / "history.csv")["time"] == pytest.approx([4e-6 * n for n in range(1, 11)])
    assert report["windows"] == 10 and report["window_ms"]["median"] > 0
    assert (tmp_path / "points.pvd").read_text().endswith("</VTKFile>\n")


def test_interrupted_run_leaves_what_it_had(words, tmp_path):
    process = start(*words("dt=5e-9 substeps=1"),  # even where the tests run with interrupts turned off
                    preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler))
    history = tmp_path / "history.csv"
    while process.poll() is None and not (history.exists() and "\n5e-09," in history.read_text()):
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=60)
    assert process.returncode == 130 and err.count("\n") == 1 and err.startswith("error: interrupted; ")
    assert out.startswith("cells of ") and out.count("\n") == 1
    report = json.loads((tmp_path / "report.json").read_text())
    assert report["error"].startswith("KeyboardInterrupt") and report["windows"] == len(
        read(history)["time"]) > 0


def test_option_that_diverges_and_option_that_nobody_used(words, tmp_path):
    done = script(*words("-mpm_snes_max_it 1 -mpm_snes_atol 0 -mpm_snes_rtol 1e-15"))
    assert done.returncode == 1 and done.stdout.count("\n") == 1 and done.stderr.count("\n") == 1, done.stderr
    assert done.stderr.startswith(
        "error: Newton's method diverged in step 1, t = "), "with the shortest window"
    assert ("new tangents, a start from rest, full Newton steps did not help: too many iterations, try "
            in done.stderr)
    assert ("; tried before: the ghost penalty on inertia, the ghost penalty on stiffness, windows down to "
            in done.stderr)
    assert json.loads((tmp_path / "report.json").read_text())["error"].startswith("MPMDivergedError: ")
    assert len(read(tmp_path / "history.csv")["time"]) == 0
    done = script(*words("-mpm_snes_rtoll 1 t_end=4e-6"))
    assert done.returncode == 0 and done.stdout.count("\n") == 6
    assert done.stderr == "warning: nobody used the option -mpm_snes_rtoll: is it spelt right?\n"


def test_an_option_that_petsc_cannot_take_is_one_sentence(words):
    done = script(*words("-mpm_pc_type foo t_end=4e-6"))
    assert done.returncode == 1 and done.stderr.count("\n") == 1
    assert done.stderr.startswith("error: PETSc cannot take the options -mpm_… (Unable to find requested PC "
                                  "type foo)")


def test_help_is_the_manual():
    done = script("--help")
    lines = [" ".join(line.split()) for line in done.stdout.splitlines()]
    assert done.returncode == 0 and done.stderr == ""
    for line in ("dt=2e-06 window, MPM step [s]; none: what contacts and motion bear",
                 "h=0.002 size of the background cells, of which columns stand at the beam's ends [m]",
                 "dem=reference back end; compare runs both; one of reference, liggghts, compare",
                 "preset=paper cells=62,13 body=120,8 points=4 segments=60 dt=5e-08 substeps=1 t_end=0.0004"):
        assert line in lines


def test_every_key_has_a_meaning(case):
    for line in cli.manual(case.main).split("keys (key=value)")[1].splitlines()[1:-2]:
        assert len(line.split(maxsplit=1)) == 2, line


def test_progress_bar_is_for_terminals_only(words):
    """Simulated time and time to go; that a pipe gets nothing is seen wherever ``script`` shows what it
    got."""
    pty, fcntl, termios, struct = (pytest.importorskip(name) for name in ("pty", "fcntl", "termios",
                                                                          "struct"))
    primary, secondary = pty.openpty()
    fcntl.ioctl(secondary, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 100, 0, 0))
    process, shown = start(*words("dt=5e-7 substeps=10"), stderr=secondary), b""
    os.close(secondary)
    with contextlib.suppress(OSError):  # as soon as nobody writes any more
        while select.select([primary], [], [], 60.0)[0]:  # a slow run writes more than a terminal keeps
            shown += os.read(primary, 4096)
    os.close(primary)
    out, shown = process.communicate(timeout=60)[0], shown.decode(errors="replace")
    assert process.returncode == 0 and out.count("\n") == 6
    assert "t = 1." in shown and "e-04 s" in shown and "to go" in shown and "%|" in shown
