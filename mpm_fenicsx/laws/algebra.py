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
def _dot(a, b):
    """a . b in space."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@called
def _cross(a, b):
    """a x b, and the square of its length."""
    c = a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
    return c, _dot(c, c)


@called
def _furthest_root(r):
    """The greatest root of x^3 - 3 x = 2 r, 0 <= r <= 1, which is 2 cos(acos(r) / 3): a polynomial within
    2e-4, then Newton's method, which leaves of an error e at most 0.6 e^2."""
    x = 1.7319 + r * (0.3328 + r * (-0.0811 + r * 0.0165))
    for _ in range(3):
        x -= ((x * x - 3.0) * x - 2.0 * r) / (3.0 * x * x - 3.0)
    return x


@called
def _axis(xx, yy, zz, xy, yz, zx):
    """Unit vector in the kernel of a symmetric matrix of rank 2: across two of its rows, those of the longest
    product."""
    rows = (xx, xy, zx), (xy, yy, yz), (zx, yz, zz)
    w, square = _cross(rows[0], rows[1])
    other, another = _cross(rows[1], rows[2]), _cross(rows[2], rows[0])
    if other[1] > square:
        w, square = other
    if another[1] > square:
        w, square = another
    one = 1.0 / math.sqrt(square)
    return w[0] * one, w[1] * one, w[2] * one


@called
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
    if size == 0.0:
        return (mean, mean, mean), ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    one = 1.0 / size
    xx, yy, zz, xy, yz, zx = xx * one, yy * one, zz * one, xy * one, yz * one, zx * one
    r = 0.5 * (xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * zx) + zx * (xy * yz - yy * zx))
    far = math.copysign(_furthest_root(min(abs(r), 1.0)), r)
    w = _axis(xx - far, yy - far, zz - far, xy, yz, zx)
    sign = math.copysign(1.0, w[2])
    a = -1.0 / (sign + w[2])
    b = w[0] * w[1] * a
    u, v = (1.0 + sign * w[0] * w[0] * a, sign * b, -sign * w[0]), (b, sign + w[1] * w[1] * a, -w[1])
    x, y, z = (xx, xy, zx), (xy, yy, yz), (zx, yz, zz)
    Au, Av = (_dot(x, u), _dot(y, u), _dot(z, u)), (_dot(x, v), _dot(y, v), _dot(z, v))
    near, ((c, s), _) = symmetric2(_dot(u, Au), _dot(v, Av), _dot(u, Av))
    u, v = ((c * u[0] + s * v[0], c * u[1] + s * v[1], c * u[2] + s * v[2]),
            (c * v[0] - s * u[0], c * v[1] - s * u[1], c * v[2] - s * u[2]))
    far, high, low = mean + size * far, mean + size * near[0], mean + size * near[1]
    return ((far, high, low), (w, u, v)) if r >= 0.0 else ((high, low, far), (u, v, w))


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
