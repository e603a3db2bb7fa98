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
    """Each wall node follows the closest point of the interface's segments ``elements``, shape (k, 2), by linear
    interpolation between the segment's ends."""
    a, b = np.asarray(x_solid)[np.asarray(elements).T]
    edge = b - a
    length2 = np.einsum("ki,ki->k", edge, edge)
    if not (length2 > 0).all():
        raise ValueError(f"interface segment {np.argmin(length2)} has no length: remove it")
    t = np.clip(np.einsum("ki,mki->mk", edge, np.asarray(x_wall)[:, None] - a) / length2, 0.0, 1.0)
    away = np.asarray(x_wall)[:, None] - (a + t[..., None] * edge)
    segment = np.argmin(np.einsum("mki,mki->mk", away, away), axis=1)
    n = np.arange(len(x_wall))
    weight = t[n, segment]
    rows, columns = np.repeat(n, 2), np.asarray(elements)[segment].ravel()
    H = csr_matrix((np.column_stack([1 - weight, weight]).ravel(), (rows, columns)), (len(n), len(x_solid)))
    H.eliminate_zeros()
    return Mapping(H, x_solid, x_wall)
