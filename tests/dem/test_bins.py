"""Scattered, ejected and very different spheres: LIGGGHTS' neighbour lists must not grow with the box."""
import numpy as np
import pytest

from dem_liggghts import Interaction, Material, Scene, Spheres, Wall

SOFT, NONE = Material(1e8, 0.3), {dim: np.zeros((0, dim)) for dim in (2, 3)}


@pytest.mark.parametrize("n", [200, 201])
@pytest.mark.parametrize("size", [1.0, 1e4])
def test_scattered_spheres(dem, n, size):
    """In a hall (LIGGGHTS made 1e8 bins for 201 of them, none for 200), and over 3,000 km."""
    x = np.random.default_rng(1).uniform(0, 1, (n, 3)) * [300, 200, 60] * size
    v = np.random.default_rng(2).normal(size=(n, 3)) * 5
    many = dem(Scene(Spheres(x, v, 0.5, 2600.0), Wall.none(3), SOFT), 5e-4)
    many.advance(500, NONE[3], NONE[3])
    free = np.all(many.particles()["v"] == v, axis=1)
    assert free.sum() > 0.95 * n
    assert many.particles()["x"][free] == pytest.approx((x + v * many.time)[free], rel=1e-12)


def heap(dim, far):
    """Layers of spheres that fall on each other, and one that has flown ``far`` away [m]."""
    side = int(np.ceil(240 ** (1 / dim)))
    grid = np.stack(np.meshgrid(*[np.arange(side)] * dim, indexing="ij"), axis=-1).reshape(-1, dim)[:240]
    random = np.random.default_rng(5)
    x = 0.0205 * grid + 2e-4 * random.random(grid.shape)
    v = 0.3 * random.normal(size=x.shape)
    x[0], v[0] = -far, -1.0
    meet = Interaction(0.7, 0.3)
    return Scene(Spheres(x, v, 0.01, 2500.0), Wall.none(dim), Material(1e7, 0.3), None, meet, meet)


@pytest.mark.parametrize("far", [1.0, 1e5])
def test_one_flies_away(both, dim, far):
    """The others collide as they do with the built-in back end."""
    scene = heap(dim, far)
    ends = []
    for one in both(scene, 2e-5):
        for _ in range(5):
            one.advance(100, NONE[dim], NONE[dim])
        ends.append(one.particles())
        one.close()
    a, b = ends
    assert b["x"][1:] == pytest.approx(a["x"][1:], abs=1e-9) and b["v"][1:] == pytest.approx(a["v"][1:],
                                                                                             abs=1e-6)
    assert b["x"][0, :dim] == pytest.approx(-(far + 0.01) * np.ones(dim), rel=1e-9)
    assert np.abs(b["v"][1:, :dim] - scene.spheres.v[1:]).max() > 0.1


def test_many_small_spheres_around_a_large_one(dem):
    """More than LIGGGHTS has room for by default."""
    n, large, small = 3000, 1.0, 0.01
    k = np.arange(n) + 0.5
    tilt, turn = np.arccos(1 - 2 * k / n), np.pi * (1 + 5**0.5) * k
    around = np.column_stack([np.cos(turn) * np.sin(tilt), np.sin(turn) * np.sin(tilt), np.cos(tilt)])
    x = np.concatenate([[[0.0, 0.0, 0.0]], (large + small) * around])
    v = np.concatenate([[[0.0, 0.0, 0.0]], -0.01 * around])
    cloud = dem(Scene(Spheres(x, v, [large] + [small] * n, 2500.0), Wall.none(3), SOFT), 2e-5)
    cloud.advance(50, NONE[3], NONE[3])
    p = cloud.particles()
    back = (p["v"][1:] * around).sum(axis=1)
    assert back.min() > -0.01 and back.max() - back.min() < 1e-3 * np.abs(back).max() + 1e-9
