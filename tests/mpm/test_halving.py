"""A step that Newton's method cannot do is halved, and leaves the points as they were before it is."""
import numpy as np
import pytest

from mpm_fenicsx import LAWS, MPM, Body, Box, Grid, MPMDiverged, Support


@pytest.fixture
def column():
    """``column(halvings)``: soil of 10 cm x 20 cm that collapses."""
    opened = []

    def make(halvings):
        grid = Grid(Box((0.0, 0.0), (0.4, 0.3)), (16, 12))
        soil = Body(Box((0.0, 0.0), (0.1, 0.2)), (8, 16), 2, LAWS["mohr_coulomb"](5e4, 0.4, 22.0), 1300.0, f_bar=True)
        held = [Support(lambda x, d=d: x[:, d] < 1e-9, fix) for d, fix in ((1, "xy"), (0, "x"))]
        opened.append(MPM(grid, soil, held, gravity=(0.0, -9.81), inertia="lumped", halvings=halvings))
        return opened[-1]

    yield make
    for solid in opened:
        solid.close()


def test_failed_steps_are_halved(column, options):
    """Two iterations are not always enough for 4 ms: then shorter steps are taken, and the flow is nearly the same."""
    options(snes_max_it=2)
    halved, substeps = column(4), []
    for _ in range(12):
        halved.advance(4e-3)
        substeps.append(halved.substeps)
    assert min(substeps) == 1 and 2 < max(substeps) <= 16 and halved.time == pytest.approx(0.048, rel=1e-12)
    assert halved.steps == sum(substeps)
    options(snes_max_it=25)
    plain = column(0)
    for _ in range(12):
        plain.advance(4e-3)
    assert plain.substeps == 1
    assert np.abs(halved.points.x - plain.points.x).max() < 0.01 * np.abs(plain.points.x - column(0).points.x).max()


def test_a_failed_step_leaves_the_points(column, options):
    options(snes_max_it=1)
    solid = column(1)
    before = solid.get_state()
    with pytest.raises(MPMDiverged, match="step 1, t = 0.02 s"):
        solid.advance(4e-2)
    after = solid.get_state()
    assert solid.time == 0.0 and all(np.array_equal(after[name], values) for name, values in before.items()
                                     if name.startswith("points."))
