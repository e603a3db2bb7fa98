"""A law of one's own that depends on the rate of deformation: what ``laws.law`` promises is enough to write
one.

Kelvin–Voigt without lateral strain: P = E (F - 1) + eta dF/dt. Under stress the strain creeps with the time
constant eta / E; held, the viscous part of the stress is gone at once.
"""
from typing import NamedTuple

import numpy as np

from mpm_fenicsx.laws import Law

D = 2  # fixed by specialise


class Params(NamedTuple):
    E: float  # [Pa]
    eta: float  # [Pa s]


def stress(p, F, F33, dt, old, new, P):
    for i in range(D):
        for j in range(D):
            strain = F[i, j] - (1.0 if i == j else 0.0)
            rate = (strain - old.strain[i, j]) / dt if dt > 0.0 else 0.0
            new.strain[i, j] = strain
            P[i * D + j] = p.E * strain + p.eta * rate
    P[D * D] = p.E * (F33 - 1.0)


def tangent(p, F, F33, dt, old, new, P, A):
    stress(p, F, F33, dt, old, new, P)
    A[:] = 0.0
    for i in range(D * D):
        A[i, i] = p.E + (p.eta / dt if dt > 0.0 else 0.0)
    A[D * D, D * D] = p.E


def energy(p, F, F33, old):
    square = 0.0
    for i in range(D):
        for j in range(D):
            square += (F[i, j] - (1.0 if i == j else 0.0)) ** 2
    return 0.5 * p.E * square


def kelvin_voigt(E, eta):
    """The law with modulus E [Pa] and viscosity eta [Pa s]."""
    return Law("kelvin_voigt", Params(E, eta), np.dtype([("strain", float, (D, D))]), stress, tangent, energy)
