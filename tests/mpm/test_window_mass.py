"""The mass with which boundary particles resist a force over one step."""
import numpy as np
import pytest

from mpm_fenicsx import LAWS, Support

DT = 0.05


def answer(solid, force):
    """How far a force moves each boundary particle in one step [m]."""
    state = solid.get_state()
    x = solid.advance(DT, 0.0 * force)[0].copy()
    solid.set_state(state)
    moved = solid.advance(DT, force)[0] - x
    solid.set_state(state)
    return moved


@pytest.mark.parametrize("inertia", ["lumped", "consistent"])
@pytest.mark.parametrize("shift", [0.0, 0.1])
def test_window_mass_is_that_of_a_free_body(make_mpm, shift, inertia):
    """dt^2/2 over what a unit force does in a step, within a factor of two: from cells that are much larger
    than the way of a wave in it (the nodes' mass) to much smaller ones (dt^2/4 times the stiffness, a
    thousand times as much), on nodes and between them."""
    found = {}
    for E in (1e-3, 10.0, 1e3, 1e5):
        held = Support(lambda x: x[:, 1] < 0.1, "xy", name="the bottom")
        solid = make_mpm(box=((0.0, 0.0), (4.0, 1.0)), h=0.25, law=LAWS["linear"](E, 0.3), points=3,
                         segments=16, inertia=inertia, supports=[held], shift=shift)
        solid.advance(DT)
        mass, force = solid.window_mass(), np.zeros((17, 2))
        assert mass.shape == (17,) and (mass > 0).all() and mass[8] == pytest.approx(mass[9], rel=1e-6)
        force[8, 1] = -1e-4 * E
        found[E] = mass[8] / (0.5 * DT**2 * force[8, 1] / answer(solid, force)[8, 1]), mass[8]
    assert all(0.499 < ratio < 2.0 for ratio, _ in found.values()), found
    assert found[1e5][1] > 500 * found[1e-3][1]
    if inertia == "lumped":
        assert found[1e-3][0] == pytest.approx(1.0, rel=0.02)


def test_window_mass_of_what_is_held_is_infinite(make_mpm):
    top = Support(lambda x: x[:, 1] > 0.6, "xy", name="the upper side")
    solid = make_mpm(supports=[top], shift=0.0)
    assert np.isinf(solid.window_mass()).all()  # no step yet: nothing is known
    solid.advance(DT)
    assert np.isinf(solid.window_mass()).all()


RANKS = """
import sys
import numpy as np
from mpm_fenicsx import LAWS, MPM, Body, Box, Grid, Interface
box = Box((0, 0), (4, 1))
solid = MPM(Grid(Box((-1, -1), (5, 2)), (24, 12)), Body(box, (16, 4), 3, LAWS["linear"](1e3, 0.3), 1.0),
            interface=Interface.top(box, 13, 0.1))
for n in range(3):
    solid.advance(0.05, np.outer(np.arange(14), (1.0, -1.0)))
mass = solid.window_mass()
if solid.comm.rank == 0:
    np.save(sys.argv[1], mass)
"""


def test_window_mass_is_the_same_on_two_ranks(on_ranks, tmp_path):
    masses = []
    for n in (1, 2):
        done = on_ranks(n, RANKS, tmp_path / f"{n}.npy")
        assert done.returncode == 0, done.stderr
        masses.append(np.load(tmp_path / f"{n}.npy"))
    assert masses[0].shape == (14,) and masses[1] == pytest.approx(masses[0], rel=1e-10)
