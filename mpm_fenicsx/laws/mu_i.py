"""Dense granular flow: a Drucker–Prager cone whose friction grows with the rate of shear, mu(I).

With q = sqrt(J2), pressure P and rate of shear g = sqrt(2 dev(d) : dev(d)) of plastic flow along dev(tau),

    q <= mu(I) P,    mu(I) = mu_s + (mu_2 - mu_s) / (1 + I_0 / I),    I = g d / sqrt(P / rho_s)

(Jop, Forterre & Pouliquen, A constitutive law for dense granular flows, Nature 441, 2006, doi
10.1038/nature04801, eq. 1–3), d and rho_s being diameter and density of the grains. Below mu_s P the soil is
elastic; it keeps its volume as it flows; where P would become negative it separates, see ``hencky``.

A step of length dt in which the deviator shrinks by the slip s = g dt, q = q_trial - mu s at an unchanged P,
makes the condition a quadratic equation: with r = I / s = d sqrt(rho_s / P) / dt and the excess c = q_trial -
mu_s P,

    mu r s^2 + (mu I_0 + ((mu_2 - mu_s) P - c) r) s - c I_0 = 0,

whose one positive root is the return: exact, without iteration. Infinitely slow, r = 0, it is the return to
the cone of mu_s.
"""
import math
from typing import NamedTuple

import mpm_dem_checks as check

from ..compiled import called
from .hencky import hencky_law
from .law import Law, lame
from .plastic_parts import deviatoric_moduli, trial
from .plastic_state import ELASTIC, OPEN

FLOW = 2


class Params(NamedTuple):
    """Lamé parameters [Pa]; friction at rest and of fast flow, and the inertial number between [-]; diameter
    of the grains times the root of their density [kg^(1/2) m^(-1/2)]."""

    lam: float
    mu: float
    mu_s: float
    mu_2: float
    I_0: float
    grain: float


@called
def _slip(p, dt, q, pressure):
    """Slip of the step and inertial number, where q > mu_s pressure > 0; none in no time."""
    if dt == 0.0:
        return 0.0, 0.0
    per_slip = p.grain / (math.sqrt(pressure) * dt)
    excess = q - p.mu_s * pressure
    half = 0.5 * (p.mu * p.I_0 + ((p.mu_2 - p.mu_s) * pressure - excess) * per_slip)
    root = math.sqrt(half * half + p.mu * per_slip * excess * p.I_0)
    slip = excess * p.I_0 / (root + half) if half >= 0.0 else (root - half) / (p.mu * per_slip)
    return slip, per_slip * slip


def return_map(p, hardening, dt, e1, e2, e3):
    """Kirchhoff stresses [Pa] and region of the trial strains e1 >= e2 >= e3, see ``hencky``."""
    mean, q, stress = trial(p, e1, e2, e3)
    pressure = -stress
    if pressure <= 0.0:
        return 0.0, 0.0, 0.0, OPEN if pressure < 0.0 or q > 0.0 else ELASTIC
    left, region = 1.0, ELASTIC
    if not q <= p.mu_s * pressure:
        left, region = 1.0 - p.mu * _slip(p, dt, q, pressure)[0] / q, FLOW
    scale = 2.0 * p.mu * left
    return (scale * (e1 - mean) - pressure, scale * (e2 - mean) - pressure, scale * (e3 - mean) - pressure,
            region)


def moduli(p, hardening, dt, e1, e2, e3, region):
    """Derivatives of the stresses by the trial strains [Pa], see ``hencky``."""
    bulk, mu2 = p.lam + 2.0 / 3.0 * p.mu, 2.0 * p.mu
    if region == OPEN:
        return (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    _, q, stress = trial(p, e1, e2, e3)
    pressure = -stress
    if region == ELASTIC or dt == 0.0:
        return deviatoric_moduli(e1, e2, e3, bulk, 0.0, 0.0, mu2, mu2)
    slip, inertial = _slip(p, dt, q, pressure)
    friction = p.mu_s + (p.mu_2 - p.mu_s) * inertial / (p.I_0 + inertial)
    slope = (p.mu_2 - p.mu_s) * p.I_0 / (p.I_0 + inertial) ** 2  # of mu(I)
    rise = slope * pressure * p.grain / (math.sqrt(pressure) * dt)  # of mu(I) P with the slip
    by_pressure = p.mu / (p.mu + rise) * (friction - 0.5 * slope * inertial)
    return deviatoric_moduli(e1, e2, e3, bulk, 0.0, -math.sqrt(2.0) * bulk * by_pressure,
                             mu2 * (1.0 - p.mu * slip / q), mu2 * rise / (p.mu + rise))


def mu_i(E: float, nu: float, mu_s: float, mu_2: float, I_0: float, grain_diameter: float,
         grain_density: float) -> Law:
    """Granular flow with Young's modulus E [Pa] and Poisson's ratio nu of the soil, the friction coefficients
    at rest mu_s and of fast flow mu_2, the inertial number I_0 half-way between, and diameter [m] and density
    [kg/m^3] of its grains. Raises ValueError for impossible values.

    Glass beads, of the article:

    >>> law = mu_i(E=1e6, nu=0.3, mu_s=0.382, mu_2=0.644, I_0=0.279, grain_diameter=0.53e-3,
    ...            grain_density=2450.0)
    >>> round(law.params.grain, 4), law.symmetric  # it rubs and does not dilate
    (0.0262, False)
    """
    check.positive("mu_s", mu_s)
    check.finite("mu_2", mu_2)
    if not mu_2 >= mu_s:
        raise ValueError(f"mu_2 is {mu_2}: friction grows with the rate, give at least mu_s, {mu_s}")
    check.positive("I_0", I_0)
    check.positive("grain_diameter", grain_diameter, "m")
    check.positive("grain_density", grain_density, "kg/m^3")
    return hencky_law("mu_i", Params(*lame(E, nu), float(mu_s), float(mu_2), float(I_0),
                                     grain_diameter * math.sqrt(grain_density)), return_map, moduli, False)
