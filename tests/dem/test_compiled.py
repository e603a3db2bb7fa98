"""Kernels that numba keeps on disk are found again only as long as all sources are the same."""
import os
import shutil
import subprocess
import sys
from pathlib import Path

import dem_liggghts

CODE = "from dem_liggghts.reference import verlet; print(verlet.__file__, verlet.run.py_func.__qualname__)"


def test_an_edit_of_any_file_gives_the_kernels_other_names(tmp_path):
    copy = shutil.copytree(Path(dem_liggghts.__file__).parent, tmp_path / "dem_liggghts")
    names = []
    for edit in ("", "", "# another contact\n"):
        with open(copy / "contact" / "law.py", "a") as file:
            file.write(edit)
        done = subprocess.run([sys.executable, "-c", CODE], cwd=tmp_path, capture_output=True, text=True,
                              check=True, env={**os.environ, "PYTHONPATH": str(tmp_path)})
        place, name = done.stdout.split()
        assert Path(place) == copy / "reference" / "verlet.py" and name.startswith("run_")
        names.append(name)
    assert names[0] == names[1] != names[2]
