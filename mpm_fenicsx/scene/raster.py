"""Heights on a regular raster over the plan, cut into triangles (in the plane: segments), and where they come
from: ESRI ASCII grids and GeoTIFF."""
import gzip
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Dict, Optional, Sequence, Tuple

import numpy as np

import mpm_dem_checks as check

CORNERS, CENTRES = ("xllcorner", "yllcorner"), ("xllcenter", "yllcenter")
NEEDED = "ncols, nrows, xllcorner, yllcorner and cellsize"
EDGE = 1e-9  # of a cell: as far outside a place is still on the edge
BYTES = 500  # for each height, with its triangles, measured


@dataclass(frozen=True)
class Raster:
    """Heights z [m], shape (nx, ny), in the plane (nx,): z[i, j] is that at ``lower`` + (i, j) * ``cell``
    [m]. Nan where there is none. cell: one width, or one along each axis.

    Between four heights the surface is two triangles, cut along the diagonal whose ends differ less, as
    valleys and ridges run.

    >>> Raster([[0.0, 1.0], [2.0, 3.0], [4.0, 5.0]], cell=5.0, lower=(100.0, 200.0)).upper
    (110.0, 205.0)
    """

    z: np.ndarray
    cell: Tuple[float, ...]
    lower: Tuple[float, ...]

    def __post_init__(self) -> None:
        z = check.shaped("heights of the raster", self.z, ("nx",), ("nx", "ny"))
        if min(z.shape) < 2:
            raise ValueError(f"the raster has {' x '.join(map(str, z.shape))} heights: give at least 2 along "
                             "each axis")
        cell = (self.cell,) * z.ndim if np.ndim(self.cell) == 0 else self.cell
        object.__setattr__(self, "z", z)
        object.__setattr__(self, "cell", check.numbers("cell of the raster", cell, z.ndim, "m",
                                                       check.positive))
        lower = np.atleast_1d(self.lower)
        object.__setattr__(self, "lower", check.numbers("lower corner of the raster", lower, z.ndim, "m"))

    @property
    def upper(self) -> Tuple[float, ...]:
        """Place of the last height [m]."""
        return tuple(a + (n - 1) * h for a, n, h in zip(self.lower, self.z.shape, self.cell))

    def axes(self) -> Sequence[np.ndarray]:
        """Places of the heights along each axis [m]."""
        return [a + h * np.arange(n) for a, n, h in zip(self.lower, self.z.shape, self.cell)]

    def cropped(self, lower: Sequence[float], upper: Sequence[float], name: str) -> "Raster":
        """The part that covers a box in plan, as far as there is one; ValueError for none. name: of it."""
        part, first = [], []
        for a, b, start, h, n in zip(lower, upper, self.lower, self.cell, self.z.shape):
            i = max(int(np.floor((a - start) / h + EDGE)), 0)
            j = min(int(np.ceil((b - start) / h - EDGE)), n - 1)
            if j <= i:
                raise ValueError(f"inside, from {tuple(lower)} to {tuple(upper)} m, lies outside {name}, "
                                 f"from {self.lower} to {self.upper} m: look at the coordinates")
            part.append(slice(i, j + 1))
            first.append(start + i * h)
        return Raster(self.z[tuple(part)], self.cell, tuple(first))

    def check_whole(self, name: str) -> None:
        """ValueError where a height is missing."""
        missing = ~np.isfinite(self.z)
        if missing.any():
            place = np.argwhere(missing)[0]
            at = ", ".join(f"{a[i]:.12g}" for a, i in zip(self.axes(), place))
            raise ValueError(f"{missing.sum()} of {missing.size} heights of {name} are missing, the first at "
                             f"{at} m: crop them away with inside=, or fill them in")

    def surface(self) -> Tuple[np.ndarray, np.ndarray]:
        """Vertices [m], shape (n, D), in the order of the heights, and elements, shape (m, D), with their
        outside above."""
        check.check_memory(f"{self.z.size} heights of the terrain", self.z.size * BYTES, "crop it with "
                           "inside=, or take a coarser raster")
        x = np.stack([*(a.ravel() for a in np.meshgrid(*self.axes(), indexing="ij")), self.z.ravel()], axis=1)
        number = np.arange(self.z.size).reshape(self.z.shape)
        if self.z.ndim == 1:
            return x, np.column_stack([number[:-1], number[1:]])
        a, b, c, d = (number[i, j].ravel() for i, j in _corners(number))
        main = _main(*(self.z.ravel()[k] for k in (a, b, c, d)))[:, None]
        first = np.where(main, np.column_stack([a, b, d]), np.column_stack([a, b, c]))
        second = np.where(main, np.column_stack([a, d, c]), np.column_stack([b, d, c]))
        return x, np.stack([first, second], axis=1).reshape(-1, 3)

    def at(self, places: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
        """Height [m], shape (n,), and slope along each axis [-], shape (n, D - 1), at ``places`` [m], shape
        (n, D - 1), on the surface; nan outside."""
        s = (places - np.array(self.lower)) / np.array(self.cell)
        last = np.array(self.z.shape) - 1
        inside = ((s >= -EDGE) & (s <= last + EDGE)).all(axis=1)
        i = np.clip(np.where(inside[:, None], s, 0.0), 0.0, last - 1).astype(np.int64)
        t = s - i
        if self.z.ndim == 1:
            z, slope = self.z[i[:, 0]], np.diff(self.z)[i]
        else:
            a, b, c, d = (self.z[i[:, 0] + k, i[:, 1] + m] for m in (0, 1) for k in (0, 1))
            main = _main(a, b, c, d)
            low = np.where(main, t[:, 0] >= t[:, 1], t[:, 0] + t[:, 1] <= 1.0)  # the triangle with side a-b
            east = np.where(low, b - a, d - c)
            north = np.where(main == low, d - b, c - a)
            slope = np.column_stack([east, north])
            z = np.where(main | low, a, b + c - d)
        height = z + np.sum(slope * t, axis=1)
        slope = slope / np.array(self.cell)
        return np.where(inside, height, np.nan), np.where(inside[:, None], slope, np.nan)


def _corners(number: np.ndarray) -> Sequence[Tuple[slice, slice]]:
    low, high = slice(None, -1), slice(1, None)
    return (low, low), (high, low), (low, high), (high, high)


def _main(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray) -> np.ndarray:
    """Whether the cut goes from the corner a to d, opposite, not from b to c."""
    return np.abs(a - d) <= np.abs(b - c)


def read_raster(path: Path) -> Raster:
    """Heights from an ESRI ASCII grid (.asc, .asc.gz) or a GeoTIFF; ValueError for a file that is none."""
    return _read_ascii(path) if ".asc" in path.name.lower() else _read_tiff(path)


def is_raster(path: Path) -> bool:
    """Whether the ending of the name is that of a raster."""
    return path.name.lower().endswith((".asc", ".asc.gz", ".tif", ".tiff"))


def _read_ascii(path: Path) -> Raster:
    try:
        with (gzip.open(path, "rt") if path.suffix.lower() == ".gz" else open(path)) as file:
            text = file.read()
    except (OSError, UnicodeDecodeError) as error:
        raise ValueError(f"{path} cannot be read as text ({error}): give an ESRI ASCII grid") from None
    header: Dict[str, float] = {}
    start = 0
    while text[start:start + 1].isalpha():
        end = text.find("\n", start) % (len(text) + 1)
        words = text[start:end].lower().split()
        try:
            header[words[0]] = float(words[1])
        except (IndexError, ValueError):
            raise ValueError(f"{path} has the line {text[start:end]!r} in its header: give the name and one "
                             f"number, as in an ESRI ASCII grid with {NEEDED}") from None
        start = end + 1
    nx, ny, cell, lower = _header(path, header)
    z = _numbers(path, text[start:])
    if len(z) != nx * ny:
        raise ValueError(f"{path} has {len(z)} heights, its header says {ny} rows of {nx}: look at what is "
                         "missing")
    z[z == header.get("nodata_value", -9999.0)] = np.nan
    return Raster(np.ascontiguousarray(z.reshape(ny, nx)[::-1].T), cell, lower)


def _numbers(path: Path, text: str) -> np.ndarray:
    try:
        words = text.split()
        return np.array(words, dtype=np.float64)
    except ValueError as error:
        raise ValueError(f"{path} has heights that are no numbers ({error}): write them with a point and "
                         "spaces between them") from None


def _header(path: Path, header: Dict[str, float]) -> Tuple[int, int, Tuple[float, ...], Tuple[float, ...]]:
    """Columns, rows, width of a cell along x and y [m], and place of the lower left height [m], which is in
    the middle of its cell."""
    try:
        cell = tuple(header.get(d, header.get("cellsize", np.nan)) for d in ("dx", "dy"))
        corner = CORNERS[0] in header
        lower = tuple(header[name] + (0.5 * h if corner else 0.0)
                      for name, h in zip(CORNERS if corner else CENTRES, cell))
        counts = [check.count(f"{name} of {path}", header[name], 2) for name in ("ncols", "nrows")]
    except KeyError as error:
        raise ValueError(f"{path} has no {error.args[0]} in its header, but {', '.join(header) or 'nothing'}:"
                         f" give an ESRI ASCII grid with {NEEDED}") from None
    if not min(cell) > 0.0:
        raise ValueError(f"{path} has cells of {cell[0]} x {cell[1]} m in its header: give cellsize, or dx "
                         "and dy, above 0")
    return counts[0], counts[1], cell, lower


def _read_tiff(path: Path) -> Raster:
    try:
        import rasterio  # optional
    except ImportError:
        raise ValueError(f"{path} needs rasterio, which is not installed: install it, or write the raster as "
                         "ESRI ASCII grid (gdal_translate -of AAIGrid)") from None
    try:
        with rasterio.open(path) as file:
            z, a, crs = file.read(1, masked=True), file.transform, file.crs
    except (rasterio.errors.RasterioError, OSError) as error:
        raise ValueError(f"{path} cannot be read as a raster ({error}): give a GeoTIFF") from None
    if crs is not None and crs.is_geographic:
        raise ValueError(f"{path} has coordinates in degrees ({crs}): give a raster in a projection, in m "
                         "(gdalwarp -t_srs)")
    if crs is not None and crs.is_projected and crs.linear_units_factor[1] != 1.0:
        raise ValueError(f"{path} has coordinates in {crs.linear_units_factor[0]}: give a raster in m "
                         "(gdalwarp -t_srs), also its heights")
    return _from_transform(path, np.ma.filled(z.astype(float), np.nan), a)


def _from_transform(path: Path, z: np.ndarray, a: Any) -> Raster:
    """z: by rows and columns; a: the affine map from column and row to the corners of cells."""
    if a.b or a.d or not (a.a and a.e):
        raise ValueError(f"{path} has rows that do not run along x ({tuple(a)[:6]}): turn it north up "
                         "(gdalwarp)")
    turned = z[::1 if a.e > 0.0 else -1, ::1 if a.a > 0.0 else -1]
    ends = [(c, c + n * step) for c, n, step in ((a.c, z.shape[1], a.a), (a.f, z.shape[0], a.e))]
    cell = abs(a.a), abs(a.e)
    return Raster(np.ascontiguousarray(turned.T), cell, tuple(min(e) + 0.5 * h for e, h in zip(ends, cell)))


def sampled(z: Any, lower: Sequence[float], upper: Sequence[float], cell: float) -> Raster:
    """Heights of a function of the plan at the corners of cells of about ``cell`` [m], see
    ``Terrain.function``."""
    size = np.subtract(upper, lower)
    counts = [max(1, round(length / cell)) for length in size]
    steps = tuple(float(v) for v in size / counts)
    axes = [np.linspace(a, b, n + 1) for a, b, n in zip(lower, upper, counts)]
    places = np.meshgrid(*axes, indexing="ij")
    found = check.values("z of the terrain", z, [p.ravel() for p in places], (places[0].size,), (), unit="m")
    return Raster(np.broadcast_to(found, places[0].size).reshape(places[0].shape), steps, tuple(lower))


def optional_box(inside: Any, dim: int) -> Optional[Tuple[Tuple[float, ...], Tuple[float, ...]]]:
    """Lower and upper corner in plan [m], shape (dim - 1,), of a ``Box`` of x and y, or of two numbers in the
    plane; None for None."""
    if inside is None:
        return None
    if hasattr(inside, "lower") and len(inside.lower) == dim - 1:
        return tuple(inside.lower), tuple(inside.upper)
    if dim == 2:
        lower, upper = check.numbers("inside", inside, 2, "m")
        if lower < upper:
            return (lower,), (upper,)
    return check.refuse("inside", inside, "give a Box of x and y" if dim == 3 else "give (lower, upper)", "m")
