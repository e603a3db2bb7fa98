"""``check_law``: what it says of the laws of the package, and of laws with one flaw each."""
from typing import NamedTuple

import numpy as np
import pytest

from mpm_fenicsx import LAWS, check_law, drucker_prager, herschel_bulkley, mohr_coulomb, softened, von_mises
from mpm_fenicsx.laws import ELASTIC_STATE, Law
from tests.mpm.kelvin_voigt import kelvin_voigt

SOIL = dict(E=5e7, nu=0.3, friction_angle=30.0, dilation_angle=5.0, cohesion=1e3)
# Of each law of the package, so that it flows at the strains that are tested.
PARAMETERS = {"linear": dict(E=5e7, nu=0.3), "neo_hooke": dict(E=5e7, nu=0.3), "mohr_coulomb": SOIL,
              "drucker_prager": SOIL, "von_mises": dict(E=5e7, nu=0.3, yield_stress=1e5),
              "mu_i": dict(E=5e7, nu=0.3, mu_s=0.4, mu_2=0.65, I_0=0.28, grain_diameter=5e-4,
                           grain_density=2450.0),
              "cam_clay": dict(friction_angle=25.0, compression=0.1, swelling=0.02, shear_modulus=2e6,
                               preconsolidation=1e5),
              "herschel_bulkley": dict(bulk_modulus=1e6, consistency=20.0, yield_stress=50.0, exponent=0.4)}
OTHERS = {"no cohesion": mohr_coulomb(5e7, 0.3, 30.0), "cone": drucker_prager(5e7, 0.3, 30.0, 30.0),
          "cut": mohr_coulomb(5e7, 0.2, 30.0, 5.0, 1e4, tension_cutoff=1e3),
          "cut cone": drucker_prager(5e7, 0.2, 30.0, 5.0, 1e4, tension_cutoff=1e3),
          "newton": herschel_bulkley(1e6, 10.0, tension_cutoff=None),
          "softening": softened(mohr_coulomb(5e7, 0.3, 30.0, 5.0, 1e5),
                                mohr_coulomb(5e7, 0.3, 20.0, 0.0, 2e4), 0.1, 0.05, 0.1),
          "softening cone": softened(drucker_prager(5e7, 0.3, 30.0, 5.0, 1e5),
                                     drucker_prager(5e7, 0.3, 20.0, 0.0, 2e4), 0.1, 0.05, 0.1),
          "hard metal": von_mises(210e9, 0.3, 235e6, 1e9)}


def make(name):
    return LAWS[name](**PARAMETERS[name])


@pytest.mark.parametrize("law", [*(pytest.param(make(name), id=name) for name in sorted(LAWS)),
                                 *(pytest.param(law, id=name) for name, law in OTHERS.items())])
def test_laws_of_the_package(law):
    report = check_law(law)
    assert report.rate > 1.9 and report.turned < 1e-12 and report.at_rest == 0.0 and report.samples > 50
    assert law.symmetric == (report.asymmetry < 1e-12)
    assert abs(report.dissipated) < 2e-3
    assert f"{law.name}: {report.samples} deformations" in str(report)


D = 2  # fixed by specialise
FLAWS = "none", "tangent", "last row", "at rest", "energy", "old", "new", "stress", "repeated"
NONE, TANGENT, LAST_ROW, AT_REST, ENERGY, OLD, NEW, STRESS, REPEATED = range(len(FLAWS))


class Params(NamedTuple):
    """Shear modulus [Pa], and which flaw the law has."""

    mu: float
    flaw: int


def stress(p, F, F33, dt, old, new, P):
    """P = mu F (F^T F - 1)."""
    for i in range(D):
        for j in range(D):
            P[i * D + j] = -p.mu * F[i, j]
            for k in range(D):
                for m in range(D):
                    P[i * D + j] += p.mu * F[i, k] * F[m, k] * F[m, j]
    P[D * D] = p.mu * F33 * (F33 * F33 - 1.0)
    new.times = old.times
    if p.flaw == AT_REST:
        P[0] += 1e-3 * p.mu
    if p.flaw == OLD:
        old.times += 1.0
    if p.flaw == REPEATED:
        P[D * D] += 1e-2 * p.mu * (F33 - 1.0) * old.times
        new.times = old.times + 1.0


def tangent(p, F, F33, dt, old, new, P, A):
    """dP_ij/dF_kl = mu (delta_ik (C - 1)_lj + F_il F_kj + delta_jl b_ik)."""
    stress(p, F, F33, dt, old, new, P)
    A[:] = 0.0
    for i in range(D):
        for j in range(D):
            for k in range(D):
                for n in range(D):
                    a = F[i, n] * F[k, j]
                    for m in range(D):
                        a += (i == k) * F[m, n] * F[m, j] + (j == n) * F[i, m] * F[k, m]
                    A[i * D + j, k * D + n] = p.mu * (a - (i == k) * (j == n))
    A[D * D, D * D] = p.mu * (3.0 * F33 * F33 - 1.0)
    if p.flaw == TANGENT:
        A[0, 3] += 1e-3 * p.mu
        A[3, 0] += 1e-3 * p.mu
    if p.flaw == LAST_ROW:
        A[D * D, D * D] *= 1.01
    if p.flaw == NEW:
        new.times = old.times + 1.0
    if p.flaw == STRESS:
        P[0] += 1e-6 * p.mu
    if p.flaw == REPEATED:
        A[D * D, D * D] += 1e-2 * p.mu * old.times


def energy(p, F, F33, old):
    """W = mu / 4 |F^T F - 1|^2."""
    square = (F33 * F33 - 1.0)**2
    for i in range(D):
        for j in range(D):
            c = -1.0 if i == j else 0.0
            for m in range(D):
                c += F[m, i] * F[m, j]
            square += c * c
    return (0.26 if p.flaw == ENERGY else 0.25) * p.mu * square


def flawed(flaw, state=(("times", float),)):
    return Law("flawed", Params(1e6, flaw), np.dtype(list(state)), stress, tangent, energy)


def test_the_law_without_a_flaw():
    assert check_law(flawed(NONE)).samples == 64


WORDS = {TANGENT: "tangent that is not the derivative of its stress: .* order 1 in place of 2, in 2 d",
         LAST_ROW: "tangent that is not the derivative",
         AT_REST: "has a stress of 1e.03 Pa at the start, undeformed, for dt = 0 s",
         ENERGY: "has an energy of .* where the work from rest on was", OLD: "changes F or its old state",
         NEW: "another stress or new state with its tangent than without",
         STRESS: "another stress or new state", REPEATED: "does not find the stress at the end"}


@pytest.mark.parametrize("flaw", WORDS, ids=lambda flaw: FLAWS[flaw])
def test_a_flaw_is_told(flaw):
    with pytest.raises(ValueError, match=f"the law flawed .*{WORDS[flaw]}"):
        check_law(flawed(flaw))


def test_a_tangent_that_is_not_as_symmetric_as_stated():
    law = make("mohr_coulomb")
    with pytest.raises(ValueError, match="said to be symmetric .* differs from its transpose by"):
        check_law(law._replace(symmetric=True))


def test_a_law_that_is_not_objective():
    """Strain as F - 1 takes a turn for a deformation."""
    with pytest.raises(ValueError, match="the law kelvin_voigt is not objective: .* compute it from F.T F"):
        check_law(kelvin_voigt(1e6, 1e4), dims=[2])


def test_a_law_that_does_not_compile():
    with pytest.raises(ValueError, match="the law flawed does not run in 2 dimensions .*times.*: look at"):
        check_law(flawed(NONE, state=[("other", float)]))
    assert ELASTIC_STATE.names == ("unused",)
