"""The same case on 1, 2, 3 and 4 ranks: forces, deflection, every point, the report, and the pieces for
ParaView."""
import json
from pathlib import Path

import numpy as np
import pytest

from coupling.records.history import read

SCRIPT = Path(__file__).parents[2] / "cases/beam_impact.py"
WINDOWS = 400
NEAR = 1e-10  # of the largest value: what the order of the sums may change
# of the largest displacement: nothing holds the beam along its axis, where round-off moves it as a whole
DRIFT = 1e-7
# Faster than the case's 0.01 m/s: there strains are 1e-6, the last bit of F = 1 + strain is 1e-10 of them,
# and where it falls the other way, accelerations follow by 1e-8 of the largest, on one rank too.
FAST = "v0=1"


def summary(said):
    """Lines of a run without those of its progress, of which a slow machine sees one a minute."""
    return [line for line in said.splitlines() if not line.startswith("step ")]


@pytest.fixture
def beam(script_on_ranks, words, tmp_path):
    """``beam(ranks, more)``: folder of a run of the coarse beam with windows of 1e-6 s."""
    def start(ranks, more):
        folder = tmp_path / f"ranks{ranks}"
        done = script_on_ranks(ranks, SCRIPT,
                               *words(f"dt=1e-6 substeps=20 points=2 out={folder} {more}"))
        assert done.returncode == 0 and len(summary(done.stdout)) == 6, done.stderr
        return folder

    return start


def check_the_same(one, other, pieces, joined, ranks):
    """Histories, and the points at the last time of the ParaView series."""
    a, b = read(one / "history.csv"), read(other / "history.csv")
    for name in ("time", "force", "u_beam", "u_sphere", "v_sphere"):
        assert len(a[name]) == len(b[name]) and abs(a[name]
                                                    - b[name]).max() <= NEAR * abs(a[name]).max(), name
    (_, first), *_, (_, last) = pieces(one, "points")
    _, others = pieces(other, "points")[-1]
    x, data, _ = joined(list(last.values()))
    y, same, _ = joined(list(others.values()))
    start, _, _ = joined(list(first.values()))
    assert (data["gid"] == same["gid"]).all() and set(others) == set(range(ranks))
    assert abs(x - y).max() <= NEAR * abs(x).max()
    assert abs(x - y).max() <= DRIFT * abs(x - start).max()
    report = json.loads((other / "report.json").read_text())
    assert report["ranks"] == ranks == len(report["peak_mb"])


@pytest.mark.mpi
def test_ranks_agree(beam, pieces, joined, backend):
    """100 windows, until the sphere is off again; the reports name solver and balance, and the pieces make
    the whole."""
    keys = f"dem={backend} {FAST} t_end=1e-4 paraview=50 wall_segments=20"
    folders = one, two = beam(1, keys), beam(2, keys)
    check_the_same(one, two, pieces, joined, 2)
    check_pieces(one, two, pieces, joined, (0.0, 5e-5, 1e-4))
    for folder, solver in zip(folders, ("cholesky (", "redundant")):
        report = json.loads((folder / "report.json").read_text())
        assert report["solver"].startswith("newtonls, preonly, ") and solver in report["solver"]
        assert "unknowns" in report["solver"] and report["rebalances"] == []
        assert report["imbalance"] == 1.0 if folder is one else 1.0 <= report["imbalance"] < 1.2


@pytest.mark.mpi
@pytest.mark.validation
def test_ranks_agree_on_iterations_and_window_lengths(beam, backend):
    """Every rank takes the same decisions, and they are those of one rank."""
    keys = f"dem={backend} dt=8e-6 substeps=160 t_end=9.6e-5 iterate=20 relax=iqn adapt=0.05"
    one, two = (read(beam(ranks, keys) / "history.csv") for ranks in (1, 2))
    assert one["retries"].sum() > 0 and one["iterations"].max() > 1 and len(set(one["window"])) > 3
    for name in ("time", "iterations", "retries", "window"):
        assert (one[name] == two[name]).all(), name
    for name in ("force", "u_beam", "v_sphere"):  # a residual of tol is left, and its digits differ
        assert abs(one[name] - two[name]).max() <= 1e-7 * abs(one[name]).max(), name


@pytest.mark.mpi
@pytest.mark.validation
def test_ranks_agree_over_400_windows(beam, pieces, joined, backend):
    keys = f"dem={backend} t_end={WINDOWS * 1e-6:g} paraview={WINDOWS}"
    one = beam(1, keys)
    for ranks in (2, 3, 4):
        check_the_same(one, beam(ranks, keys), pieces, joined, ranks)


@pytest.mark.mpi
@pytest.mark.validation
def test_pieces_make_the_whole_of_triangles(beam, pieces, joined):
    keys = "cell=triangle points=3 t_end=8e-6 paraview=4 wall_segments=20"
    check_pieces(beam(1, keys), beam(2, keys), pieces, joined, (0.0, 4e-6, 8e-6))


def check_pieces(one, two, pieces, joined, times):
    """Files of two ranks at these times. One rank writes whole files under the names without a rank."""
    for name in ("points", "grid", "interface", "wall", "particles"):
        whole, parts = pieces(one, name), pieces(two, name)
        assert [time for time, _ in whole] == [time for time, _ in parts] == pytest.approx(times, rel=1e-12)
        assert sorted(path.name for path in one.glob(f"{name}_*")) == [f"{name}_0000{k}.vtu"
                                                                       for k in range(3)]
        shared = name in ("points", "grid")
        for (_, a), (_, b) in zip(whole, parts):
            assert set(a) == {None} and set(b) == ({0, 1} if shared else {0})
            check_mesh(joined(list(a.values())), joined(list(b.values())))
        files = sorted(path.name for path in two.glob(f"{name}_*"))
        assert files == [f"{name}_0000{k}_000{r}.vtu" for k in range(3) for r in range(1 + shared)]


def check_mesh(whole, parts):
    """Cells as often as in the whole, and the same fields; nodes of the grid at the seam of two pieces
    agree."""
    (x, data, corners), (y, other, pieces_corners) = whole, parts
    assert corners.shape == pieces_corners.shape
    np.testing.assert_allclose(pieces_corners, corners, rtol=0, atol=1e-12)
    _, of_y = np.unique(np.round(y, 9), axis=0, return_inverse=True)
    _, of_x = np.unique(np.round(x, 9), axis=0, return_inverse=True)
    place = np.argsort(of_x)[of_y.ravel()]
    assert len(np.unique(of_x)) == len(x) and set(place) == set(range(len(x)))
    for name, values in data.items():
        scale = max(abs(values).max(), 1e-9)  # the spin is noise here
        np.testing.assert_allclose(other[name], values[place], rtol=0, atol=1e-9 * scale, err_msg=name)
