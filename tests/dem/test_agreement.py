"""The two back ends on the same scenes: same scheme, same step, same force."""
import numpy as np

from dem_liggghts import Interaction, Material, Scene, Spheres


def largest_difference(both, scene, dt, windows, steps, window):
    """Largest difference of the nodal forces over the largest nodal force, and the particles at the end."""
    reference, liggghts = both(scene, dt)
    forces = []
    for _ in range(windows):
        x, v = window(reference.time, steps * dt)
        forces.append([dem.advance(steps, x, v) for dem in (reference, liggghts)])
    ends = reference.particles(), liggghts.particles()
    liggghts.close()
    forces = np.array(forces)
    assert np.abs(forces).max() > 0.0
    return np.abs(forces[:, 0] - forces[:, 1]).max() / np.abs(forces).max(), ends


def test_oblique_impact_with_friction_and_restitution(both, sheet, dim, record_property, capsys):
    """Restitution 0.7, friction 0.3: stick, slip and rebound from a rising, tilting wall."""
    wall = sheet(dim, 11, height=lambda x: 0.05 * x)
    up, along = np.eye(dim)[-1], np.eye(dim)[0]
    scene = Scene(Spheres([0.0101 * up], [0.3 * along - 0.5 * up], 0.01, 7850.0), wall, Material(2.1e11, 0.3),
                  Material(7e10, 0.33), at_wall=Interaction(0.7, 0.3), gravity=-9.81 * up)

    def window(t, length):
        return wall.nodes + np.outer(wall.nodes[:, 0] * t, up), np.outer(wall.nodes[:, 0], up)

    difference, (a, b) = largest_difference(both, scene, 1e-7, 500, 10, window)
    report(capsys, record_property, f"oblique impact, {dim}D", difference)
    assert difference < 1e-6
    for name in ("x", "v", "omega"):
        assert np.abs(a[name] - b[name]).max() < 1e-9 * np.abs(a[name]).max()
    assert b["v"][0, dim - 1] > 0.0 and np.abs(b["omega"]).max() > 1.0


def test_tumbling_spheres(both, tumble, dim, record_property, capsys):
    """Five spheres on a waving wall: contacts of all kinds, short enough that round-off does not grow."""
    scene, window = tumble(dim)
    difference, _ = largest_difference(both, scene, 5e-5, 45, 20, window)
    report(capsys, record_property, f"tumbling spheres, {dim}D", difference)
    assert difference < 1e-6


def report(capsys, record_property, what, difference):
    record_property("relative difference of the back ends", float(difference))
    with capsys.disabled():
        print(f"\n{what}: the back ends differ by {difference:.1e} of the largest force")
