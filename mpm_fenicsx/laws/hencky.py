"""Plasticity at finite strain by return mapping in principal logarithmic strains: what all such laws share.

F = Fe Fp; Hencky's elasticity is linear in the logarithmic strain of the elastic left Cauchy–Green tensor and
gives the Kirchhoff stress tau. With plastic flow frozen, b = F Cp^-1 F^T (Cp = Fp^T Fp) is the trial state of
a step, and

    b = sum_a l_a n_a n_a^T,    e_a = ln(l_a) / 2,    tau_a = r_a(e),    P = tau F^-T = sum_a tau_a n_a m_a^T,
    m_a = F^-1 n_a,             Cp^-1 = sum_a exp(2 ee_a) m_a m_a^T,     ee_a = (tau_a - lam tr(tau) / K3) / 2
                                mu,

with K3 = 3 lam + 2 mu and the return mapping r of small strains (de Souza Neto, Perić & Owen, Computational
Methods for Plasticity, section 14.4; Simo 1992, doi 10.1016/0045-7825(92)90123-2). Yield conditions are in
Kirchhoff stress.

What they remember, soil that has opened and plastic work: ``plastic_state``.

A law gives two functions of trial strains in descending order, e1 >= e2 >= e3, of the plastic strain so far
and of the length of the step, see ``law``:

    return_map(p, hardening, dt, e1, e2, e3) -> tau1, tau2, tau3, region
    moduli(p, hardening, dt, e1, e2, e3, region) -> dtau/de, a tuple of three rows

With dt = 0 a law that flows at a rate does not flow: the stress is that of the elastic strain, whatever the
rate was at which it came about.

region is ELASTIC, OPEN (separated) or a number of the law's own. The law's parameters include lam and mu
[Pa]. A law may have an elasticity, a hardening variable and an energy of its own: see ``hencky_law``.
"""
import math
from typing import Callable, Dict, NamedTuple, Optional

from ..compiled import called
from .algebra import PLACE, cofactor, determinant, from_axes2, from_axes3, symmetric2, symmetric3
from .law import Law
from .plastic_parts import keep_nothing, linear_strains, plastic_strain_of
from .plastic_state import ELASTIC, STATE, accumulate, keep_stress, remember

D = 2  # fixed by specialise, as are the functions below
return_map = moduli = hardening_of = elastic_strains = keep_hardening = None


@called
def trial_b(F, C, i, j, D):
    """Component ij of b = F (1 + C) F^T, C as it is stored."""
    s = 0.0
    for k in range(D):
        g = F[j, k]
        for n in range(D):
            g += C[PLACE[k][n]] * F[j, n]
        s += F[i, k] * g
    return s


@called
def _pulled_back2(F, n, J):
    """F^-1 n in the plane."""
    return (F[1, 1] * n[0] - F[0, 1] * n[1]) / J, (F[0, 0] * n[1] - F[1, 0] * n[0]) / J


@called
def _pulled_back3(F, n, J):
    """F^-1 n in space."""
    return ((cofactor(F, 0, 0, 3) * n[0] + cofactor(F, 1, 0, 3) * n[1] + cofactor(F, 2, 0, 3) * n[2]) / J,
            (cofactor(F, 0, 1, 3) * n[0] + cofactor(F, 1, 1, 3) * n[1] + cofactor(F, 2, 1, 3) * n[2]) / J,
            (cofactor(F, 0, 2, 3) * n[0] + cofactor(F, 1, 2, 3) * n[1] + cofactor(F, 2, 2, 3) * n[2]) / J)


def principal_axes(F, F33, C):
    """Squares l of three trial stretches, the third being the one across a plane, and D axes n and m = F^-1
    n. NaN when the body is turned inside out.
    """
    J = determinant(F, D)
    J = J if J * F33 > 0.0 else math.nan
    if D == 2:
        plane, n = symmetric2(trial_b(F, C, 0, 0, D), trial_b(F, C, 1, 1, D), trial_b(F, C, 0, 1, D))
        squares = (plane[0], plane[1], F33 * F33 * (1.0 + C[2]))
        return squares, n, (_pulled_back2(F, n[0], J), _pulled_back2(F, n[1], J))
    squares, n1, n2, n3 = symmetric3(trial_b(F, C, 0, 0, D), trial_b(F, C, 1, 1, D), trial_b(F, C, 2, 2, D),
                                     trial_b(F, C, 0, 1, D), trial_b(F, C, 1, 2, D), trial_b(F, C, 2, 0, D))
    return squares, (n1, n2, n3), (_pulled_back3(F, n1, J), _pulled_back3(F, n2, J), _pulled_back3(F, n3, J))


@called
def log_strain(square):
    """Of the square of a stretch; NaN unless that is positive."""
    return 0.5 * math.log(square) if square > 0.0 else math.nan


@called
def rank_across(e):
    """Place of the strain across the plane, e[2], among the sorted three; e[0] >= e[1] already."""
    return 0 if e[2] > e[0] else 1 if e[2] > e[1] else 2


@called
def in_order(e, rank):
    """The strains in descending order."""
    if rank == 2:
        return e
    return (e[0], e[2], e[1]) if rank == 1 else (e[2], e[0], e[1])


@called
def back_in_place(s, rank):
    """What belongs to these, the other way round."""
    if rank == 2:
        return s
    return (s[0], s[2], s[1]) if rank == 1 else (s[1], s[2], s[0])


@called
def rows_in_place(rows, rank):
    """The same of a matrix, by rows and columns."""
    return back_in_place((back_in_place(rows[0], rank), back_in_place(rows[1], rank),
                          back_in_place(rows[2], rank)), rank)


def from_axes(x, n, m):
    """Turn components x[D a + b] in the axes n, m into those of the matrix sum_ab x_ab n_a m_b^T, in
    place."""
    if D == 2:
        from_axes2(x, n, m)
    else:
        from_axes3(x, n, m)


def stress(p, F, F33, dt, old, new, P):
    """Also returns what the tangent goes on with: squares, n, m as in ``principal_axes``, trial strains in
    descending order, the rank of the one across the plane, stresses t in the order of the squares, and the
    region.
    """
    squares, n, m = principal_axes(F, F33, old.plastic)
    ahead = old.opened / 3.0
    e = (log_strain(squares[0]) + ahead, log_strain(squares[1]) + ahead, log_strain(squares[2]) + ahead)
    rank = rank_across(e) if D == 2 else 2
    ordered = in_order(e, rank)
    t1, t2, t3, region = return_map(p, hardening_of(old), dt, ordered[0], ordered[1], ordered[2])
    t = back_in_place((t1, t2, t3), rank)
    for a in range(D):
        for b in range(D):
            P[a * D + b] = t[a] if a == b else 0.0
    from_axes(P, n, m)
    P[D * D] = t[2] / F33 if D == 2 else 0.0
    ee = elastic_strains(p, t)
    flows = accumulate(old, new, n, e, ee, t, region)
    keep_stress(new, t, n)
    remember(F33, old, new, m, ee, flows)
    volume = e[0] + e[1] + e[2] - ee[0] - ee[1] - ee[2] if region != ELASTIC else 0.0
    keep_hardening(old, new, volume)
    return squares, n, m, ordered, rank, t, region


@called
def spin(squares, t, d, a, b):
    """(t_a - t_b) / (l_a - l_b), and its limit where the two meet: the error of either is then below 1e-7 of
    it, also of materials that yield at a strain of 1e-5, from which on the limit curves."""
    if abs(squares[a] - squares[b]) > 1e-7 * (squares[a] + squares[b]):
        return (t[a] - t[b]) / (squares[a] - squares[b])
    return 0.5 * (d[a][a] - d[a][b] - d[b][a] + d[b][b]) / (squares[a] + squares[b])


def tangent(p, F, F33, dt, old, new, P, A):
    """dtau = a : dF F^-1 has in principal axes a_aabb = d_ab, a_abab = w l_b, a_abba = w l_a with the spin
    term w = (t_a - t_b) / (l_a - l_b); with P = tau F^-T, A in the axes n, m is a_abcd - t_a delta_ad
    delta_bc."""
    squares, n, m, e, rank, t, region = stress(p, F, F33, dt, old, new, P)
    rows = moduli(p, hardening_of(old), dt, e[0], e[1], e[2], region)
    d = rows_in_place(rows, rank)
    last = D * D
    for i in range(last + 1):
        for j in range(last + 1):
            A[i, j] = 0.0
    for a in range(D):
        for b in range(D):
            A[a * D + a, b * D + b] = d[a][b]
            if a != b:
                w = spin(squares, t, d, a, b)
                A[a * D + b, a * D + b] = w * squares[b]
                A[a * D + b, b * D + a] = w * squares[a] - t[a]
        A[a * D + a, a * D + a] -= t[a]
        if D == 2:
            A[a * D + a, last], A[last, a * D + a] = d[a][2] / F33, d[2][a] / F33
    if D == 2:
        A[last, last] = (d[2][2] - t[2]) / (F33 * F33)
    for i in range(last + 1):
        from_axes(A[i], n, m)
    for j in range(last + 1):
        from_axes(A[:, j], n, m)


def energy(p, F, F33, old):
    """Elastic energy lam tr(e)^2 / 2 + mu e:e of the state at the end of a step."""
    squares = principal_axes(F, F33, old.plastic)[0]
    e = (log_strain(squares[0]), log_strain(squares[1]), log_strain(squares[2]))
    trace = e[0] + e[1] + e[2]
    return 0.5 * p.lam * trace * trace + p.mu * (e[0] * e[0] + e[1] * e[1] + e[2] * e[2])


def hencky_law(name: str, params: NamedTuple, return_map: Callable, moduli: Callable,
               symmetric: bool = True, own: Optional[Dict[str, Callable]] = None) -> Law:
    """The law with these parameters and functions; ``symmetric`` if the moduli are. own: functions in place
    of ``plastic_strain_of`` ("hardening_of"), ``linear_strains`` ("elastic_strains") and ``keep_nothing``
    ("keep_hardening")."""
    shared = {"principal_axes": principal_axes, "from_axes": from_axes, "accumulate": accumulate,
              "keep_stress": keep_stress, "remember": remember,
              "hardening_of": plastic_strain_of, "elastic_strains": linear_strains,
              "keep_hardening": keep_nothing, **(own or {})}
    return Law(name, params, STATE, stress, tangent, energy, symmetric=symmetric, parts=(
        *shared.items(), ("return_map", return_map), ("moduli", moduli)))
