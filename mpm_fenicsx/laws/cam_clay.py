"""Modified Cam clay at finite strain: a soil that hardens as it is compacted, to its critical state.

With the pressure P = -tr(tau) / 3 and q = sqrt(3 J2) of Kirchhoff's stress, the strains of volume positive in
compression,

    yield:       q^2 / M^2 + P (P - P_c) <= 0,      plastic flow along its normal
    hardening:   P_c = P_c0 exp(compaction / (lambda* - kappa*)),      the compaction being plastic
    elasticity:  P = P_r (exp(elastic strain of volume / kappa*) - 1),      constant shear modulus G

(Roscoe & Burland 1968; in logarithmic strains Borja & Tamagnini 1998, doi 10.1016/S0045-7825(97)00141-2;
de Souza Neto, Perić & Owen, Computational Methods for Plasticity, section 10.1). Lambda* and kappa* are the
slopes of ln V over ln P in first compression and in swelling (Butterfield 1979). The reference pressure P_r
gives clay that nothing presses a stiffness, P_r / kappa*, so that it starts without stress; far above it the
bulk modulus is P / kappa*. At the critical state, P = P_c / 2 and q = M P, it flows without change of volume.
Clay that is pulled apart loses its P_c, and has it back when it has been compacted as much again.

The return of a step, with x its compaction, h = 2 P - P_c and the multiplier g,

    x = g h,    q (1 + 6 G g / M^2) = q_trial,    q^2 / M^2 = P (P_c - P),

is one equation for x between 0 and the compaction that leads to h = 0, at which its two ends have different
signs: Newton's method within these bounds always finds it. Mostly it does so from no compaction on without
them, which need a root of their own; so of several solutions, as clay has that is dry of critical and loses
strength faster than it unloads, it finds the one next to the state before.
"""
import math
from typing import NamedTuple

import numpy as np

import mpm_dem_checks as check

from ..compiled import called
from .hencky import hencky_law
from .law import Law
from .plastic_parts import deviatoric_moduli
from .plastic_state import ELASTIC, STATE

FLOW = 2
CLAY_STATE = np.dtype([*((name, STATE[name]) for name in STATE.names or ()),
                       ("compaction", np.float64)])  # plastic strain of volume, positive in compression


class Params(NamedTuple):
    """Slope M of the critical state [-]; lambda* - kappa* and kappa* [-]; shear modulus [Pa]; P_r and P_c0
    [Pa]."""

    M: float
    hardening: float
    kappa: float
    mu: float
    P_r: float
    P_c0: float


D = 2  # fixed by specialise
principal_axes = None


@called
def _trial(p, e1, e2, e3):
    """Elastic strain of volume and q of the trial state."""
    mean = (e1 + e2 + e3) / 3.0
    return -3.0 * mean, p.mu * math.sqrt(6.0 * ((e1 - mean) ** 2 + (e2 - mean) ** 2 + (e3 - mean) ** 2))


@called
def _pressure(p, elastic):
    return p.P_r * math.expm1(elastic / p.kappa)


@called
def _critical(p, P_c, volume):
    """Compaction x at which 2 P(volume - x) = P_c exp(x / hardening), by Newton's method for y = ln P: y +
    share ln(1 + P / P_r) grows with slopes between 1 and 1 + share and is convex."""
    share = p.kappa / p.hardening
    goal = math.log(0.5 * P_c) + volume / p.hardening
    y = goal if goal < math.log(p.P_r) else (goal + share * math.log(p.P_r)) / (1.0 + share)
    for _ in range(50):
        ratio = math.exp(y) / p.P_r
        change = (goal - y - share * math.log1p(ratio)) / (1.0 + share * ratio / (1.0 + ratio))
        y += change
        if not abs(change) > 1e-14 * (1.0 + abs(y)):
            break
    return volume - p.kappa * math.log1p(math.exp(y) / p.P_r)


@called
def _excess(p, P_c, volume, q, x):
    """q^2 / M^2 + P (P - P_c) after the compaction x, its derivative, and about how far h = 0 is from x."""
    P, now = _pressure(p, volume - x), P_c * math.exp(x / p.hardening)
    stiff, harder, h = (P + p.P_r) / p.kappa, now / p.hardening, 2.0 * P - now
    a = 6.0 * p.mu / (p.M * p.M)
    turn = h + a * x  # q = q_trial h / turn
    falls = -2.0 * stiff - harder  # of h
    if turn == 0.0:
        return P * (P - now), -1.0, 0.0
    left = q * h / turn
    slope = q * a * (falls * x - h) / (turn * turn)
    return (left * left / (p.M * p.M) + P * (P - now),
            2.0 * left * slope / (p.M * p.M) - h * stiff - P * harder, -h / falls)


@called
def _nearby(p, P_c, volume, q):
    """Compaction of the step by Newton's method from none on; NaN where that is beyond the critical state,
    or does not converge at once."""
    x, last, side = 0.0, math.inf, 0.0
    for _ in range(8):
        value, slope, to_critical = _excess(p, P_c, volume, q, x)
        if side == 0.0:
            side = to_critical
        step = value / slope
        if not (to_critical * side > 0.0 and abs(step) <= 0.5 * last and (x - step) * side > 0.0):
            return math.nan
        x, last = x - step, abs(step)
        if last <= 1e-8 * min(abs(x), abs(to_critical)):  # converging quadratically, it is exact then
            return x
    return math.nan


@called
def _flow(p, P_c, volume, q):
    """Compaction of the step."""
    near = _nearby(p, P_c, volume, q)
    if near == near:
        return near
    full = _critical(p, P_c, volume)
    low, high, share, last = 0.0, 1.0, 0.5, 1.0
    for _ in range(100):
        value, slope, _ = _excess(p, P_c, volume, q, share * full)
        if value > 0.0:
            low = share
        else:
            high = share
        step = value / (slope * full) if slope * full != 0.0 else 2.0
        size = min(share, 1.0 - share)
        if low <= share - step <= high and abs(step) <= 0.5 * last:  # else it creeps along an exponential
            share, last = share - step, abs(step)
            if abs(step) <= 1e-8 * size:  # converging quadratically, it is exact then
                break
        else:
            share, last = 0.5 * (low + high), high - low
            if high - low <= 1e-16:
                break
    return share * full


@called
def _state(p, P_c, volume, q):
    """P, q, P_c and multiplier g after the return of a trial state beyond the yield surface."""
    x = _flow(p, P_c, volume, q)
    P, now = _pressure(p, volume - x), P_c * math.exp(x / p.hardening)
    h, a = 2.0 * P - now, 6.0 * p.mu / (p.M * p.M)
    if abs(h) > 0.5 * now:
        g = x / h
        return P, q / (1.0 + a * g), now, g
    left = min(p.M * math.sqrt(max(P * (now - P), 0.0)), q)  # where x / h is 0 / 0
    return P, left, now, (q / left - 1.0) / a


@called
def _yields(p, P_c, volume, q):
    P = _pressure(p, volume)
    return not q * q / (p.M * p.M) + P * (P - P_c) <= 0.0


def return_map(p, hardening, dt, e1, e2, e3):
    """Kirchhoff stresses [Pa] and region of the trial strains e1 >= e2 >= e3, see ``hencky``."""
    volume, q = _trial(p, e1, e2, e3)
    P_c, mean = p.P_c0 * math.exp(hardening / p.hardening), -volume / 3.0
    P, scale, region = _pressure(p, volume), 2.0 * p.mu, ELASTIC
    if _yields(p, P_c, volume, q):
        P, left, _, _ = _state(p, P_c, volume, q)
        scale, region = scale * (left / q if q > 0.0 else 1.0), FLOW
    return scale * (e1 - mean) - P, scale * (e2 - mean) - P, scale * (e3 - mean) - P, region


def moduli(p, hardening, dt, e1, e2, e3, region):
    """Derivatives of the stresses by the trial strains [Pa], see ``hencky``."""
    volume, q = _trial(p, e1, e2, e3)
    if region == ELASTIC:
        bulk = (_pressure(p, volume) + p.P_r) / p.kappa
        return deviatoric_moduli(e1, e2, e3, bulk, 0.0, 0.0, 2.0 * p.mu, 2.0 * p.mu)
    P, left, P_c, g = _state(p, p.P_c0 * math.exp(hardening / p.hardening), volume, q)
    bulk, harder, h, a = (P + p.P_r) / p.kappa, P_c / p.hardening, 2.0 * P - P_c, 6.0 * p.mu / (p.M * p.M)
    whole, square = 1.0 + a * g, 2.0 * left / (p.M * p.M)
    # of x - g h = 0 and of the yield condition, by x and g: rows (xx, -h), (-fall, -grow)
    xx, fall, grow = 1.0 + g * (2.0 * bulk + harder), h * bulk + P * harder, square * left * a / whole
    det = -xx * grow - h * fall
    right1, right2, pull = 2.0 * g * bulk, -h * bulk, -square / whole  # by volume, by volume, by q
    x_volume, x_q = (-right1 * grow + h * right2) / det, h * pull / det
    g_volume, g_q = (xx * right2 + fall * right1) / det, xx * pull / det
    P_volume, P_q = bulk * (1.0 - x_volume), -bulk * x_q
    q_volume, q_q = -left * a / whole * g_volume, 1.0 / whole - left * a / whole * g_q
    across = 2.0 * p.mu * (left / q if q > 0.0 else 1.0 / whole)
    return deviatoric_moduli(e1, e2, e3, P_volume, -math.sqrt(6.0) * p.mu * P_q,
                             -math.sqrt(2.0 / 3.0) * q_volume, across, 2.0 * p.mu * q_q)


def hardening_of(old):
    """The compaction so far."""
    return old.compaction


def keep_hardening(old, new, volume):
    """Compaction is plastic strain of volume, positive in compression."""
    new.compaction = old.compaction - volume


def elastic_strains(p, t):
    """Of the stresses t."""
    mean = (t[0] + t[1] + t[2]) / 3.0
    third = -p.kappa * math.log1p(-mean / p.P_r) / 3.0
    return (t[0] - mean) / (2.0 * p.mu) + third, (t[1] - mean) / (2.0 * p.mu) + third, (t[2] - mean) / (
        2.0 * p.mu) + third


def energy(p, F, F33, old):
    """P_r (kappa* (exp(v / kappa*) - 1) - v) + G e:e of the state at the end of a step, with the elastic
    strain of volume v and deviator e."""
    squares = principal_axes(F, F33, old.plastic)[0]
    e1, e2, e3 = (0.5 * math.log(squares[0]), 0.5 * math.log(squares[1]), 0.5 * math.log(squares[2]))
    volume, q = _trial(p, e1, e2, e3)
    return p.kappa * _pressure(p, volume) - p.P_r * volume + q * q / (6.0 * p.mu)


def cam_clay(friction_angle: float, compression: float, swelling: float, shear_modulus: float,
             preconsolidation: float, reference_pressure: float = 1e3) -> Law:
    """Clay with the friction angle of its critical state in triaxial compression [degrees], compression and
    swelling index lambda* and kappa* of ln V over ln P [-], shear modulus, preconsolidation pressure P_c0 at
    the start and reference pressure P_r [Pa]. Raises ValueError for impossible values.

    >>> law = cam_clay(friction_angle=25.0, compression=0.1, swelling=0.02, shear_modulus=2e6,
    ...                preconsolidation=1e5)
    >>> round(law.params.M, 4), law.state.names[-1]
    (0.9838, 'compaction')
    """
    sine = math.sin(math.radians(check.between("friction_angle", friction_angle, 0, 90, "degrees",
                                               "give more than 0 and less than 90", "()")))
    kappa = check.between("swelling", swelling, 1e-5, 1, rule="give a number from 1e-5 to 1")
    lam = check.between("compression", compression, kappa, 2, rule="give more than the swelling index, "
                        f"{swelling}, and at most 2", ends="(]")
    params = Params(6.0 * sine / (3.0 - sine), lam - kappa, kappa,
                    check.positive("shear_modulus", shear_modulus, "Pa"),
                    check.positive("reference_pressure", reference_pressure, "Pa"),
                    check.positive("preconsolidation", preconsolidation, "Pa"))
    own = {"hardening_of": hardening_of, "elastic_strains": elastic_strains, "keep_hardening": keep_hardening}
    law = hencky_law("cam_clay", params, return_map, moduli, False, own)
    return law._replace(state=CLAY_STATE, energy=energy)
