"""Material points as the interface: the particles stay where the points are, whatever forces act on them."""
import numpy as np

from mpm_fenicsx import MPM, Body, Box, Grid, Support, mohr_coulomb, of_points


def test_particles_stay_with_the_points():
    """Dry soil that falls apart, pushed at some of its points; the forces arrive at the nodes."""
    soil = Body(Box((0.0, 0.0), (0.04, 0.06)), (8, 12), 3, mohr_coulomb(50e3, 0.4, 22.0), 1300.0,
                cell="triangle", f_bar=True)
    grid = Grid(Box((0.0, 0.0), (0.12, 0.08)), (12, 8))
    supports = [Support(lambda x: x[:, 1] < 1e-6, "xy", name="the floor"),
                Support.column("x", 0.0, grid, "x")]
    solid = MPM(grid, soil, supports, of_points(soil), gravity=(0.0, -9.81), inertia="lumped")
    force = np.zeros((solid.count, 2))
    for step in range(60):
        force[:] = 0.0
        force[step % 7::7, 0] = -0.02
        x, v = solid.advance(1e-3, force)
        assert np.abs(solid.applied - force.sum(axis=0)).max() < 1e-12
    assert np.abs(x - solid.points.x).max() < 1e-14 and np.abs(v - solid.points.v).max() < 1e-12
    assert np.abs(v).max() > 0.2
    assert solid.snapshot()["interface"][1]["vertex"].shape == (solid.count, 1)
    solid.close()
