"""Terrain: where it comes from, what is read off, grids and releases on it."""
import gzip
import re
import sys
from pathlib import Path
from typing import NamedTuple

import meshio
import numpy as np
import pytest

from mpm_fenicsx import Box, Raster, Terrain, read_mesh
from mpm_fenicsx.scene.facets import corner_volumes
from mpm_fenicsx.scene.raster import _from_transform

AREA = Box((0.0, 0.0), (4.0, 3.0))


def wavy(x, y):
    return 0.3 * np.sin(2.0 * x) * np.cos(3.0 * y) + 0.2 * x


HEADER = "ncols 3\nnrows 2\nxllcorner 100.0\nyllcorner 200.0\ncellsize 2\nNODATA_value -9999\n"
HEIGHTS = "4 5 6\n1 2 3\n"


class Affine(NamedTuple):
    """From column and row to x and y, as rasterio has it."""

    a: float
    b: float
    c: float
    d: float
    e: float
    f: float


def written(tmp_path, text, name="hill.asc"):
    path = tmp_path / name
    (gzip.open if name.endswith(".gz") else open)(path, "wt").write(text)
    return path


@pytest.mark.parametrize("header, lower, cell", [
    (HEADER, (101.0, 201.0), (2.0, 2.0)),
    (HEADER.replace("corner", "center").upper(), (100.0, 200.0), (2.0, 2.0)),
    (HEADER.replace("cellsize 2", "dx 2\ndy 4"), (101.0, 202.0), (2.0, 4.0)),
    (HEADER.replace("NODATA_value -9999\n", ""), (101.0, 201.0), (2.0, 2.0))],
    ids=["corner", "center", "dx dy", "no nodata"])
@pytest.mark.parametrize("name", ["hill.asc", "hill.asc.gz"])
def test_an_ascii_grid_has_its_northern_row_first(tmp_path, header, lower, cell, name):
    hill = Terrain.read(written(tmp_path, header + HEIGHTS, name))
    assert hill.lower == lower and hill.heights.cell == cell
    assert hill.height(np.add(lower, [(0, 0), (cell[0], 0), (0, cell[1])])).tolist() == [1.0, 2.0, 4.0]
    assert hill.upper == (lower[0] + 2 * cell[0], lower[1] + cell[1])


def test_it_is_cropped_to_what_covers_a_box(tmp_path):
    path = written(tmp_path, "ncols 9\nnrows 5\nxllcenter 0\nyllcenter 0\ncellsize 1\n"
                   + "\n".join(" ".join(str(10 * j + i) for i in range(9)) for j in (4, 3, 2, 1, 0)))
    part = Terrain.read(path, inside=Box((2.5, 1.0), (4.0, 2.5)))
    assert (part.lower, part.upper) == ((2.0, 1.0), (4.0, 3.0))
    assert part.height([(3.0, 2.0)]) == [23.0]


def twin(terrain, tmp_path, name):
    """The same surface as triangles of a file."""
    path = tmp_path / name
    meshio.write_points_cells(path, terrain.x, [("triangle", terrain.elements[::-1])])
    return Terrain.read(path)


@pytest.mark.parametrize("name", ["hill.stl", "hill.obj", "hill.ply"])
def test_triangles_tell_the_heights_of_their_raster(tmp_path, name):
    hill = Terrain.function(wavy, AREA, cell=0.25)
    other = twin(hill, tmp_path, name)
    assert other.heights is None and len(other.x) == len(hill.x)
    places = np.random.default_rng(1).uniform((-0.5, -0.5), (4.5, 3.5), (2000, 2))
    found = hill.height(places)
    assert np.isnan(found).sum() == (~((places >= 0) & (places <= (4, 3))).all(axis=1)).sum()
    assert other.height(places) == pytest.approx(found, abs=2e-6, nan_ok=True)
    assert np.median(abs(other.normal(places) - hill.normal(places))[~np.isnan(found)]) < 1e-6
    assert hill.height(hill.x[:, :2]) == pytest.approx(hill.x[:, 2], abs=1e-14)
    n = hill.normal(hill.x[hill.elements].mean(axis=1)[:, :2])
    corner = hill.x[hill.elements]
    assert abs(np.einsum("ed,ead->ea", n, corner[:, 1:] - corner[:, :1])).max() < 1e-14


def test_triangles_inside_out_are_turned_and_one():
    hill = Terrain.function(wavy, AREA, cell=0.5)
    turned = np.arange(hill.elements.size).reshape(-1, 3)[:, ::-1]
    loose = Terrain(hill.x[hill.elements].reshape(-1, 3), turned)
    assert len(loose.x) == len(hill.x) and (loose.normal([(1.1, 1.3)])[0, 2] > 0.0)


def test_height_and_normal_of_one_place():
    hill, line = Terrain.function(wavy, AREA, cell=0.5), Terrain.profile([0.0, 1.0, 4.0], [2.0, 1.0, 1.0])
    for ground, place in ((hill, (1.1, 1.3)), (line, 0.3)):
        assert ground.height(place) == ground.height([place])[0]
        assert np.array_equal(ground.normal(place), ground.normal([place])[0])
    with pytest.raises(ValueError, match=r"places of the plan is \[1. 2. 3.\]: give numbers of shape"):
        hill.height((1.0, 2.0, 3.0))


def test_a_profile_is_a_line():
    line = Terrain.profile([0.0, 1.0, 4.0], [2.0, 1.0, 1.0])
    again = Terrain(line.x[::-1], [(0, 1), (2, 1)])
    for one in (line, again):
        assert one.height([0.5, 2.0, 9.0])[:2].tolist() == [1.5, 1.0] and np.isnan(one.height([9.0])).all()
        assert one.normal([0.5, 2.0])[:, 1] == pytest.approx([np.sqrt(0.5), 1.0])
        assert one.lower == (0.0,) and one.upper == (4.0,)


STEP = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1)]
ROUND = [(x, y, 0.0) for x in range(4) for y in range(4)]
RING = [(k, k + 4, k + 5) for k in (0, 4, 8, 1, 9, 2, 6, 10)] + [(k, k + 5, k + 1) for k in (
    0, 4, 8, 1, 9, 2, 6, 10)]


@pytest.mark.parametrize("make, sentence", [
    (lambda: Terrain.raster([[0.0, np.nan], [1.0, 1.0]], 1.0, (5.0, 0.0)),
     "1 of 4 heights of the raster are missing, the first at 5, 1 m: crop"),
    (lambda: Terrain.raster([[0.0, 1.0]], 1.0, (0.0, 0.0)), "the raster has 1 x 2 heights"),
    (lambda: Terrain.raster([[0.0, 1.0], [0.0, 1.0]], -1.0, (0.0, 0.0)), "cell of the raster"),
    (lambda: Terrain(STEP, [(0, 1, 5), (0, 5, 4), (0, 1, 2)]), "2 triangles that stand upright"),
    (lambda: Terrain([*STEP, (0, 1, 1), (1, 1, 1)], [(0, 1, 2), (0, 2, 3), (4, 5, 7), (4, 7, 6), (3, 2, 5)]),
     "the terrain is folded at|hangs over at|holes or more pieces"),
    (lambda: Terrain([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0.1, 0.1, 1)], [(0, 1, 2), (0, 3, 1), (1, 3, 2)]),
     "the terrain is folded at"),
    (lambda: Terrain(ROUND, RING), "the terrain has 1 holes or more pieces, one around"),
    (lambda: Terrain(STEP, np.zeros((0, 3))), "the terrain has no elements"),
    (lambda: Terrain.profile([0.0, 0.0], [1.0, 2.0]), "x of the profile is .0.0, 0.0. m: give at least 2"),
    (lambda: Terrain([(0.0, 0.0), (1.0, 0.0), (1.0, 2.0)], [(0, 1), (1, 2)]), "are not one line"),
    (lambda: Terrain.function(wavy, (0.0, 1.0), 0.1), "z of the terrain fails"),
    (lambda: Terrain.function(wavy, AREA, 0.0), "cell of the terrain is 0.0"),
    (lambda: Terrain.read("no.asc"), "path of the terrain is no.asc: this file does not exist"),
])
def test_bad_surfaces_are_one_sentence(make, sentence):
    with pytest.raises(ValueError, match=sentence):
        make()


@pytest.mark.parametrize("text, sentence", [
    (HEADER + "1 2 3\n", "has 3 heights, its header says 2 rows of 3"),
    (HEADER + HEIGHTS.replace("5", "-9999"), "1 of 6 heights of .* are missing, the first at 103, 203 m"),
    (HEADER + HEIGHTS.replace("5", "5,5"), "has heights that are no numbers"),
    (HEADER.replace("cellsize 2", "cellsize -2") + HEIGHTS, "cells of -2.0 x -2.0 m"),
    (HEADER.replace("ncols", "columns") + HEIGHTS, "has no ncols in its header"),
    (HEADER.replace("xllcorner 100.0", "xllcorner here") + HEIGHTS, "line 'xllcorner here'"),
    ("", "has no"),
])
def test_bad_files_are_one_sentence(tmp_path, text, sentence):
    with pytest.raises(ValueError, match=sentence):
        Terrain.read(written(tmp_path, text))
    with pytest.raises(ValueError, match="lies outside"):
        Terrain.read(written(tmp_path, HEADER + HEIGHTS), Box((0.0, 0.0), (1.0, 1.0)))


def test_rows_and_columns_of_a_geotiff_may_run_either_way():
    z, path = np.array([[4.0, 5.0, 6.0], [1.0, 2.0, 3.0]]), Path("hill.tif")
    for turn, a, e in (((1, 1), 2.0, -4.0), ((-1, 1), 2.0, 4.0), ((1, -1), -2.0, -4.0)):
        corner = 100.0 if a > 0 else 106.0, 208.0 if e < 0 else 200.0
        found = _from_transform(path, z[::turn[0], ::turn[1]], Affine(a, 0.0, corner[0], 0.0, e, corner[1]))
        assert found.lower == (101.0, 202.0) and found.cell == (2.0, 4.0)
        assert found.z.tolist() == [[1.0, 4.0], [2.0, 5.0], [3.0, 6.0]]
    with pytest.raises(ValueError, match="rows that do not run along x"):
        _from_transform(path, z, Affine(1.0, 0.5, 0.0, 0.5, 1.0, 0.0))


def test_a_geotiff_is_read(tmp_path):
    rasterio = pytest.importorskip("rasterio")
    place = rasterio.transform.from_origin(100.0, 204.0, 2.0, 2.0)
    with rasterio.open(tmp_path / "hill.tif", "w", driver="GTiff", width=3, height=2, count=1,
                       dtype="float32", transform=place, nodata=-1.0) as file:
        file.write(np.array([[[4.0, 5.0, 6.0], [1.0, 2.0, 3.0]]], np.float32))
    hill = Terrain.read(tmp_path / "hill.tif")
    assert hill.lower == (101.0, 201.0) and hill.height([(101.0, 203.0)]) == [4.0]


def test_a_geotiff_without_rasterio_is_one_sentence(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "rasterio", None)
    with pytest.raises(ValueError, match="needs rasterio, which is not installed"):
        Terrain.read(written(tmp_path, "no raster", "hill.tif"))


def test_the_page_runs(capsys):
    page = Path(__file__).parents[2] / "docs/terrain.md"
    exec(re.search(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL)[1], {})
    assert "slope 25.1 degrees in the mean, at most 46.7" in capsys.readouterr().out


def test_what_was_read_is_told():
    text = Terrain.function(lambda x, y: 3.28 * x, AREA, cell=0.5).summary()
    assert "z 0 to 13.12 m" in text and "cells 0.5 x 0.5 m" in text and "at most 73.0" in text


# ---------------------------------------------------------------- grids

def test_columns_follow_the_surface_and_hang_together():
    hill = Terrain.function(wavy, AREA, cell=0.125)
    corner = [(1.0, 0.5), (3.2, 0.7), (2.0, 2.6)]
    mesh = hill.grid(0.25, above=0.6, where=corner)
    assert corner_volumes(mesh.vertices[mesh.cells]).min() > 0.0
    middle = mesh.vertices[mesh.cells].mean(axis=1)
    assert np.allclose(np.prod(np.ptp(mesh.vertices[mesh.cells][:, :, :2], axis=1), axis=1), 0.0625)
    over = mesh.vertices[:, 2] - hill.height(mesh.vertices[:, :2])
    assert -0.5 - 1e-9 <= over.min() <= -0.25 + 1e-9 and 0.6 - 1e-9 <= over.max() <= 1.0 + 1e-9
    assert {tuple(p) for p in (middle[:, :2] / 0.25).astype(int)} >= {(6, 4), (8, 8)}
    assert middle[:, 0].min() > 0.75 and (hill.height(middle[:, :2]) < 9.0).all()
    sides = sum(len(facets) for facets in mesh.surfaces.values())
    assert sides == len(mesh.boundary()) and len(mesh.boundary("bottom")) == len(mesh.boundary("top"))


def test_layers_reach_as_high_as_asked():
    hill = Terrain.function(lambda x: 0.1 * x, (0.0, 4.0), cell=0.5)
    mesh = hill.grid(0.5, above=lambda p: np.where(p[:, 0] < 1.9, 0.5, 2.0), below=1.0)
    top = mesh.vertices[:, 1] - hill.height(mesh.vertices[:, 0])
    assert {round(v, 9) for v in top[mesh.vertices[:, 0] < 1.4]} == {-1.0, -0.5, 0.0, 0.5}
    assert top.max() == pytest.approx(2.0) and set(mesh.surfaces) == {"side", "top", "bottom"}


def test_it_survives_a_file(tmp_path):
    mesh = Terrain.function(wavy, AREA, cell=0.5).grid(0.5, above=1.0)
    order = [0, 1, 3, 2, 4, 5, 7, 6]
    meshio.write_points_cells(tmp_path / "grid.vtk", mesh.vertices, [("hexahedron", mesh.cells[:, order])])
    assert (read_mesh(tmp_path / "grid.vtk", 3).cells == mesh.cells).all()


# ---------------------------------------------------------------- releases

POLYGON = np.array([(0.6, 0.41), (3.13, 0.7), (2.2, 1.4), (2.9, 2.6), (0.9, 2.1)])  # not convex
POLYGON_AREA = 0.5 * abs(np.sum(POLYGON[:, 0] * np.roll(POLYGON[:, 1], -1)
                                - np.roll(POLYGON[:, 0], -1) * POLYGON[:, 1]))


@pytest.mark.parametrize("h", [0.5, 0.2, 0.07])
@pytest.mark.parametrize("way", [1, -1])
def test_the_volume_is_that_over_the_polygon(h, way):
    hill = Terrain.function(wavy, AREA, cell=0.125)
    soil = hill.release(0.4, POLYGON[::way], h)
    assert soil.volume.sum() == pytest.approx(0.4 * POLYGON_AREA, rel=1e-12)
    over = soil.x[:, 2] - hill.height(soil.x[:, :2])
    assert over.min() > 0.0 and over.max() < 0.4 and soil.half.min() > 0.0
    fine = hill.release(0.4, POLYGON, 0.02)
    middle, true = (s.volume @ s.x[:, :2] / s.volume.sum() for s in (soil, fine))
    assert middle == pytest.approx(true, abs=0.05 * h)


def test_points_of_a_column_are_even_and_begin_half_a_spacing_up():
    hill = Terrain.function(lambda x: 0.1 * x, (0.0, 4.0), cell=0.5)
    soil = hill.release(lambda p: 0.5 + 0.0 * p[:, 0], (1.0, 2.0), h=0.5)
    over = (soil.x[:, 1] - hill.height(soil.x[:, 0])).reshape(4, 2)
    assert over == pytest.approx(np.tile([0.125, 0.375], (4, 1))) and len(soil.x) == 8
    assert np.diff(np.unique(soil.x[:, 0])) == pytest.approx([0.25] * 3)


def test_depths_of_a_raster_are_kept_to_the_last_bit(tmp_path):
    hill = Terrain.function(wavy, AREA, cell=0.125)
    rng = np.random.default_rng(3)
    z = np.where(rng.random((11, 9)) < 0.3, np.nan, rng.random((11, 9)))
    depths = Raster(z, 0.23, (0.9, 0.61))
    assert hill.release(depths, None, 0.2).volume.sum() == pytest.approx(np.nansum(z) * 0.23**2, rel=1e-12)
    header = HEADER.replace("100.0", "1").replace("200.0", "1").replace("cellsize 2", "cellsize 0.5")
    path = written(tmp_path, header + "0.4 0.4 0.4\n0.2 0 0.2")
    assert hill.release(path, None, 0.2).volume.sum() == pytest.approx(0.4)


@pytest.mark.parametrize("make, sentence", [
    (lambda hill: hill.grid(0.25, 0.5, where=POLYGON + 2.0), "where reaches from .* the terrain from"),
    (lambda hill: hill.release(0.3, POLYGON + (0.0, 9.0), 0.2), "where reaches from"),
    (lambda hill: hill.grid(5.0, 0.5), "h is 5.0 m: no column"),
    (lambda hill: hill.grid(0.5, -0.5), "above is -0.5 m"),
    (lambda hill: hill.release(-0.5, None, 0.5), "depth is -0.5 m"),
    (lambda hill: hill.release(0.0, None, 0.5), "the release is empty"),
    (lambda hill: hill.release(Raster(np.ones((3, 3)), 1.0, (99.0, 0.0)), None, 0.5), "depths are from 98"),
    (lambda hill: hill.release(Raster(np.ones((3, 3)), 1.0, (2, 0.5)), None, 0.5), "16.7 % of the volume"),
    (lambda hill: hill.grid(0.5, 1.0, where=[(0, 0), (1, 1), (2, 2)]), "encloses 0 m.2"),
    (lambda hill: hill.grid(0.5, 1.0, where=lambda p: p[:, 0] > 99.0), "where holds for none of the"),
    (lambda hill: hill.structure(regions={"ice": (POLYGON + 99.0, 0.1)}), "region ice holds no element"),
    (lambda hill: hill.structure(regions={"ice": 0.1}), "region ice is 0.1: give .polygon, friction"),
    (lambda hill: hill.structure(friction=lambda p: -p[:, 0]), "the friction of terrain is -"),
])
def test_bad_areas_are_one_sentence(make, sentence):
    with pytest.raises(ValueError, match=sentence):
        make(Terrain.function(wavy, AREA, cell=0.5))


def test_regions_are_force_cells():
    hill = Terrain.function(wavy, AREA, cell=0.25)
    one = hill.structure("bed", 0.5, {"ice": ([(0, 0), (1, 0), (1, 3), (0, 3)], 0.05)})
    assert one.cells == ("bed_ice", "bed_rest")
    west = one.x[one.elements].mean(axis=1)[:, 0] < 1.0
    assert (one.friction == np.where(west, 0.05, 0.5)).all() and (one.cell == ~west).all()
    rough = hill.structure(friction=Raster([[0.2, 0.2], [0.6, 0.6]], (4.0, 3.0), (0.0, 0.0)))
    middle = rough.x[rough.elements].mean(axis=1)
    assert rough.friction == pytest.approx(0.2 + 0.1 * middle[:, 0]) and rough.cells == ("terrain",)
