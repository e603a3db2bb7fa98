"""Elements that are a graph over the plan: their checks, and which of them is above a place."""
from typing import Any, Tuple

import numpy as np

from ..compiled import compiled
from .facets import alike, same_places
from .shapes import SAME

STEEP = 1e-6  # area in plan over the area itself, below which a triangle stands upright
NEAR = 1e-9  # barycentric coordinate by which a place may be outside a triangle


def merged(x: np.ndarray, elements: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Vertices in one place as one; elements that are left without extent, and vertices of none, go."""
    elements = same_places(x, SAME * max(np.ptp(x, axis=0).max(), 1e-300))[elements]
    apart = [elements[:, a] != elements[:, b] for a in range(elements.shape[1]) for b in range(a)]
    used, elements = np.unique(elements[np.all(apart, axis=0)], return_inverse=True)
    return x[used], elements.reshape(-1, x.shape[1])


def as_graph(x: np.ndarray, elements: np.ndarray, name: str) -> np.ndarray:
    """The triangles counter-clockwise seen from above. ValueError where one stands upright or hangs over, and
    for holes."""
    corner = x[elements]
    doubled = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    plan = doubled[:, 2]
    upright = np.abs(plan) <= STEEP * np.linalg.norm(doubled, axis=1)
    if upright.any():
        raise ValueError(f"{name} has {upright.sum()} triangles that stand upright, the first at "
                         f"{_where(corner[upright])}: a terrain has one height at each place, leave out "
                         "sides and base, and give walls as structures of their own")
    elements = np.where((plan < 0.0)[:, None], elements[:, ::-1], elements)
    _check_edges(x, elements, name)
    return np.ascontiguousarray(elements)


def _check_edges(x: np.ndarray, elements: np.ndarray, name: str) -> None:
    """Beside each edge there is one triangle on each side, or none; edges with none beyond are one loop."""
    edges = np.concatenate([elements[:, [a, (a + 1) % 3]] for a in range(3)])
    order, first, count = alike(edges)
    up = (edges[:, 0] < edges[:, 1])[order]
    same = (count > 2) | ((count == 2) & (up[first] == up[np.minimum(first + 1, len(up) - 1)]))
    if same.any():
        raise ValueError(f"{name} is folded at {_where(x[edges[order[first[same]]]])}: triangles lie one "
                         "above the other there, leave out those below")
    rim = edges[order[first[count == 1]]]
    loops, of = _pieces(rim, len(x))
    if loops > 1:
        size = [np.ptp(x[rim[of == k].ravel(), :2], axis=0).max() for k in range(loops)]
        inner = rim[of == int(np.argsort(size)[-2])]
        raise ValueError(f"{name} has {loops - 1} holes or more pieces, one around {_where(x[inner])}: close "
                         "it, or crop it with inside=")


def _pieces(edges: np.ndarray, n: int) -> Tuple[int, np.ndarray]:
    """Number of connected pieces of ``edges`` between n vertices, and that of each edge."""
    from scipy.sparse import coo_matrix  # takes time to import, and few scenes need it
    from scipy.sparse.csgraph import connected_components

    used, ends = np.unique(edges, return_inverse=True)
    ends = ends.reshape(-1, 2)
    graph = coo_matrix((np.ones(len(ends)), ends.T), shape=(len(used),) * 2)
    count, label = connected_components(graph, directed=False)
    return count, label[ends[:, 0]]


def _where(corner: np.ndarray) -> str:
    """The middle of the first of ``corner``, shape (k, n, 3), in words."""
    return ", ".join(f"{v:.9g}" for v in corner[0].mean(axis=0)) + " m"


@compiled
def _search(places, size, counts, start, items, corner, to_weights, found):  # type: ignore[no-untyped-def]
    """Fill ``found``, see ``PlanSearch.find``."""
    triangle, best, times = found
    for p in range(len(places)):
        x, y = places[p]
        if not (np.isfinite(x) and np.isfinite(y)):
            continue
        i = min(max(int(np.floor(x / size)), 0), counts[0] - 1)
        b = i + counts[0] * min(max(int(np.floor(y / size)), 0), counts[1] - 1)
        nearest = -NEAR
        for item in range(start[b], start[b + 1]):
            e = items[item]
            u, v = x - corner[e, 0, 0], y - corner[e, 0, 1]
            s = to_weights[e, 0, 0] * u + to_weights[e, 0, 1] * v
            t = to_weights[e, 1, 0] * u + to_weights[e, 1, 1] * v
            least = min(1.0 - s - t, min(s, t))
            times[p] += least > NEAR
            if least >= nearest and (triangle[p] < 0 or least > nearest):
                nearest, triangle[p] = least, e
                best[p, 0], best[p, 1], best[p, 2] = 1.0 - s - t, s, t


class PlanSearch:
    """Which of the triangles, shape (m, 3), of vertices x [m], shape (n, 3), is above or below a place of the
    plan."""

    def __init__(self, x: np.ndarray, elements: np.ndarray):
        self._origin = x[:, :2].min(axis=0)
        self._corner, self._z = x[elements][:, :, :2] - self._origin, x[elements][:, :, 2]
        edge = self._corner[:, 1:] - self._corner[:, :1]
        self._to_weights = np.ascontiguousarray(np.linalg.inv(np.swapaxes(edge, 1, 2)))
        extent = np.ptp(x[:, :2], axis=0)
        self._size = np.sqrt(2.0 * np.prod(extent) / len(elements))
        self._counts = np.maximum(np.ceil(extent / self._size).astype(np.int64), 1)
        self._start, self._items = self._fill()

    def _bin(self, places: np.ndarray) -> np.ndarray:
        return np.clip(np.floor(places / self._size).astype(np.int64), 0, self._counts - 1)

    def _fill(self) -> Tuple[np.ndarray, np.ndarray]:
        low, high = self._bin(self._corner.min(axis=1)), self._bin(self._corner.max(axis=1))
        span = high - low + 1
        share = span.prod(axis=1)
        item = np.repeat(np.arange(len(low)), share)
        rest = np.arange(len(item)) - np.repeat(np.cumsum(share) - share, share)
        number = (low[item, 0] + rest % span[item, 0]) + self._counts[0] * (
            low[item, 1] + rest // span[item, 0])
        start = np.concatenate([[0], np.cumsum(np.bincount(number, minlength=self._counts.prod()))])
        return start, item[np.argsort(number, kind="stable")]

    def find(self, places: np.ndarray) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Of ``places`` [m], shape (n, 2): the triangle that each is in, -1 for none, and its barycentric
        coordinates, shape (n, 3); how many triangles it is well inside of."""
        n = len(places)
        found = np.full(n, -1), np.zeros((n, 3)), np.zeros(n, np.int64)
        _search(np.ascontiguousarray(places - self._origin), self._size, self._counts, self._start,
                self._items, self._corner, self._to_weights, found)
        return found

    def at(self, places: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
        """See ``Raster.at``."""
        e, w, _ = self.find(places)
        z = np.where(e >= 0, np.sum(w * self._z[e], axis=1), np.nan)
        rise = self._z[e][:, 1:] - self._z[e][:, :1]
        slope = np.einsum("qi,qij->qj", rise, self._to_weights[e])
        return z, np.where((e >= 0)[:, None], slope, np.nan)

    def check_single(self, name: str) -> None:
        """ValueError where two triangles lie one above the other."""
        middle = self._corner.mean(axis=1) + self._origin
        twice = self.find(middle)[2] > 1
        if twice.any():
            at = np.column_stack([middle, self._z.mean(axis=1)])[twice][:, None]
            raise ValueError(f"{name} hangs over at {_where(at)}: triangles lie one above the other there, "
                             "leave out those below")


def search_of(x: np.ndarray, elements: np.ndarray, name: str) -> Any:
    """A ``PlanSearch`` of triangles none of which lie one above the other."""
    search = PlanSearch(x, elements)
    search.check_single(name)
    return search


def as_line(x: np.ndarray, elements: np.ndarray) -> Tuple[Any, np.ndarray]:
    """What tells heights of a line, and its segments to the right, so that the left is above."""
    elements = np.sort(elements[np.argsort(x[elements].min(axis=1)[:, 0])], axis=1)
    ends = x[elements][:, :, 0]
    elements = np.where((ends[:, 0] > ends[:, 1])[:, None], elements[:, ::-1], elements)
    if (ends[:, 0] == ends[:, 1]).any() or (elements[1:, 0] != elements[:-1, 1]).any():
        raise ValueError("the segments of the terrain are not one line with one height at each x: give them "
                         "from left to right, each from where the one before ends")
    return Line(x[np.append(elements[:, 0], elements[-1, 1])]), elements


class Line:
    """Heights along a line in the plane, points shape (n, 2), from left to right."""

    def __init__(self, points: np.ndarray):
        self._x, self._z = points.T

    def at(self, places: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
        """See ``Raster.at``."""
        p = places[:, 0]
        i = np.clip(np.searchsorted(self._x, p, side="right") - 1, 0, len(self._x) - 2)
        slope = (np.diff(self._z) / np.diff(self._x))[i]
        inside = (p >= self._x[0]) & (p <= self._x[-1])
        z = self._z[i] + slope * (p - self._x[i])
        return np.where(inside, z, np.nan), np.where(inside, slope, np.nan)[:, None]
