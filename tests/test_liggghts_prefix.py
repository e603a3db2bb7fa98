"""LIGGGHTS of one's own, LIGGGHTS_PREFIX: here a folder of links to that of the system."""
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


def build(prefix, *words):
    env = {name: text for name, text in os.environ.items() if name != "LIGGGHTS_INCLUDE"}
    return subprocess.run([sys.executable, "setup.py", "-q", *map(str, words)], cwd=ROOT, capture_output=True,
                          text=True, env={**env, "LIGGGHTS_PREFIX": str(prefix)}, timeout=300)


def test_a_prefix_without_liggghts_is_an_error(tmp_path):
    """Who names it does not want the package without."""
    pytest.importorskip("setuptools")
    done = build(tmp_path, "--version")
    assert done.returncode == 1
    assert f"error: LIGGGHTS_PREFIX is {tmp_path}, which has no libliggghts.so in lib, lib64, " in done.stderr


@pytest.mark.validation
def test_the_shim_finds_the_library_of_the_prefix(tmp_path, liggghts):
    pytest.importorskip("setuptools")
    from dem_liggghts.liggghts.library import SHIM

    used = subprocess.run(["ldd", SHIM], check=True, capture_output=True, text=True).stdout
    library = next(Path(line.split()[2]).resolve() for line in used.splitlines() if "libliggghts" in line)
    (tmp_path / "include").mkdir()
    (tmp_path / "include/liggghts").symlink_to(os.environ.get("LIGGGHTS_INCLUDE", "/usr/include/liggghts"))
    (tmp_path / "lib").mkdir()
    for name in ("libliggghts.so", "libliggghts.so.3"):
        (tmp_path / "lib" / name).symlink_to(library)
    done = build(tmp_path, "build_ext", f"--build-lib={tmp_path / 'made'}",
                 f"--build-temp={tmp_path / 'temp'}")
    assert done.returncode == 0, done
    shim = tmp_path / "made/dem_liggghts/liggghts/libdemshim.so"
    found = subprocess.run(["ldd", shim], check=True, capture_output=True, text=True).stdout
    assert f"=> {tmp_path / 'lib/libliggghts.so.3'} " in found
    code = "import sys; from dem_liggghts.liggghts.library import load; print(load(sys.argv[1]).shares_mpi)"
    opened = subprocess.run([sys.executable, "-c", code, shim], cwd=ROOT, capture_output=True, text=True,
                            timeout=120)
    assert opened.stdout.strip() in ("True", "False"), opened  # and no older than its source
