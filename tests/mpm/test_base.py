"""The ground shakes: in its frame a block slides as Newmark's does, and what it gives is booked."""
import numpy as np
import pytest

from mpm_fenicsx import MPM, Body, Box, Grid, GridWall, Numerics, linear
from tests.newmark import FRICTION, GRAVITY, newmark, shaking


@pytest.mark.parametrize("transfer, contact", [
    ("newmark", "nodes"), pytest.param("tpic", "surface", marks=pytest.mark.validation)])
def test_a_block_slides_as_newmarks_does(transfer, contact):
    """Momentum closes to round-off; what the base does, friction and the way down take."""
    end, h = 0.6, 0.05
    block = Body(Box((0.0, 0.0), (0.4, 0.2)), (8, 4), 2, linear(2e7, 0.2), 1000.0)
    floor = GridWall(lambda x: abs(x[:, 1]) < 1e-9, "+y", friction=FRICTION, separates=True, contact=contact)
    solid = MPM(Grid(Box((-0.2, -0.1), (0.8, 0.3)), Grid.counts((1.0, 0.4), h)), block, penalties=[floor],
                gravity=GRAVITY, inertia="lumped", base=shaking,
                numerics=Numerics(settle=1, transfer=transfer))
    mass, energy = solid.points.mass.sum(), sum(solid.energy().values())
    start, before = solid.points.mass @ solid.points.x / mass, sum(solid.impulses().values())
    while solid.time < end - 1e-9:
        solid.advance(2e-3)
    slid = solid.points.mass @ solid.points.x / mass - start
    assert slid[0] == pytest.approx(newmark(end), rel=0.02)
    given = sum(solid.impulses().values()) - before
    np.testing.assert_allclose(solid.momentum(), given[:2], rtol=0, atol=1e-10 * abs(given).max())
    works = solid.works()
    taken = energy + works["base"] - sum(solid.energy().values()) - works["springs"]
    assert works["friction"] == pytest.approx(taken, rel=0.03) and works["base"] == solid.base_work
    solid.close()


@pytest.mark.parametrize("transfer", ["newmark", "tpic"])
def test_what_flies_keeps_its_path_in_space(transfer):
    """A function of time, and a record of it."""
    block = Body(Box((0.0, 0.0), (0.2, 0.2)), (2, 2), 2, linear(1e5, 0.2), 1000.0, velocity=(1.0, 0.0))
    times = np.linspace(0.0, 0.1, 401)
    base = lambda t: (3.0 + 6.0 * t, -2.0 * np.cos(9.0 * t))  # noqa: E731
    if transfer == "tpic":
        base = times, np.column_stack(base(times))
    solid = MPM(Grid(Box((-0.2, -0.2), (0.6, 0.4)), (8, 6)), block, gravity=(0.0, -9.81), inertia="lumped",
                base=base, numerics=Numerics(transfer=transfer))
    start, x, energy = solid.momentum(), solid.points.x.copy(), sum(solid.energy().values())
    for _ in range(100):
        solid.advance(1e-3)
    t, mass = solid.time, solid.points.mass.sum()
    moved = [t - 1.5 * t**2 - t**3, -0.5 * 9.81 * t**2 + 2.0 / 81.0 * (1.0 - np.cos(9.0 * t))]
    np.testing.assert_allclose(solid.points.x - x, np.tile(moved, (len(x), 1)), rtol=0, atol=2e-6)
    given = sum(solid.impulses().values())[:2]
    np.testing.assert_allclose(solid.momentum() - start, given, rtol=0, atol=1e-12 * mass)
    assert sum(solid.energy().values()) - energy == pytest.approx(solid.base_work, rel=1e-6)
    solid.close()


def test_what_is_no_motion_is_refused():
    block = Body(Box((0.0, 0.0), (0.2, 0.2)), (2, 2), 2, linear(1e5, 0.2), 1000.0)
    for base, words in ((1.0, "base is 1.0: give a function"), (lambda t: 1.0, "value of base is 1.0"),
                        (([0.0], [(1.0, 1.0)]), "base has 1 times and 1 values: give as many of both")):
        with pytest.raises(ValueError, match=words):
            MPM(Grid(Box((-0.2, -0.2), (0.6, 0.4)), (8, 6)), block, base=base)
