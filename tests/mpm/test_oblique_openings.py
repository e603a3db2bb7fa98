"""Material that comes in and leaves obliquely to the grid: as along an axis of it."""

import numpy as np
import pytest

from mpm_fenicsx import MPM, Body, Box, Cloud, Grid, Inflow, Outflow, Soil, Structure, linear

STIFF = linear(1e5, 0.3)
COS, SIN = np.cos(np.radians(30.0)), np.sin(np.radians(30.0))
TURNED = {  # along the flow, up and across
    "plane": np.array([(COS, SIN), (-SIN, COS)]),
    "up": np.array([(COS, SIN, 0.0), (0.0, 0.0, 1.0), (SIN, -COS, 0.0)]),
    "any": np.linalg.qr(np.array([(2.0, 1.0, -1.0), (0.0, 1.0, 3.0), (1.0, 0.0, 1.0)]).T)[0].T}


def plug(axes, **more):
    """A block of 0.3 m x 0.2 m that goes on growing out of an inlet at 1 m/s. axes: of the inlet, in rows."""
    D = len(axes)
    counts, sizes = (4, 6, 4)[:D], np.array([0.2, 0.3, 0.2][:D])
    places = np.stack(np.meshgrid(*[(np.arange(n) + 0.5) / n for n in counts], indexing="ij"),
                      axis=-1).reshape(-1, D) * sizes
    if D == 3:
        places[:, 2] -= 0.1
    x, at = places @ axes, np.full(D, 0.017)
    body = Body(Cloud(x + at, np.full(len(x), 0.05**D)), None, None, STIFF, 1000.0, velocity=tuple(axes[0]))
    inlet = Inflow("inlet", at, axes[0], depth=0.3, speed=1.0, width=0.2 if D == 3 else None, up=axes[1])
    box = Box((-1.0,) * D, (1.3,) * D)
    return MPM(Grid(box, (23,) * D), body, openings=[inlet, *more.pop("openings", ())], **more)


@pytest.mark.parametrize("name", TURNED)
def test_a_plug_moves_as_a_rigid_body(name):
    """Without stress or rotation; as much as the discharge says, booked. Consistent inertia is nearly
    singular at the rim: whether a factorisation refuses it, and what is left of F - I, is up to the
    package."""
    solid, area = plug(TURNED[name], inertia="lumped"), 0.3 * (1.0 if name == "plane" else 0.2)
    start, volume = solid.momentum(), solid.columns()["volume_inlet"][2]
    for step in range(1, 21):
        solid.advance(0.02)
        assert volume() == pytest.approx(0.02 * step * area, rel=1e-10, abs=1e-13)
    p, came = solid.points, solid.entered
    assert abs(solid.cauchy_stress()).max() < 1e-8 * 1e5 and abs(p.v - TURNED[name][0]).max() < 1e-9
    assert abs(p.F - np.eye(solid.dim)).max() < 1e-12 and len(set(p.gid)) == len(p)
    given = sum(solid.impulses().values())[:solid.dim]
    np.testing.assert_allclose(solid.momentum() - start, given, rtol=0, atol=1e-10 * came["mass"])
    assert abs(solid.impulses()["inlet"]).max() < 1e-9 * came["mass"]
    solid.close()


def test_what_comes_in_leaves_by_a_part_of_an_oblique_plane():
    """The upper half of the plug passes the end of the line, the lower one is taken away."""
    axes, at = TURNED["plane"], np.full(2, 0.017)
    weir = Outflow("weir", at + 0.4 * axes[0] + 0.075 * axes[1], axes[0], width=0.15)
    solid = plug(axes, openings=[weir])
    for _ in range(40):
        solid.advance(0.02)
    left = solid.columns()["volume_weir"][2]()
    seen = (solid.points.x - at) @ axes.T
    assert left == pytest.approx((0.8 + 0.2 - 0.4) * 0.15, abs=0.05 * 0.15)
    assert seen[seen[:, 1] < 0.15, 0].max() < 0.4 + 0.02 + 1e-9 and seen[seen[:, 1] > 0.15, 0].max() > 0.9
    assert solid.points.V0.sum() + left == pytest.approx(0.06 + solid.entered["volume"], rel=1e-10)
    solid.close()


def chute(angle, dim, **more):
    """Soil down a slope of 25 degrees, in a direction that is turned from x by an angle: in the plane of the
    drawing, in space in that of the bed, over which it spreads."""
    a, b, g = np.radians(angle), np.radians(25.0), 9.81
    soil = Soil(E=1e6, nu=0.3, rho=1500.0, phi=30.0)
    if dim == 2:
        axes = np.array([(np.cos(a), np.sin(a)), (-np.sin(a), np.cos(a))])
        low, high, cells = (-0.5, -0.5), (1.7, 1.5), (22, 20)
    else:
        axes = np.array([(np.cos(a), np.sin(a), 0.0), (0.0, 0.0, 1.0), (np.sin(a), -np.cos(a), 0.0)])
        low, high, cells = (-0.5, -0.6, -0.1), (1.3, 1.2, 0.4), (18, 18, 5)
    at = np.full(dim, 0.013) if dim == 2 else np.array([0.013, 0.013, 0.002])
    first = Body(Cloud([at + 0.025 * axes[0] + 0.026 * axes[1]], [0.05**dim]), None, None, soil.material(dim),
                 soil.rho, velocity=tuple(axes[0]), f_bar=True)
    gravity = g * (np.sin(b) * axes[0] - np.cos(b) * axes[1])
    bed = Structure.plane("bed", at, axes[1], Box(low, high), friction=0.4)
    inlet = Inflow("inlet", at, axes[0], depth=0.2, speed=1.5, width=None if dim == 2 else 0.3, up=axes[1])
    solid = MPM(Grid(Box(low, high), cells), first, structures=[bed], openings=[inlet], gravity=gravity,
                inertia="lumped", outflow="remove", **more)
    return solid, at, axes


def flow(solid, at, axes, t_end):
    """Volume that has come in [m^3], and of what is beyond the inlet by its axes: mean place, mean height and
    spread [m], mean velocity [m/s]; of all ranks."""
    volume, start = solid.columns()["volume_inlet"][2], solid.momentum()
    while solid.time < t_end - 1e-9:
        solid.advance(5e-3)
    came = volume()
    given = sum(solid.impulses().values())[:solid.dim]
    assert abs(solid.momentum() - start - given).max() < 1e-10 * abs(given).max()
    p, gather = solid.points, lambda values: np.concatenate(solid.comm.allgather(values))
    seen, v, V = gather((p.x - at) @ axes.T), gather(p.v @ axes.T), gather(p.V0)
    there, fresh = seen[:, 0] > 0.0, abs(seen[:, 0] + 0.05) < 0.05  # before the plane
    mean = lambda values: V[there] @ values[there] / V[there].sum()
    return np.array([came, mean(seen[:, 0]), mean(seen[:, 1]), np.sqrt(mean(seen[:, -1] ** 2)), mean(v[:, 0]),
                     np.ptp(v[fresh, 0])])


@pytest.mark.parametrize("dim", [2, 3])
def test_an_oblique_flow_is_as_deep_as_one_along_an_axis(dim):
    """Mean place, height, spread and velocity, in cells of half the depth; volume and velocity that come in
    are those given."""
    found = []
    for angle in (0.0, 30.0):
        solid, *where = chute(angle, dim)
        found.append(flow(solid, *where, 0.5))
        solid.close()
    along, oblique = found
    area = 0.2 * (1.0 if dim == 2 else 0.3)
    assert [along[0], oblique[0]] == pytest.approx([1.5 * 0.5 * area] * 2, rel=1e-10)
    np.testing.assert_allclose(oblique[1:5], along[1:5], rtol=0.01)
    assert max(along[5], oblique[5]) < 1e-9


@pytest.mark.parametrize("make, sentence", [
    (lambda: Inflow("inlet", (0.0, 0.0), (0.0, 0.0), depth=1.0, speed=1.0),
     "normal of inlet is .0.0, 0.0.: give the way in"),
    (lambda: Inflow("inlet", (0.0, 0.0), (1.0, 1.0), depth=1.0, speed=1.0, up=(2.0, 2.0)),
     "up of inlet is .2.0, 2.0., along its normal: give a direction across it"),
    (lambda: Outflow("weir", (0.0, 0.0), "+x", width=-1.0), "width of weir is -1")])
def test_bad_input_is_one_sentence(make, sentence):
    with pytest.raises(ValueError, match=sentence):
        make()


RANKS = """
import sys
import numpy as np
from test_oblique_openings import *
solid, at, axes = chute(float(sys.argv[2]), 3)
solid.rebalance_every = 7
found = flow(solid, at, axes, 0.3)
gather = lambda name: np.concatenate(solid.comm.allgather(getattr(solid.points, name)))
order = np.argsort(gather("gid"))
fields = {name: gather(name)[order] for name in ("gid", "x", "v", "mass")}
many = min(solid.comm.allgather(len(solid.points)))
if solid.comm.rank == 0:
    np.savez(sys.argv[1], **fields, flow=found, many=many)
"""


@pytest.mark.mpi
@pytest.mark.parametrize("angle", [pytest.param(0, marks=pytest.mark.validation), 30])
def test_ranks_give_what_one_gives_in_space(on_ranks, tmp_path, angle):
    """Both ranks have points."""
    found = []
    for ranks in (1, 2):
        path = tmp_path / f"{ranks}.npz"
        done = on_ranks(ranks, RANKS, path, angle, "-mpm_snes_rtol", "1e-11", "-mpm_snes_atol", "1e-9")
        assert done.returncode == 0, done.stderr[-2000:]
        found.append(np.load(path))
    one, two = found
    np.testing.assert_array_equal(two["gid"], one["gid"])
    assert two["many"] > 0
    for name in ("x", "v", "mass", "flow"):
        np.testing.assert_allclose(two[name], one[name], rtol=0, atol=1e-9 * abs(one[name]).max())
