"""How Mohr–Coulomb's pyramid softens, see ``softening``."""
import math
from typing import NamedTuple, Tuple

from ..compiled import called
from .mohr_coulomb import (
    COMPRESSION_EDGE,
    EXTENSION_EDGE,
    OPEN,
    SHEAR,
    SHEAR_TENSION,
    TENSION,
    TENSION_EDGE,
    edge_compliance,
    moduli,
    return_map,
    young,
)
from .mohr_coulomb import Params as Pyramid
from .softening import Softens


class Params(NamedTuple):
    """Those of ``mohr_coulomb`` at the peak; how much N, M, S [Pa] and the cut-off T [Pa] lose per plastic
    strain; the plastic strain at which the strength is residual."""

    lam: float
    mu: float
    N: float
    M: float
    S: float
    T: float
    low: float
    viscosity: float
    N_falls: float
    M_falls: float
    S_falls: float
    T_falls: float
    full: float


def params(peak: Pyramid, residual: Pyramid, full: float) -> Params:
    """Of the softening soil. Where the residual soil bears tension up to its apex, the cut-off stays."""
    falls = [(one - other) / full for one, other in zip(peak[2:5], residual[2:5])]
    cut_off = residual.low < residual.T < peak.T
    return Params(*peak, *falls, (peak.T - residual.T) / full if cut_off else 0.0, full)


def _drop(p: Pyramid, flow: Tuple[float, float, float], N: float) -> float:
    """Of N t1 - t3 [Pa] per plastic strain, when that is along ``flow``."""
    mean = sum(flow) / 3.0
    t1, t3 = (3.0 * p.lam * mean + 2.0 * p.mu * part for part in (flow[0], flow[2]))
    return (N * t1 - t3) / math.sqrt(2.0 / 3.0 * sum((part - mean) ** 2 for part in flow))


def steepest(peak: Pyramid, residual: Pyramid) -> float:
    """Loss of S per plastic strain [Pa] at which the soil unloads: the least over the plane and its edges."""
    return min(_drop(peak, flow, N) for N in (peak.N, residual.N) for M in (peak.M, residual.M)
               for flow in ((M, 0.0, -1.0), (M, M, -2.0), (2.0 * M, -1.0, -1.0)))


def loss(peak: Pyramid, residual: Pyramid) -> float:
    """Of S [Pa]."""
    return peak.S - residual.S


def weakened(p, k):
    """The pyramid at the plastic strain k."""
    k = min(k, p.full)
    N, M, S, T = p.N - k * p.N_falls, p.M - k * p.M_falls, p.S - k * p.S_falls, p.T - k * p.T_falls
    apex = S / (N - 1.0) if N > 1.0 else math.inf
    if apex > T:
        return Pyramid(p.lam, p.mu, N, M, S, T, N * T - S, p.viscosity)
    return Pyramid(p.lam, p.mu, N, M, S, apex, apex, p.viscosity)


@called
def _apart(p, q):
    """Derivatives of N, M, S, of T and of the smallest stress that goes with it."""
    N, M, S, T = -p.N_falls, -p.M_falls, -p.S_falls, -p.T_falls
    if q.low < q.T:
        return N, M, S, T, N * q.T + q.N * T - S
    T = (S - q.T * N) / (q.N - 1.0) if q.N > 1.0 else 0.0
    return N, M, S, T, T


@called
def _plane_by_strain(q, N, M, S, e1, e2, e3):
    """Of the return to the shear plane, t = s - flow a."""
    lam, mu2 = q.lam, 2.0 * q.mu
    s1, s3 = lam * (e1 + e2 + e3) + mu2 * e1, lam * (e1 + e2 + e3) + mu2 * e3
    volume = lam * (q.M - 1.0)
    a1, a2, a3 = volume + mu2 * q.M, volume, volume - mu2
    whole = q.N * a1 - a3
    flow = (q.N * s1 - s3 - q.S) / whole
    of_flow = (N * s1 - S - flow * (N * a1 + q.N * (lam + mu2) * M - lam * M)) / whole
    return (-of_flow * a1 - flow * (lam + mu2) * M, -of_flow * a2 - flow * lam * M,
            -of_flow * a3 - flow * lam * M)


def by_strain(p, q, t, region, e1, e2, e3):
    """Derivatives of the stresses t by the plastic strain, see ``Softens``."""
    N, M, S, T, low = _apart(p, q)
    nu, E = 0.5 * p.lam / (p.lam + p.mu), young(p)
    if region == SHEAR:
        return _plane_by_strain(q, N, M, S, e1, e2, e3)
    if region == COMPRESSION_EDGE:
        r, g = (1.0, 1.0, q.N), (1.0, 1.0, q.M)
        x = (M * e3 - (S * (2.0 * nu - q.M) - q.S * M) / E - t[0] * (
            edge_compliance(q, (0.0, 0.0, N), g) + edge_compliance(q, r, (0.0, 0.0, M)))
             ) / edge_compliance(q, r, g)
        return x, x, N * t[0] + q.N * x - S
    if region == EXTENSION_EDGE:
        r, g = (1.0, q.N, q.N), (1.0, q.M, q.M)
        x = (M * (e2 + e3) - 2.0 * (S * (nu - q.M * (1.0 - nu)) - q.S * M * (1.0 - nu)) / E - t[0] * (
            edge_compliance(q, (0.0, N, N), g) + edge_compliance(q, r, (0.0, M, M)))
             ) / edge_compliance(q, r, g)
        return x, N * t[0] + q.N * x - S, N * t[0] + q.N * x - S
    if region == TENSION:
        return T, T * nu / (1.0 - nu), T * nu / (1.0 - nu)
    if region == TENSION_EDGE:
        return T, T, 2.0 * nu * T
    if region == SHEAR_TENSION:
        return T, nu * (T + low), low
    if region == OPEN:
        return T, T, T
    return T, T if t[1] == t[0] else low, low


SOFTENS = Softens(params, steepest, loss, weakened, by_strain, return_map, moduli)
