"""A step that Newton's method cannot do leaves the points as they were, and the loop takes shorter ones."""
import numpy as np
import pytest

from coupling import Steps, march
from mpm_fenicsx import LAWS, MPM, Body, Box, Grid, MPMDivergedError, Support


@pytest.fixture
def column():
    """``column()``: soil of 10 cm x 20 cm that collapses; its basis leaves only shorter steps to try."""
    opened = []

    def make():
        grid = Grid(Box((0.0, 0.0), (0.4, 0.3)), (16, 12))
        soil = Body(Box((0.0, 0.0), (0.1, 0.2)), (8, 16), 2, LAWS["mohr_coulomb"](7e4, 0.4, 22.0), 1300.0,
                    f_bar=True)
        held = [Support(lambda x, d=d: x[:, d] < 1e-9, fix) for d, fix in ((1, "xy"), (0, "x"))]
        opened.append(MPM(grid, soil, held, gravity=(0.0, -9.81), inertia="lumped", basis="gimp"))
        return opened[-1]

    yield make
    for solid in opened:
        solid.close()


def test_failed_steps_are_halved(column, options):
    """Two iterations are not always enough for 4 ms: then shorter steps are taken, and the flow is nearly
    that of steps of 2 ms."""
    options(snes_max_it=2, pc_type="lu", snes_rtol=1e-6)
    halved, steps = column(), []
    march(halved, Steps(4e-3, 0.048), [steps.append])
    lengths = np.array([step.dt for step in steps])
    assert lengths.max() == 4e-3 and 4e-3 / 16 <= lengths.min() < 2e-3
    assert np.log2(4e-3 / lengths) == pytest.approx(np.round(np.log2(4e-3 / lengths)), abs=1e-12)
    assert halved.time == pytest.approx(0.048, rel=1e-12) == steps[-1].time
    assert halved.steps == len(steps) > 12 and sum(step.failed for step in steps) > 0
    assert all(step.fraction == step.dt / 4e-3 for step in steps)
    options(snes_max_it=25, pc_type="lu")
    plain, steps = column(), []
    march(plain, Steps(2e-3, 0.048), [steps.append])
    assert len(steps) == 24 and not any(step.failed for step in steps)
    assert np.abs(halved.points.x - plain.points.x).max() < 0.01 * np.abs(plain.points.x
                                                                          - column().points.x).max()


def test_a_failed_step_leaves_the_points(column, options):
    options(snes_max_it=1)
    solid = column()
    before = solid.get_state()
    with pytest.raises(MPMDivergedError, match="step 1, t = 0.04 s"):
        solid.advance(4e-2)
    after = solid.get_state()
    assert solid.time == 0.0 and all(np.array_equal(after[name], values) for name, values in before.items()
                                     if name.startswith("points."))
