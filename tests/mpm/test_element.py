"""The command ``python -m mpm_fenicsx.element``: keys, errors, what it leaves."""
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from mpm_fenicsx import element

ROOT = Path(__file__).parents[2]
SOIL = "law=mohr_coulomb E=50e6 nu=0.3 friction_angle=30 cohesion=1e3"
RUBBER = "law=neo_hooke E=1e6 nu=0.3"
PRESSED = "path=triaxial pressure=1e5 shortening=0.05 steps=20"
OWN = '''
from mpm_fenicsx import Stage, neo_hooke

def rubber(hardness: float):
    """Neo-Hookean, by its hardness."""
    return neo_hooke(1e4 * hardness, 0.49)

def pushed():
    return [Stage(stress={"yy": -1e9}, steps=10)]

def twist(turns: float = 1.0, steps: int = 5):
    return [Stage({"xz": turns}, steps=steps)]
'''


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """An empty one to work in."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def read(path):
    lines = [line for line in path.read_text().splitlines() if not line.startswith("#")]
    return dict(zip(lines[0].split(","), np.array([line.split(",") for line in lines[1:]], float).T))


def test_it_leaves_a_table_and_a_figure(folder, capsys):
    assert element.main(f"{SOIL} {PRESSED}".split()) == 0
    table, said = read(folder / "out/element/element.csv"), capsys.readouterr().out.splitlines()
    assert len(table["time"]) == 41 and table["s_xx"][-1] == pytest.approx(-1e5)
    assert {"plastic_strain", "plastic_xx", "q", "volume", "stage"} <= set(table)
    assert (folder / "out/element/element.png").read_bytes()[:4] == b"\x89PNG"
    assert said[0].startswith("largest q  e_yy = -0.0") and said[2].startswith("results in out/element")
    comments = [line for line in (folder / "out/element/element.csv").read_text().splitlines() if "#" in line]
    assert SOIL in comments[0] and "s_yy [Pa]" in comments[1] and "e_yy [-]" in comments[1]


def test_law_and_path_of_one_s_own(folder, capsys):
    (folder / "mine_of_this_test.py").write_text(OWN)
    words = "law=mine_of_this_test.py:rubber hardness=50 path=mine_of_this_test.py:twist turns=0.5 out=here"
    assert element.main(words.split()) == 0
    table = read(folder / "here/element.csv")
    assert table["s_xz"][-1] == pytest.approx(0.5 * 5e5 / 2.98) and len(table["time"]) == 6
    words_of_a_limit = ["law=linear", "E=1e6", "nu=0.3", "path=mine_of_this_test.py:pushed", "out=there"]
    assert element.main(words_of_a_limit) == 1
    assert "error: the path of linear ends at" in capsys.readouterr().err and not Path("there").exists()
    assert element.main([*words.split()[:1], "path=undrained", "--help"]) == 0
    shown = capsys.readouterr().out
    assert "rubber: Neo-Hookean, by its hardness." in shown and "hardness=…" in shown
    assert "pressure=…             of the cell at the start [Pa]" in shown


@pytest.mark.parametrize("words, status, said", [
    ("", 2, "law= is missing: choose one of linear, neo_hooke, "),
    (SOIL, 2, "path= is missing: choose one of isotropic, oedometer, triaxial, "),
    ("law=neo_hook path=triaxial", 2, "law=neo_hook does not exist (did you mean neo_hooke?): choose one of"),
    ("law=linear path=tri", 2, "path=tri does not exist: choose one of isotropic"),
    ("law=no.py:rubber path=triaxial", 1, "law is no.py: this file does not exist, look at its name"),
    (f"{RUBBER} path=triaxial", 2, "shortening= is missing: along the axis, logarithmic [-]"),
    (f"{RUBBER} {PRESSED} presure=1", 2, "unknown key 'presure' (did you mean pressure?); known keys: law, "),
    (f"{RUBBER} {PRESSED} steps=1.5", 2, "steps=1.5 repeats the key steps"),
    (f"{RUBBER} path=triaxial shortening=0.1 steps=1.5", 2, "steps=1.5 cannot be read as a whole number"),
    (f"{RUBBER} path=triaxial shortening=nan", 2, "shortening=nan cannot be read as a finite number"),
    (f"{RUBBER} path=triaxial shortening", 2, "'shortening' is not key=value"),
    (f"{RUBBER} path=oedometer shortening=30", 1, "strain yy is -30.0: give a number from -10.0 to 10.0"),
    ("law=linear E=1e6 nu=0.5 path=triaxial shortening=0.1", 1, "nu is 0.5: Poisson's ratio must lie")])
def test_errors_are_one_sentence(folder, capsys, words, status, said):
    assert element.main(words.split()) == status
    error = capsys.readouterr().err
    assert error.startswith(f"error: {said}") and error.count("\n") == 1
    assert not list(folder.iterdir())


def test_as_a_command(folder):
    done = subprocess.run([sys.executable, "-m", "mpm_fenicsx.element", *RUBBER.split(), "path=isotropic",
                           "pressure=1e4"], cwd=folder, env={"PYTHONPATH": str(ROOT), "HOME": str(folder),
                                                             "PATH": "/usr/bin:/bin"}, capture_output=True,
                          text=True, timeout=120)
    assert done.returncode == 0 and done.stderr == "" and done.stdout.count("\n") == 3, done.stderr


def test_in_the_plane(folder, capsys):
    words = f"{SOIL} path=plane_strain pressure=1e5 shortening=0.02 steps=20 dimensions=2"
    assert element.main(words.split()) == 0
    table = read(folder / "out/element/element.csv")
    assert "s_yz" not in table and table["s_zz"][-1] < -1e5 and table["e_zz"][-1] == table["e_zz"][20]
    assert element.main([*words.split()[:-1], "dimensions=1"]) == 1
    assert capsys.readouterr().err.splitlines()[-1] == "error: dimensions is 1: choose one of 2, 3"


def test_on_two_ranks_one_writes(folder, run_ranks):
    """Law and path are made on all, what is said and written comes from the first."""
    words = [*f"{RUBBER} path=isotropic pressure=1e4 steps=3".split(), "out=here"]
    code = ("import sys; from mpi4py import MPI; from mpm_fenicsx import element; element.draw_table = "
            "lambda *_: print('drawn by', MPI.COMM_WORLD.rank); status = element.main(sys.argv[1:]); "
            "assert element.main(['law=none']) == 2 and status == 0")
    done = run_ranks(2, "-c", code, *words)
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("drawn by") == 1 and "drawn by 0" in done.stdout
    assert done.stdout.count("results in here") == 1 and done.stderr.count("error: path= is missing") == 1
