"""Drucker–Prager soil: a cone in place of Mohr–Coulomb's pyramid, elastic–perfectly plastic.

With q = sqrt(J2) and the mean stress p, tension positive,

    shear:    q + eta p <= xi,    plastic flow along dev(tau) / 2 q + etab / 3
    tension:  p <= T,             plastic flow along 1,             T at most the apex xi / eta

(de Souza Neto, Perić & Owen, Computational Methods for Plasticity, section 8.3). A cone meets the pyramid of
friction angle phi, dilation angle psi and cohesion c in one kind of loading only; ``match`` chooses which:

    "compression"   triaxial compression (t1 = t2): eta = 6 sin phi / (sqrt(3) (3 - sin phi)), xi = eta c cot
                    phi
    "extension"     triaxial extension (t2 = t3): 3 + sin phi in place of 3 - sin phi
    "plane_strain"  plastic flow in plane strain: etab = sin psi / sqrt(1 + sin(psi)^2 / 3),
                    eta = sin phi / (sqrt(1 - etab^2 / 3) + etab sin(phi) / 3)

and etab is eta with psi for phi. The last follows from flow without strain across the plane, dev(tau)_33 =
-2/3 etab q; for psi = phi it is the one of section 6.4.4 there. At p = T the soil separates and remembers how
far, see ``hencky``.
"""
import math
from typing import NamedTuple, Optional

import mpm_dem_checks as check

from .hencky import hencky_law
from .law import Law, lame
from .mohr_coulomb import soil_angles, tension_limit
from .plastic_parts import deviatoric_moduli, trial
from .plastic_state import ELASTIC, OPEN
from .viscosity import with_viscosity

CONE = 2


class Params(NamedTuple):
    """Lamé parameters [Pa]; slopes eta of the cone and etab of its flow; xi and the cut-off T as above [Pa];
    q at the cut-off [Pa], 0 at the apex; viscosity [Pa s]."""

    lam: float
    mu: float
    eta: float
    etab: float
    xi: float
    T: float
    q_cut: float
    viscosity: float


def return_map(p, hardening, dt, e1, e2, e3):
    """Kirchhoff stresses [Pa] and region of the trial strains e1 >= e2 >= e3, see ``hencky``."""
    mean, q, pressure = trial(p, e1, e2, e3)
    excess = q + p.eta * pressure - p.xi
    q_new, p_new, region = q, pressure, ELASTIC
    if not excess <= 0.0:
        bulk = p.lam + 2.0 / 3.0 * p.mu
        flow = excess / (p.mu + bulk * p.eta * p.etab)
        q_new, p_new, region = q - p.mu * flow, pressure - bulk * p.etab * flow, CONE
    if p_new > p.T:
        q_new, p_new, region = min(q, p.q_cut), p.T, OPEN
    scale = 2.0 * p.mu * (q_new / q if q > 0.0 else 1.0)
    return p_new + scale * (e1 - mean), p_new + scale * (e2 - mean), p_new + scale * (e3 - mean), region


def moduli(p, hardening, dt, e1, e2, e3, region):
    """Derivatives of the stresses by the trial strains [Pa], see ``hencky``."""
    _, q, _ = trial(p, e1, e2, e3)
    mu2, bulk = 2.0 * p.mu, p.lam + 2.0 / 3.0 * p.mu
    if region == ELASTIC:
        return deviatoric_moduli(e1, e2, e3, bulk, 0.0, 0.0, mu2, mu2)
    if region == OPEN:
        if q <= p.q_cut:
            return deviatoric_moduli(e1, e2, e3, 0.0, 0.0, 0.0, mu2, mu2)
        return deviatoric_moduli(e1, e2, e3, 0.0, 0.0, 0.0, mu2 * p.q_cut / q, 0.0)
    whole = p.mu + bulk * p.eta * p.etab
    left = 1.0 - p.mu * (q + p.eta * bulk * (e1 + e2 + e3) - p.xi) / (whole * q)
    coupling = math.sqrt(2.0) * p.mu * bulk / whole
    return deviatoric_moduli(e1, e2, e3, bulk * p.mu / whole, -coupling * p.etab, -coupling * p.eta,
                             mu2 * left, mu2 * (1.0 - p.mu / whole))


def _slope(sine, match, etab=0.0):
    """eta / sin of the angle with that sine, see the table above; it has a limit where both vanish."""
    if match == "plane_strain":
        return 1.0 / (math.sqrt(1.0 - etab * etab / 3.0) + etab * sine / 3.0)
    return 6.0 / (math.sqrt(3.0) * (3.0 - sine if match == "compression" else 3.0 + sine))


def drucker_prager(E: float, nu: float, friction_angle: float, dilation_angle: float = 0.0,
                   cohesion: float = 0.0, tension_cutoff: Optional[float] = None,
                   match: str = "compression", viscosity: float = 0.0) -> Law:
    """Drucker–Prager soil with Young's modulus E [Pa], Poisson's ratio nu, friction and dilation angle
    [degrees], cohesion and greatest mean tension [Pa] (None: up to the apex c cot phi); ``match`` as above;
    ``viscosity`` [Pa s], see there. Raises ValueError for impossible values.

    >>> law = drucker_prager(E=50e6, nu=0.3, friction_angle=30.0, cohesion=1e3)
    >>> round(law.params.eta, 4), round(law.params.xi), law.symmetric  # it dilates less than it rubs
    (0.6928, 1200, False)
    """
    friction, dilation = soil_angles(friction_angle, dilation_angle, cohesion)
    check.choice("match", match, ("compression", "extension", "plane_strain"))
    if match == "plane_strain":
        etab = dilation / math.sqrt(1.0 + dilation**2 / 3.0)
    else:
        etab = dilation * _slope(dilation, match)
    slope = _slope(friction, match, etab)
    eta, xi = slope * friction, slope * cohesion * math.sqrt(1.0 - friction**2)
    apex = xi / eta if eta > 0.0 else math.inf
    T = tension_limit(tension_cutoff, apex)
    q_cut = 0.0 if apex == T else xi - eta * T
    return with_viscosity(hencky_law(
        "drucker_prager", Params(*lame(E, nu), eta, etab, xi, T, q_cut, viscosity), return_map, moduli,
        friction == dilation))
