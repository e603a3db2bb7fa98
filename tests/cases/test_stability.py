"""The stability matrix as a tool: a case that does what its keys say, and two rows of the real one."""
import csv
from pathlib import Path

import pytest

from coupling import cli
from coupling.keys import refuse_without_effect
from coupling.ledger import exchange
from studies import extreme_keys, stability, sweep

MATRIX = Path(__file__).parents[2] / "cases/studies/matrix.py"
CASE = '''
import json, os, sys, time
keys = dict(word.split("=", 1) for word in sys.argv[1:])
kind = keys.get("kind", "ok")
if kind == "refused":
    sys.exit(print("error: kind is refused: take another one", file=sys.stderr) or 1)
if kind == "bug":
    sys.exit(print("Traceback\\nerror: this is a bug in the program: please report", file=sys.stderr) or 1)
if kind == "crash":
    os.abort()
if kind == "silent":
    sys.exit(3)
if kind == "hang":
    import signal
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    time.sleep(60)
errors = {"energy_gain": float(keys.get("gain", "0")), "force": float(keys["force"])}
json.dump({"wall_s": 1.0, "startup_s": 0.5, "window_s": 0.5, "peak_mb": [1.0], "errors": errors},
          open(os.path.join(keys["out"], "report.json"), "w"))
'''
ROWS = [("made", "good", "force=0.01", "right", {"force": 0.02}, "it is made so"),
        ("made", "coarse", "force=0.03", "right", {"force": 0.02}, "it is made so"),
        ("made", "refused", "kind=refused", "stopped", {}, "it is made so"),
        ("wrong", "gains", "force=0.01 gain=0.06", "right", {"force": 0.02}, "it is made so"),
        ("wrong", "allowed", "force=0.01 gain=0.06", "right", {"force": 0.02, "energy_gain": 0.1},
         "it is made so"), ("wrong", "nan", "force=nan", "right", {"force": 0.02}, "it is made so"),
        ("wrong", "bug", "kind=bug", "stopped", {}, "it is made so"), ("wrong", "crash", "kind=crash",
                                                                       "stopped", {}, "it is made so"),
        ("wrong", "silent", "kind=silent", "stopped", {}, "it is made so"), ("wrong", "other", "force=0.01",
                                                                             "right", {"moment": 0.02},
                                                                             "it is made so"),
        ("hang", "hangs", "kind=hang", "right", {"force": 0.02}, "it is made so")]
FOUND = dict(good="right", coarse="inaccurate", refused="stopped", gains="wrong", allowed="right",
             nan="wrong", bug="wrong", crash="wrong", silent="wrong", other="wrong", hangs="wrong")


@pytest.fixture
def matrix(tmp_path):
    """``matrix(rows)``: words for a matrix of these rows, results in ``tmp_path``."""
    def make(rows):
        (tmp_path / "case.py").write_text(CASE)
        (tmp_path / "rows.py").write_text(f"CASE = 'case.py'\nROWS = {rows!r}\n")
        return [f"matrix={tmp_path / 'rows.py'}", f"out={tmp_path / 'out'}", "jobs=2"]

    return make


def table(folder):
    with open(folder / "out" / "stability.csv", newline="") as file:
        return {row["row"]: row for row in csv.DictReader(file)}


def test_every_run_gets_its_class(matrix, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(sweep, "PATIENCE", 0.2)
    assert stability.main([*matrix(ROWS), "timeout=2"]) == 1
    found = table(tmp_path)
    assert {name: row["found"] for name, row in found.items()} == FOUND
    assert found["coarse"]["measure"] == "force" and float(found["coarse"]["error"]) == 0.03
    assert found["refused"]["says"] == "kind is refused: take another one"
    assert found["hangs"]["says"] == "stopped after 2 s"
    assert "moment" in found["other"]["says"] and found["crash"]["says"] == "killed by SIGABRT"
    assert "2 right, 1 inaccurate, 1 stopped, 7 wrong; 8 not as expected" in capsys.readouterr().out
    assert "**inaccurate**" in (tmp_path / "out" / "stability.md").read_text()
    assert (tmp_path / "out" / "stability.png").stat().st_size > 1e4


def test_goes_on_and_takes_names(matrix, tmp_path):
    words = matrix(ROWS)
    assert stability.main([*words, "made", "allowed"]) == 0
    (tmp_path / "case.py").write_text("raise SystemExit(5)")  # what is finished is not run again
    assert stability.main([*words, "made"]) == 0 and list(table(tmp_path)) == ["good", "coarse", "refused"]


@pytest.mark.parametrize("rows, words, message",
                         [(ROWS, ["goood"], "no row or group 'goood': did you mean " "good"),
                          (ROWS, ["job=2"], "unknown key 'job'"), (ROWS, ["jobs=0"], "jobs is 0"),
                          ([ROWS[0], ROWS[0]], [], "two rows of one name"),
                          ([("a", "b", "force=1", "wrong", {"force": 1}, "why")], [], "expects 'wrong'"),
                          ([("a", "b", "force=1", "right", {}, "why")], [], "no bound"),
                          ([("a", "b", "force=1", "right", {"force": 1}, "")], [], "why"),
                          (ROWS, ["jobs=1", "jobs=2"], "jobs=2 repeats the key jobs: give it once"),
                          ([("a", "b")], [], "row 1 of the matrix is .'a', 'b'.: give a tuple of 6, group, "
                           "name, words"), ([("a", "b", "force=1", "right", 1.0, "why")], [],
                                            "of which bounds is a dictionary"), ([3], [], "row 1 .* is 3"),
                          (3, [], "cannot be read .TypeError: .*: give a Python file with CASE"),
                          ([("a", "../b", "force=1", "right", {"force": 1}, "why")], [],
                           "called '../b', which is to be the name of a folder"),
                          ([("a", "..", "force=1", "right", {"force": 1}, "why")], [], "called '..'"),
                          ([("a", "b", "force=1", "right", {"force": -1}, "why")], [],
                           "bound of force in row b is -1: give a positive")])
def test_bad_input(matrix, rows, words, message):
    with pytest.raises(cli.UsageError, match=message):
        stability.main([*matrix(rows)[:2], *words])


def test_the_matrix_itself():
    """Enough rows, each with its reason; three of them run, one of which is refused."""
    case, rows = stability.read(MATRIX)
    assert case.is_file() and len(rows) >= 60
    assert {row.group for row in rows if "dem=liggghts" in row.words} > {"mass", "rest", "units", "contact"}


def test_every_row_is_a_command_line(extreme):
    """No key twice, none without effect in its scene."""
    keys = extreme.main.keys
    for row in stability.read(MATRIX)[1]:
        values = {**{name: key.default for name, key in keys.items()},
                  **cli.parse(extreme.main, row.words.split())}
        refuse_without_effect(values, keys, extreme_keys.COUNTS)
        extreme_keys.check_keys(values)


def test_rows_of_the_matrix(tmp_path):
    assert stability.main(["restitution_0.05", "far_from_points", "beam_1e3_weak", f"out={tmp_path}",
                           "jobs=3"]) == 0
    with open(tmp_path / "stability.csv", newline="") as file:
        right, *stopped = csv.DictReader(file)
    assert (right["row"], right["found"]) == ("beam_1e3_weak", "stopped") and "iterate=20" in right["says"]
    assert [(row["row"], row["found"]) for row in stopped] == [("restitution_0.05", "right"),
                                                               ("far_from_points", "stopped")]


def test_a_closed_system_that_gains_energy_is_stopped():
    exchange.check_closed({"interface_error": 0.2, "energy_error": -0.9}, 1.0)
    exchange.check_closed({"interface_error": 0.0, "energy_error": 0.5}, 1.0, share=0.1)  # it lies still
    for made in ({"interface_error": 0.3, "energy_error": 0.1},
                 {"interface_error": 0.0, "energy_error": 0.3}):
        with pytest.raises(exchange.UnstableError, match="gained energy until t = 2 s, .*30%.*iterate=20"):
            exchange.check_closed(made, 2.0)
