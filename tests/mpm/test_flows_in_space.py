"""Laws of flow in space: a flow between smooth side walls is the plane one, and two ranks give what one
gives."""
import numpy as np
import pytest

from mpm_fenicsx import LAWS, MPM, Body, Box, Grid, Numerics, Support, at_rest

G, RHO = 9.81, 1500.0
TIGHT = "-mpm_snes_rtol", "1e-11", "-mpm_snes_atol", "1e-9"
KEYS = {  # of soils and fluids that strain by some 1 % under 10 cm of themselves
    "mu_i": dict(E=1e5, nu=0.3, mu_s=0.38, mu_2=0.64, I_0=0.28, grain_diameter=2e-3, grain_density=2500.0),
    "herschel_bulkley": dict(bulk_modulus=1e5, consistency=5.0, yield_stress=50.0, exponent=0.6),
    "cam_clay": dict(friction_angle=12.0, compression=0.1, swelling=0.02, shear_modulus=5e4,
                     preconsolidation=800.0)}


def column(name, dim, deep=False, f_bar=True):
    """A column of 10 cm in a corner that runs out along x, in space also along z where it is ``deep``, over a
    floor that it sticks to; else between smooth side walls, two cells wide."""
    h = 0.025
    size, room = (0.1, 0.1, 0.1 if deep else 2 * h)[:dim], (0.25, 0.125, 0.25 if deep else 2 * h)[:dim]
    body = Body(Box((0.0,) * dim, size), Grid.counts(size, h), 2, LAWS[name](**KEYS[name]), RHO, f_bar=f_bar,
                stress=at_rest(0.1, RHO, G, 0.7))
    held = [Support(lambda x: x[:, 1] < 1e-9, "xyz"[:dim]), Support(lambda x: x[:, 0] < 1e-9, "x")]
    held += [Support(lambda x, at=at: abs(x[:, 2] - at) < 1e-9, "z")
             for at in ((0.0,) if deep else (0.0, 2 * h))[:2 if dim == 3 else 0]]
    return MPM(Grid(Box((0.0,) * dim, room), Grid.counts(room, h)), body, held,
               gravity=(0.0, -G, 0.0)[:dim], inertia="lumped", numerics=Numerics(rebalance=1.05))


RANKS = """
import sys
import numpy as np
from mpm_fenicsx import MPM
from test_flows_in_space import KEYS, column
MPM.rebalance_every = 10
found = {}
for name in KEYS:
    solid = column(name, 3, deep=True)
    for _ in range(40):
        solid.advance(2.5e-3)
    gather = lambda values: np.concatenate(solid.comm.allgather(values))
    order = np.argsort(gather(solid.points.gid))
    found |= {f"{name} {field}": gather(getattr(solid.points, field))[order] for field in ("x", "v", "F")}
    found[f"{name} ranks"] = solid.comm.size
    solid.close()
if solid.comm.rank == 0:
    np.savez(sys.argv[1], **found)
"""


SIDES = """
import sys
import numpy as np
from test_flows_in_space import KEYS, column

def order(x):
    return np.lexsort(np.round(x, 6).T)

found = {}
for name in KEYS:
    plane, space = (column(name, dim, f_bar=False) for dim in (2, 3))
    x = space.points.x.copy()
    layers = [np.flatnonzero(abs(x[:, 2] - z) < 1e-5) for z in np.unique(np.round(x[:, 2], 6))]
    layers, same = [layer[order(x[layer, :2])] for layer in layers], order(plane.points.x)
    for _ in range(40):
        plane.advance(2.5e-3)
        space.advance(2.5e-3)
    found[name] = [plane.points.x[:, 0].max(), abs(space.points.v[:, 2]).max()] + [
        abs(getattr(space.points, field)[layer, :2] - getattr(plane.points, field)[same]).max()
        for layer in layers for field in "xv"]
    plane.close()
    space.close()
np.savez(sys.argv[1], **found)
"""


@pytest.mark.mpi
def test_flow_between_smooth_sides_is_the_plane_one(on_ranks, tmp_path):
    """Each of the four layers of points across the channel moves as the plane column does, none across, to
    what Newton's method leaves when it is run tightly. Without F-bar, whose mean of the change of volume
    stretches the third direction in space alone."""
    done = on_ranks(1, SIDES, tmp_path / "sides.npz", *TIGHT)
    assert done.returncode == 0, done.stderr[-2000:]
    for name, (far, across, *off) in np.load(tmp_path / "sides.npz").items():
        assert far > 0.11, name  # it flows
        assert across < 1e-9 and len(off) == 8, name
        assert max(off[::2]) < 1e-9 and max(off[1::2]) < 1e-7, name


@pytest.mark.mpi
def test_two_ranks_give_what_one_gives(on_ranks, tmp_path):
    """A corner that runs out in two directions, Newton's method run tightly: to 1e-8 of the largest value."""
    found = []
    for ranks in (1, 2):
        path = tmp_path / f"{ranks}.npz"
        done = on_ranks(ranks, RANKS, path, *TIGHT)
        assert done.returncode == 0, done.stderr[-2000:]
        found.append(np.load(path))
    one, two = found
    for name in KEYS:
        assert (int(one[f"{name} ranks"]), int(two[f"{name} ranks"])) == (1, 2)
        assert one[f"{name} x"][:, 0].max() > 0.11, name  # it flows
        for field in "xvF":
            key = f"{name} {field}"
            np.testing.assert_allclose(two[key], one[key], rtol=0, atol=1e-8 * abs(one[key]).max(),
                                       err_msg=key)
