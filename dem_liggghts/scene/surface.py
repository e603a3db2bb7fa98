"""The solid inside a closed surface of triangles: its volume, centre and inertia, exactly."""
import contextlib
import io
from pathlib import Path
from typing import Any, NamedTuple, Optional, Tuple, Union

import numpy as np

import mpm_dem_checks as check

from .arrays import Array, finite, rows, same_place

FLAT = 1e-12  # volume over the cube of the size, up to which a surface encloses nothing


class Solid(NamedTuple):
    """A body of density one inside a closed surface."""

    x: np.ndarray  # vertices [m], (n, 3)
    triangles: np.ndarray  # counter-clockwise seen from outside, (m, 3)
    volume: float  # [m^3]
    centre: np.ndarray  # of mass [m], (3,)
    inertia: np.ndarray  # about the centre of mass [m^5], (3, 3)


class Surface(NamedTuple):
    """Triangles of a closed surface."""

    x: np.ndarray  # vertices [m], (n, 3)
    triangles: np.ndarray  # counter-clockwise seen from outside, (m, 3)


def read_faces(vertices: Array, triangles: Array) -> Tuple[np.ndarray, np.ndarray]:
    """Vertices [m], shape (n, 3), and triangles, shape (m, 3), as arrays; ValueError for others."""
    x = finite(vertices, "vertices of the surface", (3,))
    return x, check.indices("triangles of the surface", rows(triangles), len(x), (3,), "vertices")


def closed_surface(vertices: Array, triangles: Array, scale: Optional[float] = None,
                   size: Optional[float] = None, volume: Optional[float] = None) -> Solid:
    """The solid inside the surface of ``triangles``, shape (m, 3), over ``vertices`` [m], shape (n, 3).

    Vertices in one place are one, triangles between fewer than three places are left out, and a surface that
    is inside out is turned. scale: factor of all lengths; or size [m]: the longest side of its box along the
    axes; or volume [m^3]. Raises ValueError when the surface is not closed, or encloses nothing.
    """
    x, t = read_faces(vertices, triangles)
    t = same_place(x)[t]
    t = t[(t[:, 0] != t[:, 1]) & (t[:, 1] != t[:, 2]) & (t[:, 2] != t[:, 0])]
    if not len(t):
        raise ValueError(f"the surface has {len(triangles)} triangles, and none has three corners in "
                         "different places: give a closed surface of triangles")
    _check_closed(x, t)
    used, number = np.unique(t, return_inverse=True)
    solid = _solid(x[used], number.reshape(-1, 3))
    if abs(solid.volume) <= FLAT * np.ptp(solid.x, axis=0).max()**3:
        raise ValueError(f"the surface encloses {abs(solid.volume):.3g} m^3, which is nothing: give the "
                         "surface of a body, not a sheet or flat triangles")
    if solid.volume < 0.0:
        solid = _solid(solid.x, solid.triangles[:, ::-1])
    return _scaled(solid, scale, size, volume)


def _check_closed(x: np.ndarray, t: np.ndarray) -> None:
    """ValueError unless as many triangles run through each edge in one direction as in the other."""
    edges = np.concatenate([t[:, [0, 1]], t[:, [1, 2]], t[:, [2, 0]]])
    low, high = edges.min(axis=1), edges.max(axis=1)
    keys, number, times = np.unique(low * len(x) + high, return_inverse=True, return_counts=True)
    balance = np.bincount(number.ravel(), np.where(edges[:, 0] == low, 1, -1))
    for wrong, what, remedy in (
            (times % 2 == 1, "is not closed: {} of its {} edges are open, with one triangle or an odd number "
                             "of them", "close the holes"),
            (balance != 0, "has triangles with opposite sides outside: {} of its {} edges are run through in "
                           "one direction only", "let all run counter-clockwise seen from outside")):
        if wrong.any():
            first = keys[np.argmax(wrong)]
            a, b = (x[int(k)].tolist() for k in divmod(first, len(x)))
            raise ValueError(f"the surface {what.format(wrong.sum(), len(keys))} (the first from {a} to {b} "
                             f"m): {remedy}")


def _solid(x: np.ndarray, t: np.ndarray) -> Solid:
    """Sums over the tetrahedra from one point to the triangles, with their signs: the divergence theorem, as
    in Mirtich, J. Graphics Tools 1(2) (1996) 31-50, and Eberly, Polyhedral Mass Properties (2002). Volume,
    centre and inertia are negative multiples of the true ones when the surface is inside out.

    For a tetrahedron with corners 0, a, b, c and D = det(a, b, c), the integral of 1 is D/6, that of x is
    D (a + b + c) / 24, and that of x x^T is D (a a^T + b b^T + c c^T + s s^T) / 120 with s = a + b + c.
    """
    origin = 0.5 * (x.min(axis=0) + x.max(axis=0))  # near the surface, for the digits
    corners = x[t] - origin
    det = np.linalg.det(corners)
    volume, sums = det.sum() / 6.0, corners.sum(axis=1)
    if not volume:
        return Solid(x, t, 0.0, origin, np.zeros((3, 3)))
    centre = det @ sums / 24.0 / volume
    second = np.einsum("t,tki,tkj->ij", det, corners, corners) + np.einsum("t,ti,tj->ij", det, sums, sums)
    second = second / 120.0 - volume * np.outer(centre, centre)
    second = 0.5 * (second + second.T)
    return Solid(x, t, float(volume), origin + centre, np.trace(second) * np.eye(3) - second)


def _scaled(solid: Solid, scale: Optional[float], size: Optional[float], volume: Optional[float]) -> Solid:
    given = {"scale": scale, "size": size, "volume": volume}
    named = [f"{name}={value}" for name, value in given.items() if value is not None]
    if len(named) > 1:
        raise ValueError(f"{' and '.join(named)} of the surface: give one of them")
    if not named:
        return solid
    factor = 1.0
    if scale is not None:
        factor = check.positive("scale of the surface", scale)
    elif size is not None:
        factor = check.positive("size of the surface", size, "m") / np.ptp(solid.x, axis=0).max()
    else:
        factor = (check.positive("volume of the surface", volume, "m^3") / solid.volume)**(1.0 / 3.0)
    return Solid(factor * solid.x, solid.triangles, factor**3 * solid.volume, factor * solid.centre,
                 factor**5 * solid.inertia)


def read_surface(given: Union[str, Path]) -> Tuple[np.ndarray, np.ndarray]:
    """Vertices, shape (n, 3), and triangles, shape (m, 3), of a file that meshio reads, such as STL, OBJ or
    PLY; quadrilaterals are divided. Raises ValueError."""
    import meshio  # slow to import, and few scenes read files

    path = check.file("path of the surface", given)
    said = io.StringIO()  # of its readers, which print what is wrong, and leave Python without a reason
    try:
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            data: Any = meshio.read(path)
    except (Exception, SystemExit) as error:  # meshio's readers fail in many ways, some by leaving Python
        reason = error if str(error) not in ("", "1") else said.getvalue()
        raise ValueError(f"{path} cannot be read as a surface ({check.shown(str(reason), plain=True)}): give "
                         "a file that meshio knows, as STL, OBJ or PLY") from None
    found = [block.data for block in data.cells if block.type == "triangle"]
    for quads in (block.data for block in data.cells if block.type == "quad"):
        found += [quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]
    others = sorted({block.type for block in data.cells if block.dim > 1} - {"triangle", "quad"})
    if others or not found:
        raise ValueError(f"{path} holds {', '.join(others) or 'no triangles'}: give a surface of triangles")
    return np.asarray(data.points, float), np.concatenate(found).astype(np.int64)
