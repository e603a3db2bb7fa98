"""Keys of cases for the soil at the start: weight, layers, water, a checkpoint of another run."""
import numpy as np
import pytest

from coupling.records.history import read
from mpm_fenicsx import MPM, Body, Box, Grid, InitialGround, InitialState, Soil, Support

G = 10.0
SOIL = Soil(E=1e6, nu=0.3, rho=1500.0, phi=30.0)
COARSE = dict(h=0.025, dt=1e-3, t_end=0.03)


def unbalanced(dim=2, density=None, **keys):
    """Largest acceleration over gravity's that the first step leaves in ground between smooth walls, and the
    stresses at its points."""
    size = (0.4, 1.0, 0.2)[:dim]
    body = Body(Box((0.0,) * dim, size), Grid.counts(size, 0.1), 2, SOIL.material(dim), SOIL.rho)
    held = [Support(lambda x: x[:, 1] < 1e-9, "xyz"[:dim])]
    held += [Support(lambda x, d=d: (x[:, d] < 1e-9) | (x[:, d] > size[d] - 1e-9), "xyz"[d])
             for d in range(dim) if d != 1]
    gravity = (0.0, -G, 0.0)[:dim]
    stated = InitialGround(initial="geostatic", **keys).ground(body, SOIL, gravity)
    solid = MPM(Grid(Box((0.0,) * dim, size), Grid.counts(size, 0.1)), supports=held, gravity=gravity,
                inertia="lumped", **stated)
    stress, x = solid.cauchy_stress(), np.concatenate([one.points.x for one in solid.bodies])
    solid.advance(1e-3)
    left = max(np.abs(one.points.v).max() for one in solid.bodies) / (G * 1e-3)
    solid.close()
    return left, stress, x


@pytest.mark.parametrize("dim", [2, 3])
def test_layers_rest_with_the_numbers_of_each(dim):
    """Weights 1500 and 2000 kg/m^3, K0 = 1 - sin phi of each."""
    left, stress, x = unbalanced(dim, layers=(0.4,), layer_rho=(1500.0, 2000.0), layer_phi=(30.0, 20.0))
    deep = x[:, 1] < 0.6
    vertical = np.where(deep, -0.4 * 1500.0 * G - (0.6 - x[:, 1]) * 2000.0 * G, -(1.0 - x[:, 1]) * 1500.0 * G)
    np.testing.assert_allclose(stress[:, 1, 1], vertical, rtol=1e-9)
    ratio = 1.0 - np.sin(np.radians(np.where(deep, 20.0, 30.0)))
    np.testing.assert_allclose(stress[:, 0, 0], ratio * vertical, rtol=1e-9)
    assert left < 1e-11 and 0 < deep.sum() < len(x)


def test_water_takes_its_weight_off():
    left, stress, x = unbalanced(water=0.5, ratio=0.6)
    depth = 1.0 - x[:, 1]
    vertical = -G * (1500.0 * depth - 1000.0 * np.maximum(depth - 0.5, 0.0))
    np.testing.assert_allclose(stress[:, 1, 1], vertical, rtol=1e-9)
    np.testing.assert_allclose(stress[:, 0, 0], 0.6 * vertical, rtol=1e-9)
    assert left < 1e-11


def test_layers_of_one_soil_fall_as_one(column, tmp_path):
    """But for F-bar, whose means are those of each layer."""
    one = column.main(**COARSE, f_bar=False, out=tmp_path / "one")["solid"]
    two = column.main(**COARSE, f_bar=False, layers=(0.1,), out=tmp_path / "two")["solid"]
    for name in ("front", "height", "kinetic", "elastic", "volume"):
        np.testing.assert_allclose(two[name], one[name], rtol=1e-6)
    rougher = column.main(**COARSE, layers=(0.1,), layer_phi=(22.0, 40.0), out=tmp_path / "rough")["solid"]
    assert rougher["front"][-1] < one["front"][-1] - 1e-4


def test_a_run_starts_where_another_one_ended(column, tmp_path, capsys):
    """With the velocities as one run, and books that close; without them, and with another floor, another."""
    layers = dict(layers=(0.1,), layer_rho=(1300.0, 1500.0), layer_ratio=None)
    whole = column.main(**{**COARSE, "t_end": 0.06}, **layers, out=tmp_path / "whole")["solid"]
    column.main(**COARSE, **layers, checkpoint="end", out=tmp_path / "first")
    second = dict(**COARSE, **layers, start=tmp_path / "first")
    moving = column.main(**second, start_velocities=True, out=tmp_path / "moving")["solid"]
    at_rest = column.main(**second, floor="slip", out=tmp_path / "at_rest")["solid"]
    for name in ("front", "height", "kinetic", "elastic"):
        assert moving[name][-1] == pytest.approx(whole[name][-1], rel=1e-6), name
    assert "books of momentum" not in capsys.readouterr().err
    assert at_rest["kinetic"][0] < 0.1 * moving["kinetic"][0]
    assert read(tmp_path / "at_rest" / "history.csv")["time"][-1] == pytest.approx(0.03)


@pytest.mark.parametrize("keys, sentence", [
    (dict(layer_phi=(20.0, 30.0)), "layer_phi=20,30 has no effect here, it counts with layers="),
    (dict(start_places=False), "start_places=False has no effect here, it counts with start=, a checkpoint"),
    (dict(layers=(0.07,)), r"layers is \(0.07,\) m: give growing depths below 0.2 m that are multiples of "
     "0.0125 m, the height"),
    (dict(layers=(0.1, 0.05)), "give growing depths"), (dict(layers=(0.2,)), "give growing depths"),
    (dict(layers=(0.1,), layer_rho=(1e3,)), r"layer_rho is \(1000.0,\): give 2 numbers"),
    (dict(layers=(0.1,), layer_rho=(1e3, -1e3)), "rho of the layer is -1000.0"),
    (dict(water=0.1, soil_rho=900.0), "density of 900 kg/m"),
    (dict(start="nowhere"), "nowhere does not exist")], ids=str)
def test_bad_input(column, tmp_path, keys, sentence):
    keys = {"rho" if name == "soil_rho" else name: value for name, value in keys.items()}
    with pytest.raises((ValueError, OSError), match=sentence):
        column.main(**COARSE, **keys, out=tmp_path)


def test_of_several_bodies_each_has_its_number():
    body = Body(Box((0.0, 0.0), (1.0, 1.0)), (4, 4), 2, SOIL.material(2), SOIL.rho)
    assert InitialState().of(body) is body
    deep = InitialGround(start="there", initial="geostatic", layers=(0.5,))
    stated = deep.ground(body, SOIL, (0.0, -G))
    assert [(one.start.body, one.stress) for one in stated["body"]] == [(0, None), (1, None)]
