"""Motion from the solid's interface points to the wall nodes (eq. 22) and forces back by the transpose (eq. 23)."""
import numpy as np
from scipy.sparse import csr_matrix, identity
from scipy.spatial import cKDTree


class Mapping:
    """The matrix H of eq. 22, shape (wall nodes, interface points), and the places where both sides started."""

    def __init__(self, H, x_solid, x_wall):
        self.H, self._transpose = H.tocsr(), H.T.tocsr()
        self._x_solid, self._x_wall = np.array(x_solid, float), np.array(x_wall, float)
        self.is_copy = H.shape[0] == H.shape[1] and (H != identity(H.shape[0])).nnz == 0 \
            and np.array_equal(self._x_solid, self._x_wall)

    def motion(self, x, v):
        """Wall positions [m] and velocities [m/s] from those of the interface; displacements are mapped, so that a wall
        that starts elsewhere keeps its shape."""
        if self.is_copy:
            return x, v
        return self._x_wall + self.H @ (x - self._x_solid), self.H @ v

    def force(self, wall_force):
        """Forces on the interface points [N] from those on the wall nodes: same sum, same work."""
        return wall_force if self.is_copy else self._transpose @ wall_force


def nearest(x_solid, x_wall):
    """Each wall node follows the nearest interface point: a copy where positions coincide."""
    _, partner = cKDTree(x_solid).query(x_wall)
    n = len(x_wall)
    return Mapping(csr_matrix((np.ones(n), (np.arange(n), partner)), (n, len(x_solid))), x_solid, x_wall)


def linear(x_solid, elements, x_wall):
    """Each wall node follows the closest point of the interface's ``elements``, segments of shape (k, 2) or triangles of
    shape (k, 3), by linear interpolation between their corners. ValueError for an element without extent."""
    elements, p = np.asarray(elements), np.asarray(x_wall, float)[:, None]
    corner = np.asarray(x_solid, float)[elements]
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
    return Mapping(H, x_solid, x_wall)


def _check_extent(corner):
    """ValueError naming the first segment without length or triangle without area, corner: shape (k, 2 or 3, dim)."""
    edges = corner[:, 1:] - corner[:, :1]
    gram = np.einsum("kai,kbi->kab", edges, edges)
    flat = np.linalg.det(gram) <= 1e-24 * np.trace(gram, axis1=1, axis2=2) ** gram.shape[1]
    if flat.any():
        name, extent = ("segment", "length") if corner.shape[1] == 2 else ("triangle", "area")
        raise ValueError(f"interface {name} {np.argmax(flat)} has no {extent}: remove it")


def _weights(corner, p):
    """Weights of the corners at the closest point to p, shape (m, 1, dim), of each segment; of each triangle at the
    projection onto its plane, negative where that lies outside. Shape (m, k, corners)."""
    edges = corner[:, 1:] - corner[:, :1]
    to_weight = np.linalg.solve(np.einsum("kai,kbi->kab", edges, edges), edges)
    t = np.einsum("kai,mki->mka", to_weight, p - corner[:, 0])
    if t.shape[2] == 1:
        t = np.clip(t, 0.0, 1.0)
    return np.concatenate([1.0 - t.sum(axis=2, keepdims=True), t], axis=2)
