"""Soil that loses strength as it shears: from a peak to a residual strength, over a stated slip of its bands.

The coefficients of the yield surface and of the flow (N, M, S; eta, etab, xi) fall in a straight line with
the plastic shear strain, so that at any confinement the strength does,

    N(k) = N_peak - (N_peak - N_residual) min(k / k_full, 1),    k = accumulated plastic strain,
    k_full = strain / sqrt(3) length / cell,

the tension borne being at most that of the apex of now. k is ``plastic_strain``, the integral of sqrt(2/3
dev(d) : dev(d)): in simple shear sqrt(3) k is the plastic slide gamma, in which ``strain`` is given. (Linear
softening of strength with plastic strain: de Souza Neto, Perić & Owen, Computational Methods for Plasticity,
sections 6.4.3 and 6.5; in slides of soil Zabala & Alonso 2011, doi 10.1680/geot.9.P.134.)

Softening soil fails in a band that is as narrow as the grid allows: one cell. What is a property of the soil
is the slip of a band, strain times length, at which its strength is residual; the law takes it up in the
width of a ``cell``, and so dissipates the same in a band on every grid (crack band: Bažant & Oh 1983, doi
10.1007/BF02486267).

A return with the strength of the end of the step: k is the root of

    k_old + increment(strain, strength(k)) - k = 0,

which lies between k_old and that for the residual strength; Newton's method within these bounds finds it.
"""
import math
from typing import Callable, NamedTuple, Optional

from .hencky import hencky_law
from .law import Law
from .plastic_state import ELASTIC
from .viscosity import with_viscosity

# Parts of the law, which ``bound`` fixes; those that follow call those before.
weakened = soil_return = soil_moduli = by_strain = increment = after = None


class Softens(NamedTuple):
    """What a law needs to soften: its parameters as they fall, ``params(peak, residual, full)``; the strength
    [Pa] that may go per plastic strain, ``steepest(peak, residual)``, and that goes in all, ``loss(peak,
    residual)``; and kernels: ``weakened(p, k)``, the parameters of the perfectly plastic law at the plastic
    strain k, ``by_strain(p, q, t, region, e1, e2, e3)``, the derivatives of its stresses t by k at fixed
    trial strains, q being ``weakened``, and ``return_map`` and ``moduli`` of the perfectly plastic law."""

    params: Callable
    steepest: Callable
    loss: Callable
    weakened: Callable
    by_strain: Callable
    return_map: Callable
    moduli: Callable


def increment(p, t, e1, e2, e3):  # noqa: F811
    """Plastic strain of the step that ends with the stresses t, and the deviator of the plastic flow: none
    where round-off is all there is, as in soil that opens."""
    f1, f2, f3 = e1 - 0.5 * t[0] / p.mu, e2 - 0.5 * t[1] / p.mu, e3 - 0.5 * t[2] / p.mu
    mean = (f1 + f2 + f3) / 3.0
    f1, f2, f3 = f1 - mean, f2 - mean, f3 - mean
    grown = math.sqrt(2.0 / 3.0 * (f1 * f1 + f2 * f2 + f3 * f3))
    if grown <= 1e-13 * (abs(e1) + abs(e2) + abs(e3)):
        return 0.0, 0.0, 0.0, 0.0
    return grown, f1, f2, f3


def after(p, before, dt, e1, e2, e3):  # noqa: F811
    """Plastic strain at the end of the step."""
    if not before < p.full:
        return before
    if soil_return(weakened(p, before), before, dt, e1, e2, e3)[3] == ELASTIC:
        return before
    most = before + increment(p, soil_return(weakened(p, p.full), before, dt, e1, e2, e3), e1, e2, e3)[0]
    if not most < p.full:
        return most
    k, low, high = before, before, p.full
    for _ in range(60):
        q = weakened(p, k)
        t1, t2, t3, region = soil_return(q, before, dt, e1, e2, e3)
        grown, f1, f2, f3 = increment(p, (t1, t2, t3), e1, e2, e3)
        gap = before + grown - k
        if gap > 0.0:
            low = k
        else:
            high = k
        d1, d2, d3 = by_strain(p, q, (t1, t2, t3), region, e1, e2, e3)
        slope = -1.0
        if grown > 0.0:
            slope -= (f1 * d1 + f2 * d2 + f3 * d3) / (3.0 * p.mu * grown)
        to = k - gap / slope
        if not low <= to <= high:
            to = 0.5 * (low + high)
        change, k = abs(to - k), to
        if change <= 1e-9 * grown:  # converging quadratically, it is exact then
            break
    return k


def return_map(p, hardening, dt, e1, e2, e3):
    """Kirchhoff stresses [Pa] and region of the trial strains e1 >= e2 >= e3, see ``hencky``."""
    return soil_return(weakened(p, after(p, hardening, dt, e1, e2, e3)), hardening, dt, e1, e2, e3)


def moduli(p, hardening, dt, e1, e2, e3, region):
    """Derivatives of the stresses by the trial strains [Pa], see ``hencky``: those at the strength of now,
    D, and what is lost with the plastic strain,

        D + dt/dk dk/de,    dk/de = 2/3 f (1 - D / 2 mu) / (increment + f . dt/dk / 3 mu),

    f being the deviator of the plastic flow."""
    k = after(p, hardening, dt, e1, e2, e3)
    q = weakened(p, k)
    rows = soil_moduli(q, hardening, dt, e1, e2, e3, region)
    if region == ELASTIC or not k < p.full:
        return rows
    t1, t2, t3, _ = soil_return(q, hardening, dt, e1, e2, e3)
    grown, f1, f2, f3 = increment(p, (t1, t2, t3), e1, e2, e3)
    d1, d2, d3 = by_strain(p, q, (t1, t2, t3), region, e1, e2, e3)
    whole = 1.5 * grown + 0.5 * (f1 * d1 + f2 * d2 + f3 * d3) / p.mu
    if whole == 0.0:
        return rows
    half = 0.5 / p.mu
    g1 = (f1 - half * (f1 * rows[0][0] + f2 * rows[1][0] + f3 * rows[2][0])) / whole
    g2 = (f2 - half * (f1 * rows[0][1] + f2 * rows[1][1] + f3 * rows[2][1])) / whole
    g3 = (f3 - half * (f1 * rows[0][2] + f2 * rows[1][2] + f3 * rows[2][2])) / whole
    return ((rows[0][0] + d1 * g1, rows[0][1] + d1 * g2, rows[0][2] + d1 * g3),
            (rows[1][0] + d2 * g1, rows[1][1] + d2 * g2, rows[1][2] + d2 * g3),
            (rows[2][0] + d3 * g1, rows[2][1] + d3 * g2, rows[2][2] + d3 * g3))


def full_strain(strain: float, length: float, cell: float) -> float:
    """Plastic strain at which the strength is residual, see above."""
    return strain / math.sqrt(3.0) * length / cell


def softening_law(peak: Law, residual: Law, strain: float, length: float, cell: Optional[float],
                  softens: Softens) -> Law:
    """See ``softened``; ``peak`` and ``residual`` go together, and have their viscosity in their parameters.
    ValueError where strength goes faster than the soil unloads in cells of that size."""
    full = full_strain(strain, length, cell or length)
    steepest = softens.steepest(peak.params, residual.params)
    loss = softens.loss(peak.params, residual.params)
    if cell and loss > steepest * full:
        raise ValueError(
            f"cell is {cell:.6g} m: within bands so wide the strength falls by {loss:.4g} Pa over a plastic "
            f"strain of {full:.4g}, faster than the soil unloads; give cells of less than "
            f"{cell * steepest * full / loss:.4g} m, or more softening strain or length")
    own = {"weakened": softens.weakened, "soil_return": softens.return_map, "soil_moduli": softens.moduli,
           "by_strain": softens.by_strain, "increment": increment, "after": after}
    params = softens.params(peak.params, residual.params, full)
    return with_viscosity(hencky_law(f"softening_{peak.name}", params, return_map, moduli, False, own))
