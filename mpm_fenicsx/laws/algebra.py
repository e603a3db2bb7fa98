"""Small matrices in scalars and tuples: at every point of a body, making an array costs more than the
arithmetic."""
import math

from ..compiled import called


@called
def determinant(F, D):
    """det F of a D x D matrix, in the plane or in space."""
    if D == 2:
        return F[0, 0] * F[1, 1] - F[0, 1] * F[1, 0]
    return (F[0, 0] * (F[1, 1] * F[2, 2] - F[1, 2] * F[2, 1]) - F[0, 1] * (F[1, 0] * F[2, 2] - F[1, 2] * F[2,
                                                                                                           0])
            + F[0, 2] * (F[1, 0] * F[2, 1] - F[1, 1] * F[2, 0]))


@called
def cofactor(F, i, j, D):
    """Component ij of the cofactor matrix: F^-T = cofactor / det F."""
    if D == 2:
        return F[1 - i, 1 - j] if i == j else -F[1 - i, 1 - j]
    a, b = (i + 1) % 3, (i + 2) % 3
    c, d = (j + 1) % 3, (j + 2) % 3
    return F[a, c] * F[b, d] - F[a, d] * F[b, c]


@called
def symmetric2(xx, yy, xy):
    """Principal values (greater, smaller) and right-handed axes of [[xx, xy], [xy, yy]], in closed form."""
    mean, half = 0.5 * (xx + yy), 0.5 * (xx - yy)
    radius = math.sqrt(half * half + xy * xy)
    c, s = 1.0, 0.0
    if radius > 0.0:  # (radius + half, xy) or, the same direction without cancellation, (xy, radius - half)
        c, s = (radius + half, xy) if half >= 0.0 else (xy, radius - half)
        norm = math.sqrt(c * c + s * s)
        c, s = c / norm, s / norm
    return (mean + radius, mean - radius), ((c, s), (-s, c))


@called
def _turned(c, s, u, v):
    """The vectors u, v turned in their plane."""
    return ((c * u[0] - s * v[0], c * u[1] - s * v[1], c * u[2] - s * v[2]),
            (s * u[0] + c * v[0], s * u[1] + c * v[1], s * u[2] + c * v[2]))


@called
def symmetric3(xx, yy, zz, xy, yz, zx):
    """Principal values in descending order and orthonormal axes of a symmetric 3x3 matrix.

    Jacobi's method (Golub & Van Loan, Matrix Computations, section 8.5): axes are orthogonal to round-off
    also where values meet, which the cubic formula cannot promise. The rotation always makes xy zero;
    renaming the coordinates x → y → z → x after each brings every pair in turn to that place.
    """
    u, v, w = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
    negligible = 1e-36 * (xx * xx + yy * yy + zz * zz)
    for _ in range(30):
        if xy * xy + yz * yz + zx * zx <= negligible:
            break
        if xy != 0.0:
            ratio = (yy - xx) / (2.0 * xy)
            t = math.copysign(1.0, ratio) / (abs(ratio) + math.sqrt(ratio * ratio + 1.0))
            c = 1.0 / math.sqrt(t * t + 1.0)
            s = t * c
            xx, yy, xy = xx - t * xy, yy + t * xy, 0.0
            zx, yz = c * zx - s * yz, s * zx + c * yz
            u, v = _turned(c, s, u, v)
        xx, yy, zz, xy, yz, zx = yy, zz, xx, yz, zx, xy
        u, v, w = v, w, u
    if xx < yy:
        xx, yy, u, v = yy, xx, v, u
    if yy < zz:
        yy, zz, v, w = zz, yy, w, v
    if xx < yy:
        xx, yy, u, v = yy, xx, v, u
    return (xx, yy, zz), (u, v, w)


@called
def combine2(c1, c2, n):
    """c1 n1 + c2 n2 in the plane."""
    return c1 * n[0][0] + c2 * n[1][0], c1 * n[0][1] + c2 * n[1][1]


@called
def combine3(c1, c2, c3, n):
    """c1 n1 + c2 n2 + c3 n3 in space."""
    return (c1 * n[0][0] + c2 * n[1][0] + c3 * n[2][0], c1 * n[0][1] + c2 * n[1][1] + c3 * n[2][1],
            c1 * n[0][2] + c2 * n[1][2] + c3 * n[2][2])


@called
def from_axes2(x, n, m):
    """Turn components x[2 a + b] in the axes n, m of a matrix in the plane into sum_ab x_ab n_a m_b^T, in
    place."""
    first, second = combine2(x[0], x[1], m), combine2(x[2], x[3], m)
    x[0], x[2] = combine2(first[0], second[0], n)
    x[1], x[3] = combine2(first[1], second[1], n)


@called
def from_axes3(x, n, m):
    """The same in space, x[3 a + b]."""
    first, second, third = combine3(x[0], x[1], x[2], m), combine3(x[3], x[4], x[5], m), combine3(x[6], x[7],
                                                                                                  x[8], m)
    x[0], x[3], x[6] = combine3(first[0], second[0], third[0], n)
    x[1], x[4], x[7] = combine3(first[1], second[1], third[1], n)
    x[2], x[5], x[8] = combine3(first[2], second[2], third[2], n)
