"""Scenes in which points cross cells, small: what the linear basis does there, and that the tools work."""
import csv
import importlib
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from coupling.records.report import relative_l2
from references import vibrating_bar
from studies.crossing import table

ROOT = Path(__file__).parents[2]
BAR = dict(length=25.0, E=100.0, rho=1.0)


def scene(name):
    return importlib.import_module(f"studies.crossing.{name}").run


def test_bar_of_finite_elements_converges():
    """Second order in the element size; the energy stays; small swings have the period of Newmark's
    method."""
    fine = vibrating_bar.vibrate(**BAR, speed=0.75, dt=0.1, steps=200, elements=400)
    errors = [relative_l2(vibrating_bar.vibrate(**BAR, speed=0.75, dt=0.1, steps=200, elements=n).momentum,
                          fine.momentum) for n in (25, 50, 100)]
    assert np.log2(np.divide(errors[:-1], errors[1:])) == pytest.approx(2.0, abs=0.15)
    assert fine.energy == pytest.approx(0.25 * 25.0 * 0.75**2, rel=5e-5)
    small = vibrating_bar.vibrate(**BAR, speed=1e-3, dt=0.1, steps=400)
    omega = 2 * np.arctan(0.5 * 0.1 * 0.2 * np.pi) / 0.1
    assert vibrating_bar.period(0.1 * np.arange(1, 401), small.momentum) == pytest.approx(2 * np.pi / omega,
                                                                                          rel=2e-6)


def test_bar_of_material_points_is_that_of_elements_while_nothing_crosses():
    """On cells of 1 m a swing of 5 cm; the rest is the error of the cells, as of elements of their size."""
    found = scene("bar")(h=1.0, speed=0.03, periods=2)
    steps, fine = 200, vibrating_bar.vibrate(**BAR, speed=0.03, dt=0.1, steps=200)
    coarse = vibrating_bar.vibrate(**BAR, speed=0.03, dt=0.1, steps=steps, elements=25)
    assert found["history"] < 2 * relative_l2(coarse.momentum, fine.momentum)
    assert found["energy"] == pytest.approx(1.0, abs=2e-3)


PINNED = {  # scene → (arguments, numbers with the linear basis): what must not change unnoticed
    "bar": (dict(h=1.0, periods=2), dict(energy=0.648333, history=0.257957)),
    "step": (dict(h=1.0), dict(plateau=0.885838, spread=0.286122)),
    "flying_bar": (dict(h=1.0, swings=2), dict(stress=0.0739442, velocity=0.0276902)),
    "flyer": (dict(h=5e-3), dict(noise=0.128568, energy_change=0.245876)),
    "off_centre": (dict(h=5e-3), dict(force=0.0223268, u_beam=0.0581083))}


@pytest.mark.parametrize("name", PINNED)
def test_linear_basis(name):
    given, numbers = PINNED[name]
    found = scene(name)(**given)
    assert {key: found[key] for key in numbers} == pytest.approx(numbers, rel=1e-4)
    assert found["seconds"] > 0 and found["newton"] > 1


SMOOTH = [  # scene, arguments, numbers measured with a smooth basis, which the rim of the body touches little
    ("bar", dict(h=1.0, periods=2, basis="ugimp"), dict(energy=0.998144, history=0.00322671)),
    ("bar", dict(h=1.0, periods=2, basis="gimp"), dict(energy=0.999766, history=0.00269469)),
    ("bar", dict(h=1.0, periods=2, basis="gimp", transfer="tpic"),
     dict(energy=0.999942, history=0.000164987)),
    ("step", dict(h=1.0, basis="ugimp"), dict(plateau=0.981894, spread=0.0508239)),
    ("flying_bar", dict(h=1.0, swings=2, basis="ugimp"), dict(stress=0.0474265, velocity=0.0120446)),
    ("off_centre", dict(h=5e-3, basis="ugimp"), dict(force=0.00881362, u_beam=0.01588))]


@pytest.mark.parametrize("name, given, numbers", SMOOTH)
def test_smooth_basis(name, given, numbers):
    found = scene(name)(**given)
    for key, value in numbers.items():
        assert found[key] == pytest.approx(value, rel=5e-5 if key in ("energy", "plateau") else 0.02), key


def test_step_without_crossing_is_flat():
    found = scene("step")(cells=0.02)
    assert found["plateau"] == pytest.approx(1.0, abs=0.001) and found["spread"] < 0.005


RANKS = """
import importlib, json, sys
sys.path.insert(0, "cases")
from mpi4py import MPI
found = {name: importlib.import_module(f"studies.crossing.{name}").run(**given)
         for name, given in (("bar", dict(h=1.0, periods=0.5, basis="gimp")), ("step", dict(h=1.0)))}
if MPI.COMM_WORLD.rank == 0:
    print(json.dumps(found))
"""


@pytest.mark.mpi
@pytest.mark.validation
def test_three_ranks_find_what_one_finds(run_ranks, monkeypatch):
    monkeypatch.chdir(ROOT)
    one, three = (json.loads(run_ranks(n, "-c", RANKS).stdout.splitlines()[-1]) for n in (1, 3))
    for name in one:
        errors = [{k: v for k, v in found[name].items() if k not in table.COST} for found in (one, three)]
        assert errors[1] == pytest.approx(errors[0], rel=1e-5, nan_ok=True), name


def test_table_of_two_scenes(tmp_path, capsys, monkeypatch):
    for name, given in (("bar", dict(h=1.0, periods=1)), ("step", dict(h=1.0))):
        monkeypatch.setattr(importlib.import_module(f"studies.crossing.{name}"), "SWEEP", 2 * [given])
    page = tmp_path / "page.md"
    page.write_text("before\n<!-- crossing: made -->\nold\n<!-- end of crossing -->\nafter\n")
    assert table.main(["step", "bar", "basis=linear", f"out={tmp_path / 'out'}", f"into={page}"]) == 0
    text = page.read_text()
    assert text.startswith("before\n<!-- crossing: made -->\n\n**Step wave**") and text.endswith("after\n")
    assert text.count("| linear |") == 4 and "old" not in text
    assert (tmp_path / "page.png").stat().st_size > 1e4
    assert "bar linear h=1.0 periods=1: energy" in capsys.readouterr().out
    with open(tmp_path / "out/crossing.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    plateau, _ = (row for row in rows if row["given"] == "h=1.0" and row["name"] == "plateau")
    assert plateau["scene"] == "step" and float(plateau["value"]) == pytest.approx(0.885838, rel=1e-4)


def test_a_scene_that_fails_is_a_row_with_its_reason(monkeypatch):
    def fails(basis):
        raise ArithmeticError("Newton's method\nhas more to say")

    monkeypatch.setattr(importlib.import_module("studies.crossing.bar"), "run", fails)
    monkeypatch.delattr(importlib.import_module("studies.crossing.bar"), "SWEEP")
    (row,) = table.run("bar", "linear")
    assert row.failure == "Newton's method"
    assert "| linear | stopped: Newton's method |" in table.markdown([row])


def test_every_scene_can_be_run_by_the_table():
    for name in table.scenes():
        module = importlib.import_module(f"studies.crossing.{name}")
        assert module.__doc__ and callable(module.run), name


@pytest.mark.parametrize("words, message", [(["bra"], "choose one of"), (["h=1"], "unknown key 'h'")])
def test_wrong_words(words, message):
    done = subprocess.run([sys.executable, "-m", "coupling.crossing", *words], cwd=ROOT, capture_output=True,
                          text=True)
    assert done.returncode == 2 and message in done.stderr
