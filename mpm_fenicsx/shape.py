"""Basis functions at the points: P1 on triangles and tetrahedra, Q1 on parallelograms and parallelepipeds.

The kernels are templates: ``specialise`` fixes D (dimension) and K (nodes per cell). basix tabulates the same
functions in ten times the time; it is the oracle of the tests.
"""
import numpy as np

D, K = 2, 4  # fixed by specialise


def shapes(cell, x, origin, inverse, N, G):
    """Values and gradients of the K basis functions at each point.

    cell: (n,) cell of each point; x: (n, D) positions [m]; origin: (m, D) first vertex [m];
    inverse: (m, D, D) inverse of the cell's Jacobian [1/m]; fills N: (n, K) and G: (n, K, D) [1/m].
    """
    xi = np.empty(D)
    gradient = np.empty(D)
    for p in range(len(cell)):
        c = cell[p]
        for i in range(D):
            s = 0.0
            for j in range(D):
                s += inverse[c, i, j] * (x[p, j] - origin[c, j])
            xi[i] = s
        for a in range(K):
            if K == D + 1:  # simplex: N_0 = 1 - sum(xi), N_a = xi_(a-1)
                value = 1.0 if a == 0 else 0.0
                for i in range(D):
                    gradient[i] = -1.0 if a == 0 else (1.0 if i == a - 1 else 0.0)
                    value += gradient[i] * xi[i]
            else:  # tensor product: bit i of a tells whether the factor of direction i is xi or 1 - xi
                value = 1.0
                for i in range(D):
                    value *= xi[i] if (a >> i) & 1 else 1.0 - xi[i]
                    g = 1.0
                    for j in range(D):
                        upper = (a >> j) & 1
                        if i == j:
                            g *= 1.0 if upper else -1.0
                        else:
                            g *= xi[j] if upper else 1.0 - xi[j]
                    gradient[i] = g
            N[p, a] = value
            for i in range(D):
                s = 0.0
                for j in range(D):
                    s += gradient[j] * inverse[c, j, i]
                G[p, a, i] = s


def vertices_of_axes(cell, dim):
    """Local vertices at the ends of the reference axes, after vertex 0: the columns of the Jacobian."""
    return (1, 2, 3)[:dim] if cell in ("triangle", "tetrahedron") else (1, 2, 4)[:dim]


def affine_maps(x, cells, cell):
    """First vertex (m, D) and inverse Jacobian (m, D, D) of each cell; raises ValueError for a degenerate one."""
    dim = x.shape[1]
    origin = x[cells[:, 0]]
    jacobian = np.stack([x[cells[:, v]] - origin for v in vertices_of_axes(cell, dim)], axis=2)
    flat = np.flatnonzero(np.abs(np.linalg.det(jacobian)) < 1e-14 * np.ptp(x, axis=0).max() ** dim) if len(x) else []
    if len(flat):
        raise ValueError(f"cell {flat[0]} of the grid has no volume: repair the mesh")
    return np.ascontiguousarray(origin), np.ascontiguousarray(np.linalg.inv(jacobian))
