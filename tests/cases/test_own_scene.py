"""The scene of one's own that the README shows: it needs the packages alone, few lines, and an empty
folder."""
import ast
import json
import os
import subprocess
import sys
from pathlib import Path

from coupling.records.history import read

ROOT = Path(__file__).parents[2]
SCENE = ROOT / "docs/own_scene.py"


def lines_of_code(text):
    """Number of lines besides imports, docstrings and blank ones, and the packages that are imported."""
    without, packages = set(), set()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, (ast.Import, ast.ImportFrom)):
            without |= set(range(node.lineno, node.end_lineno + 1))
            packages |= {node.module} if isinstance(node, ast.ImportFrom) else {name.name
                                                                                for name in node.names}
        elif isinstance(node, (ast.Module, ast.FunctionDef)) and ast.get_docstring(node):
            without |= set(range(node.body[0].lineno, node.body[0].end_lineno + 1))
    return sum(bool(line.strip()) and n not in without for n, line in enumerate(text.splitlines(),
                                                                                1)), packages


def test_it_is_short_and_needs_the_packages_alone():
    count, packages = lines_of_code(SCENE.read_text())
    assert count <= 30 and packages <= {"numpy", "coupling", "dem_liggghts", "mpm_fenicsx"}


def test_it_runs_in_an_empty_folder(tmp_path):
    """Until the soil has reached the rocks and pushes them along."""
    script = tmp_path / "scene.py"
    script.write_text(SCENE.read_text())
    env = {**os.environ, "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"}
    done = subprocess.run([sys.executable, script, "t_end=0.22", "animation=55"], cwd=tmp_path, env=env,
                          capture_output=True, text=True, timeout=300)
    assert done.returncode == 0 and done.stderr == "" and done.stdout.count("\n") == 6, done.stderr
    out = tmp_path / "out/own_scene"
    assert {path.name for path in out.iterdir()} == {"history.csv", "report.json", "manifest.txt",
                                                     "own_scene_flow.gif"}
    history, report = read(out / "history.csv"), json.loads((out / "report.json").read_text())
    assert history["front"][0] == 0.18 < 0.185 < history["front"][-1] < 0.25 and history["push"].max() > 0.5
    assert report["windows"] == 110 and report["parameters"]["h"] == 0.025 and report["parameters"][
        "phi"] == 30.0
    shown = subprocess.run([sys.executable, script, "--help"], env=env, capture_output=True, text=True,
                           timeout=60).stdout
    lines = [" ".join(line.split()) for line in shown.splitlines()]
    assert lines[0] == "How far soil that collapses carries rocks, and with which force."
    assert "radius=0.01 of the rocks [m]" in lines
    assert "dt=0.002 window, MPM step [s]; none: what contacts and motion bear" in lines
