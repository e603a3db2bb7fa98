"""Rocks that lie on each other and press on soil whose material points they meet, on several ranks: the same
motion, a checkpoint that goes on on others, and an exchange of the chosen points alone."""
import json
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI

import dem_liggghts as dem
from coupling import Output, Run, Scheme
from coupling.records.history import read
from mpm_fenicsx import MPM, Balls, Body, Box, Grid, Support, mohr_coulomb

H, WINDOWS, KEPT = 0.05, 16, 9  # windows in all, and until the checkpoint
NEAR = 1e-10  # of the largest value
PUSHED = "impulse_solid", "impulse_solid_x", "angular_solid_z", "energy_solid", "energy_grains"
# all windows on 2 ranks, then those after the checkpoint on so many
RANKS = {"bits": (2,), "round-off": (1, 3)}


def soil():
    """A bed of 8 x 2 x 4 cells between smooth walls."""
    size = 8 * H, 2 * H, 4 * H
    body = Body(Box((0.0, 0.0, 0.0), size), (8, 2, 4), 2, mohr_coulomb(1e6, 0.3, 30.0), 1600.0)
    grid = Grid(Box((0.0, 0.0, 0.0), (size[0], 4 * H, size[2])), (8, 4, 4))
    walls = [Support(lambda x, k=k: (x[:, k] < 1e-9) | (x[:, k] > size[k] - 1e-9), "xyz"[k]) for k in (0, 2)]
    return MPM(grid, body, [Support(lambda x: x[:, 1] < 1e-9, "xyz"), *walls], Balls(0.25 * H),
               gravity=(0.0, -9.81, 0.0), inertia="lumped")


def rocks():
    """Two of eight spheres each, side by side and 1 mm above the bed, and a third one on both."""
    corners = 0.2 * H * np.array([(a, b, c) for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)])
    stone, low = dem.Material(1e7, 0.3), 2 * H + 0.5 * H + 1e-3
    places = (2.5 * H, low, 2 * H), (3.51 * H, low, 2 * H), (3.0 * H, low + 1.02 * H, 2 * H)
    clusters = [dem.Cluster.of_spheres(corners, np.full(8, 0.3 * H), 2600.0, x=x, v=(0.1, -0.5, 0.05))
                for x in places]
    contact = dem.Interaction(0.3, 0.5)
    return dem.Scene(clusters=clusters, material=stone, wall_material=stone, between=contact, at_wall=contact,
                     gravity=(0.0, -9.81, 0.0))


def go(folder, backend, restart=None):
    """A run of the ranks; ``folder`` gets, besides its results, where all are at the end and how many points
    were chosen in each window."""
    chosen, ends = [], []

    def observe(solid, grains):
        def look(window):
            chosen.append(len(window.x))
            if window.number == WINDOWS:
                ends.extend([solid.points.gid, solid.points.x.copy(), grains.bodies()["x"]])

        return [look]

    scheme = Scheme(1e-3, WINDOWS * 1e-3, substeps=20, dem=backend)
    more = dict(checkpoint=str(KEPT)) if restart is None else dict(restart=folder)
    Run("rocks", soil(), rocks(), scheme, Output(folder, **more), observe=observe).go()
    gid, mine, bodies = ends
    points = MPI.COMM_WORLD.gather((gid, mine))
    if MPI.COMM_WORLD.rank == 0:
        x = np.concatenate([x for _, x in points])[np.argsort(np.concatenate([gid for gid, _ in points]))]
        np.savez(folder / "end.npz", points=x, rocks=bodies, chosen=chosen)


@pytest.fixture
def start(script_on_ranks):
    """``start(ranks, folder, backend, *more)``: a run, which must succeed; returns what ``go`` has left."""
    def run(ranks, folder, backend, *more):
        done = script_on_ranks(ranks, __file__, str(folder), backend, *more)
        assert done.returncode == 0, done.stderr
        with np.load(folder / "end.npz") as end:
            return dict(end)

    return run


def check_near(first, other, one, two):
    """Histories in the folders ``first`` and ``other``, and ends ``one`` and ``two``."""
    for name in ("points", "rocks"):
        np.testing.assert_allclose(two[name], one[name], rtol=0, atol=NEAR * np.abs(one[name]).max())
    old, new = read(first / "history.csv"), read(other / "history.csv")
    for name in PUSHED:
        np.testing.assert_allclose(new[name], old[name], rtol=0, atol=NEAR * np.abs(old[name]).max(),
                                   err_msg=name)


def check_in_contact(folder):
    """From the checkpoint on the rocks press, and rock presses on rock."""
    history = read(folder / "history.csv")
    push = np.diff(history["impulse_grains"])[KEPT:]
    assert push.max() > 0.05 * history["impulse_grains"].max() and len(history["time"]) == WINDOWS


@pytest.mark.mpi
@pytest.mark.parametrize("backend, ranks", [
    ("reference", (2,)), *(pytest.param(backend, (1, 2, 4), marks=pytest.mark.validation)
                           for backend in ("reference", "liggghts"))])
def test_ranks_agree_and_exchange_what_is_near(start, tmp_path, backend, ranks, request):
    """Places and velocities of the chosen points go to all other ranks, and besides them little."""
    request.getfixturevalue(backend) if backend == "liggghts" else None
    ends = {n: start(n, tmp_path / str(n), backend) for n in (1, *ranks)}
    check_in_contact(tmp_path / "1")
    for n in ranks:
        check_near(tmp_path / "1", tmp_path / str(n), ends[1], ends[n])
        assert np.array_equal(ends[n]["chosen"], ends[1]["chosen"])
        sent = json.loads((tmp_path / str(n) / "report.json").read_text())["exchanged"]
        needed = 6 * 8 * ends[n]["chosen"].sum() * (n - 1)
        assert needed <= sent <= 1.3 * needed
        assert ends[n]["chosen"].max() < 0.5 * len(ends[n]["points"])


@pytest.mark.mpi
@pytest.mark.validation
@pytest.mark.parametrize("ranks", RANKS.values(), ids=RANKS)
@pytest.mark.parametrize("backend", ["reference", "liggghts"])
def test_goes_on_on_other_ranks(start, tmp_path, backend, ranks, request):
    """From a checkpoint in contact: on as many ranks to the last bit, on others to round-off."""
    request.getfixturevalue(backend) if backend == "liggghts" else None
    first = tmp_path / "first"
    one = start(2, first, backend)
    check_in_contact(first)
    for n in ranks:
        again = tmp_path / f"ranks{n}"
        shutil.copytree(first, again)
        for name in ("checkpoint.h5", "end.npz"):  # that of the end
            (again / name).unlink()
        two = start(n, again, backend, "restart")
        if n == 2:
            assert (first / "history.csv").read_bytes() == (again / "history.csv").read_bytes()
            assert all(np.array_equal(one[name], two[name]) for name in ("points", "rocks"))
        check_near(first, again, one, two)


if __name__ == "__main__":
    where, which, *more_words = sys.argv[1:]
    del sys.argv[1:]  # no words for PETSc
    go(Path(where), which, *more_words)
