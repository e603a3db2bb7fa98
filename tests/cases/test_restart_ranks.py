"""Runs that are restarted on other ranks than they began on: to the last bit on as many, to round-off on
others."""
import shutil
from pathlib import Path

import numpy as np
import pytest

from coupling.records.history import read

CASES = Path(__file__).parents[2] / "cases"
NEAR = 1e-10  # of the largest value


@pytest.fixture
def go(script_on_ranks):
    """``go(ranks, case, words)``: a run, which must succeed."""
    def start(ranks, case, *words):
        done = script_on_ranks(ranks, CASES / f"{case}.py", *words)
        assert done.returncode == 0, done.stderr

    return start


def check_near(folder, other, names):
    old, new = read(folder / "history.csv"), read(other / "history.csv")
    for name in names:
        assert len(old[name]) == len(new[name])
        np.testing.assert_allclose(new[name], old[name], rtol=0, atol=NEAR * np.abs(old[name]).max(),
                                   err_msg=name)


def check(go, tmp_path, case, names, *words, ranks=(2, 1, 3), options=()):
    """Straight on two ranks; from its checkpoint before the last on so many ranks each. options: PETSc's, of
    all runs."""
    first = tmp_path / "first"
    go(2, case, f"out={first}", *words, *options)
    for n in ranks:
        again = tmp_path / f"ranks{n}"
        shutil.copytree(first, again)
        (again / "checkpoint.h5").unlink()
        go(n, case, f"restart={again}", *options)
        if n == 2:
            assert (first / "history.csv").read_bytes() == (again / "history.csv").read_bytes()
        check_near(first, again, names)


BEAM = ["force", "u_beam", "u_sphere", "v_sphere"]


@pytest.mark.mpi
@pytest.mark.parametrize("more", ["iterate=20 relax=iqn dem=liggghts",
                                  pytest.param("adapt=0.05", marks=pytest.mark.validation),
                                  pytest.param("dem=liggghts", marks=pytest.mark.validation)])
def test_the_beam_goes_on_on_other_ranks(go, words, tmp_path, more, liggghts):
    keys = [word for word in words(f"checkpoint=14 {more}") if not word.startswith("out=")]
    check(go, tmp_path, "beam_impact", BEAM, *keys, ranks=(2, 1) if "iqn" in more else (2, 1, 3))


@pytest.mark.mpi
@pytest.mark.validation
@pytest.mark.parametrize("more, ranks", [("solver=cg", (2,)), ("", (1, 3))], ids=["bits", "round-off"])
def test_the_beam_in_space_goes_on_on_other_ranks(go, tmp_path, more, ranks):
    """MUMPS, the default, adds on several ranks in the order in which messages arrive: no two runs have the
    same bits. How far conjugate gradients come, on the other hand, depends on the ranks."""
    keys = f"dim=3 h=4e-3 points=2 dt=4e-6 substeps=40 t_end=8e-5 checkpoint=8 {more}"
    check(go, tmp_path, "beam_impact", BEAM, *keys.split(), ranks=ranks)


@pytest.mark.mpi
@pytest.mark.validation
@pytest.mark.parametrize("more", ["contact=outline", "contact=points dem=liggghts", "iterate=20"])
def test_soil_and_blocks_go_on_on_other_ranks(go, tmp_path, more, liggghts):
    """Before and in the first moments of the impact: a resampled outline, clusters that lie on each other."""
    check(go, tmp_path, "granular_blocks", ["front", "kinetic", "left2", "energy_grains"],
          *f"h=0.02 dt=1e-3 substeps=50 t_end=0.084 at=0.12 box=0.3,0.4 restitution=0.3 checkpoint=25 {more}"
          .split())


@pytest.mark.mpi
@pytest.mark.validation
@pytest.mark.parametrize("more, ranks", [("solver=gmres", (2,)), ("", (1, 3))], ids=["bits", "round-off"])
def test_a_flow_on_a_new_distribution_goes_on_on_other_ranks(go, tmp_path, more, ranks):
    """The column has spread, and its points are on other ranks than at the start. MUMPS, the default, has no
    bits to keep, see above. Ranks that make a tangent anew at another step differ by what Newton's method
    leaves: here next to nothing."""
    check(go, tmp_path, "column_collapse", ["front", "kinetic", "height"],
          *f"h=0.025 dt=2e-3 t_end=0.2 rebalance=1.01 checkpoint=40 {more}".split(), ranks=ranks,
          options=("-mpm_snes_rtol", "1e-12", "-mpm_snes_atol", "1e-11"))
