"""Von Mises metal with linear isotropic hardening.

    sqrt(3 J2) <= Y + H alpha,    plastic flow along dev(tau)

in Kirchhoff stress, alpha the accumulated equivalent plastic strain. The return shrinks the trial deviator
(de Souza Neto, Perić & Owen, Computational Methods for Plasticity, section 7.3):

    dalpha = (q - Y - H alpha) / (3 mu + H),    dev(tau) = (1 - 3 mu dalpha / q) dev(trial)

with q = sqrt(3 J2) of the trial stress.
"""
import math
from typing import NamedTuple

import mpm_dem_checks as check

from ..compiled import called
from .hencky import hencky_law
from .law import Law, lame
from .plastic_parts import deviatoric_moduli
from .plastic_state import ELASTIC
from .viscosity import with_viscosity

FLOW = 2


class Params(NamedTuple):
    """Lamé parameters, yield stress Y in uniaxial stress and hardening modulus H [Pa]; viscosity [Pa s]."""

    lam: float
    mu: float
    Y: float
    H: float
    viscosity: float


@called
def _left(p, hardening, e1, e2, e3):
    """The share of the trial deviator that is left after the return; 1 in the elastic range."""
    mean = (e1 + e2 + e3) / 3.0
    q = p.mu * math.sqrt(6.0 * ((e1 - mean) ** 2 + (e2 - mean) ** 2 + (e3 - mean) ** 2))
    excess = q - p.Y - p.H * hardening
    return 1.0 if excess <= 0.0 else 1.0 - 3.0 * p.mu * excess / ((3.0 * p.mu + p.H) * q)


def return_map(p, hardening, dt, e1, e2, e3):
    """Kirchhoff stresses [Pa] and region of the trial strains e1 >= e2 >= e3, see ``hencky``."""
    mean, left = (e1 + e2 + e3) / 3.0, _left(p, hardening, e1, e2, e3)
    pressure, scale = (3.0 * p.lam + 2.0 * p.mu) * mean, 2.0 * p.mu * left
    return (pressure + scale * (e1 - mean), pressure + scale * (e2 - mean), pressure + scale * (e3 - mean),
            ELASTIC if left == 1.0 else FLOW)


def moduli(p, hardening, dt, e1, e2, e3, region):
    """Derivatives of the stresses by the trial strains [Pa], see ``hencky``."""
    bulk, left = p.lam + 2.0 / 3.0 * p.mu, _left(p, hardening, e1, e2, e3)
    along = 1.0 if region == ELASTIC else p.H / (3.0 * p.mu + p.H)
    return deviatoric_moduli(e1, e2, e3, bulk, 0.0, 0.0, 2.0 * p.mu * left, 2.0 * p.mu * along)


def von_mises(E: float, nu: float, yield_stress: float, hardening: float = 0.0,
              viscosity: float = 0.0) -> Law:
    """Von Mises law with Young's modulus E [Pa], Poisson's ratio nu, yield stress in uniaxial stress and
    hardening modulus (stress per plastic strain) [Pa]; ``viscosity`` [Pa s], see there. Raises ValueError for
    impossible values.

    >>> law = von_mises(E=210e9, nu=0.3, yield_stress=235e6)
    >>> law.state.names
    ('plastic', 'plastic_strain', 'opened', 'plastic_work', 'kirchhoff_stress')
    """
    yield_stress = check.positive("yield_stress", yield_stress, "Pa")
    hardening = check.not_negative("hardening", hardening, "Pa",
                                   "give 0 or a positive number; softening needs a length scale")
    return with_viscosity(hencky_law("von_mises", Params(*lame(E, nu), yield_stress, hardening, viscosity),
                                     return_map, moduli))
