"""How Drucker–Prager's cone softens, see ``softening``."""
import math
from typing import NamedTuple

from ..compiled import called
from .drucker_prager import CONE, OPEN, moduli, return_map, trial
from .drucker_prager import Params as Cone
from .softening import Softens


class Params(NamedTuple):
    """Those of ``drucker_prager`` at the peak; how much eta, etab, xi [Pa] and the cut-off T [Pa] lose per
    plastic strain; the plastic strain at which the strength is residual."""

    lam: float
    mu: float
    eta: float
    etab: float
    xi: float
    T: float
    q_cut: float
    viscosity: float
    eta_falls: float
    etab_falls: float
    xi_falls: float
    T_falls: float
    full: float


def params(peak: Cone, residual: Cone, full: float) -> Params:
    """Of the softening soil. Where the residual soil bears tension up to its apex, the cut-off stays."""
    falls = [(one - other) / full for one, other in zip(peak[2:5], residual[2:5])]
    cut_off = residual.q_cut > 0.0 and residual.T < peak.T
    return Params(*peak, *falls, (peak.T - residual.T) / full if cut_off else 0.0, full)


def steepest(peak: Cone, residual: Cone) -> float:
    """Loss of xi per plastic strain [Pa] at which the soil unloads."""
    bulk = peak.lam + 2.0 / 3.0 * peak.mu
    return math.sqrt(3.0) * (peak.mu + bulk * residual.eta * residual.etab)


def loss(peak: Cone, residual: Cone) -> float:
    """Of xi [Pa]."""
    return peak.xi - residual.xi


def weakened(p, k):
    """The cone at the plastic strain k."""
    k = min(k, p.full)
    eta, etab = p.eta - k * p.eta_falls, p.etab - k * p.etab_falls
    xi, T = p.xi - k * p.xi_falls, p.T - k * p.T_falls
    apex = xi / eta if eta > 0.0 else math.inf
    if apex > T:
        return Cone(p.lam, p.mu, eta, etab, xi, T, xi - eta * T, p.viscosity)
    return Cone(p.lam, p.mu, eta, etab, xi, apex, 0.0, p.viscosity)


@called
def _apart(p, q):
    """Derivatives of the cut-off and of q there."""
    if q.q_cut > 0.0:
        return -p.T_falls, -p.xi_falls + p.eta_falls * q.T + q.eta * p.T_falls
    return (-p.xi_falls + p.eta_falls * q.T) / q.eta if q.eta > 0.0 else 0.0, 0.0


def by_strain(p, q, t, region, e1, e2, e3):
    """Derivatives of the stresses t by the plastic strain, see ``Softens``."""
    mean, size, pressure = trial(p, e1, e2, e3)
    of_mean, of_size = 0.0, 0.0
    if region == OPEN:
        of_mean, of_cut = _apart(p, q)
        of_size = of_cut if size > q.q_cut else 0.0
    if region == CONE:
        bulk = p.lam + 2.0 / 3.0 * p.mu
        whole = p.mu + bulk * q.eta * q.etab
        flow = (size + q.eta * pressure - q.xi) / whole
        of_flow = (p.xi_falls - p.eta_falls * pressure
                   + flow * bulk * (p.eta_falls * q.etab + q.eta * p.etab_falls)) / whole
        of_mean, of_size = bulk * (p.etab_falls * flow - q.etab * of_flow), -p.mu * of_flow
    scale = 2.0 * p.mu * of_size / size if size > 0.0 else 0.0
    return of_mean + scale * (e1 - mean), of_mean + scale * (e2 - mean), of_mean + scale * (e3 - mean)


SOFTENS = Softens(params, steepest, loss, weakened, by_strain, return_map, moduli)
