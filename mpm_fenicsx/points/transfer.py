"""Transfers between points and grid, phases I and III. Templates: ``specialise`` fixes D and K.

What a point has or gets is a tuple of three numbers, of which D count, and stays in registers: numbers of an
array would be read again after whatever is written to another one.
"""
from ..compiled import inlined, put

D, K = 2, 4
# Added to the basis in phase I: nodes of a point's element at which it has none, as it lies on the edge of
# its cell, get its velocity all the same. No bit of the others depends on it.
TOUCH = 1e-40


@inlined
def of_point(x, p, D):
    """Row p of an array (n, D)."""
    return x[p, 0], x[p, 1], x[p, D - 1]


@inlined
def add_from_nodes(cell, cells, N, p, nodal, D, K, x):
    """x plus the field with ``nodal`` values, shape (nodes, D), at point p."""
    for q in range(K):
        node, w = cells[cell[p], q], N[p, q]
        for i in range(D):
            x = put(x, i, x[i] + w * nodal[node, i])
    return x


def to_grid(cell, cells, N, mass, v, a, nodal):
    """Phase I: add nodal mass [kg], momentum [kg m/s] and inertia force [N] to ``nodal``, shape (nodes, 1 +
    2D).

    cell: (n,) cells of the points; cells: (m, K) nodes; N: (n, K); mass: (n,); v, a: (n, D).
    """
    for p in range(len(cell)):
        c, m, v_p, a_p = cell[p], mass[p], of_point(v, p, D), of_point(a, p, D)
        for q in range(K):
            node = cells[c, q]
            w = (N[p, q] + TOUCH) * m
            nodal[node, 0] += w
            for i in range(D):
                nodal[node, 1 + i] += w * v_p[i]
                nodal[node, 1 + D + i] += w * a_p[i]


def to_points(cell, cells, N, increment, x, v, a):
    """Phase III: move the points with the grid and update their velocity by the trapezoidal rule.

    N: (n, K); increment: what the nodes do, a ``newmark.Increment``; changes x [m], v [m/s], a [m/s^2]: (n,
    D).
    """
    dt, u, a_nodes = increment.dt, increment.u, increment.a
    for p in range(len(cell)):
        du = add_from_nodes(cell, cells, N, p, u, D, K, (0.0, 0.0, 0.0))
        an = add_from_nodes(cell, cells, N, p, a_nodes, D, K, (0.0, 0.0, 0.0))
        for i in range(D):
            x[p, i] += du[i]
            v[p, i] += 0.5 * dt * (a[p, i] + an[i])
            a[p, i] = an[i]


def to_points_midpoint(cell, cells, N, increment, x, v, a):
    """Phase III by the midpoint rule, as ``to_points``: the points take the velocity that the nodes have at
    the end of the step, u/dt + dt/2 a; after a load step without inertia, which takes no time, none."""
    dt, u, a_nodes = increment.dt, increment.u, increment.a
    for p in range(len(cell)):
        du = add_from_nodes(cell, cells, N, p, u, D, K, (0.0, 0.0, 0.0))
        an = add_from_nodes(cell, cells, N, p, a_nodes, D, K, (0.0, 0.0, 0.0))
        for i in range(D):
            x[p, i] += du[i]
            v[p, i] = du[i] / dt + 0.5 * dt * an[i] if dt > 0.0 else 0.0
            a[p, i] = an[i]


def interpolate(cell, cells, N, nodal, values):
    """Add to the points' ``values``, shape (n, D), the field with ``nodal`` values, shape (nodes, D)."""
    for p in range(len(cell)):
        x = add_from_nodes(cell, cells, N, p, nodal, D, K, of_point(values, p, D))
        for i in range(D):
            values[p, i] = x[i]


def spread(cell, cells, N, force, nodal):
    """Eq. 13: add point loads ``force``, shape (n, D) [N], to the nodes, shape (nodes, D)."""
    for p in range(len(cell)):
        c, f = cell[p], of_point(force, p, D)
        for q in range(K):
            for i in range(D):
                nodal[cells[c, q], i] += N[p, q] * f[i]


def reaches(cell, cells, N, chosen, mask):
    """Set the mask, shape (n,), for points with a basis value other than zero at a ``chosen`` node, mask
    (nodes,)."""
    for p in range(len(cell)):
        for q in range(K):
            if N[p, q] != 0.0 and chosen[cells[cell[p], q]]:
                mask[p] = True


def only_active(cell, cells, active, N):
    """Eq. 14: scale the basis values N, shape (n, K), to the nodes that carry mass.

    Returns the first point none of whose nodes is active, or -1.
    """
    lost = -1
    for p in range(len(cell)):
        total = 0.0
        for q in range(K):
            if not active[cells[cell[p], q]]:
                N[p, q] = 0.0
            total += N[p, q]
        if total > 0.0:
            for q in range(K):
                N[p, q] /= total
        elif lost < 0:
            lost = p
    return lost
