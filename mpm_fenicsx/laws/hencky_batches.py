"""Stress and tangent of ``hencky`` in space at a batch of points at once, see ``batches``.

LLVM turns a loop over points into packed arithmetic, four or eight points in one instruction, where the
loop has no branches, stays in one array, and goes as far as the array is long (``len``), not to a constant.
So the work array has a row of SIZE numbers, one per point, for each number of a point, and what all points
do alike (principal axes, logarithms, the way back from the axes) is done in whole rows. In between every
point goes through its return mapping on its own. Principal axes of a point take 15 ns in the place of 77,
the stress 55 in the place of 235 (measured, AVX-512).
"""
import math
from typing import Callable, Dict, Tuple

import numpy as np

from ..compiled import inlined, multiply, specialise, where
from .algebra import NEAR, dot, exp_near_zero, half_log_near_one, symmetric3
from .hencky import log_strain, spin
from .law import Law, compiled_parts, constants_of
from .plastic_state import ELASTIC, THIRD

SIZE = 32  # points of a batch: the rows then take 16 kB, half of the fastest memory
# Rows of the work array: the first of each group
DEFORMATION, PLASTIC, AXES, PULLED = 0, 9, 15, 24
SQUARES, STRAINS, STRESSES, ELASTIC_STRAINS, PIOLA = 33, 36, 39, 42, 45
FLOWS, FAR, REGION, KIRCHHOFF, ROWS = 54, 55, 56, 57, 63

RETURN = "return_map", "hardening_of", "elastic_strains", "keep_hardening", "accumulate"  # parts of a law

# fixed by specialise
return_map = hardening_of = elastic_strains = keep_hardening = accumulate = moduli = None


@inlined
def at(row, q):
    """Place of a point's number of that ``row`` in the work array."""
    return row * SIZE + q


def gather(F, old, part, W):
    """F and Cp^-1 of the points into their rows."""
    for q in range(len(part)):
        for i in range(3):
            for j in range(3):
                W[at(DEFORMATION + 3 * i + j, q)] = F[part[q], i, j]
        C = old[part[q]].plastic
        put(W, PLASTIC, q, (1.0 + C[0], 1.0 + C[1], 1.0 + C[2]))
        put(W, PLASTIC + 3, q, (C[3], C[4], C[5]))


@inlined
def three(W, row, q):
    """Three numbers of a point, from ``row`` on."""
    return W[at(row, q)], W[at(row + 1, q)], W[at(row + 2, q)]


@inlined
def put(W, row, q, x):
    """The other way round."""
    W[at(row, q)], W[at(row + 1, q)], W[at(row + 2, q)] = x


@inlined
def _times_symmetric(row, diagonal, rest):
    """A row times the symmetric matrix with that diagonal and the rest xy, yz, zx."""
    a, b, c = row
    return (a * diagonal[0] + b * rest[0] + c * rest[2], a * rest[0] + b * diagonal[1] + c * rest[1],
            a * rest[2] + b * rest[1] + c * diagonal[2])


@inlined
def _cross(a, b):
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@inlined
def _combined(factor, n, u, v, w):
    """factor (n_1 u + n_2 v + n_3 w)."""
    x, y, z = factor * n[0], factor * n[1], factor * n[2]
    return x * u[0] + y * v[0] + z * w[0], x * u[1] + y * v[1] + z * w[1], x * u[2] + y * v[2] + z * w[2]


def find_axes(W):
    """Squares of the trial stretches, trial strains, axes n and m = F^-1 n, see ``hencky.principal_axes``."""
    for q in range(len(W) // ROWS):
        f, g, h = three(W, 0, q), three(W, 3, q), three(W, 6, q)
        diagonal, rest = three(W, PLASTIC, q), three(W, PLASTIC + 3, q)
        a, b, c = (_times_symmetric(f, diagonal, rest), _times_symmetric(g, diagonal, rest),
                   _times_symmetric(h, diagonal, rest))
        squares, n1, n2, n3 = symmetric3(dot(a, f), dot(b, g), dot(c, h), dot(a, g), dot(b, h), dot(c, f))
        u, v, w = _cross(g, h), _cross(h, f), _cross(f, g)
        J = dot(f, u)
        one = 1.0 / where(J > 0.0, J, math.nan)
        put(W, SQUARES, q, squares)
        put(W, STRAINS, q, (half_log_near_one(squares[0]), half_log_near_one(squares[1]),
                            half_log_near_one(squares[2])))
        put(W, AXES, q, n1)
        put(W, AXES + 3, q, n2)
        put(W, AXES + 6, q, n3)
        put(W, PULLED, q, _combined(one, n1, u, v, w))
        put(W, PULLED + 3, q, _combined(one, n2, u, v, w))
        put(W, PULLED + 6, q, _combined(one, n3, u, v, w))


@inlined
def _strain(W, k, q):
    """Trial strain k of a point, by the logarithm where the series is not exact."""
    e = W[at(STRAINS + k, q)]
    return e if abs(e) < NEAR else log_strain(W[at(SQUARES + k, q)])


def return_points(p, dt, old, new, part, W):
    """The return mapping of each point: its stresses and twice its elastic strains. Fills ``new`` but for
    Cp."""
    for q in range(len(part)):
        before, after = old[part[q]], new[part[q]]
        ahead = THIRD * before.opened
        e = (_strain(W, 0, q) + ahead, _strain(W, 1, q) + ahead, _strain(W, 2, q) + ahead)
        t1, t2, t3, region = return_map(p, hardening_of(before), dt, e[0], e[1], e[2])
        ee = elastic_strains(p, (t1, t2, t3))
        put(W, STRAINS, q, e)
        put(W, STRESSES, q, (t1, t2, t3))
        W[at(REGION, q)] = region
        axes = three(W, AXES, q), three(W, AXES + 3, q), three(W, AXES + 6, q)
        flows = accumulate(before, after, axes, e, ee, (t1, t2, t3), region)
        far = flows and not max(abs(ee[0]), abs(ee[1]), abs(ee[2])) < NEAR
        for k in range(3):
            W[at(ELASTIC_STRAINS + k, q)] = math.exp(2.0 * ee[k]) if far else 2.0 * ee[k]
        W[at(FLOWS, q)], W[at(FAR, q)] = 1.0 if flows else 0.0, 1.0 if far else 0.0
        volume = e[0] + e[1] + e[2] - ee[0] - ee[1] - ee[2] if region != ELASTIC else 0.0
        keep_hardening(before, after, volume)


def combine(W):
    """From the axes back: P and tau, and Cp^-1 - 1 of points that flow."""
    for q in range(len(W) // ROWS):
        far = W[at(FAR, q)] > 0.0
        x, y, z = three(W, ELASTIC_STRAINS, q)
        x, y, z = (where(far, x, exp_near_zero(x)), where(far, y, exp_near_zero(y)),
                   where(far, z, exp_near_zero(z)))
        r, s, t = three(W, STRESSES, q)
        a, b, c = three(W, AXES, q), three(W, AXES + 3, q), three(W, AXES + 6, q)
        u, v, w = three(W, PULLED, q), three(W, PULLED + 3, q), three(W, PULLED + 6, q)
        first, second, third = ((r * a[0], s * b[0], t * c[0]), (r * a[1], s * b[1], t * c[1]),
                                (r * a[2], s * b[2], t * c[2]))
        put(W, PIOLA, q, _combined(1.0, first, u, v, w))
        put(W, PIOLA + 3, q, _combined(1.0, second, u, v, w))
        put(W, PIOLA + 6, q, _combined(1.0, third, u, v, w))
        tx, ty, tz = (_combined(1.0, first, a, b, c), _combined(1.0, second, a, b, c),
                      _combined(1.0, third, a, b, c))
        put(W, KIRCHHOFF, q, (tx[0], ty[1], tz[2]))
        put(W, KIRCHHOFF + 3, q, (tx[1], ty[2], tz[0]))
        xx = _combined(1.0, (x * u[0], y * v[0], z * w[0]), u, v, w)
        yy = _combined(1.0, (x * u[1], y * v[1], z * w[1]), u, v, w)
        zz = _combined(1.0, (x * u[2], y * v[2], z * w[2]), u, v, w)
        put(W, PLASTIC, q, (xx[0] - 1.0, yy[1] - 1.0, zz[2] - 1.0))
        put(W, PLASTIC + 3, q, (xx[1], yy[2], zz[0]))


def scatter(old, new, part, W, P):
    """Stress, and what is plastic, from the rows to the points."""
    for q in range(len(part)):
        for i in range(9):
            P[q, i] = W[at(PIOLA + i, q)]
        C, tau = new[part[q]].plastic, new[part[q]].kirchhoff_stress
        before, flows = old[part[q]].plastic, W[at(FLOWS, q)] > 0.0
        for i in range(6):
            tau[i] = W[at(KIRCHHOFF + i, q)]
            C[i] = W[at(PLASTIC + i, q)] if flows else before[i]


def batch_stress(p, dt, old, new, part, W, P):
    """See ``batches``."""
    (_, F33, before), (F, F33_new, after) = old, new
    gather(F, before, part, W)
    find_axes(W)
    return_points(p, dt, before, after, part, W)
    combine(W)
    scatter(before, after, part, W, P)
    for q in part:
        F33_new[q] = F33[q]


@inlined
def _row(Y, row, a, x, b, y, N):
    """A row of Y: x times row a of N and y times row b."""
    for k in range(9):
        Y[row, k] = x * N[a, k] + y * N[b, k]


def spatial_moduli(squares, t, d, axes, weight, N, Y, B):
    """B = weight sum_abcd x_abcd n_a n_b n_c n_d, where x are the moduli in the principal axes as
    ``hencky.tangent`` has them, with the derivatives d of the stresses t by the trial strains. N: the dyads
    n_a n_b, and Y: x times these, (9, 9), work."""
    for a in range(3):
        for b in range(3):
            for i in range(3):
                for j in range(3):
                    N[3 * a + b, 3 * i + j] = axes[a][i] * axes[b][j]
    for a in range(3):
        b, c = (a + 1) % 3, (a + 2) % 3
        ta, tb = weight * t[a], weight * t[b]
        for k in range(9):
            Y[4 * a, k] = (weight * (d[a][a] * N[4 * a, k] + d[a][b] * N[4 * b, k] + d[a][c] * N[4 * c, k])
                           - ta * N[4 * a, k])
        w = weight * spin(squares, t, d, a, b)
        _row(Y, 3 * a + b, 3 * a + b, w * squares[b], 3 * b + a, w * squares[a] - ta, N)
        _row(Y, 3 * b + a, 3 * b + a, w * squares[a], 3 * a + b, w * squares[b] - tb, N)
    multiply((9, 9, 9), False, (B, 0, 9), (N, 0, 1, 9), (Y, 0, 9))


def batch_tangent(p, dt, old, new, part, V0, work, out):
    """See ``batches``."""
    W, N, Y = work
    P, B = out
    batch_stress(p, dt, old, new, part, W, P)
    for q in range(len(part)):
        hardening, e = hardening_of(old.state[part[q]]), three(W, STRAINS, q)
        d = moduli(p, hardening, dt, e[0], e[1], e[2], int(W[at(REGION, q)]))
        axes = three(W, AXES, q), three(W, AXES + 3, q), three(W, AXES + 6, q)
        spatial_moduli(three(W, SQUARES, q), three(W, STRESSES, q), d, axes, V0[part[q]], N, Y, B[q])


def rows():
    """Work of ``batch_stress``."""
    return np.zeros(ROWS * SIZE)


def rows_and_dyads():
    """Work of ``batch_tangent``."""
    return np.zeros(ROWS * SIZE), np.empty((9, 9)), np.empty((9, 9))


def assemble(law: Law, D: int, own: Dict[str, Callable]) -> Tuple[Callable, ...]:
    """What ``batches.OfBatches`` holds, of a ``law`` of ``hencky`` in ``D`` dimensions, from the functions
    of a module like this one, by name."""
    record = constants_of(law, D)
    parts = compiled_parts(law, record)
    returns = {name: parts[name] for name in RETURN}
    steps = dict(gather=specialise(own["gather"], **record), find_axes=specialise(own["find_axes"]),
                 return_points=specialise(own["return_points"], **record, **returns),
                 combine=specialise(own["combine"]), scatter=specialise(own["scatter"], **record))
    stress = specialise(own["batch_stress"], **record, **steps)
    tangent = specialise(own["batch_tangent"], **record, batch_stress=stress, moduli=parts["moduli"],
                         hardening_of=parts["hardening_of"], spatial_moduli=specialise(own["spatial_moduli"]))
    return stress, specialise(own["rows"]), tangent, specialise(own["rows_and_dyads"])


def rows_functions(law: Law) -> Tuple[Callable, ...]:
    """Of a ``law`` of ``hencky`` in space, see ``assemble``."""
    return assemble(law, 3, globals())
