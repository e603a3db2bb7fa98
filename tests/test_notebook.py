"""The notebook of the documentation runs from its first cell to its last, and its results are right."""
import importlib.util
import os
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
NOTEBOOK = ROOT / "docs/plane_scene.ipynb"
JUPYTER = all(importlib.util.find_spec(name) for name in ("nbclient", "ipykernel"))
RUN = """
import sys
from pathlib import Path
sys.path.append("docs/site")
import notebook
path, folder = map(Path, sys.argv[1:])
if {jupyter}:
    done = notebook.run(path, folder)
    _, files = notebook.page(done, path.stem)
    assert len(files) == 2 and all(data.startswith(b"\\x89PNG") for data in files.values()), list(files)
    print(notebook.printed(done))
else:
    path = path.resolve()
    print(notebook.run_plainly(path))
"""


def load():
    spec = importlib.util.spec_from_file_location("notebook", ROOT / "docs/site/notebook.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_it_runs_from_its_first_cell_to_its_last(tmp_path):
    """In a kernel of Jupyter where the extra ``docs`` is installed, as in CI after ``./dev docs``, else its
    cells in plain Python."""
    env = {**os.environ, "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"}
    if not JUPYTER:
        env["MPLBACKEND"] = "agg"
    code = RUN.format(jupyter=JUPYTER).replace("docs/site", str(ROOT / "docs/site"))
    done = subprocess.run([sys.executable, "-c", code, NOTEBOOK, tmp_path], cwd=tmp_path, env=env,
                          capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    assert "UserWarning" not in done.stdout + done.stderr
    assert "plane_scene: 288 points, 500 windows of 40 DEM steps" in done.stdout
    sand, rocks = map(float, re.search(r"sand (\S+) N s, rocks (\S+) N s", done.stdout).groups())
    assert 0.02 < sand < 0.6 and 0.3 < rocks < 2.0
    assert float(re.search(r"books miss, relative: (\S+)", done.stdout).group(1)) < 1e-10
    assert (tmp_path / "out/plane_scene/history.csv").is_file()


def test_it_is_stored_without_outputs():
    found = load().cells(NOTEBOOK)
    code = [cell for cell in found if cell["cell_type"] == "code"]
    assert len(code) > 5 and not any(cell["outputs"] or cell["execution_count"] for cell in code)
    drawn = [cell for cell in code if "plt.show()" in cell["source"]]
    assert drawn and all(len(cell["metadata"]["alt"].split()) > 3 for cell in drawn)
