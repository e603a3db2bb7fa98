"""Mohr–Coulomb soil: friction, dilation, cohesion and a tension cut-off, elastic–perfectly plastic.

In principal Kirchhoff stresses, tension positive, t1 >= t2 >= t3, with N = (1 + sin phi) / (1 - sin phi),
friction angle phi, dilation angle psi (M is N of psi), cohesion c:

    shear:    N t1 - t3 <= 2 c sqrt(N) = S,    plastic flow (M, 0, -1)
    tension:  t1 <= T,                         plastic flow (1, 0, 0)

with the mirror images of both where stresses meet, and T at most the apex S / (N - 1). The surface is made of
planes: flow onto a plane, or onto a line where planes meet, is linear in the trial strain, and onto a corner
constant. So the return is exact in one go, without iteration or smoothing (Clausen, Damkilde & Andersen 2007,
doi 10.1016/j.compstruc.2007.04.002; tension planes added). Soil without cohesion that is pulled has exactly
no stress.

At t1 = t2 = t3 = T the soil separates and remembers how far, see ``hencky``. Cracks in one or two directions
(only with cohesion) are not remembered. Opening and closing again at T > 0 takes and gives back the same
work.
"""
import math
from typing import NamedTuple, Optional, Tuple

import mpm_dem_checks as check

from ..compiled import called, inlined, within
from .hencky import hencky_law
from .law import Law, lame
from .plastic_state import ELASTIC, OPEN
from .viscosity import with_viscosity

# Where the stress ends up, in the order of t1 >= t2 >= t3. Compression edge: t1 = t2, as in triaxial
# compression.
SHEAR, COMPRESSION_EDGE, EXTENSION_EDGE, TENSION, TENSION_EDGE, SHEAR_TENSION, CORNER = range(2, 9)


class Params(NamedTuple):
    """Lamé parameters [Pa]; N of the friction and M of the dilation angle; S and T [Pa] as above; the
    smallest stress ``low`` = N T - S [Pa] that goes with T, equal to T at the apex; viscosity [Pa s]."""

    lam: float
    mu: float
    N: float
    M: float
    S: float
    T: float
    low: float
    viscosity: float


@called
def young(p):
    """Young's modulus [Pa]."""
    return p.mu * (3.0 * p.lam + 2.0 * p.mu) / (p.lam + p.mu)


@called
def edge_compliance(p, r, g):
    """g . C r with the elastic compliance C: how far a strain moves the stress along an edge with direction
    r, where g is normal to the plastic flow."""
    product = g[0] * r[0] + g[1] * r[1] + g[2] * r[2]
    both = (g[0] + g[1] + g[2]) * (r[0] + r[1] + r[2])
    return (product - p.lam / (3.0 * p.lam + 2.0 * p.mu) * both) / (2.0 * p.mu)


@inlined
def _shear(p, e1, e2, e3, s1, s2, s3, excess):
    """Return from trial stresses s to the shear plane or one of its edges, as if there were no apex."""
    lam, mu2, N, M = p.lam, 2.0 * p.mu, p.N, p.M
    volume = lam * (M - 1.0)
    flow = excess / (N * (volume + mu2 * M) - volume + mu2)
    t1, t2, t3 = s1 - flow * (volume + mu2 * M), s2 - flow * volume, s3 - flow * (volume - mu2)
    if t1 >= t2 >= t3:
        return t1, t2, t3, SHEAR
    # On an edge t = (0, .., -S) + x r: from the trial point only plastic flow is left, so g . (e - C t) = 0.
    # Both sides times 2 mu K, of which C then has no fraction: divisions take most of the time here.
    K, S2 = 3.0 * lam + mu2, 2.0 * p.S
    if t1 < t2:
        given = mu2 * K * (e1 + e2 + M * e3) - S2 * (lam - M * (lam + p.mu))
        x = given / (K * (2.0 + N * M) - lam * (2.0 + N) * (2.0 + M))
        return x, x, N * x - p.S, COMPRESSION_EDGE
    given = mu2 * K * (e1 + M * (e2 + e3)) - S2 * (lam - M * (lam + mu2))
    x = given / (K * (1.0 + 2.0 * N * M) - lam * (1.0 + 2.0 * N) * (1.0 + 2.0 * M))
    return x, N * x - p.S, N * x - p.S, EXTENSION_EDGE


@within
def return_map(p, hardening, dt, e1, e2, e3):
    """Kirchhoff stresses [Pa] and region of the trial strains e1 >= e2 >= e3, see ``hencky``."""
    pressure = p.lam * (e1 + e2 + e3)
    s1, s2, s3 = pressure + 2.0 * p.mu * e1, pressure + 2.0 * p.mu * e2, pressure + 2.0 * p.mu * e3
    excess, T, low = p.N * s1 - s3 - p.S, p.T, p.low
    if excess <= 0.0 and s1 <= T:
        return s1, s2, s3, ELASTIC
    # One kind of planes alone, if its result satisfies the other kind; else both.
    if not excess <= 0.0:
        t1, t2, t3, region = _shear(p, e1, e2, e3, s1, s2, s3, excess)
        if not t1 > T:
            return t1, t2, t3, region
    if low >= T:  # no planes of tension below the apex
        return T, T, T, OPEN
    nu, E = 0.5 * p.lam / (p.lam + p.mu), young(p)
    drop = (s1 - T) * nu / (1.0 - nu)
    t2, t3, region = s2 - drop, s3 - drop, TENSION
    if t2 > T:
        t2, t3, region = T, E * e3 + 2.0 * nu * T, TENSION_EDGE
        if t3 >= T:
            return T, T, T, OPEN
    if t3 >= low:
        return T, t2, t3, region
    t2 = E * e2 + nu * (T + low)
    if low <= t2 <= T:
        return T, t2, low, SHEAR_TENSION
    return T, T if t2 > T else low, low, CORNER


@called
def _along(p, r, g):
    """Moduli on an edge: stress moves along r only, by strain along g."""
    x = 1.0 / edge_compliance(p, r, g)
    return ((x * r[0] * g[0], x * r[0] * g[1], x * r[0] * g[2]), (x * r[1] * g[0], x * r[1] * g[1],
                                                                  x * r[1] * g[2]),
            (x * r[2] * g[0], x * r[2] * g[1], x * r[2] * g[2]))


@called
def _plane(p, f, g):
    """Moduli C - (C g) (f C) / (f C g) on the plane with normal f and flow g."""
    lam, mu2 = p.lam, 2.0 * p.mu
    F, G = lam * (f[0] + f[1] + f[2]), lam * (g[0] + g[1] + g[2])
    F = (F + mu2 * f[0], F + mu2 * f[1], F + mu2 * f[2])
    G = (G + mu2 * g[0], G + mu2 * g[1], G + mu2 * g[2])
    x = 1.0 / (f[0] * G[0] + f[1] * G[1] + f[2] * G[2])
    return ((lam + mu2 - x * G[0] * F[0], lam - x * G[0] * F[1], lam - x * G[0] * F[2]),
            (lam - x * G[1] * F[0], lam + mu2 - x * G[1] * F[1], lam - x * G[1] * F[2]),
            (lam - x * G[2] * F[0], lam - x * G[2] * F[1], lam + mu2 - x * G[2] * F[2]))


def moduli(p, hardening, dt, e1, e2, e3, region):
    """Derivatives of the stresses by the trial strains [Pa], see ``hencky``."""
    if region == ELASTIC:
        direct = p.lam + 2.0 * p.mu
        return (direct, p.lam, p.lam), (p.lam, direct, p.lam), (p.lam, p.lam, direct)
    if region == SHEAR:
        return _plane(p, (p.N, 0.0, -1.0), (p.M, 0.0, -1.0))
    if region == TENSION:
        return _plane(p, (1.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    if region == COMPRESSION_EDGE:
        return _along(p, (1.0, 1.0, p.N), (1.0, 1.0, p.M))
    if region == EXTENSION_EDGE:
        return _along(p, (1.0, p.N, p.N), (1.0, p.M, p.M))
    if region == TENSION_EDGE:
        return _along(p, (0.0, 0.0, 1.0), (0.0, 0.0, 1.0))
    if region == SHEAR_TENSION:
        return _along(p, (0.0, 1.0, 0.0), (0.0, 1.0, 0.0))
    return (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)


def soil_angles(friction_angle: float, dilation_angle: float, cohesion: float) -> Tuple[float, float]:
    """sin of both angles [degrees] of a soil with that cohesion [Pa]; raises ValueError for impossible
    values."""
    check.between("friction_angle", friction_angle, 0, 90, "degrees", "give at least 0 and less than 90",
                  "[)")
    check.between("dilation_angle", dilation_angle, 0, friction_angle, "degrees",
                  f"give at least 0 and at most the friction angle, {friction_angle} degrees")
    check.not_negative("cohesion", cohesion, "Pa")
    if friction_angle == 0.0 and cohesion == 0.0:
        raise ValueError("friction_angle and cohesion are both 0: give one of them, or nothing resists shear")
    return math.sin(math.radians(friction_angle)), math.sin(math.radians(dilation_angle))


def tension_limit(tension_cutoff: Optional[float], apex: float) -> float:
    """The greatest tension [Pa]: ``tension_cutoff``, or ``apex`` for None; raises ValueError unless 0 <= it
    <= apex."""
    if tension_cutoff is None:
        return apex
    return check.between("tension_cutoff", tension_cutoff, 0, apex, "Pa",
                         f"give at least 0 and at most the apex of the yield surface, {apex:.6g} Pa")


def mohr_coulomb(E: float, nu: float, friction_angle: float, dilation_angle: float = 0.0,
                 cohesion: float = 0.0, tension_cutoff: Optional[float] = None,
                 viscosity: float = 0.0) -> Law:
    """Mohr–Coulomb soil with Young's modulus E [Pa], Poisson's ratio nu, friction and dilation angle
    [degrees], cohesion and greatest tension [Pa] (None: up to the apex c cot phi); ``viscosity`` [Pa s], see
    there. Raises ValueError for impossible values.

    >>> law = mohr_coulomb(E=50e6, nu=0.3, friction_angle=30.0, cohesion=1e3)
    >>> round(law.params.N, 12), round(law.params.T, 1)  # ratio of principal stresses, greatest tension [Pa]
    (3.0, 1732.1)
    """
    friction, dilation = soil_angles(friction_angle, dilation_angle, cohesion)
    N, M = (1.0 + friction) / (1.0 - friction), (1.0 + dilation) / (1.0 - dilation)
    S = 2.0 * cohesion * math.sqrt(N)
    apex = S / (N - 1.0) if N > 1.0 else math.inf
    T = tension_limit(tension_cutoff, apex)
    low = T if apex == T else N * T - S
    return with_viscosity(hencky_law("mohr_coulomb", Params(*lame(E, nu), N, M, S, T, low, viscosity),
                                     return_map, moduli, N == M))
