"""A DEM goes on from a file, bit for bit (both back ends)."""
from dataclasses import replace

import numpy as np
import pytest

import mpm_dem_store as store
from dem_liggghts import Wall

DT, STEPS = 5e-6, 100  # of a window


def assert_same(one, other):
    """Particles, clusters and all else that a state has, bit for bit."""
    for mine, theirs in ((one.particles(), other.particles()), (one.bodies(), other.bodies())):
        assert mine.tobytes() == theirs.tobytes()
    state, others = one.get_state(), other.get_state()
    assert state.keys() == others.keys()
    for name, values in state.items():
        assert np.asarray(values).tobytes() == np.asarray(others[name]).tobytes(), name
    assert one.time == other.time


def advance(grains, window, first, last):
    for k in range(first, last):
        grains.advance(STEPS, *window(STEPS * k * DT, STEPS * DT))


@pytest.mark.parametrize("kind, windows", [("tumble", 8), ("heap", 64)])
def test_goes_on_from_its_file(dem, dim, kind, windows, tumble, heap, tmp_path):
    """Spheres, and clusters with single spheres, in contact with friction."""
    scene, window = {"tumble": tumble, "heap": heap}[kind](dim)
    grains, other = dem(scene, DT), dem(scene, DT)
    advance(grains, window, 0, windows)
    assert grains.energy()["contact"] > 0.0
    grains.save(tmp_path / "state.h5")
    other.load(tmp_path / "state.h5")
    assert_same(grains, other)
    for one in (grains, other):
        advance(one, window, windows, windows + 10)
    assert_same(grains, other)


def test_goes_on_with_another_wall(dem, heap, tmp_path):
    """The moving wall has been replaced since the start."""
    scene, window = heap(2)
    grains, other = dem(scene, DT), dem(scene, DT)
    advance(grains, window, 0, 62)
    nodes = window(62 * STEPS * DT, STEPS * DT)[0]
    middles = 0.5 * (nodes[1:] + nodes[:-1])
    finer = np.insert(nodes, np.arange(1, len(nodes)), middles, axis=0)
    number = np.arange(len(finer) - 1)
    grains.replace_wall(Wall(finer, np.column_stack([number, number + 1])))
    still = lambda t, length: (finer, np.zeros_like(finer))  # noqa: E731
    advance(grains, still, 0, 2)
    assert grains.energy()["contact"] > 0.0
    grains.save(tmp_path / "state.h5")
    other.load(tmp_path / "state.h5")
    assert len(other.scene.wall.nodes) == len(finer)
    assert_same(grains, other)
    for one in (grains, other):
        advance(one, still, 2, 10)
    assert_same(grains, other)


@pytest.mark.parametrize("way", ["hold", "remove"])
def test_goes_on_without_what_has_left(dem, heap, way, tmp_path):
    """Some have left before, some leave after."""
    scene, window = heap(2)
    scene = replace(scene, domain=((-0.06, -0.05), (0.056, 0.052)), outflow=way, gravity=(0.0, 300.0))
    grains, other, gone = dem(scene, DT), dem(scene, DT), []
    advance(grains, window, 0, 20)
    grains.save(tmp_path / "state.h5")
    other.load(tmp_path / "state.h5")
    gone.append(grains.removed["count"])
    assert_same(grains, other)
    for one in (grains, other):
        advance(one, window, 20, 34)
    gone.append(grains.removed["count"])
    assert 0 < gone[0] < gone[1]
    assert_same(grains, other)


def test_files_of_others(dem, both, tumble, tmp_path):
    """That of a coupled run has the state of its grains; all else is refused in a sentence."""
    (scene, window), path = tumble(2), tmp_path / "state.h5"
    grains, other = dem(scene, DT), dem(scene, DT)
    advance(grains, window, 0, 5)
    store.write(path, {"grains": grains.get_state(), "solid": {}}, {"kind": "run"})
    other.load(path)
    assert_same(grains, other)
    store.write(path, {"time": 0.0}, {"kind": "MPM"})
    with pytest.raises(ValueError, match=f"checkpoint of kind 'MPM': give one of 'DEM {dem.backend}', or of"):
        other.load(path)
    for stranger in both(scene, DT):
        if not isinstance(stranger, type(grains)):
            stranger.save(path)
            with pytest.raises(ValueError, match="is a checkpoint of kind 'DEM .*': give one of 'DEM"):
                other.load(path)
        stranger.close()
    heavy = dem(replace(scene, spheres=replace(scene.spheres, rho=2600.0)), DT)
    grains.save(path)
    with pytest.raises(ValueError, match="belongs to another scene: its masses differ"):
        heavy.load(path)
