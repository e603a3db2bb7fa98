"""PETSc's options that a user gave: known wherever they come from, and refused where they make no sense."""
import subprocess
import sys
import warnings
from pathlib import Path

import pytest
from petsc4py import PETSc

from mpm_fenicsx.command_line import words
from mpm_fenicsx.solve import options

ROOT = Path(__file__).parents[2]


@pytest.fixture
def give():
    """``give(name, text)``: an option with our prefix; taken back at the end."""
    given = []

    def put(name, text):
        given.append(name)
        PETSc.Options(options.PREFIX)[name] = text

    yield put
    for name in given:
        PETSc.Options(options.PREFIX).delValue(name)


@pytest.mark.parametrize("name", ["snes_rtol", "snes_stol", "ksp_rtol", "snes_atol", "ksp_atol"])
@pytest.mark.parametrize("text", ["nan", "-1", "inf", "none", "1_0"])
def test_tolerances_that_make_no_sense_are_refused(give, name, text):
    give(name, text)
    with pytest.raises(ValueError, match=f"^-mpm_{name} is {text}.*: give a number .* 0.*, or leave the "
                       "option out$"):
        options.check()


@pytest.mark.parametrize("name", ["snes_rtol", "snes_stol", "ksp_rtol"])
def test_a_tolerance_that_accepts_everything_is_refused(give, name):
    for text in ("1", "1e30"):
        give(name, text)
        with pytest.raises(ValueError, match=f"^-mpm_{name} is {text}, which accepts everything: give"):
            options.check()
    for text in ("0", "1e-8", "0.5"):
        give(name, text)
        options.check()


@pytest.mark.parametrize("name, text", [("snes_type", "ksponly"), ("snes_convergence_test", "skip")])
def test_solvers_that_check_nothing_are_warned_of(give, name, text):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        options.check()
    give(name, text)
    with pytest.warns(UserWarning, match=f"-mpm_{name} {text}: no step is checked"):
        options.check()


def test_a_step_that_is_not_solved_is_warned_of_once(give):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        options.Doubt()(1.0, 1.0, "step 1")  # the user has decided nothing
        give("snes_atol", "1e3")
        doubt = options.Doubt()
        doubt(1e-3, 1.0, "step 1")
    with pytest.warns(UserWarning, match="step 2 was accepted with a residual of 1 N, 3.3e-01 of loads "
                      "and inertia, 3 N.*, correct -mpm_snes_a"):
        doubt(1.0, 3.0, "step 2")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        doubt(1.0, 1.0, "step 3")


def test_options_are_known_wherever_they_come_from(tmp_path):
    """Those that somebody asked for, and those that nobody did, without what the program itself puts in."""
    (tmp_path / ".petscrc").write_text("-mpm_snes_stol 1e-20\n-mpm_nonsense 3\n-other 4\n")
    code = """
import os
from mpm_fenicsx.command_line import words
from mpm_fenicsx.solve import options
from petsc4py import PETSc
options.solvers._default(PETSc.Options("mpm_"), pc_hypre_type="boomeramg")
snes = PETSc.SNES().create()
snes.setOptionsPrefix("mpm_")
snes.setFromOptions()
print(options.used(), options.unused(), sep=";")
"""
    env = {"PETSC_OPTIONS": "-mpm_snes_rtol 1e-9", "PYTHONPATH": str(ROOT), "HOME": str(tmp_path),
           "PATH": "/usr/bin"}
    done = subprocess.run([sys.executable, "-c", code, "-mpm_snes_max_it", "7", "-mpm_typo", "1"],
                          cwd=tmp_path, env=env, capture_output=True, text=True, timeout=60)
    used, unused = map(eval, done.stdout.split(";"))
    assert used == {"-mpm_snes_stol": "1e-20", "-mpm_snes_rtol": "1e-9", "-mpm_snes_max_it": "7"}, done.stderr
    assert unused == ["-mpm_typo", "-mpm_nonsense"]


def test_the_words_of_a_notebooks_kernel_are_not_ours(monkeypatch):
    kernel = ["ipykernel_launcher.py", "-f", "kernel.json"]
    monkeypatch.setattr(sys, "argv", kernel)
    assert options.unused() == ["-f"] and words() == kernel
    monkeypatch.setitem(sys.modules, "ipykernel", object())
    assert options.unused() == [] and words() == kernel[:1]
