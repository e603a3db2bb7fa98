"""Basis functions at the points: P1 on triangles and tetrahedra, Q1 on quadrilaterals and hexahedra of any
shape.

The kernels are templates: ``specialise`` fixes D (dimension), K (nodes per cell) and AFFINE (simplices,
parallelograms, parallelepipeds: the map to the reference cell is linear). basix tabulates the same functions
in ten times the time; it is the oracle of the tests.
"""
from typing import NamedTuple

import numpy as np

from ..compiled import inlined, put

D, K, AFFINE = 2, 4, True  # fixed by specialise
to_reference = None


class CellMaps(NamedTuple):
    """Maps between m cells and the reference cell: ``corner`` (m, K, D), the cells' vertices [m], and
    ``inverse`` (m, D, D), the inverse Jacobian at their middle [1/m], or (1, D, D) where all have one."""

    corner: np.ndarray
    inverse: np.ndarray


class ReferencePoint(NamedTuple):
    """What ``reference`` finds of one point: ``xi`` (D,) reference coordinates, ``to_xi`` (D, D) inverse
    Jacobian there [1/m], ``value`` (K,) and ``gradient`` (K, D) of the basis functions by xi. J (D, D):
    work."""

    xi: np.ndarray
    to_xi: np.ndarray
    value: np.ndarray
    gradient: np.ndarray
    J: np.ndarray


@inlined
def of_node(a, xi, D, K):
    """Value of basis function a at the reference coordinates xi and its gradient there, tuples of three
    numbers, of which D count."""
    gradient = 0.0, 0.0, 0.0
    if K == D + 1:  # simplex: N_0 = 1 - sum(xi), N_a = xi_(a-1)
        v = 1.0 if a == 0 else 0.0
        for i in range(D):
            g = -1.0 if a == 0 else (1.0 if i == a - 1 else 0.0)
            gradient = put(gradient, i, g)
            v += g * xi[i]
    else:  # tensor product: bit i of a tells whether the factor of direction i is xi or 1 - xi
        v = 1.0
        for i in range(D):
            v *= xi[i] if (a >> i) & 1 else 1.0 - xi[i]
            g = 1.0
            for j in range(D):
                upper = (a >> j) & 1
                if i == j:
                    g *= 1.0 if upper else -1.0
                else:
                    g *= xi[j] if upper else 1.0 - xi[j]
            gradient = put(gradient, i, g)
    return v, gradient


@inlined
def basis(xi, D, K, value, gradient):
    """Values (K,) and gradients (K, D) of the basis functions at the reference coordinates xi (D,)."""
    at = xi[0], xi[1], xi[D - 1]
    for a in range(K):
        v, g = of_node(a, at, D, K)
        value[a] = v
        for i in range(D):
            gradient[a, i] = g[i]


@inlined
def invert(J, D, inverse):
    """Inverse of the D x D matrix J."""
    if D == 2:
        det = J[0, 0] * J[1, 1] - J[0, 1] * J[1, 0]
        inverse[0, 0], inverse[0, 1] = J[1, 1] / det, -J[0, 1] / det
        inverse[1, 0], inverse[1, 1] = -J[1, 0] / det, J[0, 0] / det
    else:
        for i in range(3):
            a, b = (i + 1) % 3, (i + 2) % 3
            for j in range(3):
                c, d = (j + 1) % 3, (j + 2) % 3
                inverse[j, i] = J[a, c] * J[b, d] - J[a, d] * J[b, c]
        det = J[0, 0] * inverse[0, 0] + J[0, 1] * inverse[1, 0] + J[0, 2] * inverse[2, 0]
        for i in range(3):
            for j in range(3):
                inverse[i, j] /= det


def reference(p, c, x, maps: CellMaps, found: ReferencePoint):
    """Fill ``found`` with the place in the reference cell of point p, of those at x (n, D) [m], in cell c.

    In a cell that is not affine Newton's method starts from the linear map; far outside it may fail, which
    shows as NaN.
    """
    corner, inverse = maps
    xi, to_xi, value, gradient, J = found
    k = min(c, len(inverse) - 1)
    for i in range(D):
        s = 0.0 if AFFINE else 0.5
        for j in range(D):
            middle = corner[c, 0, j]
            if not AFFINE:
                middle = 0.0
                for a in range(K):
                    middle += corner[c, a, j] / K
            s += inverse[k, i, j] * (x[p, j] - middle)
            to_xi[i, j] = inverse[k, i, j]
        xi[i] = s
    basis(xi, D, K, value, gradient)
    if AFFINE:
        return
    largest = 1.0
    for _ in range(20):
        for i in range(D):
            for j in range(D):
                s = 0.0
                for a in range(K):
                    s += corner[c, a, i] * gradient[a, j]
                J[i, j] = s
        invert(J, D, to_xi)
        if largest < 1e-8:
            return  # the last correction squared is round-off, and basis and Jacobian belong to this xi
        largest = 0.0
        for i in range(D):
            s = 0.0
            for j in range(D):
                r = x[p, j]
                for a in range(K):
                    r -= value[a] * corner[c, a, j]
                s += to_xi[i, j] * r
            J[0, i] = s  # the correction, kept until all components are known
            largest = max(largest, abs(s))
        for i in range(D):
            xi[i] += J[0, i]
        if not largest < 10.0:
            break
        basis(xi, D, K, value, gradient)
    for i in range(D):
        xi[i] = np.nan


def shapes(cell, x, maps: CellMaps, N, G):
    """Values and gradients of the K basis functions at each point.

    cell: (n,) cell of each point; x: (n, D) positions [m]; fills N: (n, K) and G: (n, D, K) [1/m].
    """
    found = ReferencePoint(np.empty(D), np.empty((D, D)), np.empty(K), np.empty((K, D)), np.empty((D, D)))
    _, to_xi, value, gradient, _ = found
    for p in range(len(cell)):
        to_reference(p, cell[p], x, maps, found)
        for a in range(K):
            N[p, a] = value[a]
            for i in range(D):
                s = 0.0
                for j in range(D):
                    s += gradient[a, j] * to_xi[j, i]
                G[p, i, a] = s


def affine_shapes(cell, x, maps: CellMaps, N, G):
    """``shapes`` in affine cells: all of a point stays in registers, which is several times as fast."""
    corner, inverse = maps
    for p in range(len(cell)):
        c = cell[p]
        k, xi = min(c, len(inverse) - 1), (0.0, 0.0, 0.0)
        for i in range(D):
            s = 0.0
            for j in range(D):
                s += inverse[k, i, j] * (x[p, j] - corner[c, 0, j])
            xi = put(xi, i, s)
        for a in range(K):
            v, g = of_node(a, xi, D, K)
            N[p, a] = v
            for i in range(D):
                s = 0.0
                for j in range(D):
                    s += g[j] * inverse[k, j, i]
                G[p, i, a] = s


def cell_maps(x, cells):
    """``CellMaps`` of cells, shape (m, K), with nodes at x (n, D) [m], and whether all are affine."""
    D, corner = x.shape[1], x[cells]
    K = cells.shape[1]
    if K == D + 1:
        jacobian, affine = np.swapaxes(corner[:, 1:] - corner[:, :1], 1, 2), True
    else:
        sign = np.array([[1.0 if (a >> d) & 1 else -1.0 for d in range(D)] for a in range(K)])
        jacobian = np.einsum("mai,ad->mid", corner, sign) / 2 ** (D - 1)
        linear = corner[:, :1] + np.einsum("mid,ad->mai", jacobian, (sign + 1) / 2)
        round_off = 4 * np.finfo(float).eps * np.abs(x).max(initial=0.0)
        affine = bool(np.abs(linear - corner).max(initial=0.0)
                      < 1e-12 * np.abs(jacobian).max(initial=1e-300) + round_off)
    return CellMaps(np.ascontiguousarray(corner), np.ascontiguousarray(np.linalg.inv(jacobian))), affine
