"""Motion from the solid's interface points to the wall nodes (eq. 22) and forces back by the transpose (eq.
23).

Each rank keeps and multiplies a block of rows of the matrix H and a block of rows of its transpose, and the
results are put together in the order of the ranks. A product with the transpose of a distributed matrix, as
libraries offer it, adds what other ranks contribute in the order in which it arrives; with the transpose in
rows of its own, every sum runs over ascending columns on one rank, and the result is the same to the last bit
on any number of ranks.
"""
from typing import Any, Tuple

import numpy as np
from mpi4py import MPI
from scipy.sparse import coo_matrix, csr_matrix

import mpm_dem_checks as check


def share(n: int, comm: Any) -> Tuple[slice, np.ndarray]:
    """The rows, of n in all, that this rank keeps: a slice; and where the ranks' shares begin and end, shape
    (ranks + 1,)."""
    bounds = n * np.arange(comm.size + 1) // comm.size
    return slice(bounds[comm.rank], bounds[comm.rank + 1]), bounds


class Mapping:
    """The matrix H of eq. 22, shape (wall nodes, interface points), and the places where both sides started.

    rows: this rank's rows of H, those of ``share``. Everything is collective, except where the mapping
    ``is_copy``: that costs nothing. ``compliance`` [m/N] and ``indentation``: see ``spread``.

    >>> x = np.array([[0.0, 0.0], [1.0, 0.0]])
    >>> middle = linear(x, [[0, 1]], [[0.5, 0.1]])
    >>> wall_x, wall_v = middle.motion(x + [0.0, 0.2], np.array([[0.0, 1.0], [0.0, 3.0]]))
    >>> wall_x.round(12).tolist(), wall_v.tolist()
    ([[0.5, 0.3]], [[0.0, 2.0]])
    """

    compliance = 0.0

    def __init__(self, rows: Any, x_solid: np.ndarray, x_wall: np.ndarray,
                 comm: Any = MPI.COMM_WORLD) -> None:
        self._x_solid, self._x_wall, self._comm = np.array(x_solid, float), np.array(x_wall, float), comm
        (mine, self._wall_bounds), self._solid_bounds = share(len(x_wall), comm), share(len(x_solid), comm)[1]
        self._rows = rows.tocsr()
        self._rows.sum_duplicates()  # also sorts the columns
        self._transpose = self._transposed(mine.start)
        entries = self._rows.tocoo()
        same = len(x_solid) == len(x_wall) and np.array_equal(self._x_solid, self._x_wall) \
            and len(entries.data) == rows.shape[0] and (entries.data == 1.0).all() \
            and np.array_equal(entries.row + mine.start, entries.col)
        self.comm, self.rows, self.x_solid, self.x_wall = comm, self._rows, self._x_solid, self._x_wall
        self.is_copy = bool(comm.allreduce(same, MPI.LAND))

    def _transposed(self, first: int) -> Any:
        """This rank's rows of the transpose, from the entries that the ranks have in its columns."""
        entries, bounds, comm = self._rows.tocoo(), self._solid_bounds, self._comm
        keeper = np.searchsorted(bounds, entries.col, side="right") - 1
        parts = comm.alltoall([(entries.row[to] + first, entries.col[to], entries.data[to])
                               for to in (keeper == rank for rank in range(comm.size))])
        wall, solid, values = map(np.concatenate, zip(*parts))
        start, stop = bounds[comm.rank:comm.rank + 2]
        block = coo_matrix((values, (solid - start, wall)), (stop - start, len(self._x_wall))).tocsr()
        block.sort_indices()
        return block

    def _whole(self, block: np.ndarray, bounds: np.ndarray) -> np.ndarray:
        """The shares of all ranks, one after the other."""
        if self._comm.size == 1:
            return block
        whole = np.empty((bounds[-1], block.shape[1]))
        self._comm.Allgatherv(np.ascontiguousarray(block), [whole, np.diff(bounds) * block.shape[1]])
        return whole

    def motion(self, x: np.ndarray, v: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
        """Wall positions [m] and velocities [m/s] from those of the interface; displacements are mapped, so
        that a wall that starts elsewhere keeps its shape."""
        if self.is_copy:
            return x, v
        dim = x.shape[1]
        moved = self._whole(self._rows @ np.hstack([x - self._x_solid, v]), self._wall_bounds)
        return self._x_wall + moved[:, :dim], moved[:, dim:].copy()

    def force(self, wall_force: np.ndarray) -> np.ndarray:
        """Forces on the interface points [N] from those on the wall nodes: same sum, same work."""
        return wall_force if self.is_copy else self._whole(self._transpose @ wall_force, self._solid_bounds)

    def mean_places(self, x: np.ndarray) -> np.ndarray:
        """Of the interface at x [m], shape (n, dim), at each wall node, with its weights, (m, dim): there the
        forces on wall nodes have the moment that ``force`` has at x."""
        return x if self.is_copy else self._whole(self._rows @ x, self._wall_bounds)

    def indentation(self, wall_force: np.ndarray) -> np.ndarray:
        """Displacement of the wall nodes [m] that is not to be passed on to the wall, shape (m, dim): none
        here."""
        return np.zeros_like(wall_force)


def _places(x_solid: Any, x_wall: Any) -> Tuple[np.ndarray, np.ndarray]:
    """Both as arrays of float; ValueError unless they are positions of one dimension."""
    x_solid = check.array("x of the interface", x_solid, ("n", 2), ("n", 3), unit="m")
    if not len(x_solid):
        raise ValueError("the interface has no points: give at least one for the wall to follow")
    return x_solid, check.array("x of the wall", x_wall, ("n", x_solid.shape[1]), unit="m")


class Same(Mapping):
    """The map of an interface to a wall that always has its points, whichever they are."""

    def __init__(self) -> None:
        self.is_copy = True


def same() -> Mapping:
    """The map of an interface to a wall that gets its nodes from it, as balls do: whatever points there are.

    >>> same().is_copy
    True
    """
    return Same()


def copy(x: np.ndarray, comm: Any = MPI.COMM_WORLD) -> Mapping:
    """The map of an interface to a wall with the same nodes x [m], shape (n, dim), in the same order.

    >>> copy([[0.0, 0.0], [1.0, 0.0]]).is_copy
    True
    """
    x, _ = _places(x, x)
    rows, _ = share(len(x), comm)
    n = rows.stop - rows.start
    entries = np.ones(n), (np.arange(n), np.arange(rows.start, rows.stop))
    return Mapping(csr_matrix(entries, (n, len(x))), x, x, comm)


def nearest(x_solid: np.ndarray, x_wall: np.ndarray, comm: Any = MPI.COMM_WORLD) -> Mapping:
    """Each wall node follows the nearest interface point: a copy where positions coincide.

    >>> follow = nearest([[0.0, 0.0], [1.0, 0.0]], [[0.3, 0.0], [0.9, 0.0]])
    >>> follow.force(np.array([[0.0, 1.0], [0.0, 2.0]])).tolist()
    [[0.0, 1.0], [0.0, 2.0]]
    """
    x_solid, x_wall = _places(x_solid, x_wall)
    mine = x_wall[share(len(x_wall), comm)[0]]
    from scipy.spatial import cKDTree  # takes time to import, and few scenes need it

    partner = cKDTree(x_solid).query(mine)[1] if len(mine) else np.zeros(0, int)
    n = len(mine)
    rows = csr_matrix((np.ones(n), (np.arange(n), partner)), (n, len(x_solid)))
    return Mapping(rows, x_solid, x_wall, comm)


def linear(x_solid: np.ndarray, elements: np.ndarray, x_wall: np.ndarray,
           comm: Any = MPI.COMM_WORLD) -> Mapping:
    """Each wall node follows the closest point of the interface's ``elements``, segments of shape (k, 2) or
    triangles of shape (k, 3), by linear interpolation between their corners. ValueError for an element
    without extent.

    >>> middle = linear([[0.0, 0.0], [1.0, 0.0]], [[0, 1]], [[0.25, 0.0]])
    >>> middle.force(np.array([[0.0, 4.0]])).tolist()
    [[0.0, 3.0], [0.0, 1.0]]
    """
    x_solid, x_wall = _places(x_solid, x_wall)
    elements = check.indices("elements of the interface", elements, len(x_solid), (2, 3), "points")
    p = x_wall[share(len(x_wall), comm)[0], None]
    corner = x_solid[elements]
    _check_extent(corner)
    m, k = len(p), len(elements)
    weight, shortest = np.zeros((m, k, elements.shape[1])), np.full((m, k), np.inf)
    for corners in ([(0, 1)] if elements.shape[1] == 2 else [(0, 1, 2), (0, 1), (1, 2), (2, 0)]):
        w = _weights(corner[:, corners], p)
        away = p - np.einsum("mkc,kci->mki", w, corner[:, corners])
        distance = np.where((w >= 0).all(axis=2), np.einsum("mki,mki->mk", away, away), np.inf)
        better = distance < shortest
        shortest[better] = distance[better]
        weight[better] = 0.0
        weight[np.ix_(range(m), range(k), corners)] = np.where(
            better[..., None], w, weight[np.ix_(range(m), range(k), corners)])
    closest = np.argmin(shortest, axis=1)
    weight = weight[np.arange(m), closest]
    weight[weight < 1e-12] = 0.0  # round-off: coinciding places make a copy
    weight /= weight.sum(axis=1, keepdims=True)
    rows, columns = np.repeat(np.arange(m), elements.shape[1]), elements[closest].ravel()
    H = csr_matrix((weight.ravel(), (rows, columns)), (m, len(x_solid)))
    H.eliminate_zeros()
    return Mapping(H, x_solid, x_wall, comm)


def _check_extent(corner: np.ndarray) -> None:
    """ValueError naming the first segment without length or triangle without area, corner: shape (k, 2 or 3,
    dim)."""
    edges = corner[:, 1:] - corner[:, :1]
    gram = np.einsum("kai,kbi->kab", edges, edges)
    flat = np.linalg.det(gram) <= 1e-24 * np.trace(gram, axis1=1, axis2=2) ** gram.shape[1]
    if flat.any():
        name, extent = ("segment", "length") if corner.shape[1] == 2 else ("triangle", "area")
        raise ValueError(f"interface {name} {np.argmax(flat)} has no {extent}: remove it")


def _weights(corner: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Weights of the corners at the closest point to p, shape (m, 1, dim), of each segment; of each triangle
    at the projection onto its plane, negative where that lies outside. Shape (m, k, corners)."""
    edges = corner[:, 1:] - corner[:, :1]
    to_weight = np.linalg.solve(np.einsum("kai,kbi->kab", edges, edges), edges)
    t = np.einsum("kai,mki->mka", to_weight, p - corner[:, 0])
    if t.shape[2] == 1:
        t = np.clip(t, 0.0, 1.0)
    return np.concatenate([1.0 - t.sum(axis=2, keepdims=True), t], axis=2)
