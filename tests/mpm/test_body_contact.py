"""Contact between bodies that have fields of the grid of their own."""
import numpy as np
import pytest

from mpm_fenicsx import MPM, Body, Box, Grid, linear


@pytest.fixture
def start():
    opened = []

    def make(*args, **more):
        opened.append(MPM(*args, **more))
        return opened[-1]
    yield make
    for solid in opened:
        solid.close()


def velocity(body):
    """Mean of the points of a body [m/s]."""
    p = body.points
    return p.mass @ p.v / p.mass.sum()


def bars(v, gap, n, offset=0.0):
    """Two bars 1 m long and 1/4 m thick in body cells of 1/n m that fly along x at the velocities v [m/s],
    ``gap`` [m] apart in the middle of a grid of the same cells, moved by ``offset`` cells, E 1 MPa."""
    h = 1.0 / n
    make = lambda x, v: Body(Box((x, 0.0), (x + 1.0, 4 * h)), (n, 4), 2, linear(1e6, 0.0),  # noqa: E731
                             1000.0, velocity=np.array([v, 0.0]))
    first, second = make(offset * h - 1.0 - gap / 2, v[0]), make(offset * h + gap / 2, v[1])
    return Grid(Box((-1.5, -4 * h), (1.5, 8 * h)), (3 * n, 12)), [first, second]


def test_bodies_that_touch_part(start):
    """Both move as they did, to round-off: nothing pulls."""
    solid = start(*bars((-1.0, 1.0), 0.0, 16))
    for _ in range(200):
        solid.advance(1e-3)
    assert velocity(solid.bodies[0])[0] == pytest.approx(-1.0, abs=1e-13)
    assert velocity(solid.bodies[1])[0] == pytest.approx(1.0, abs=1e-13)


@pytest.mark.parametrize("basis", ["linear", "gimp"])
def test_bars_exchange_their_velocities(start, basis):
    """Of equal impedance (Saint-Venant): what strikes stops, what rests flies on, within 2 %; contact begins
    where they touch, and the energy never rises."""
    grid, bodies = bars((0.1, 0.0), 0.02, 64, 0.37)
    solid, step = start(grid, bodies, basis=basis), 0.5 / 64 / 1000.0**0.5
    energy, momentum, touch = [sum(solid.energy().values())], solid.momentum(), None
    while solid.time < 0.02 / 0.1 + 3.0 / 1000.0**0.5:
        solid.advance(step)
        energy.append(sum(solid.energy().values()))
        if touch is None and solid.reaction("bodies 0 and 1").any():
            touch = solid.time
    assert touch == pytest.approx(0.2, abs=5 * step)
    assert velocity(solid.bodies[0])[0] == pytest.approx(0.0, abs=0.002)
    assert velocity(solid.bodies[1])[0] == pytest.approx(0.1, abs=0.002)
    assert max(energy) <= energy[0] * (1 + 1e-12)
    np.testing.assert_allclose(solid.momentum(), momentum, rtol=0, atol=1e-6 * momentum[0])
