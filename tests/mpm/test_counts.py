"""What ranks send each other in a step is what docs/cost_model.md says, from their nodes and neighbours."""
import json

import pytest

RUN = """
import json
import sys
from mpi4py import MPI
from tests.benchmarks.counts import bytes_of_points, counted, formulas, made, reductions, shared
comm, (path, dim, n) = MPI.COMM_WORLD, sys.argv[1:4]
solid, force = made(int(dim), int(n))
found, body = counted(solid, force), solid.bodies[0]
expected = formulas(shared(solid), int(dim), found.iterations)
mine = {"sent": {name: list(sums) for name, sums in found.traffic.items()}, "expected": expected,
        "sizes": bytes_of_points(body), "iterations": found.iterations, "reductions": found.reductions,
        "others": found.calls, "got": solid.exchanged / solid.steps, "interface": 16 * force.size}
everybody = comm.gather(mine)
if comm.rank == 0:
    with open(path, "w") as file:
        json.dump(everybody, file, default=int)  # of integers of numpy
solid.close()
"""
SIZES = {2: (117, 258, 125), 3: (181, 522, 189)}  # bytes of a point, with work arrays, travelling


@pytest.mark.mpi
@pytest.mark.parametrize("ranks", [2, 3])
@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("new", [0, 1])
def test_messages_and_bytes_are_those_of_the_model(on_ranks, tmp_path, dim, ranks, new):
    path = tmp_path / "counts.json"
    words = ["-mpm_pc_type", "lu", "-mpm_ksp_type", "preonly"] + ["-mpm_snes_lag_jacobian", "1"] * new
    done = on_ranks(ranks, RUN, path, dim, {2: 12, 3: 6}[dim], *words)
    assert done.returncode == 0, done.stderr[-2000:]
    for rank in json.loads(path.read_text()):
        for name in ("to grid", "residual"):
            assert rank["sent"][name] == pytest.approx(rank["expected"][name]), name
        messages, size = rank["sent"]["tangent"]
        if new:
            assert messages == rank["expected"]["new tangent"][0]
            assert 0.5 < size / rank["expected"]["new tangent"][1] < 2.0  # cells at a node
        assert rank["sent"]["search"] == rank["sent"]["to points"] == [0.0, 0.0]
        assert tuple(rank["sizes"]) == SIZES[dim]
        assert rank["got"] <= rank["interface"]
        if not rank["others"]:  # mpi4py from 4 on hides its calls from the profiler, PETSc 3.25 its sums
            continue
        assert rank["others"]["Allgatherv"] == 1.0
        if not new:  # and a few where points have gone to another rank
            i = rank["iterations"]
            assert rank["reductions"] == pytest.approx(1 + 4 * i)
            assert -1e-9 <= rank["others"]["Allreduce"] - (8 + 2 * i) < 1.0
