"""The tutorials: what they tell to type is typed, in their order, in an empty folder."""
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
BLOCK = re.compile(r"^```(sh|python)(?: title=\"([^\"]+)\")?\n(.*?)^```$", re.M | re.S)
OF_RANKS = "OMPI_", "PMIX_", "PMI_"  # what MPI tells the children of a process that it has started
ENV = {**{name: value for name, value in os.environ.items() if not name.startswith(OF_RANKS)},
       "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1", "OMPI_MCA_hwloc_base_binding_policy": "none",
       "OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",  # as ./dev sets them
       "OMPI_MCA_rmaps_base_oversubscribe": "1", "PRTE_MCA_rmaps_default_mapping_policy": ":oversubscribe",
       "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}"}


@pytest.fixture
def follow(tmp_path):
    """``follow(page)`` does what the page of that name in docs says: writes its files, runs its commands and
    its Python; returns all that they print. With ``alone`` each command runs without its mpirun."""
    def do(page, alone=False):
        printed = []
        for kind, file, text in BLOCK.findall((ROOT / "docs" / page).read_text(encoding="utf-8")):
            if file:
                (tmp_path / file).write_text(text)
                continue
            text = text.replace(" cases/", f" {ROOT}/cases/")  # a link would have its kernels compiled anew
            text = text.replace("mpirun -n 2 ", "") if alone else text
            command = ["bash", "-ec", text] if kind == "sh" else [sys.executable, "-c", text]
            done = subprocess.run(command, cwd=tmp_path, env=ENV, capture_output=True, text=True, timeout=300)
            assert done.returncode == 0, f"{text}\n{done.stderr}"
            printed.append(done.stdout)
        return "".join(printed)

    return do


def test_start_in_ten_minutes(follow, tmp_path):
    said = follow("start.md")
    assert "beam_impact: 3840 points, 200 windows of 20 DEM steps" in said
    assert "200 windows, largest force 4.92 N" in said
    assert (tmp_path / "out/first/beam_impact.png").is_file()
    fine, coarse = (float(number) for number in re.findall(r"errors: force ([\d.e-]+)", said))
    assert fine == pytest.approx(0.00159, rel=0.02) and 0.005 < coarse < 0.03


def test_boulders_in_space(follow):
    said = follow("boulders.md")
    assert "768 points" in said and "soil on barrier_1: largest 0 N" in said
    page, script = ((ROOT / f"docs/boulders.{kind}").read_text(encoding="utf-8") for kind in ("md", "py"))
    assert f"```python title=\"boulders.py\"\n{script}```" in page


def test_restart_on_one_rank(follow):
    """Three processes in place of six; tests/cases/test_restart_ranks.py has several ranks."""
    assert "the same to the last bit: True" in follow("restart.md", alone=True)


@pytest.mark.validation
@pytest.mark.mpi
def test_restart_on_several_ranks(follow, run_ranks):
    """``run_ranks`` is only asked whether there is an mpirun."""
    assert "the same to the last bit: True" in follow("restart.md")


def test_tuning_the_solver(follow):
    said = follow("tuning.md")
    assert "SNES Function norm" in said and "Linear mpm_ solve converged" in said
    assert "largest difference of the force" in said
