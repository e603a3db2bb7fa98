"""Terrain: a surface from a survey that soil and rocks stand on as on one object. Frozen data in SI units."""
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Callable, Dict, Optional, Sequence, Tuple, Union

import numpy as np

import mpm_dem_checks as check

from .bodies import Cloud
from .column_grid import Columns
from .columns import column_cloud, column_grid
from .facets import normal_areas
from .graph import as_graph, as_line, merged, search_of
from .mesh import Box
from .raster import Raster, is_raster, optional_box, read_raster, sampled
from .regions import frictions
from .structures import Structure

Area = Union[Sequence, np.ndarray, Callable, None]
Depth = Union[float, Callable, str, Path, Raster]


@dataclass(frozen=True)
class Terrain:
    """A surface that has one height at each place of the plan: x (east), y (north) and z (up) in space, x and
    y (up) in the plane. x: vertices [m], shape (n, D); elements, shape (m, D): triangles (in the plane
    segments), turned so that their outside is above; heights: the raster that they are made of, if any.

    Coordinates stay as they are given, also those of a map. Made by ``read``, ``raster``, ``function`` and
    ``profile``, or from vertices and triangles; vertices in one place are one.

    Raises ValueError for heights that are missing, and for triangles that stand upright, hang over, or leave
    holes.

    >>> hill = Terrain.function(lambda x, y: 0.2 * x, Box((0.0, 0.0), (4.0, 2.0)), cell=1.0)
    >>> hill.height([(0.5, 1.5), (9.0, 9.0)]), hill.normal([(0.5, 1.5)]).round(3).tolist()
    (array([0.1, nan]), [[-0.196, -0.0, 0.981]])
    >>> print(hill)
    terrain in space, 15 vertices and 16 triangles: x 0 to 4 m, y 0 to 2 m, z 0 to 0.8 m; cells 1 x 1 m;
    slope 11.3 degrees in the mean, at most 11.3
    """

    x: np.ndarray
    elements: np.ndarray
    heights: Optional[Raster] = field(default=None, repr=False)

    def __post_init__(self) -> None:
        x = check.array("vertices of the terrain", self.x, ("n", 2), ("n", 3), unit="m")
        elements = check.indices("elements of the terrain", self.elements, len(x), (x.shape[1],), "vertices")
        if not len(elements):
            raise ValueError("the terrain has no elements: give triangles, in the plane segments")
        search: Any = self.heights
        if search is None:
            x, elements = merged(x, elements)
            if x.shape[1] == 2:
                search, elements = as_line(x, elements)
            else:
                elements = as_graph(x, elements, "the terrain")
                search = search_of(x, elements, "the terrain")
        for name, value in (("x", x), ("elements", elements), ("_search", search)):
            object.__setattr__(self, name, value)

    # ---------------------------------------------------------------- where it comes from

    @classmethod
    def read(cls, path: Union[str, Path], inside: Optional[Box] = None) -> "Terrain":
        """From a file: an ESRI ASCII grid (.asc, .asc.gz); a GeoTIFF in metres, where rasterio is installed;
        triangles that meshio reads (STL, OBJ, PLY). inside: a ``Box`` of x and y [m], of which it is taken.

        >>> import tempfile
        >>> file = Path(tempfile.mkdtemp()) / "hill.asc"
        >>> header = "ncols 3\\nnrows 2\\nxllcorner 10\\nyllcorner 20\\ncellsize 2\\n"
        >>> _ = file.write_text(header + "4 5 6\\n1 2 3\\n")
        >>> hill = Terrain.read(file)
        >>> hill.lower, hill.upper, hill.height([(11.0, 21.0), (15.0, 23.0)])
        ((11.0, 21.0), (15.0, 23.0), array([1., 6.]))
        """
        found = check.file("path of the terrain", path)
        box = optional_box(inside, 3)
        if is_raster(found):
            return cls._of_raster(read_raster(found), box, str(found))
        from .meshfile import read_triangles

        x, triangles = read_triangles(found)
        if box is not None:
            corner = x[triangles][:, :, :2]
            held = ((corner.max(axis=1) > box[0]) & (corner.min(axis=1) < box[1])).all(axis=1)
            triangles = triangles[held]
            if not len(triangles):
                raise ValueError(f"inside, from {box[0]} to {box[1]} m, lies outside {found}, whose x and y "
                                 f"are from {tuple(x[:, :2].min(axis=0))} to {tuple(x[:, :2].max(axis=0))} "
                                 "m: look at the coordinates")
        return cls(x, triangles)

    @classmethod
    def raster(cls, z: np.ndarray, cell: Union[float, Sequence[float]],
               lower: Union[float, Sequence[float]]) -> "Terrain":
        """From heights z [m], shape (nx, ny), in the plane (nx,): z[i, j] at ``lower`` + (i, j) ``cell``.

        >>> Terrain.raster([[0.0, 1.0], [0.0, 1.0], [0.0, 1.0]], cell=5.0, lower=(100.0, 200.0)).upper
        (110.0, 205.0)
        """
        return cls._of_raster(Raster(z, cell, lower), None, "the raster")  # type: ignore[arg-type]

    @classmethod
    def function(cls, z: Callable, inside: Union[Box, Sequence[float]], cell: float) -> "Terrain":
        """From a function z(x, y) -> heights, arrays in and array out, at the corners of squares of about
        ``cell`` [m] that fill ``inside``, a ``Box`` of x and y; in the plane z(x) and (lower, upper).

        >>> Terrain.function(lambda x: 0.1 * x**2, (0.0, 3.0), cell=1.0).x[:, 1].round(2).tolist()
        [0.0, 0.1, 0.4, 0.9]
        """
        check.positive("cell of the terrain", cell, "m")
        box = optional_box(inside, 3 if isinstance(inside, Box) else 2)
        if box is None:
            return check.refuse("inside", inside, "give a Box of x and y, in the plane (lower, upper)")
        return cls._of_raster(sampled(z, *box, cell), None, "the function")

    @classmethod
    def profile(cls, x: Sequence[float], y: Sequence[float]) -> "Terrain":
        """In the plane, a line through the heights y [m] at x [m], which grows.

        >>> Terrain.profile([0.0, 10.0, 14.0], [5.0, 0.0, 0.0]).height([2.0, 12.0])
        array([4., 0.])
        """
        a = check.array("x of the profile", x, ("n",), unit="m")
        line = np.column_stack([a, check.array("y of the profile", y, (len(a),), unit="m")])
        if len(a) < 2 or not (np.diff(a) > 0.0).all():
            check.refuse("x of the profile", a.tolist(), "give at least 2, each greater than the one before",
                         "m")
        k = np.arange(len(a) - 1)
        return cls(line, np.column_stack([k, k + 1]))

    @classmethod
    def _of_raster(cls, heights: Raster, box: Any, name: str) -> "Terrain":
        if box is not None:
            heights = heights.cropped(box[0], box[1], name)
        heights.check_whole(name)
        return cls(*heights.surface(), heights)

    # ---------------------------------------------------------------- what is read off

    @property
    def dim(self) -> int:
        """Number of dimensions."""
        return int(self.x.shape[1])

    @property
    def lower(self) -> Tuple[float, ...]:
        """Lower corner in plan [m], shape (dim - 1,)."""
        return tuple(float(v) for v in self.x[:, :-1].min(axis=0))

    @property
    def upper(self) -> Tuple[float, ...]:
        """Upper corner in plan [m], shape (dim - 1,)."""
        return tuple(float(v) for v in self.x[:, :-1].max(axis=0))

    def height(self, xy: Any) -> np.ndarray:
        """Of the surface at places of the plan [m], shape (n, dim - 1): (n,); of one place (dim - 1,) a
        number. nan outside."""
        return self._at(xy)[0]

    def normal(self, xy: Any) -> np.ndarray:
        """Upward unit normal of the surface at places of the plan [m], shape (n, dim - 1): (n, dim); of one
        place (dim - 1,) its own, (dim,). nan outside."""
        slope = np.asarray(self._at(xy)[1])
        n = np.concatenate([-slope, np.ones((*slope.shape[:-1], 1))], axis=-1)
        return np.asarray(n / np.linalg.norm(n, axis=-1, keepdims=True))

    def _at(self, xy: Any) -> Tuple[np.ndarray, np.ndarray]:
        """Heights and slopes at places of the plan, or at one."""
        given = np.asarray(xy, float)
        one = given.shape == ((2,) if self.dim == 3 else ())
        if one or self.dim == 2 and given.ndim == 1:
            given = given.reshape(-1, self.dim - 1)
        places = check.shaped("places of the plan", given, ("n", self.dim - 1))
        height, slope = self._search.at(places)  # type: ignore[attr-defined]
        return (height[0], slope[0]) if one else (height, slope)

    def summary(self) -> str:
        """What it is, in two lines: a unit other than metres would show here."""
        kind = "in space" if self.dim == 3 else "in the plane"
        extent = ", ".join(f"{name} {a:.10g} to {b:.10g} m" for name, a, b in zip(
            "xyz", self.x.min(axis=0) + 0.0, self.x.max(axis=0) + 0.0))
        cells = self.heights and "; cells " + " x ".join(f"{h:.6g}" for h in self.heights.cell) + " m"
        areas = normal_areas(self.x, self.elements)
        steep = np.degrees(np.arctan2(np.linalg.norm(areas[:, :-1], axis=1), areas[:, -1]))
        mean = float(np.average(steep, weights=areas[:, -1]))
        return (f"terrain {kind}, {len(self.x)} vertices and {len(self.elements)} "
                f"{'triangles' if self.dim == 3 else 'segments'}: {extent}{cells or ''};\n"
                f"slope {mean:.1f} degrees in the mean, at most {steep.max():.1f}")

    __str__ = summary

    # ---------------------------------------------------------------- what stands on it

    def structure(self, name: str = "terrain", friction: Any = 0.0,
                  regions: Optional[Dict[str, Tuple]] = None, material: Optional[str] = None,
                  xi: Any = np.inf, motion: Optional[Callable] = None) -> Structure:
        """The surface as ``Structure``, for soil and rocks. friction: with the soil [-], one coefficient, a
        function of places of the plan [m], shape (n, dim - 1), or a ``Raster`` of coefficients; xi: Voellmy's
        turbulent friction [m/s^2], likewise. regions: name -> (polygon, shape (k, 2), or in the plane two
        ends, friction), or with its xi behind: elements whose middle is inside are a force cell of their own,
        such as "terrain_ice"; the others are "terrain_rest". motion: how the ground has moved since the start
        [m] as a function of time [s], shape (dim,), or of each vertex x, shape (n, dim), see ``Structure``.

        >>> slope = Terrain.profile([0.0, 5.0, 9.0], [5.0, 0.0, 0.0])
        >>> slope.structure(friction=0.5, regions={"ice": ((0.0, 5.0), 0.1)}).cells
        ('terrain_ice', 'terrain_rest')
        """
        middle = self.x[self.elements].mean(axis=1)[:, :-1]
        values, turbulent, cell, names = frictions(middle, friction, xi, regions or {})
        return Structure(name, self.x, self.elements, values, cell=cell, names=names, material=material,
                         xi=turbulent, motion=motion)

    def grid(self, h: float, above: Union[float, Callable], where: Area = None,
             below: Optional[float] = None) -> Columns:
        """Background grid of columns of cells of ``h`` [m] whose layers follow the surface, from ``below``
        [m] (by default h) under it to at least ``above`` [m] over it, a number or a function of places of the
        plan. Columns stand side by side from the lower corner of the terrain; with ``where``, a polygon,
        shape (k, 2), in the plane two ends, or a function of places with a mask, those whose middle or one of
        whose corners it holds. Surfaces "side", "top" and "bottom".

        >>> slope = Terrain.profile([0.0, 4.0], [2.0, 0.0])
        >>> mesh = slope.grid(h=1.0, above=2.0)
        >>> len(mesh.cells), mesh.box, sorted(mesh.surfaces)
        (12, Box(lower=(0.0, -1.0), upper=(4.0, 4.0)), ['bottom', 'side', 'top'])
        """
        return column_grid(self, h, above, where, h if below is None else below)

    def release(self, depth: Depth, where: Area, h: float) -> Cloud:
        """Material points between the surface and ``depth`` [m] over it, upright: a number, a function of
        places of the plan, or a raster (a path to one), each value of which holds over its cell. where: as in
        ``grid``. The points are h / 2 apart in plan; those of a column share its depth evenly.

        The volume is the integral of the depth: exactly with a number over a polygon, and with a raster; a
        function is taken at the middles of squares of h / 2.

        >>> slope = Terrain.profile([0.0, 4.0], [2.0, 0.0])
        >>> slope.release(0.5, where=(1.0, 2.1), h=1.0).volume.sum().round(12)
        0.55
        """
        if isinstance(depth, (str, Path)):
            depth = read_raster(check.file("depth", depth))
        return column_cloud(self, depth, where, h)
