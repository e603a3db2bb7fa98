"""Disc on a slope, coarse: it rolls or slides on its surface, and sticks on the nodes of a wall."""
import numpy as np
import pytest

from studies.crossing import rolling

COARSE = dict(h=0.2, dt=4e-3, points=5, time=0.4)


def test_critical_angle_is_where_both_forms_agree():
    """tan(theta) = 3 mu."""
    critical = np.degrees(np.arctan(0.9))
    below, above = (rolling.closed_form(critical + d, 0.3) for d in (-1e-9, 1e-9))
    np.testing.assert_allclose(below, above, rtol=1e-8)


@pytest.mark.parametrize("basis, wall", [("linear", "surface"), ("linear", "plane"), ("ugimp", "surface")])
def test_disc_rolls_on_its_surface(basis, wall):
    """Within 1.3 to 1.8 %, measured with cells of 0.4 radii and steps of 4 ms."""
    found = rolling.run(basis, wall=wall, **COARSE)
    assert abs(found["acceleration"]) < 0.02 and abs(found["spin"]) < 0.02 and abs(found["slip"]) < 0.006


def test_disc_slides_on_a_steep_slope_and_rolls_on_a_rough_one():
    """Measured: 0.3 and -3.4 %, -0.3 and -1.1 %, with steps of 4 ms."""
    slides, rolls = (rolling.run(angle=60.0, mu=mu, **COARSE) for mu in (0.3, 0.8))
    assert abs(slides["acceleration"]) < 0.02 and abs(slides["spin"]) < 0.04 and slides["slip"] > 0.5
    assert abs(rolls["acceleration"]) < 0.015 and abs(rolls["spin"]) < 0.015


def test_nodes_of_a_wall_hold_the_disc():
    """What the surface is for: they press on it over a width of cells, ahead of its middle."""
    found = rolling.run(wall="nodes", transfer="newmark", **COARSE)
    assert found["acceleration"] < -0.5 and found["spin"] < -0.8
