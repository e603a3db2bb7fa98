"""Small matrices in scalars and tuples: at every point of a body, making an array costs more than the
arithmetic."""
import math

import numpy as np

from ..compiled import called, inlined, merged, where

NEAR = 0.1  # of a strain: up to there series are exact to round-off
# A symmetric matrix is stored as xx, yy, zz, xy, yz, zx, as ParaView has it: component ij is at PLACE[i][j].
PLACE = (0, 3, 5), (3, 1, 4), (5, 4, 2)


def whole(S):
    """Matrices (..., 3, 3) of the stored ones (..., 6).

    >>> whole(np.arange(6)).tolist()
    [[0, 3, 5], [3, 1, 4], [5, 4, 2]]
    """
    return S[..., np.array(PLACE)]


def stored(T):
    """The other way round, also of matrices (..., 2, 2) in the plane.

    >>> stored(np.array([[1.0, 2.0], [2.0, 3.0]])).tolist()
    [1.0, 3.0, 0.0, 2.0, 0.0, 0.0]
    """
    S, D = np.zeros((*T.shape[:-2], 6)), T.shape[-1]
    for i in range(D):
        for j in range(i, D):
            S[..., PLACE[i][j]] = T[..., i, j]
    return S


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


# What follows has no branches, so that loops over many points become packed arithmetic, see ``batches``.


@inlined
def half_log_near_one(x):
    """log(x) / 2 to round-off where it is below NEAR: y + y^3 / 3 + y^5 / 5 + ..., y = (x - 1) / (x + 1)."""
    y = (x - 1.0) / (x + 1.0)
    s = y * y
    return y * (1.0 + s * (1 / 3 + s * (1 / 5 + s * (1 / 7 + s * (1 / 9 + s * (1 / 11 + s * (
        1 / 13 + s * (1 / 15))))))))


@inlined
def exp_near_zero(x):
    """exp x to round-off for abs(x) < 2 NEAR."""
    return 1.0 + x * (1.0 + x * (1 / 2 + x * (1 / 6 + x * (1 / 24 + x * (1 / 120 + x * (1 / 720 + x * (
        1 / 5040 + x * (1 / 40320 + x * (1 / 362880 + x * (1 / 3628800 + x / 39916800))))))))))


@inlined
def dot(a, b):
    """a . b in space."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inlined
def _cross(a, b):
    """a x b, and the square of its length."""
    c = a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
    return c, dot(c, c)


@inlined
def _furthest_root(r):
    """The greatest root of x^3 - 3 x = 2 r, 0 <= r <= 1, which is 2 cos(acos(r) / 3): a polynomial within
    2e-4, then Newton's method, which leaves of an error e at most 0.6 e^2."""
    x = 1.7319 + r * (0.3328 + r * (-0.0811 + r * 0.0165))
    x -= ((x * x - 3.0) * x - 2.0 * r) / (3.0 * x * x - 3.0)
    x -= ((x * x - 3.0) * x - 2.0 * r) / (3.0 * x * x - 3.0)
    return x - ((x * x - 3.0) * x - 2.0 * r) / (3.0 * x * x - 3.0)


@inlined
def _choose(first, a, b):
    """a where ``first``, else b, three numbers each."""
    return where(first, a[0], b[0]), where(first, a[1], b[1]), where(first, a[2], b[2])


@inlined
def _axis(xx, yy, zz, xy, yz, zx):
    """Unit vector in the kernel of a symmetric matrix of rank 2: across two of its rows, those of the longest
    product."""
    rows = (xx, xy, zx), (xy, yy, yz), (zx, yz, zz)
    w, square = _cross(rows[0], rows[1])
    other, another = _cross(rows[1], rows[2]), _cross(rows[2], rows[0])
    better = other[1] > square
    w, square = _choose(better, other[0], w), where(better, other[1], square)
    better = another[1] > square
    w, square = _choose(better, another[0], w), where(better, another[1], square)
    one = 1.0 / math.sqrt(square)
    return w[0] * one, w[1] * one, w[2] * one


@inlined
def _rotation(half, xy):
    """Cosine and sine of the angle to the axis of the greater value of [[half, xy], [xy, -half]], and that
    value."""
    radius = math.sqrt(half * half + xy * xy)
    # (radius + half, xy) or, the same direction without cancellation, (xy, radius - half)
    c, s = where(half >= 0.0, radius + half, xy), where(half >= 0.0, xy, radius - half)
    square = c * c + s * s
    one = 1.0 / math.sqrt(where(square > 0.0, square, 1.0))
    return where(square > 0.0, c * one, 1.0), s * one, radius


@inlined
def symmetric2(xx, yy, xy):
    """Principal values (greater, smaller) and right-handed axes of [[xx, xy], [xy, yy]], in closed form."""
    mean = 0.5 * (xx + yy)
    c, s, radius = _rotation(0.5 * (xx - yy), xy)
    return (mean + radius, mean - radius), ((c, s), (-s, c))


@merged
def symmetric3(xx, yy, zz, xy, yz, zx):
    """Principal values in descending order and orthonormal axes of a symmetric 3x3 matrix.

    The value that is furthest from their mean lies apart from both others, so it is a simple root of the
    cubic equation, and its axis is accurate to round-off. Across that axis, in any basis that is orthonormal
    (Duff et al. 2017, jcgt.org/published/0006/01/01), a problem in the plane is left. So axes are orthogonal
    to round-off also where values meet (Scherzinger & Dohrmann 2008, doi 10.1016/j.cma.2008.03.031).
    """
    mean = (xx + yy + zz) / 3.0
    xx, yy, zz = xx - mean, yy - mean, zz - mean
    size = math.sqrt((0.5 * (xx * xx + yy * yy + zz * zz) + xy * xy + yz * yz + zx * zx) / 3.0)
    one = 1.0 / where(size > 0.0, size, 1.0)
    # Three equal values have any axes: those of another matrix.
    xx, yy, zz = _choose(size > 0.0, (xx * one, yy * one, zz * one), (2.0, -1.0, -1.0))
    xy, yz, zx = xy * one, yz * one, zx * one
    r = 0.5 * (xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * zx) + zx * (xy * yz - yy * zx))
    far = _furthest_root(where(abs(r) < 1.0, abs(r), 1.0))
    far = where(r >= 0.0, far, -far)
    w = _axis(xx - far, yy - far, zz - far, xy, yz, zx)
    sign = where(w[2] >= 0.0, 1.0, -1.0)
    a = -1.0 / (sign + w[2])
    b = w[0] * w[1] * a
    u, v = (1.0 + sign * w[0] * w[0] * a, sign * b, -sign * w[0]), (b, sign + w[1] * w[1] * a, -w[1])
    x, y, z = (xx, xy, zx), (xy, yy, yz), (zx, yz, zz)
    Au, Av = (dot(x, u), dot(y, u), dot(z, u)), (dot(x, v), dot(y, v), dot(z, v))
    uu, vv = dot(u, Au), dot(v, Av)
    c, s, radius = _rotation(0.5 * (uu - vv), dot(u, Av))
    u, v = ((c * u[0] + s * v[0], c * u[1] + s * v[1], c * u[2] + s * v[2]),
            (c * v[0] - s * u[0], c * v[1] - s * u[1], c * v[2] - s * u[2]))
    middle = 0.5 * (uu + vv)
    far, high, low = mean + size * far, mean + size * (middle + radius), mean + size * (middle - radius)
    first = r >= 0.0
    return (_choose(first, (far, high, low), (high, low, far)),
            _choose(first, w, u), _choose(first, u, v), _choose(first, v, w))


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
