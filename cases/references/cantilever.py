"""A cantilever in large deflection: finite elements in total Lagrangian form, and the elastica.

Quadratic elements of nine nodes with 3 x 3 Gauss points, plane strain, the neo-Hookean law of the material
point method (Bonet & Wood, section 6.4.3), clamped at X = 0 and loaded at its other end by a shear force of
fixed direction, spread evenly. What is left of a difference to material points is their discretisation.

The elastica bends without stretch and shear: E I d2theta/ds2 + P cos theta = 0, theta = 0 at the clamp and no
moment at the end. It depends on k = P L^2 / (E I) alone.

    python -m references.cantilever      in the folder cases: the numbers that the tests pin
"""
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import spsolve

LENGTH, DEPTH = 10.0, 1.0  # [m]
E, NU, FORCE = 12e6, 0.2, 1e5  # [Pa], [-], [N] per metre across: k = 10
MOST = 30  # Newton iterations
GAUSS = np.array([-np.sqrt(0.6), 0.0, np.sqrt(0.6)]), np.array([5.0, 8.0, 5.0]) / 9.0


class Deflection(NamedTuple):
    """By load factor, shape (steps,) each: ``factor``, how far the middle of the end goes along the force,
    ``v``, and towards the clamp, ``u`` [m]."""

    factor: np.ndarray
    v: np.ndarray
    u: np.ndarray


def finite_elements(counts: tuple = (40, 4), steps: int = 20) -> Deflection:
    """With so many elements along length and depth, in equal load steps."""
    x, cells = _mesh(counts)
    n, tip = len(x), int(np.argmin(np.hypot(x[:, 0] - LENGTH, x[:, 1] - 0.5 * DEPTH)))
    free = np.flatnonzero(np.repeat(x[:, 0] > 1e-9, 2))
    gradients, weights = _basis(x, cells)
    dof = (2 * cells[:, :, None] + np.arange(2)).reshape(len(cells), -1)
    load, u, rows = _end_load(x, counts[1]), np.zeros(2 * n), []
    for step in range(1, steps + 1):
        for _ in range(MOST):
            inner, stiffness = _assemble(u, gradients, weights, dof)
            residual = (inner - step / steps * load)[free]
            change = spsolve(stiffness[free][:, free], -residual)
            u[free] += change
            if np.abs(change).max() < 1e-10 * LENGTH:
                break
        else:
            raise ArithmeticError(f"no equilibrium of the cantilever in load step {step}: take more of them")
        rows.append((step / steps, -u[2 * tip + 1], -u[2 * tip]))
    return Deflection(*np.array(rows).T)


def _mesh(counts: tuple) -> tuple:
    """Nodes (n, 2) [m] and elements (m, 9), nodes in rows from below."""
    columns, rows = 2 * counts[0] + 1, 2 * counts[1] + 1
    X, Y = np.meshgrid(np.linspace(0, LENGTH, columns), np.linspace(0, DEPTH, rows))
    i, j = np.meshgrid(2 * np.arange(counts[0]), 2 * np.arange(counts[1]))
    near = np.array([b * columns + a for b in range(3) for a in range(3)])
    return np.column_stack([X.ravel(), Y.ravel()]), (j * columns + i).ravel()[:, None] + near


def _quadratic(s: float) -> tuple:
    """Values and slopes of the three functions on [-1, 1]."""
    return (np.array([0.5 * s * (s - 1), 1 - s * s, 0.5 * s * (s + 1)]), np.array([s - 0.5, -2 * s, s + 0.5]))


def _basis(x: np.ndarray, cells: np.ndarray) -> tuple:
    """Gradients (m, 9 points, 9, 2) [1/m] and weights (m, 9) [m^2]."""
    local, factor = [], []
    for t, wt in zip(*GAUSS):
        for s, ws in zip(*GAUSS):
            (a, da), (b, db) = _quadratic(s), _quadratic(t)
            local.append(np.column_stack([np.outer(b, da).ravel(), np.outer(db, a).ravel()]))
            factor.append(ws * wt)
    jacobian = np.einsum("qan,mai->mqin", np.array(local), x[cells])
    gradients = np.einsum("qan,mqni->mqai", np.array(local), np.linalg.inv(jacobian))
    return gradients, np.linalg.det(jacobian) * np.array(factor)


def _end_load(x: np.ndarray, elements: int) -> np.ndarray:
    """Downward, by Simpson's rule over the end [N]."""
    load, end = np.zeros(2 * len(x)), np.flatnonzero(x[:, 0] > LENGTH - 1e-9)
    share = np.zeros(len(end))
    for e in range(elements):
        share[2 * e:2 * e + 3] += np.array([1.0, 4.0, 1.0]) / (6 * elements)
    load[2 * end + 1] = -FORCE * share
    return load


def _assemble(u: np.ndarray, gradients: np.ndarray, weights: np.ndarray, dof: np.ndarray) -> tuple:
    """Inner forces [N] and tangent [N/m]: P = mu (F - F^-T) + lam ln J F^-T and its derivative."""
    lam, mu = E * NU / ((1 + NU) * (1 - 2 * NU)), E / (2 * (1 + NU))
    F = np.eye(2) + np.einsum("mai,mqaj->mqij", u[dof].reshape(len(dof), 9, 2), gradients)
    inverse = np.swapaxes(np.linalg.inv(F), -1, -2)  # F^-T
    log_J = np.log(np.linalg.det(F))[..., None, None]
    P = mu * (F - inverse) + lam * log_J * inverse
    inner = np.zeros(len(u))
    np.add.at(inner, dof, np.einsum("mq,mqij,mqaj->mai", weights, P, gradients).reshape(len(dof), -1))
    A = (mu * np.einsum("ik,jl->ijkl", np.eye(2), np.eye(2)) + lam * np.einsum("mqij,mqkl->mqijkl", inverse,
                                                                               inverse)
         + (mu - lam * log_J)[..., None, None] * np.einsum("mqil,mqkj->mqijkl", inverse, inverse))
    K = np.einsum("mq,mqaj,mqijkl,mqbl->maibk", weights, gradients, A, gradients, optimize=True)
    K = K.reshape(len(dof), 18, 18)
    rows, columns = np.repeat(dof, 18, axis=1), np.tile(dof, (1, 18))
    return inner, coo_matrix((K.ravel(), (rows.ravel(), columns.ravel())), (len(u), len(u))).tocsr()


def elastica(k: float) -> tuple:
    """Deflection v / L along the force and u / L towards the clamp at k = P L^2 / (E I), by shooting for the
    curvature at the clamp."""
    def shoot(curvature: float) -> np.ndarray:
        line = lambda s, y: (y[1], -k * np.cos(y[0]), np.cos(y[0]), np.sin(y[0]))  # noqa: E731
        return solve_ivp(line, (0.0, 1.0), (0.0, curvature, 0.0, 0.0), rtol=1e-10, atol=1e-12).y[:, -1]

    theta, _, x, y = shoot(brentq(lambda curvature: shoot(curvature)[1], 1e-9, max(k, 1e-6)))
    return float(y), float(1.0 - x)


def main() -> None:
    """Print what the tests pin: finite elements on three meshes, and the elastica beside them."""
    for counts in ((20, 2), (40, 4), (80, 8)):
        found = finite_elements(counts)
        v, u = (np.interp([0.1, 0.5, 1.0], found.factor, values) for values in (found.v, found.u))
        print(counts, "v [m] at k = 1, 5, 10:", v.round(5).tolist(), "u [m]:", u.round(5).tolist())
    for k in (1.0, 5.0, 10.0):
        print("elastica, k =", k, "v/L, u/L:", np.round(elastica(k), 4).tolist())


if __name__ == "__main__":
    main()
