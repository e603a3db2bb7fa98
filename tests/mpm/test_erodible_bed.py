"""A flow over a bed of its own strength, bonded to it: a weak bed is taken along, a strong one stays."""
import numpy as np
import pytest

from mpm_fenicsx import MPM, Body, Box, Grid, Support, at_rest, mohr_coulomb

SLOPE, RHO = np.radians(25.0), 1600.0
GRAVITY = 9.81 * np.array([np.sin(SLOPE), -np.cos(SLOPE)])


def eroded(cohesion, speed=3.0):
    """Mass of a bed of this cohesion [Pa] that has moved by more than half a cell 0.4 s after soil came over
    it at ``speed`` [m/s], as a part of the bed's."""
    bed = Body(Box((0.0, 0.0), (1.6, 0.2)), (16, 2), 2, mohr_coulomb(2e6, 0.3, 30.0, cohesion=cohesion), RHO,
               f_bar=True, stress=at_rest(0.2, RHO, GRAVITY, 0.43, 30.0))
    flow = Body(Box((0.0, 0.2), (0.4, 0.5)), (4, 3), 2, mohr_coulomb(2e6, 0.3, 30.0), RHO, f_bar=True,
                velocity=(speed, 0.0))
    held = [Support(lambda x: (x[:, 0] < 1e-9) & (x[:, 1] < 0.2 + 1e-9), "xy", name="upstream"),
            Support(lambda x: x[:, 0] > 1.6 - 1e-9, "x", name="downstream"),
            Support(lambda x: x[:, 1] < 1e-9, "xy", name="rock")]
    bodies = [bed, flow] if speed else bed
    solid = MPM(Grid(Box((-0.2, 0.0), (1.6, 0.8)), (18, 8)), bodies, held, gravity=GRAVITY, inertia="lumped",
                bonded=True, outflow="remove")
    points = solid.bodies[0].points
    start, mass = points.x[:, 0].copy(), points.mass.sum()
    while solid.time < 0.4 - 1e-9:
        solid.advance(4e-3)
    moved = points.mass[points.x[:, 0] - start[points.gid] > 0.05].sum()
    solid.close()
    return moved / mass


@pytest.mark.parametrize("cohesion, speed, low, high", [
    (200.0, 3.0, 0.2, 0.4),  # 0.28
    (2e3, 3.0, 0.0, 0.1),  # 0.03
    (2e4, 3.0, 0.0, 0.0),
    (200.0, 0.0, 0.0, 0.0)])  # without a flow
def test_a_weak_bed_is_eroded_and_a_strong_one_is_not(cohesion, speed, low, high):
    assert low <= eroded(cohesion, speed) <= high
