"""Herschel–Bulkley fluid, weakly compressible; Bingham's and Newton's are members.

With tau = sqrt(J2) of the stress, which the fluids' books write so, and the rate of shear g = sqrt(2 dev(d) :
dev(d)) of flow along the deviator,

    tau = tau_y + k g^n where the fluid flows,    p = -K ln J,

k being the consistency [Pa s^n]: n = 1 is Bingham's fluid with the plastic viscosity k, tau_y = 0 besides
Newton's with the viscosity k (Herschel & Bulkley 1926; Bird, Dai & Yarusso, Rev. Chem. Eng. 1, 1983). The
yield stress is exact, without a regularised viscosity: below it, the fluid is elastic with a shear modulus G.
So it is for quick changes above: the stress follows the rate with the delay k / G. As a default G is K, and
elastic strain tau / G then as small as the change of volume p / K; in steady shear it makes a normal stress
across, 2 tau^2 / G. K is a number to choose: about 100 times the largest pressure, or rho (10 v)^2, keeps the
density within 1 %.

A step of length dt with the slip s = g dt and q = q_trial - G s is the return of viscoplasticity (Perzyna;
de Souza Neto, Perić & Owen, Computational Methods for Plasticity, section 11.5),

    G s + k (s / dt)^n = q_trial - tau_y,

in closed form for n = 1, else by Newton's method, which from its start converges from one side: the left side
is convex or concave. Beyond the tension T the fluid separates, see ``hencky``; it then still resists shear.
"""
import math
from typing import NamedTuple, Optional

import mpm_dem_checks as check

from ..compiled import called
from .hencky import hencky_law
from .law import Law
from .plastic_parts import deviatoric_moduli, trial
from .plastic_state import ELASTIC, OPEN

FLOW = 2


class Params(NamedTuple):
    """Lamé parameters [Pa], yield stress tau_y [Pa], consistency k [Pa s^n], exponent n [-], greatest mean
    tension T [Pa]."""

    lam: float
    mu: float
    Y: float
    k: float
    n: float
    T: float


@called
def _rate(p, dt, excess):
    """g [1/s] with mu dt g + k g^n = excess > 0."""
    at_most = excess if p.n > 1.0 else 0.5 * excess  # of each of the two: where Newton's method starts
    g = min(at_most / (p.mu * dt), (at_most / p.k) ** (1.0 / p.n))
    for _ in range(60):
        viscous = p.k * g**p.n
        change = (excess - p.mu * dt * g - viscous) / (p.mu * dt + p.n * viscous / g)
        g += change
        if not abs(change) > 1e-13 * g:
            break
    return g


@called
def _left(p, dt, q):
    """What is left of a trial deviator of size q, as a share, and its derivative by q times q, plus that
    share: for q, and along it."""
    excess = q - p.Y
    if dt == 0.0 or excess < 0.0 or (excess == 0.0 and p.Y > 0.0):
        return 1.0, 1.0
    if p.n == 1.0 or p.k == 0.0 or math.isinf(dt):
        rise = p.k / dt if p.n == 1.0 else 0.0  # of the viscous stress with the slip
        along = rise / (p.mu + rise)
        return (along + (1.0 - along) * p.Y / q if q > 0.0 else along), along
    if excess == 0.0:  # at rest without a yield stress: a power of the rate is infinitely steep, or flat
        return (1.0, 1.0) if p.n < 1.0 else (0.0, 0.0)
    g = _rate(p, dt, excess)
    rise = p.n * p.k * g ** (p.n - 1.0) / dt
    return 1.0 - p.mu * dt * g / q, rise / (p.mu + rise)


def return_map(p, hardening, dt, e1, e2, e3):
    """Kirchhoff stresses [Pa] and region of the trial strains e1 >= e2 >= e3, see ``hencky``."""
    mean, q, pressure = trial(p, e1, e2, e3)
    left = _left(p, dt, q)[0]
    region = ELASTIC if left == 1.0 else FLOW
    if not pressure <= p.T:
        pressure, region = p.T, OPEN
    scale = 2.0 * p.mu * left
    return (pressure + scale * (e1 - mean), pressure + scale * (e2 - mean), pressure + scale * (e3 - mean),
            region)


def moduli(p, hardening, dt, e1, e2, e3, region):
    """Derivatives of the stresses by the trial strains [Pa], see ``hencky``."""
    bulk = 0.0 if region == OPEN else p.lam + 2.0 / 3.0 * p.mu
    left, along = _left(p, dt, trial(p, e1, e2, e3)[1])
    return deviatoric_moduli(e1, e2, e3, bulk, 0.0, 0.0, 2.0 * p.mu * left, 2.0 * p.mu * along)


def herschel_bulkley(bulk_modulus: float, consistency: float, yield_stress: float = 0.0,
                     exponent: float = 1.0, shear_modulus: Optional[float] = None,
                     tension_cutoff: Optional[float] = 0.0) -> Law:
    """Fluid with bulk modulus K [Pa], consistency k [Pa s^n], yield stress in shear [Pa] and exponent n;
    shear modulus G [Pa] of what has not yielded (None: K), greatest mean tension [Pa] (None: any). Bingham's
    with exponent 1, Newton's also without yield stress. Raises ValueError for impossible values.

    >>> mud = herschel_bulkley(bulk_modulus=1e6, consistency=20.0, yield_stress=50.0, exponent=0.4)
    >>> water = herschel_bulkley(bulk_modulus=1e6, consistency=1e-3)
    >>> water.params.Y, water.params.n, water.symmetric
    (0.0, 1.0, True)
    """
    K = check.positive("bulk_modulus", bulk_modulus, "Pa")
    k = check.not_negative("consistency", consistency, "Pa s^n")
    Y = check.not_negative("yield_stress", yield_stress, "Pa")
    n = check.between("exponent", exponent, 0, 10, rule="give a number above 0 and at most 10; below 1 the "
                      "fluid thins as it is sheared", ends="(]")
    G = K if shear_modulus is None else check.positive("shear_modulus", shear_modulus, "Pa")
    T = math.inf if tension_cutoff is None else check.not_negative("tension_cutoff", tension_cutoff, "Pa")
    return hencky_law("herschel_bulkley", Params(K - 2.0 / 3.0 * G, G, Y, k, n, T), return_map, moduli)
