"""A user without rights: a source tree that he cannot write, no home, an output folder that is not his."""
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
NOBODY = 65534
CODE = """
import os, coupling, dem_liggghts, mpm_fenicsx, numba, numpy, warnings
from coupling import Run
from coupling.pictures.figure import pyplot
from dem_liggghts.reference.rigid import turn_axes
turn_axes(numpy.array([1.0, 0.0, 0.0, 0.0]), numpy.empty((3, 3)))  # compiles
pyplot()
print(sum(turn_axes.stats.cache_hits.values()), numba.config.CACHE_DIR)
"""


@pytest.fixture
def unprivileged():
    """``unprivileged(words)``: a Python process of a user without rights and home, in a copy of the sources
    that he cannot write, with a folder for temporary files that he can."""
    place = Path(tempfile.mkdtemp())  # those of pytest are closed to others
    place.chmod(0o755)
    for name in ("coupling", "dem_liggghts", "mpm_fenicsx", "cases"):
        shutil.copytree(ROOT / name, place / name, ignore=shutil.ignore_patterns("__pycache__"))
    for leaf in ROOT.glob("mpm_dem_*.py"):
        shutil.copy(leaf, place)
    (place / "tmp").mkdir()
    (place / "tmp").chmod(0o777)
    folders = [place, *(path for path in place.rglob("*") if path.is_dir() and path.name != "tmp")]
    for folder in folders:
        folder.chmod(0o555)
    become = ["setpriv", f"--reuid={NOBODY}", f"--regid={NOBODY}",
              "--clear-groups"] if os.getuid() == 0 else []

    def run(*words):
        env = {"PATH": "/usr/bin:/bin", "HOME": "/nonexistent", "TMPDIR": str(place / "tmp"),
               "OMP_NUM_THREADS": "1", "PYTHONPATH": str(place)}
        return subprocess.run([*become, os.path.realpath(sys.executable), *map(str, words)], cwd=place,
                              env=env, capture_output=True, text=True, timeout=120)

    if run("-c", "").returncode:
        pytest.skip(f"{sys.executable} is not for other users")
    yield run
    for folder in folders:
        folder.chmod(0o755)
    shutil.rmtree(place)


def test_kernels_are_kept_among_the_temporary_files(unprivileged):
    """And found again by the next process, which else would compile for half a minute."""
    for hits in (0, 1):
        done = unprivileged("-c", CODE)
        assert done.returncode == 0 and done.stderr == "", done.stderr
        count, folder = done.stdout.split()
        uid = NOBODY if os.getuid() == 0 else os.getuid()
        assert int(count) == hits and Path(folder).name == f"mpm-dem-{uid}"


def test_a_folder_that_somebody_else_has_prepared_is_not_used(monkeypatch, tmp_path):
    """What lies in it would be run."""
    import mpm_dem_cache

    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    own = mpm_dem_cache.own_folder()
    assert own == tmp_path / f"mpm-dem-{os.getuid()}" and own.stat().st_mode & 0o777 == 0o700
    own.chmod(0o777)
    assert mpm_dem_cache.own_folder() != own
    own.rmdir()
    (tmp_path / "elsewhere").mkdir(mode=0o700)
    own.symlink_to(tmp_path / "elsewhere")
    assert mpm_dem_cache.own_folder() != own


def test_a_folder_of_results_that_is_not_his_is_a_sentence(unprivileged):
    done = unprivileged("-c", "from coupling.records.results import Results; Results('out', 'case')")
    assert "out=out cannot be written (Permission denied): choose another folder" in done.stderr.splitlines()[
        -1]
