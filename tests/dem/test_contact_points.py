"""Contacts as they are shown: places, forces and overlaps."""
import numpy as np
import pytest

from dem_liggghts import Material, Scene, Spheres, Wall


@pytest.mark.parametrize("dem", ["reference", "liggghts"])
def test_contacts_of_a_pile(dem):
    """One sphere falls on another on a floor: Hertz' forces, amid the overlap and at the floor."""
    r, E, nu = 0.01, 1e7, 0.3
    x = [(0.0, 1.001 * r, 0.0), (0.0, 3.002 * r, 0.0), (0.5, 0.3, 0.0)]
    floor = Wall([(-1, 0, -1), (1, 0, -1), (0, 0, 1)], [(0, 2, 1)])
    v = [(0.0, -0.5, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, 0.0)]
    scene = Scene(Spheres(x, v, r, 2600.0), floor, Material(E, nu), Material(E, nu))
    grains = scene.open(dem, 1e-6)
    assert not len(grains.contact_points())
    grains.advance(100, floor.nodes, np.zeros((3, 3)))
    found, (low, high, _) = grains.contact_points(), grains.particles()["x"]
    grains.close()
    pair, wall = found[found["wall"] < 0], found[found["wall"] >= 0]
    assert len(pair) == len(wall) == 1 and {int(pair["particle"][0]), int(pair["other"][0])} == {1, 2}
    assert (wall["particle"][0], wall["other"][0], wall["wall"][0]) == (1, 0, 0)
    overlap = 2 * r - (high[1] - low[1]), r - low[1]
    assert (pair["overlap"][0], wall["overlap"][0]) == pytest.approx(overlap) and min(overlap) > 1e-6
    modulus, sign = E / (1 - nu**2) / 2, 1.0 if pair["particle"][0] == 2 else -1.0
    force = 4 / 3 * modulus * np.sqrt([r / 2 * overlap[0] ** 3, r * overlap[1] ** 3])
    assert pair["force"][0] == pytest.approx([0.0, sign * force[0], 0.0])
    assert wall["force"][0] == pytest.approx([0.0, force[1], 0.0])
    assert pair["x"][0] == pytest.approx([0.0, low[1] + r - 0.5 * overlap[0], 0.0], abs=1e-12)
    assert wall["x"][0] == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)
