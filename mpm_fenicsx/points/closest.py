"""Closest point of a segment or triangle to a place, by barycentric coordinates (Ericson, Real-Time Collision
Detection, 2005, section 5.1.5)."""
from ..compiled import inlined


@inlined
def _dot(a, b, D):
    s = 0.0
    for i in range(D):
        s += a[i] * b[i]
    return s


@inlined
def closest(x, corner, D, weight, w):
    """Fill ``weight``, shape (D,), with the barycentric coordinates of the closest point to x, shape (D,);
    those of corners that it is not between are zero. corner: (D, D); w: work of shape (3, D)."""
    for i in range(D):
        w[0, i], w[2, i] = corner[1, i] - corner[0, i], x[i] - corner[0, i]
    if D == 2:
        t = _dot(w[0], w[2], D) / _dot(w[0], w[0], D)
        weight[1] = min(max(t, 0.0), 1.0)
        weight[0] = 1.0 - weight[1]
        return
    for i in range(D):
        w[1, i] = corner[2, i] - corner[0, i]
    ab, ac, abc = _dot(w[0], w[0], D), _dot(w[1], w[1], D), _dot(w[0], w[1], D)
    d1, d2 = _dot(w[0], w[2], D), _dot(w[1], w[2], D)
    d3, d4, d5, d6 = d1 - ab, d2 - abc, d1 - abc, d2 - ac
    s, t, inner = 0.0, 0.0, True
    if d1 <= 0.0 and d2 <= 0.0:
        pass
    elif d3 >= 0.0 and d4 <= d3:
        s = 1.0
    elif d6 >= 0.0 and d5 <= d6:
        t = 1.0
    elif d1 * d4 - d3 * d2 <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        s = d1 / (d1 - d3)
    elif d5 * d2 - d1 * d6 <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        t = d2 / (d2 - d6)
    elif d3 * d6 - d5 * d4 <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0:
        t = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        s, inner = 1.0 - t, False
    else:
        va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
        s, t = vb / (va + vb + vc), vc / (va + vb + vc)
    weight[0], weight[1], weight[2] = max(1.0 - s - t, 0.0) if inner else 0.0, s, t
