"""Two ranks give what one gives, while points travel between them and until one rank has none left."""
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
RUN = """
import sys
import numpy as np
from mpi4py import MPI
from mpm_fenicsx import LAWS, MPM, Body, Box, Grid, Interface
_, path, cell, law, inertia = sys.argv
box = Box((0, 0), (2, 1))
grid, body = Grid(Box((-1, -1), (5, 3)), (12, 8), cell), Body(box, (8, 4), 3, LAWS[law](1e3, 0.3), 1.0, cell=cell,
                                                             velocity=(2.0, 0.2))
solid = MPM(grid, body, interface=Interface.top(box, 6, 0.1), gravity=(0, -0.5), inertia=inertia)
solid.start = set(solid.points.gid)
for n in range(30):
    x, v = solid.advance(0.03, np.outer(np.cos(0.3 * n + np.arange(7)), (0.3, -0.2)))
travelled = solid.comm.allreduce(len(set(solid.points.gid) - solid.start))
gid, F = np.concatenate(solid.comm.allgather(solid.points.gid)), np.concatenate(solid.comm.allgather(solid.points.F))
energy, momentum = solid.energy(), solid.momentum()
state = solid.get_state()
end = solid.advance(0.03)[0]
solid.set_state(state)
assert np.array_equal(solid.advance(0.03)[0], end)
try:
    for n in range(30):
        solid.advance(0.05)
    message = "the body is still there"
except Exception as error:
    message = str(error)
if solid.comm.rank == 0:
    np.savez(path, x=x, v=v, F=F[np.argsort(gid)], energy=list(energy.values()), momentum=momentum, travelled=travelled,
             ranks=solid.comm.size, message=message)
"""


def run(ranks, path, *words):
    if shutil.which("mpirun") is None:
        (pytest.fail if "mpi" in os.environ.get("MPMDEM_REQUIRE", "") else pytest.skip)("mpirun is missing")
    start = ["mpirun", "--allow-run-as-root", "--oversubscribe", "-n", str(ranks)] if ranks > 1 else []
    env = dict(os.environ, OMP_NUM_THREADS="1")  # os.environ has none of what MPI, running here, tells its children
    done = subprocess.run([*start, sys.executable, "-c", RUN, str(path), *words], cwd=ROOT, env=env, timeout=120,
                          capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-2000:]
    return np.load(path)


@pytest.mark.mpi
@pytest.mark.parametrize("cell, law, inertia", [("quadrilateral", "linear", "lumped"),
                                                ("triangle", "neo_hooke", "lumped")])
def test_two_ranks_give_what_one_gives(tmp_path, cell, law, inertia):
    one, two = (run(n, tmp_path / f"{n}.npz", cell, law, inertia) for n in (1, 2))
    assert two["ranks"] == 2 and two["travelled"] > 50 and one["travelled"] == 0
    for name in ("x", "v", "F", "energy", "momentum"):
        np.testing.assert_allclose(two[name], one[name], rtol=0, atol=1e-12 * abs(one[name]).max(), err_msg=name)
    assert "left the grid" in str(one["message"]) and str(one["message"])[:25] == str(two["message"])[:25]
