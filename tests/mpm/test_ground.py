"""Ground of several soils starts at rest: level, under water, inclined."""
import numpy as np
import pytest

from mpm_fenicsx import MPM, Body, Box, Grid, Ground, Layer, Mesh, Support, at_rest, cam_clay, mohr_coulomb
from mpm_fenicsx.grid.background import whole_mesh

G = 10.0
LAWS = {"sand": mohr_coulomb(2e6, 0.3, 34.0), "silt": mohr_coulomb(1e6, 0.3, 28.0, cohesion=500.0),
        "clay": cam_clay(25.0, 0.1, 0.02, 1e6, 1e5)}
LAYERS = [Layer(0.4, 1600.0, 0.44, 34.0), Layer(0.2, 1900.0, 0.6), Layer(None, 2000.0, 0.8)]
TOPS = (1.0, 0.6, 0.4, 0.0)


def column(ground, rho=(1600.0, 1900.0, 2000.0), dim=2, **others):
    """Three soils between smooth walls, bonded."""
    size = (0.4, 1.0, 0.2)[:dim]
    bodies = []
    for n, law in enumerate(LAWS.values()):
        low, high = np.zeros(dim), np.array(size)
        low[1], high[1] = TOPS[n + 1], TOPS[n]
        bodies.append(Body(Box(tuple(low), tuple(high)), Grid.counts(high - low, 0.1), 2, law, rho[n],
                           stress=ground.stress, f_bar=n == 0))
    room = (0.4, 1.2, 0.2)[:dim]
    held = [Support(lambda x: x[:, 1] < 1e-9, "xyz"[:dim])]
    held += [Support(lambda x, d=d: (x[:, d] < 1e-9) | (x[:, d] > size[d] - 1e-9), "xyz"[d])
             for d in range(dim) if d != 1]
    return MPM(Grid(Box((0.0,) * dim, room), Grid.counts(room, 0.1)), bodies, held,
               gravity=(0.0, -G, 0.0)[:dim], inertia="lumped", bonded=True, **others)


def unbalanced(solid, dt=1e-3):
    """Largest acceleration that one step leaves, over that of gravity."""
    solid.advance(dt)
    return max(np.abs(body.points.v).max() for body in solid.bodies) / (G * dt)


@pytest.mark.parametrize("dim", [2, 3])
def test_level_layers_are_in_equilibrium_to_round_off(dim):
    ground = Ground(LAYERS, (0.0, 1.0, 0.0)[:dim], (0.0, -G, 0.0)[:dim])
    solid = column(ground, dim=dim)
    weight = [0.0, 0.4 * 1600.0 * G, 0.4 * 1600.0 * G + 0.2 * 1900.0 * G]
    stress = solid.cauchy_stress()
    x = np.concatenate([body.points.x for body in solid.bodies])
    of = np.repeat(range(3), [len(body.points) for body in solid.bodies])
    depth = np.array(TOPS)[of] - x[:, 1]  # in its layer
    vertical = -np.array(weight)[of] - np.array([1600.0, 1900.0, 2000.0])[of] * G * depth
    np.testing.assert_allclose(stress[:, 1, 1], vertical, rtol=1e-9)
    for d in set(range(dim)) - {1}:
        np.testing.assert_allclose(stress[:, d, d], np.array([0.44, 0.6, 0.8])[of] * vertical, rtol=1e-9)
    assert unbalanced(solid) < 1e-11
    for _ in range(50):
        solid.advance(1e-2)
    assert max(np.abs(body.points.v).max() for body in solid.bodies) < 1e-9
    solid.close()


def test_another_density_is_not_in_equilibrium():
    solid = column(Ground(LAYERS, (0.0, 1.0), (0.0, -G)), rho=(1600.0, 1900.0, 2100.0))
    assert unbalanced(solid) > 1e-3
    solid.close()


@pytest.mark.parametrize("water", [0.0, 0.4, 0.5])
def test_a_water_table_takes_from_the_weight(water):
    """Effective stress, with buoyancy on what lies below: in equilibrium to round-off where the table is at
    the side of a cell, and in the middle of one, between its points."""
    ground = Ground(LAYERS, (0.0, 1.0), (0.0, -G), water=water)
    solid = column(ground, body_force=ground.buoyancy)
    lowest = np.array([[0.1, 0.0]])
    total = G * (0.4 * 1600.0 + 0.2 * 1900.0 + 0.4 * 2000.0)
    assert ground.stress(lowest)[0, 1, 1] == pytest.approx(-total + 1000.0 * G * (1.0 - water), rel=1e-12)
    assert unbalanced(solid) < (1e-11 if water != 0.5 else 0.02)
    solid.close()


def slope(angle, layers, laws, length=2.4, h=0.1):
    """Ground with a surface inclined by ``angle`` [degrees], downhill along x, in a grid along the surface,
    and gravity along y; also the normal of the surface."""
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    axes = np.array([(c, -s), (s, c)])  # rows: downhill, normal
    turned = lambda box: (lambda vertices, cells: Mesh(vertices @ axes, cells, "quadrilateral"))(  # noqa: E731
        *whole_mesh(Grid(box, Grid.counts(box.size, h))))
    top, thickness = 0.6, 0.3
    ground = Ground(layers, top * axes[1], (0.0, -G), axes[1])
    boxes = Box((0.0, thickness), (length, top)), Box((0.0, 0.0), (length, thickness))
    bodies = [Body(turned(box), None, 2, law, layer.rho, stress=ground.stress)
              for box, law, layer in zip(boxes, laws, layers)]
    held = [Support(lambda x: x @ axes[1] < 1e-9, "xy"),
            Support(lambda x: (x @ axes[0] < 1e-9) | (x @ axes[0] > length - 1e-9), "xy")]
    solid = MPM(turned(Box((0.0, 0.0), (length, top + h))), bodies, held, gravity=(0.0, -G), inertia="lumped",
                bonded=True)
    return solid, ground, axes


@pytest.mark.parametrize("angle", [0.0, 15.0, 26.0])
def test_layers_on_a_slope_are_those_of_an_infinite_one(angle):
    """sigma_n = W g cos(a), tau = W g sin(a) with the mass W above per area; all are at rest, between ends
    that are held, to the round-off of a stress that grows linearly."""
    layers = [Layer(0.3, 1600.0, 0.5, 30.0), Layer(None, 2000.0, 0.6)]
    laws = mohr_coulomb(2e6, 0.3, 30.0), mohr_coulomb(5e6, 0.3, 30.0, cohesion=5e3)
    solid, ground, axes = slope(angle, layers, laws)
    a = np.radians(angle)
    for depth, mass in (0.2, 0.2 * 1600.0), (0.5, 0.3 * 1600.0 + 0.2 * 2000.0):
        stress = ground.stress(np.array([1.0 * axes[0] + (0.6 - depth) * axes[1]]))[0, :2, :2]
        along = axes @ stress @ axes.T
        assert along[1, 1] == pytest.approx(-mass * G * np.cos(a), rel=1e-12)
        assert along[0, 1] == pytest.approx(mass * G * np.sin(a), abs=1e-9)
        assert along[0, 0] <= 0.5 * along[1, 1] * (1.0 - 1e-12)
    middle = [np.abs(body.points.x @ axes[0] - 1.2) < 0.5 for body in solid.bodies]
    start = [body.points.x[here] for body, here in zip(solid.bodies, middle)]
    solid.advance(1e-3)
    speed = max(np.abs(body.points.v[here]).max() for body, here in zip(solid.bodies, middle))
    assert speed < 1e-9 * G * 1e-3
    for _ in range(40):
        solid.advance(2e-3)
    moved = max(np.abs(body.points.x[here] - x).max() for body, here, x in zip(solid.bodies, middle, start))
    assert moved < 1e-6
    solid.close()


def test_a_single_layer_is_that_of_at_rest():
    """Gravity along inclined axes, and a surface that is inclined, are the same."""
    c, s = np.cos(0.3), np.sin(0.3)
    axes = np.array([(c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0)])
    x = np.random.default_rng(1).uniform(-1.0, 1.0, (20, 3))
    along = at_rest(1.0, 1500.0, axes @ (0.0, -9.81, 0.0), 0.4, 32.0)(x @ axes.T)
    ground = Ground([Layer(None, 1500.0, 0.4, 32.0)], axes[1], (0.0, -9.81, 0.0), axes[1])
    np.testing.assert_allclose(axes @ ground.stress(x) @ axes.T, along, rtol=0, atol=1e-9)


@pytest.mark.parametrize("make, words", [
    (lambda: Layer(0.0, 1600.0, 0.5), "thickness of the layer is 0.0 m"),
    (lambda: Layer(1.0, 0.0, 0.5), "rho of the layer is 0.0 kg/m.3: the density must be positive"),
    (lambda: Layer(1.0, 1600.0, -0.5), "ratio is -0.5: the ratio of horizontal to vertical stress must be"),
    (lambda: Layer(1.0, 1600.0, 0.5, 90.0), "phi is 90.0 degrees"),
    (lambda: Ground([], (0, 0), (0, -G)), "the ground has no layers"),
    (lambda: Ground([Layer(None, 1600.0, 0.5)] * 2, (0, 0), (0, -G)), "layer 0 has no thickness"),
    (lambda: Ground(LAYERS, (0, 0), (0, -G), (0.0, -1.0)), "its part along the normal of the surface"),
    (lambda: Ground(LAYERS, (0, 0), (0, 0)), "the surface has no normal"),
    (lambda: Ground(LAYERS, (0, 0, 0), (0, -G)), "at is"),
    (lambda: Ground(LAYERS, (0, 0), (0, -G), water=-1.0), "water is -1.0 m: give the depth of"),
    (lambda: Ground(LAYERS, (0, 0), (0, -G), (0.1, 1.0), water=1.0), "water is 1.0 m, and the surface is a"),
    (lambda: Ground([Layer(None, 900.0, 0.5)], (0, 0), (0, -G), water=1.0), "layer 0 has a density of 900")])
def test_what_cannot_be_meant_is_told(make, words):
    with pytest.raises(ValueError, match=words):
        make()
