"""Scenes that begin, or end, in equilibrium without inertia, small; and settle as a key of a case."""
import csv
import importlib
import json
from pathlib import Path

import numpy as np
import pytest

from references import cantilever

ROOT = Path(__file__).parents[2]


def scene(name):
    return importlib.import_module(f"studies.crossing.{name}").run


def kinetic(folder):
    with open(folder / "history.csv", newline="") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    return max(float(row["kinetic"]) for row in rows)


def test_a_cohesive_column_stands_at_rest(column, tmp_path):
    """With the key it does; without, it sinks and swings."""
    keys = dict(cohesion=5e3, h=0.02, t_end=0.02)
    for settle in (0, 10):
        column.main(**keys, settle=settle, out=tmp_path / str(settle))
    report = json.loads((tmp_path / "10/report.json").read_text())
    assert report["parameters"]["settle"] == 10 and report["errors"]["speed"] < 0.02
    assert kinetic(tmp_path / "10") < 1e-3 * kinetic(tmp_path / "0")


def test_a_column_without_cohesion_has_no_equilibrium(column, tmp_path):
    with pytest.raises(ArithmeticError, match="there is no equilibrium without inertia"):
        column.main(h=0.02, settle=4, out=tmp_path)


PINNED = {"linear": 0.0366, "gimp": 0.0100}


@pytest.mark.parametrize("basis", PINNED)
def test_compaction_of_eight_cells(basis):
    """The column sinks by half; the stress of the weight is that of the undeformed column, whatever the
    law."""
    found = scene("compaction")(basis, cells=8)
    assert found["error"] == pytest.approx(PINNED[basis], rel=0.02)
    assert found["sinks"] == pytest.approx(26.0, abs=0.5) and found["newton"] < 2.6


def test_finite_elements_of_the_cantilever():
    """Two elements across, ten load steps; in small deflection they are Timoshenko's beam in plane strain, in
    large ones near the elastica, which knows no stretch and shear."""
    found = cantilever.finite_elements((20, 2), steps=10)
    assert (found.v[-1], found.u[-1]) == pytest.approx((8.20862, 5.50373), abs=2e-5)
    v, u = (cantilever.LENGTH * value for value in cantilever.elastica(10.0))
    assert found.v[-1] == pytest.approx(v, rel=0.02) and found.u[-1] == pytest.approx(u, rel=0.02)


@pytest.mark.parametrize("k, v, u", [(0.5, 0.1621, 0.0159), (2.0, 0.4935, 0.1606), (10.0, 0.8106, 0.5550)])
def test_elastica(k, v, u):
    """Its table."""
    assert cantilever.elastica(k) == pytest.approx((v, u), abs=6e-5)


def test_cantilever_of_coarse_cells():
    """To k = 10, where the linear basis comes apart on finer ones."""
    found = scene("cantilever")("ugimp", h=0.5, points=2)
    assert abs(found["error"]) < 0.01 and found["shortest"] == 1.0
    assert np.hypot(found["v"] - 8.2121, found["u"] - 5.507) < 0.13


RANKS = """
import json, sys
sys.path.insert(0, "cases")
from mpi4py import MPI
from studies.crossing import cantilever, compaction
found = [compaction.run("gimp", cells=8, load_steps=10),
         cantilever.run("ugimp", h=0.5, points=2, load_steps=10)]
if MPI.COMM_WORLD.rank == 0:
    print(json.dumps(found))
"""


@pytest.mark.mpi
@pytest.mark.validation
def test_three_ranks_find_what_one_finds(run_ranks, monkeypatch):
    monkeypatch.chdir(ROOT)
    runs = [run_ranks(n, "-c", RANKS) for n in (1, 3)]
    one, three = (json.loads(done.stdout.splitlines()[-1]) for done in runs)
    for a, b in zip(one, three):
        for name in {"error", "sinks", "v", "u"} & set(a):
            assert b[name] == pytest.approx(a[name], rel=1e-5), name
