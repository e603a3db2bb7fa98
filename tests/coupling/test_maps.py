"""Maps of a flow: sums over rasters, files, gauges, lines, rocks; on any ranks and after a restart."""
import json
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace as Toy

import numpy as np
import pytest

from coupling import Gauge, Line, Maps
from coupling.hazard import kernels
from coupling.hazard.raster import Ground, raster_over, write_grid
from coupling.hazard.rocks import Rocks
from coupling.hazard.watch import LARGEST, MapWatch
from coupling.records.history import read
from coupling.shapes import motion_of
from dem_liggghts import Cluster, Material, Scene, Spheres, Wall
from mpm_fenicsx import Box, Terrain

CASE = Path(__file__).with_name("slope_case.py")


def plane(*upper, fall=0.0, lower=None):
    return Toy(lower=lower or (0.0,) * len(upper), upper=upper, height=lambda xy: -fall * xy[:, 0])


def body(x, v, volume, rho=1500.0, thickness=1.0):
    volume = np.broadcast_to(np.asarray(volume, float), len(x)).copy()
    return Toy(x=np.asarray(x, float), v=np.broadcast_to(np.asarray(v, float), np.shape(x)).copy(),
               mass=rho * volume, volume=volume, rest=volume.copy(), thickness=thickness)


def solid_of(*bodies, **more):
    return Toy(time=0.0, matter=lambda: list(bodies), **more)


def window(time, dt, number=1):
    return Toy(time=time, dt=dt, number=number)


def read_grid(path):
    """Head, name → number, and values, shape (rows, columns), the southernmost row first."""
    lines = path.read_text().splitlines()
    head = {name.lower(): float(number) for name, number in map(str.split, lines[:6])}
    values = np.loadtxt(lines[6:], ndmin=2)[::-1]
    return head, np.where(values == head["nodata_value"], np.nan, values)


# ---------------------------------------------------------------- sums

def slowly(x, width, spread, raster):
    """Share of each cell in what is spread around x, shape (points, rows, columns), by brute force: with the
    trapezoidal rule over all kinks and edges."""
    edges = [raster.lower[i] + raster.cell * np.arange(raster.shape[1 - i] + 1) for i in (0, 1)]
    ends = 0.5 * np.array([-spread - 1.0, 1.0 - spread, spread - 1.0, spread + 1.0])

    def along(middle, w, e):
        at = np.sort(np.append(e, middle + w * ends))
        density = np.interp(at, middle + w * ends, np.array([0.0, 1.0, 1.0, 0.0]) / (spread * w))
        return np.diff(np.interp(e, at, np.append(0.0, np.cumsum(0.5 * np.diff(at) * (
            density[1:] + density[:-1])))))

    parts = [np.array([along(*one, e) for one in zip(x[:, i], width)]) for i, e in enumerate(edges)]
    return parts[1][:, :, None] * parts[0][:, None, :]


@pytest.mark.parametrize("spread", [1.0, 2.0])
def test_points_are_spread_over_their_width(spread):
    random = np.random.default_rng(1)
    raster = raster_over(Ground(plane(1.0, 0.7, lower=(0.2, -0.1))), 0.11)
    x, v = random.uniform(-0.3, 1.2, (50, 3)), random.normal(size=(50, 3))
    volume, rest, mass = random.uniform(1e-5, 1e-2, (3, 50))
    sums = np.zeros((*raster.shape, 5))
    inside = kernels.to_raster(x, v, mass, volume, rest, spread, (raster.lower, raster.cell), sums)
    shares = slowly(x, volume ** (1 / 3), spread, raster)
    for k, values in enumerate([volume, mass, *(mass * v.T)]):
        assert np.allclose(sums[..., k], np.einsum("prc,p->rc", shares, values), rtol=1e-12, atol=1e-16)
    assert inside == pytest.approx(rest @ shares.sum(axis=(1, 2)), rel=1e-13)


@pytest.mark.parametrize("far", [0.0, 2.6e6])
def test_depth_times_area_is_the_volume(far):
    """Also far from zero, as in coordinates of a country."""
    random = np.random.default_rng(2)
    raster = raster_over(Ground(plane(far + 4.0, 3.0, lower=(far, 0.0))), 0.25)
    x = random.uniform(0.8, 2.2, (500, 3)) + [far, 0.0, 0.0]
    volume, sums = random.uniform(0.01, 0.1, 500), np.zeros((*raster.shape, 5))
    kernels.to_raster(x, 0 * x, volume, volume, volume, 2.0, (raster.lower, raster.cell), sums)
    assert sums[..., 0].sum() == pytest.approx(volume.sum(), rel=1e-13)


def test_a_layer_of_points_is_even():
    """Whether the points lie in the middles of equal parts or at Gauss points, two per cell."""
    for places in ([0.25, 0.75], [0.5 - 0.5 / 3**0.5, 0.5 + 0.5 / 3**0.5]):
        line = (np.arange(8)[:, None] + places).ravel()
        x = np.array(np.meshgrid(line, line, line[:4])).reshape(3, -1).T
        watch = MapWatch(Maps(plane(8.0, 8.0), 0.3), solid_of(body(x, 0.0, 0.125)), None)
        assert np.allclose(watch.flow.depth[4:-4, 4:-4], 2.0, rtol=1e-12)


@pytest.mark.parametrize("apart, uneven", [(0.8, 0.09), (0.94, 0.04), (1.07, 0.06), (1.25, 0.2)])
def test_a_layer_that_has_stretched_is_nearly_even(apart, uneven):
    """Points that are farther apart or closer together than their widths."""
    line = apart * (np.arange(20) + 0.5)
    x = np.array(np.meshgrid(line, line, [0.5])).reshape(3, -1).T
    watch = MapWatch(Maps(plane(12.0, 12.0), 0.13), solid_of(body(x, 0.0, 1.0)), None)
    depth = watch.flow.depth[30:-30, 30:-30] * apart**2
    assert abs(depth - 1.0).max() < uneven


def test_speed_pressure_and_arrival():
    """Two layers with different speeds, and a third that comes later; what is dry has no speed."""
    bodies = [body([[0.5, 0.5, 0.2]], (3.0, 0.0, 0.0), 0.001),
              body([[0.5, 0.5, 0.4]], (1.0, 0.0, 0.0), 0.003),
              body([[1.5, 0.5, 0.2]], (0.0, 9.0, 0.0), 1e-6)]
    watch = MapWatch(Maps(plane(3.0, 1.0), 1.0, dry=1e-4), solid_of(*bodies), None)
    assert watch.values("depth_max")[0, :2] == pytest.approx([0.004, 1e-6])
    assert watch.values("speed_max")[0, 0] == pytest.approx(1.5)  # mean over the depth
    assert watch.values("pressure_max")[0, 0] == pytest.approx(1500.0 * 1.5**2)
    assert np.isnan(watch.values("speed_max")[0, 1:]).all() and np.isnan(watch.values("arrival")[0, 1:]).all()
    bodies[0].x[0, 0], bodies[0].v[0, 0] = 2.5, 2.0
    watch(window(0.7, 0.1))
    assert watch.values("arrival").tolist()[0] == pytest.approx([0.0, np.nan, 0.7], nan_ok=True)
    assert watch.values("speed_max")[0, [0, 2]] == pytest.approx([1.5, 2.0])
    assert watch.values("deposit")[0, [0, 2]] == pytest.approx([0.003, 0.001])


def test_in_the_plane_thickness_does_not_count_in_the_depth():
    strip = body([[0.25, 0.1], [0.75, 0.1]], (2.0, 0.0), 0.03, thickness=0.5)
    watch = MapWatch(Maps(plane(1.0), 0.5, gauges=[Gauge("g", 0.25)], lines=[Line("l", 0.25)], spread=1.0),
                     solid_of(strip), None)
    assert watch.flow.depth[0] == pytest.approx([0.12, 0.12])
    assert watch.places.now["depth_g"] == pytest.approx(0.12)
    assert watch.places.now["discharge_l"] == pytest.approx(2.0 * 0.12 * 0.5)
    assert watch.places.released == pytest.approx(0.06)


# ---------------------------------------------------------------- gauges, lines, balance

@pytest.mark.parametrize("turn", [0.0, 0.5, 2.0])
def test_what_passes_a_line_is_booked_once(turn):
    """A cube of points flies across a line of any direction, in steps of a part of its band; what passes it
    beside its ends does not count, what comes back is taken off."""
    c, s = np.cos(turn), np.sin(turn)
    side = (np.arange(4) + 0.5) * 0.25
    x = np.array(np.meshgrid(side, side, side)).reshape(3, -1).T - [2.0, 0.0, 0.0]
    turned = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    soil = body(x @ turned.T, turned @ [1.0, 0.0, 0.0], 1 / 64)
    ends = [tuple(turned[:2, :2] @ p) for p in ((0.0, -0.5), (0.0, 1.5), (0.0, 0.5))]
    lines = [Line("whole", ends[0], ends[1], 0.5), Line("half", ends[2], ends[1], 0.5)]
    watch = MapWatch(Maps(plane(5.0, 5.0, lower=(-5.0, -5.0)), 0.5, lines=lines), solid_of(soil), None)
    for k in range(400):
        soil.x += 0.01 * soil.v
        watch(window(0.01 * (k + 1), 0.01))
        if k == 150:  # its front is 0.5 past the line
            assert watch.places.now["discharge_whole"] == pytest.approx(1.0, rel=1e-3)
    assert watch.places.volumes == pytest.approx([1.0, 0.5], rel=2e-2 if turn else 1e-4)
    assert watch.places.volumes[0] == pytest.approx(1.0, rel=1e-4)
    soil.v *= -1.0
    for k in range(400):
        soil.x += 0.01 * soil.v
        watch(window(4.0 + 0.01 * (k + 1), 0.01))
    assert watch.places.volumes == pytest.approx([0.0, 0.0], abs=1e-3)


def test_the_volume_is_balanced():
    soil = body(np.random.default_rng(3).uniform(-0.5, 1.5, (100, 3)), 0.0, 0.01)
    solid = solid_of(soil, removed={"volume": 0.0})
    watch = MapWatch(Maps(plane(1.0, 1.0), 0.1), solid, None)
    now = watch.places.now
    assert now["volume_on_map"] + now["volume_beyond_map"] == pytest.approx(1.0, rel=1e-12)
    assert watch.flow.depth.sum() * 0.01 == pytest.approx(now["volume_on_map"], rel=1e-10)
    for name in ("x", "v", "mass", "volume", "rest"):
        setattr(soil, name, getattr(soil, name)[:80].copy())
    soil.volume *= 1.1  # it loosens
    solid.removed["volume"] = 0.2
    watch(window(0.1, 0.1))
    now = watch.places.now
    assert now["volume_left"] == 0.2 and abs(now["volume_error"]) < 1e-12
    assert watch.flow.depth.sum() * 0.01 == pytest.approx(1.1 * now["volume_on_map"], rel=0.05)


# ---------------------------------------------------------------- files

def test_a_grid_is_read_back(tmp_path):
    """Rows from north to south, corner, size and no data as an ESRI ASCII grid has them."""
    raster = raster_over(Ground(plane(2600001.0, 0.5, lower=(2600000.0, -1.0))), 0.25)
    values = np.arange(24.0).reshape(raster.shape) / 3.0
    values[0, 1] = np.nan
    write_grid(tmp_path / "a.asc", raster, values)
    head, again = read_grid(tmp_path / "a.asc")
    assert head == dict(ncols=4, nrows=6, xllcorner=2.6e6, yllcorner=-1.0, cellsize=0.25, nodata_value=-9999)
    assert np.allclose(again, values, rtol=1e-14, equal_nan=True)
    assert (tmp_path / "a.asc").read_text().splitlines()[6].startswith("6.66666666666667 7")  # the largest y


@pytest.mark.parametrize("wrong, says", [
    (dict(cell=0.0), "cell is 0.0 m: give a positive number"),
    (dict(every=-1.0), "every is -1.0 s"), (dict(every=0), "every is 0: give a whole number"),
    (dict(gauges=[Gauge("a", (9.0, 0.5))]), r"a of the gauges is at \(9.0, 0.5\): give a place on"),
    (dict(gauges=[Gauge("a", 0.5)]), "give a place on the terrain"),
    (dict(lines=[Line("b", (0.1, 0.1), (0.9, 0.1))] * 2), "the lines are called b, b: give each a name"),
    (dict(terrain=plane(-1.0, 1.0)), "the terrain extends from"), (dict(spread=-1), "spread is -1")])
def test_bad_maps_are_refused(wrong, says):
    with pytest.raises(ValueError, match=says):
        Maps(**{"terrain": plane(1.0, 1.0), "cell": 0.1, **wrong})


def test_bad_lines_are_refused():
    with pytest.raises(ValueError, match="the line a has no end b"):
        Line("a", (0.0, 1.0))
    with pytest.raises(ValueError, match="give two different places"):
        Line("a", (0.0, 1.0), (0.0, 1.0))
    with pytest.raises(ValueError, match="name of a gauge is 'a,b'"):
        Gauge("a,b", (0.0, 1.0))


# ---------------------------------------------------------------- rocks

PARTICLE = [("id", int), ("body", int), ("x", float, 3), ("v", float, 3), ("omega", float, 3),
            ("radius", float), ("mass", float)]


def grains_of(*rows):
    particles = np.array(list(rows), PARTICLE)
    return Toy(particles=lambda: particles.copy(), scene=Toy(clusters=())), particles


def test_a_rock_on_a_slope_touches_it():
    """Its height is that of its surface above the terrain, along the vertical."""
    steep = np.hypot(1.0, 0.75)
    grains, p = grains_of((1, 0, (2.0, 1.0, -1.5 + 0.2 * steep), (3.0, 0.0, 4.0), (0.0, 2.0, 0.0), 0.2, 5.0),
                          (2, 0, (1.0, 1.0, 1.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.5, 9.0))
    rocks = Rocks(grains, Ground(plane(4.0, 4.0, fall=0.75)), 3)
    assert rocks.motion.height == pytest.approx([0.0, 1.75 - 0.5 * steep], abs=1e-12)
    assert rocks.motion.energy == pytest.approx([0.5 * 5.0 * (25.0 + 0.4 * 0.04 * 4.0), 0.0])
    p["x"][0] += [0.4, 0.3, 0.7]
    p["radius"][1] = 0.0  # has left
    rocks.look()
    rocks.follow()
    assert rocks.largest["height"] == pytest.approx([1.0, 1.75 - 0.5 * steep])
    assert rocks.runout == pytest.approx([0.5, 0.0]) and rocks.motion.there.tolist() == [True, False]


@pytest.mark.parametrize("each", [False, True], ids=["as a whole", "each vertex"])
def test_heights_are_those_over_ground_that_has_moved(each):
    """A slope has gone 3 m aside and 0.4 m up. Not those of vertices that move
    each for themselves. terrain.asc stays that of the start."""
    terrain = Terrain.function(lambda x, y: 0.75 * x, Box((0.0, 0.0), (8.0, 4.0)), 1.0)
    way = np.array([3.0, 0.0, 0.4])
    bed = terrain.structure(motion=lambda t: t * (np.tile(way, (len(terrain.x), 1)) if each else way))
    ground = Ground(terrain, motion_of(terrain, Toy(), Toy(scene=Toy(structures=[bed]))))
    ground.go(1.0)
    wanted = 0.75 * 2.0 + 0.4 if not each else 0.75 * 5.0
    assert ground.height(np.array([[5.0, 2.0]])) == pytest.approx(wanted)
    watch = MapWatch(Maps(terrain, 1.0), solid_of(body([(1.0, 1.0, 1.0)], 0.0, 0.1), structures=[bed]), None)
    assert watch.ground[0] == pytest.approx(0.75 * (np.arange(8) + 0.5))


@pytest.mark.parametrize("dim", [2, 3])
def test_rocks_of_several_spheres_have_the_energy_of_the_dem(dem, dim):
    """Clusters that turn about no axis of theirs, and a single sphere, over a plain."""
    up = np.eye(dim)[-1]
    shape = np.vstack([np.zeros(dim), 0.3 * np.eye(dim)])
    spin = 2.0 if dim == 2 else (1.0, 2.0, -0.5)
    turning = [Cluster.of_spheres(shape, 0.2, 2000.0, at * np.eye(dim)[0] + at * up, v=v, omega=spin)
               for at, v in ((2.0, -up), (4.0, 3.0 * up))]
    single = Spheres([8.0 * np.eye(dim)[0] + 1.5 * up], [2.0 * np.eye(dim)[0]], 0.5, 2600.0)
    corners = [(-9.0, -9.0), (9.0, -9.0)] if dim == 2 else [(-9, -9, -9.0), (9, -9, -9.0), (0, 9, -9.0)]
    rubber = Material(1e6, 0.3)
    scene = Scene(single, Wall(corners, [tuple(range(dim))]), rubber, rubber, clusters=turning)
    grains = dem(scene, 1e-4)
    grains.advance(100, grains.scene.wall.nodes, np.zeros((dim, dim)))
    rocks = Rocks(grains, Ground(plane(*(9.0,) * (dim - 1), lower=(-5.0,) * (dim - 1))), dim)
    assert rocks.motion.energy.sum() == pytest.approx(grains.energy()["kinetic"], rel=1e-9)
    particles = grains.particles()
    lowest = [(particles["x"][mask, dim - 1] - particles["radius"][mask]).min() for mask in (
        particles["body"] == 1, particles["body"] == 2, particles["body"] == 0)]
    assert rocks.motion.height == pytest.approx(lowest) and rocks.motion.height[2] == pytest.approx(1.0)
    assert rocks.motion.speed == pytest.approx([1.0, 3.0, 2.0], rel=1e-6)


def test_cells_that_a_rock_covers_keep_its_largest_energy():
    grains, p = grains_of((1, 0, (1.5, 0.5, 0.6), (2.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.6, 3.0))
    watch = MapWatch(Maps(plane(4.0, 1.0), 1.0), solid_of(body(np.zeros((0, 3)), 0.0, 1.0)), grains)
    watch(window(0.1, 0.1))
    p["x"][0, 0], p["v"][0, 0] = 2.5, 1.0
    watch(window(0.2, 0.1))
    assert watch.values("rock_energy_max")[0].tolist() == pytest.approx([6.0, 6.0, 6.0, 1.5])


# ---------------------------------------------------------------- whole runs

def rasters(folder):
    return {name: read_grid(folder / f"{name}.asc")[1] for name in [*LARGEST, "terrain", "depth_0001"]}


@pytest.fixture(scope="module")
def straight(tmp_path_factory):
    """Folder of a run in space."""
    from tests.coupling import slope_case

    out = tmp_path_factory.mktemp("slope")
    slope_case.main(out=out, t_end=0.06, every=0.03, paraview=60, checkpoint=40)
    return out


def test_a_run_leaves_its_maps(straight):
    names = {path.name for path in straight.iterdir()}
    ends = {f"{name}.asc" for name in [*LARGEST, "terrain", "depth_0000", "depth_0001", "depth_0002"]}
    assert ends | {"map.png", "rocks.csv", "rocks_largest.csv", "terrain.pvd"} <= names
    assert "depth_0003.asc" not in names and "terrain_00001.vtu" not in names
    history = read(straight / "history.csv")
    told = json.loads((straight / "report.json").read_text())["maps"]
    assert told["times"] == pytest.approx([0.0, 0.03, 0.06])
    assert told["volume_released"] == pytest.approx(0.0048, rel=1e-12)
    assert np.abs(history["volume_error"]).max() < 1e-10
    start, found = read_grid(straight / "depth_0000.asc")[1], rasters(straight)
    area = 0.025**2
    assert np.nanmax(start) == pytest.approx(0.12, rel=1e-9) and np.nansum(start) * area < 0.0048
    assert (found["depth_max"] >= np.nan_to_num(start)).all(where=~np.isnan(found["depth_max"]))
    # points of the soil beyond the edges of the map are not on it, and it has hardly loosened
    assert np.nansum(found["deposit"]) * area == pytest.approx(history["volume_on_map"][-1], rel=0.01)
    assert found["terrain"][:, 0] == pytest.approx(-0.7 * 0.0125)
    wet = ~np.isnan(found["speed_max"])
    assert found["pressure_max"][wet] == pytest.approx(1500.0 * found["speed_max"][wet] ** 2, rel=0.05)
    assert 0.1 < found["speed_max"][wet].max() < 9.81 * 0.06


def test_a_rock_ahead_of_the_soil_rolls(straight):
    """Down the slope, by 5/7 of the acceleration without friction, and does not jump."""
    rocks, largest = read(straight / "rocks.csv"), read(straight / "rocks_largest.csv")
    assert rocks["time"].tolist() == pytest.approx([0.0, 0.0, 0.03, 0.03, 0.06, 0.06])
    speed = 5.0 / 7.0 * 9.81 * 0.7 / np.hypot(1.0, 0.7) * 0.06
    assert rocks["speed"][-1] == pytest.approx(speed, rel=0.01)
    assert np.abs(rocks["height"][1::2]).max() < 2e-4  # the overlap that bears it
    assert rocks["spin"][-1] == pytest.approx(speed / 0.02, rel=0.01)
    assert largest["energy"][1] == pytest.approx(0.7 * largest["mass"][1] * speed**2, rel=0.02)
    assert largest["runout"][1] == pytest.approx(0.5 * speed * 0.06 / np.hypot(1.0, 0.7), rel=0.02)
    highest = np.nanmax(rasters(straight)["rock_energy_max"])
    assert highest == pytest.approx(largest["energy"].max(), rel=1e-12)


def test_a_run_that_goes_on_leaves_the_same(straight, tmp_path):
    """In its own folder and in another one."""
    from tests.coupling import slope_case

    shutil.copytree(straight, tmp_path / "own")
    for restart in (tmp_path / "own", tmp_path / "other"):
        slope_case.main(restart=tmp_path / "own", out=restart)
        for path in [*straight.glob("*.asc"), straight / "rocks.csv", straight / "rocks_largest.csv",
                     straight / "history.csv"]:
            assert (restart / path.name).read_bytes() == path.read_bytes(), path.name


DIES = """
import os, sys
from coupling.hazard.watch import MapWatch
from tests.coupling import slope_case

look = MapWatch.__call__
MapWatch.__call__ = lambda self, window: os._exit(9) if window.number == 46 else look(self, window)
slope_case.main(out=sys.argv[1], t_end=0.06, every=0.01, checkpoint=25)
"""


def test_a_run_that_dies_leaves_what_was_until_then(tmp_path):
    """Of a process that is killed: paths of rocks and maxima until the last map; its run goes on."""
    done = subprocess.run([sys.executable, "-c", DIES, tmp_path], cwd=CASE.parents[2], capture_output=True)
    assert done.returncode == 9, done.stderr
    rocks, largest = read(tmp_path / "rocks.csv"), read(tmp_path / "rocks_largest.csv")
    assert rocks["time"].tolist() == pytest.approx(np.repeat([0.0, 0.01, 0.02, 0.03, 0.04], 2))
    assert largest["speed"][1] == pytest.approx(rocks["speed"][-1], rel=1e-12)
    assert np.nanmax(read_grid(tmp_path / "speed_max.asc")[1]) > 0.1 and not (tmp_path / "map.png").exists()
    from tests.coupling import slope_case

    slope_case.main(restart=tmp_path, out=tmp_path)
    again = read(tmp_path / "rocks.csv")
    assert again["time"].tolist() == pytest.approx(np.repeat(np.arange(7) * 0.01, 2))
    np.testing.assert_array_equal(again["speed"][:10], rocks["speed"])


@pytest.mark.mpi
@pytest.mark.parametrize("ranks", [2, pytest.param(3, marks=pytest.mark.validation)])
def test_on_any_ranks_maps_are_the_same(script_on_ranks, tmp_path, ranks):
    """A cell that two ranks have points in has the depth of both together."""
    folders = tmp_path / "alone", tmp_path / "shared"
    for n, folder in zip((1, ranks), folders):
        folder.mkdir()
        done = script_on_ranks(n, CASE.with_name("map_ranks.py"), folder)
        assert not done.returncode, done.stderr
    for path in folders[0].glob("*.asc"):
        one, other = (read_grid(folder / path.name)[1] for folder in folders)
        assert np.allclose(one, other, rtol=1e-12, atol=1e-15, equal_nan=True), path.name
    one, other = (np.loadtxt(folder / "now") for folder in folders)
    assert np.allclose(one, other, rtol=1e-12, atol=1e-15)


def test_in_the_plane_there_are_profiles(tmp_path):
    from tests.coupling import slope_case

    slope_case.main(dim=2, out=tmp_path, t_end=0.02, every=0.01)
    first, largest = read(tmp_path / "profile_0000.csv"), read(tmp_path / "profile_max.csv")
    assert list(largest) == ["x", "terrain", *LARGEST] and len(largest["x"]) == 36
    assert first["depth"].max() == pytest.approx(0.12)
    assert first["terrain"] == pytest.approx(-0.7 * first["x"])
    assert (largest["depth_max"] >= first["depth"])[first["depth"] > 0.0].all()
    history = read(tmp_path / "history.csv")
    assert np.abs(history["volume_error"]).max() < 1e-10
    assert history["volume_on_map"][0] == pytest.approx(0.5 * 0.12 * 0.2, rel=0.2)  # less what sticks out
    names = {path.name for path in tmp_path.iterdir()}
    assert {"map.png", "profile_0002.csv", "rocks.csv"} <= names and "depth_max.asc" not in names


@pytest.mark.mpi
@pytest.mark.validation
def test_a_run_on_any_ranks_leaves_the_same_maps(run_ranks, tmp_path):
    """Newton's method, whose tangents are kept or renewed in different iterations on 2 ranks, must not be
    what is seen: at its own tolerance it moves the points by 1e-8 of the speed."""
    tight = "-mpm_snes_rtol", "1e-13", "-mpm_snes_atol", "1e-10"
    for n in (1, 2, 3):
        done = run_ranks(n, CASE, f"out={tmp_path / str(n)}", "t_end=0.06", "every=0.03", *tight)
        assert not done.returncode, done.stderr
    one = rasters(tmp_path / "1")
    for n in ("2", "3"):
        other = rasters(tmp_path / n)
        for name, values in one.items():
            assert np.allclose(values, other[name], rtol=1e-10, atol=1e-12, equal_nan=True), name


def test_both_back_ends_leave_maps_of_their_own(tmp_path, liggghts):
    from tests.coupling import slope_case

    slope_case.main(dim=2, dem="compare", out=tmp_path, t_end=0.01, every=5e-3)
    for name in ("profile_0001", "profile_max", "rocks_largest"):
        one, other = (read(tmp_path / f"{name}{label}.csv") for label in ("", "_liggghts"))
        assert all(np.allclose(one[key], other[key], rtol=1e-6, atol=1e-9, equal_nan=True) for key in one)
    assert (tmp_path / "map_liggghts.png").exists()


def test_what_comes_in_and_leaves_is_balanced():
    """A plug that an inflow feeds passes a line as it is fed; what flows out of a flood is missed nowhere."""
    from tests.mpm.test_inflow import PLUGS, flood, plug

    maps, ends = Maps(plane(1.0), 0.1, lines=[Line("line", 0.1)], gauges=[Gauge("gauge", 0.1)]), []
    for solid, dt, steps in ((plug(*PLUGS["along x"])[0], 0.02, 20), (flood(), 0.01, 30)):
        watch = MapWatch(maps, solid, None)
        for number in range(steps):
            solid.advance(dt)
            watch(window(solid.time, dt, number + 1))
        ends.append(watch.places.now)
        assert abs(ends[-1]["volume_error"]) < 1e-13 and solid.entered["volume"] > 0.0
        assert ends[-1]["volume_left"] == solid.removed["volume"]
        solid.close()
    fed, flooded = ends
    assert [fed[f"{name}_gauge"] for name in ("depth", "speed")] == pytest.approx([0.3, 1.0], rel=1e-9)
    assert [fed[f"{name}_line"] for name in ("discharge", "passed")] == pytest.approx([0.3, 0.12], rel=1e-9)
    assert fed["volume_left"] == 0.0 < flooded["volume_left"]
