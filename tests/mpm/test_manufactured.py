"""A manufactured solution: orders of convergence in cell size and time step, in two and three dimensions.

The sides of a unit cube hold their normal direction, a body force makes it move by u_i = A_i sin(pi X_i)
sin(omega t). The orders show while the motion is small against the cells: quadrature at material points, of
gradients that jump from cell to cell, is good only near the places where they were seeded. Points that move
by a part of a cell and further bound what a finer grid can gain: that of large motions is measured apart, as
a bound.
"""
import numpy as np
import pytest

from mpm_fenicsx import MPM, Body, Box, Grid, Support, neo_hooke

LAW, OMEGA = neo_hooke(1.0, 0.3), np.pi
POINTS = {"quadrilateral": 2, "triangle": 3, "hexahedron": 2, "tetrahedron": 4}


class Motion:
    """amplitude: A_i [m], as many as dimensions."""

    def __init__(self, amplitude):
        self.A = np.array(amplitude)

    def displacement(self, X, t):
        return self.A * np.sin(np.pi * X) * np.sin(OMEGA * t)

    def body_force(self, X, t):
        """b = a - Div P, rho = 1: F is diagonal, P_ii = mu (F_ii - 1 / F_ii) + lam ln J / F_ii."""
        lam, mu = LAW.params
        F = 1.0 + self.A * np.pi * np.cos(np.pi * X) * np.sin(OMEGA * t)
        slope = mu * (1.0 + 1.0 / F**2) + lam * (1.0 - np.log(F).sum(axis=1)[:, None]) / F**2
        return (np.pi**2 * slope - OMEGA**2) * self.displacement(X, t)


def run(cell, counts, steps, motion, points=None, until=0.5):
    """Material points at the time ``until`` [s], on ``counts`` cells per direction."""
    D = len(counts)
    box = Box((0.0,) * D, (1.0,) * D)
    sides = [Support(lambda x, d=d: np.minimum(x[:, d], 1 - x[:, d]) < 1e-9, "xyz"[d]) for d in range(D)]
    body = Body(box, counts, points or POINTS[cell], LAW, 1.0, cell=cell,
                velocity=lambda X: OMEGA * motion.displacement(X, 0.5))
    solid = MPM(Grid(box, counts, cell), body, sides, body_force=motion.body_force)
    for _ in range(steps):
        solid.advance(until / steps)
    solid.close()
    return solid.points


def error(p, motion, t=0.5):
    """Relative L2 error of the displacement."""
    u = motion.displacement(p.x0, t)
    return np.sqrt(p.V0 @ np.sum((p.x - p.x0 - u)**2, axis=1) / (p.V0 @ np.sum(u**2, axis=1)))


def rates(values):
    return np.log2(np.divide(values[:-1], values[1:]))


def dim(cell):
    return 2 if cell in ("quadrilateral", "triangle") else 3


def test_second_order_in_the_cell_size(any_cell):
    """Cells and steps are halved together."""
    D = dim(any_cell)
    motion, counts = Motion([1e-6] * D), (4, 8, 16) if D == 2 else (2, 4, 8)
    errors = [error(run(any_cell, (n,) * D, 2 * n, motion), motion) for n in counts]
    print(any_cell, errors, rates(errors))
    np.testing.assert_allclose(rates(errors), 2.0, atol=0.15 if D == 2 else 0.3)


def test_second_order_in_the_time_step(any_cell):
    """By differences between runs on one grid, so that its own error drops out. Motion along x alone allows
    fine cells, with which the damping by the projection, of order h^2 dt, is small."""
    D = dim(any_cell)
    motion, counts = Motion([1e-6, 0.0, 0.0][:D]), (64, 1, 1)[:D]
    x = [run(any_cell, counts, steps, motion, until=0.3).x for steps in (4, 8, 16)]
    changes = [np.linalg.norm(a - b) for a, b in zip(x, x[1:])]
    print(any_cell, changes, rates(changes))
    np.testing.assert_allclose(rates(changes), 2.0, atol=0.05)


@pytest.mark.parametrize("cell, points", [("quadrilateral", 4), ("triangle", 12), ("hexahedron", 3),
                                          ("tetrahedron", 24)])
def test_large_motion(cell, points):
    """Strains of 16 % and points that cross half a cell."""
    motion = Motion([0.05] * dim(cell))
    errors = [error(run(cell, (n,) * dim(cell), 2 * n, motion, points), motion) for n in (4, 8)]
    print(cell, errors, rates(errors))
    assert errors[1] < 0.04 and errors[1] < 0.6 * errors[0]
