"""The background grid as a domain of FEniCSx: fields of its nodes as functions for UFL and XDMF."""
import numpy as np

from . import compat


def node_shares(corner):
    """Integrals of the basis functions over m cells with vertices ``corner``, shape (m, K, D) [m]: (m, K)
    [m^3], in the plane [m^2]. Exact: with two Gauss points per direction also in cells that are not affine.
    """
    K, D = corner.shape[1:]
    if K == D + 1:
        edges = corner[:, 1:] - corner[:, :1]
        volume = np.abs(np.linalg.det(edges)) / (2.0 if D == 2 else 6.0)
        return np.tile(volume[:, None] / K, (1, K))
    upper = np.arange(K)[:, None] >> np.arange(D) & 1  # (a, direction): whether the factor is xi or 1 - xi
    xi = 0.5 + (upper - 0.5) / np.sqrt(3.0)
    factor = np.where(upper, xi[:, None], 1.0 - xi[:, None])  # (point, a, direction)
    gradient = np.empty_like(factor)
    for d in range(D):
        gradient[..., d] = (2 * upper[:, d] - 1) * np.delete(factor, d, axis=2).prod(axis=2)
    weight = np.abs(np.linalg.det(np.einsum("mai,qaj->mqij", corner, gradient))) / K
    return weight @ factor.prod(axis=2)


class Domain:
    """The grid as a ``mesh`` of dolfinx, once and in the user's coordinates, distributed as ``background``.
    Where that has several fields, or computes in a frame of its own, it is a mesh besides. Collective."""

    def __init__(self, background):
        vertices, cells = background.whole
        self._cells, moved = cells, bool(background.origin.any())
        self.mesh = background.mesh
        if moved or background.fields > 1:
            self.mesh = background.distribute(vertices + background.origin, cells)
        nodes = compat.nodes_of_cells(self.mesh, cells.shape[1])
        count = len(compat.node_positions(self.mesh))
        self._vertex = np.empty(count, np.int64)  # of each node, among those of the whole grid
        self._vertex[nodes] = cells[compat.original_cells(self.mesh)]
        self._nodes, self._spaces = nodes, {}
        share = node_shares(vertices[self._vertex[nodes]])  # all cells of a node are here, but of ghosts
        self.volume = np.ones(len(vertices))
        self.volume[self._vertex] = np.bincount(nodes.ravel(), share.ravel(), minlength=count)

    def function(self, name, values):
        """``Function`` of the continuous linear (P1, Q1) space with ``values`` at the vertices of the whole
        grid, shape (n,) or (n, D), of which this rank's own nodes count."""
        shape = values.shape[1:]
        if shape not in self._spaces:
            self._spaces[shape] = compat.linear_space(self.mesh, shape)
        return compat.function_of(self._spaces[shape], name, self._nodes, values[self._vertex])
