"""Material leaves at planes inside the grid: counted by name, booked with all that leaves."""
import numpy as np
import pytest

from mpm_fenicsx import MPM, Body, Box, Grid, Inflow, Outflow, linear

PLANE = Outflow("weir", (0.9, 0.0), "+x")
BODY = Body(Box((0.0, 0.0), (0.4, 0.2)), (4, 2), 2, linear(1e5, 0.0), 1000.0, velocity=(1.0, 0.0))


def stream(openings, body=BODY, **more):
    """A block that flies to the right at 1 m/s."""
    grid = Grid(Box((-0.2, -0.1), (2.0, 0.3)), (22, 4))
    return MPM(grid, body, openings=openings, inertia="lumped", **more)


def test_what_passes_a_plane_is_counted_and_booked():
    solid = stream([Outflow("gap", (0.9, 0.0), (2.0, 0.0), Box((0.9, 0.0), (1.5, 0.1))), PLANE])
    volume, discharge = (solid.columns()[f"{what}_weir"][2] for what in ("volume", "discharge"))
    gap = solid.columns()["volume_gap"][2]
    start, mass = solid.momentum(), solid.points.mass.sum()
    for _ in range(76):
        solid.advance(0.01)
    state, left = solid.get_state(), solid.removed
    # columns of points that have passed until 0.75 s, the last look
    assert gap() == pytest.approx(0.025, rel=1e-12) == volume() == left["volume"] / 2.0
    assert solid.count == 32 - left["count"] == len(solid.points) and discharge() >= 0.0
    assert solid.points.mass.sum() + left["mass"] == pytest.approx(mass, rel=1e-12)
    np.testing.assert_allclose(solid.momentum() + left["momentum"], start, rtol=0, atol=1e-9 * mass)
    given = sum(solid.impulses().values())[:2]
    np.testing.assert_allclose(solid.momentum() - start, given, rtol=0, atol=1e-10 * mass)
    ends = []
    for _ in range(2):
        for _ in range(8):
            solid.advance(0.01)
        ends.append((volume(), gap(), discharge(), solid.removed["count"], solid.points.x.tobytes()))
        solid.set_state(state)
    assert ends[0] == ends[1] and ends[0][3] > left["count"] and solid.removed["count"] == left["count"]
    solid.close()


def test_what_comes_in_leaves():
    """A channel without resistance: discharge in is discharge out, once the front has passed."""
    solid = stream([Inflow("inlet", (0.0, 0.0), "+x", depth=0.2, speed=1.0), PLANE])
    came, went = (solid.columns()[f"volume_{name}"][2] for name in ("inlet", "weir"))
    for _ in range(150):
        solid.advance(0.01)
    assert came() == pytest.approx(0.3, rel=1e-9)
    there = solid.points
    inside = there.V0[there.x[:, 0] > 0.0].sum()
    assert came() + 0.08 == pytest.approx(went() + inside, abs=0.01)  # a layer
    assert abs(solid.cauchy_stress()).max() < 1e-8 * 1e5
    solid.close()


@pytest.mark.parametrize("words, sentence", [
    (dict(at=(2.5, 0.0)), r"weir lies outside the grid, at \[2.5, 0.0\] m with the normal \[1.0, 0.0\]: the"),
    (dict(normal="up"), "normal of weir is 'up': choose one of"),
    (dict(normal=(0.0, 0.0)), "normal of weir is .0.0, 0.0.: give the way out"),
    (dict(box=Box((3.0, 0.0), (4.0, 1.0))), "weir lies outside the grid"),
    (dict(box=Box((0.0, 0.0, 0.0), (1.0, 1.0, 1.0))), "box of weir has 3 dimensions, at has 2"),
    (dict(at=(0.0, 0.0, 0.0)), "weir has 3 dimensions, the grid 2"),
    (dict(name="outflow"), "'outflow' is the name of an opening, and of something else in the books")])
def test_what_is_no_way_out_is_refused(words, sentence):
    with pytest.raises(ValueError, match=sentence):
        stream([Outflow(**{**dict(name="weir", at=(0.9, 0.0), normal="+x"), **words})])
