"""Bodies without the material points in rocks: volume, mass, centre of mass, distance, and that they run."""
import numpy as np
import pytest

from dem_liggghts import Cluster, Spheres
from mpm_fenicsx import MPM, Body, Box, Cloud, Grid, Soil, Support, at_rest, linear, seed
from mpm_fenicsx.points.points import half_widths, surface_distances

SOIL = Soil(E=1e6, nu=0.3, rho=1500.0, phi=30.0)
SPHERE = Spheres([(0.42, 0.5, 0.47)], np.zeros((1, 3)), 0.23, 2600.0)
CLUSTER = Cluster.of_spheres([(0.0, 0.0, 0.0), (0.2, 0.0, 0.0)], (0.2, 0.15), 2600.0, (0.5, 0.5, 0.5),
                             quaternion=(np.cos(0.4), 0.0, 0.0, np.sin(0.4)))
ANOTHER = Spheres([(0.2, 0.2, 0.85)], np.zeros((1, 3)), 0.1, 2600.0)
DISCS = Spheres([(0.3, 0.31), (0.7, 0.62)], np.zeros((2, 2)), (0.2, 0.15), 2600.0)


def block(dim, cell=None, points=2, n=10):
    return Body(Box((0.0,) * dim, (1.0,) * dim), (n,) * dim, points, linear(1e6, 0.3), 1000.0, cell=cell)


def volume_of(cluster):
    """Of two balls that overlap [m^3], with their lens."""
    (R, r), d = cluster.radii, np.linalg.norm(np.diff(cluster.centres, axis=0))
    lens = np.pi * (R + r - d)**2 * (d**2 + 2*d*(R + r) - 3*(R - r)**2) / (12*d)
    return 4.0 / 3.0 * np.pi * (R**3 + r**3) - lens


@pytest.mark.parametrize("kind", ["sphere", "cluster", "both"])
@pytest.mark.parametrize("gap", [0.0, 0.025])
def test_volume_and_distance_in_space(kind, gap):
    rocks = {"sphere": SPHERE, "cluster": CLUSTER, "both": [CLUSTER, ANOTHER]}[kind]
    expected = {"sphere": 4.0 / 3.0 * np.pi * 0.23**3, "cluster": volume_of(CLUSTER),
                "both": volume_of(CLUSTER) + 4.0 / 3.0 * np.pi * 0.1**3}[kind]
    x, volume = seed(block(3).without(rocks, gap))
    assert 1.0 - volume.sum() == pytest.approx(expected, rel=0.01)
    centres = {"sphere": SPHERE.x, "cluster": CLUSTER.places, "both": CLUSTER.places}[kind]
    radii = SPHERE.radius if kind == "sphere" else CLUSTER.radii
    away = (np.linalg.norm(x[:, None] - centres, axis=2) - radii).min()
    assert away > gap * (1.0 - 1e-5)
    assert x.min() > 0.0 and x.max() < 1.0


@pytest.mark.parametrize("cell", ["quadrilateral", "triangle"])
def test_mass_centre_and_widths_in_the_plane(cell):
    body = block(2, cell, 2 if cell == "quadrilateral" else 3)
    soil = body.without(DISCS)
    x, volume = seed(soil)
    areas = np.pi * DISCS.radius**2
    assert volume.sum() == pytest.approx(1.0 - areas.sum(), rel=0.01)
    centre = (0.5 - areas @ DISCS.x) / (1.0 - areas.sum())
    np.testing.assert_allclose(volume @ x / volume.sum(), centre, atol=1e-3)
    half = half_widths(soil, volume)
    np.testing.assert_allclose(np.prod(2.0 * half, axis=1), volume, rtol=1e-9)
    np.testing.assert_array_equal(surface_distances(soil, volume), half)


def test_nothing_changes_without_rocks():
    body = Body(Box((0.0, 0.0), (1.0, 0.5)), (10, 10), 2, linear(1e6, 0.3), 1000.0)
    soil = body.without(Spheres.none(2), gap=0.1)
    x, volume = seed(body, even=True)
    order, other = np.lexsort(np.round(x, 9).T), np.lexsort(np.round(soil.shape.x, 9).T)
    np.testing.assert_allclose(soil.shape.x[other], x[order], atol=1e-14)
    np.testing.assert_allclose(soil.shape.half[0], half_widths(body, volume)[0])


def test_again_and_of_a_cloud():
    once = block(2).without(DISCS)
    twice = block(2).without(Spheres(DISCS.x[:1], np.zeros((1, 2)), 0.2, 1.0)).without(
        [Spheres(DISCS.x[1:], np.zeros((1, 2)), 0.15, 1.0)])
    assert twice.shape.volume.sum() == pytest.approx(once.shape.volume.sum(), rel=1e-12)
    cloud = Body(Cloud(once.shape.x, once.shape.volume), None, None, once.law, 1000.0)
    hollow = cloud.without(Spheres([(0.5, 0.1)], np.zeros((1, 2)), 0.08, 1.0))
    assert once.shape.volume.sum() - hollow.shape.volume.sum() == pytest.approx(np.pi * 0.08**2, rel=0.03)


def test_what_a_body_has_is_kept_and_it_starts_at_rest():
    size = (1.0, 0.6)
    stress = at_rest(size[1], SOIL.rho, 10.0, 0.5)
    body = Body(Box((0.0, 0.0), size), (10, 6), 2, SOIL.material(2), SOIL.rho, f_bar=True, stress=stress,
                thickness=0.3, friction=0.2)
    soil = body.without(Spheres([(0.5, 0.3)], np.zeros((1, 2)), 0.15, 2600.0))
    assert (soil.law, soil.rho, soil.f_bar, soil.thickness, soil.friction) == (
        body.law, body.rho, True, 0.3, 0.2)
    floor = Support(lambda x: x[:, 1] < 1e-9, "xy")
    sides = [Support(lambda x: (x[:, 0] < 1e-9) | (x[:, 0] > 1.0 - 1e-9), "x")]
    solid = MPM(Grid(Box((0.0, 0.0), (1.0, 0.8)), (10, 8)), soil, [floor, *sides], gravity=(0.0, -10.0),
                inertia="lumped")
    for _ in range(3):
        solid.advance(1e-3)
    push = 0.3 * SOIL.rho * np.pi * 0.15**2 * 10.0  # of soil on the rock [N]: its counterpart is missing
    assert solid.momentum()[1] == pytest.approx(push * 3e-3, rel=0.3)
    np.testing.assert_allclose(-soil.stress(np.array([(0.5, 0.1)]))[0, 1], SOIL.rho * 10.0 * 0.5)
    solid.close()


@pytest.mark.parametrize("make, said", [
    (lambda: block(2).without(3.0), "give Spheres, a Cluster, or a list"),
    (lambda: block(2).without(SPHERE), "rocks have 3 coordinates and the body has 2"),
    (lambda: block(2).without(DISCS, gap=-1.0), "gap is -1.0 m"),
    (lambda: block(2).without(Spheres([(0.5, 0.5)], np.zeros((1, 2)), 1.0, 1.0)), "leave none of the 400"),
], ids=["no_rock", "dimensions", "gap", "nothing_left"])
def test_bad_input(make, said):
    with pytest.raises(ValueError, match=said):
        make()
