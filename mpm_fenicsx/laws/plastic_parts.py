"""What laws of ``hencky`` may have of their own: hardening and elasticity of those that have not."""
import math
from typing import Callable, Optional

import numpy as np

from ..compiled import called, specialise
from .law import Law


def plastic_strain_of(old):
    """What ``return_map`` and ``moduli`` are told as hardening."""
    return old.plastic_strain


def keep_nothing(old, new, volume):
    """The plastic strain is there already; volume: plastic strain of volume of the step."""


@called
def trial(p, e1, e2, e3):
    """Mean strain, q and mean stress [Pa] of the trial state with these strains, by Hencky's law with Lamé's
    parameters."""
    mean = (e1 + e2 + e3) / 3.0
    q = p.mu * math.sqrt(2.0 * ((e1 - mean) ** 2 + (e2 - mean) ** 2 + (e3 - mean) ** 2))
    return mean, q, (3.0 * p.lam + 2.0 * p.mu) * mean


def linear_strains(p, t):
    """Elastic strains of the principal Kirchhoff stresses t, by Hencky's law with Lamé's parameters."""
    mean, give = p.lam / (3.0 * p.lam + 2.0 * p.mu) * (t[0] + t[1] + t[2]), 0.5 / p.mu
    return give * (t[0] - mean), give * (t[1] - mean), give * (t[2] - mean)


@called
def deviatoric_moduli(e1, e2, e3, volume, back, forth, across, along):
    """Moduli of a law that knows mean stress and size of the deviator only: volume 11 + back 1n + forth n1 +
    across (I - 11/3 - nn) + along nn, with n the direction of the deviatoric strain."""
    mean = (e1 + e2 + e3) / 3.0
    n1, n2, n3 = e1 - mean, e2 - mean, e3 - mean
    norm = math.sqrt(n1 * n1 + n2 * n2 + n3 * n3)
    if norm > 0.0:
        n1, n2, n3 = n1 / norm, n2 / norm, n3 / norm
    base, square = volume - across / 3.0, along - across
    return ((base + back * n1 + forth * n1 + square * n1 * n1 + across, base + back * n2 + forth * n1 + square
             * n1 * n2, base + back * n3 + forth * n1 + square * n1 * n3),
            (base + back * n1 + forth * n2 + square * n2 * n1, base + back * n2 + forth * n2 + square * n2
             * n2 + across, base + back * n3 + forth * n2 + square * n2 * n3),
            (base + back * n1 + forth * n3 + square * n3 * n1, base + back * n2 + forth * n3 + square * n3
             * n2, base + back * n3 + forth * n3 + square * n3 * n3 + across))


def _function(law: Law) -> Optional[Callable]:
    for name, part in law.parts:
        found = _function(part) if isinstance(part, Law) else part if name == "elastic_strains" else None
        if found is not None:
            return found
    return None


def strains_of(law: Law, stress: np.ndarray) -> np.ndarray:
    """Elastic strains of principal stresses [Pa], shape (n, 3). ValueError for a law that cannot start with a
    stress, and for a stress that it never has."""
    function = _function(law)
    if function is None:
        raise ValueError(f"the law {law.name} cannot start with a stress: take one of the plastic ones")
    function = specialise(function, D=2)
    found = np.array([function(law.params, (t[0], t[1], t[2])) for t in stress.tolist()]).reshape(-1, 3)
    bad = ~np.isfinite(found).all(axis=1)
    if bad.any():
        raise ValueError(f"the law {law.name} has no state with the principal stresses "
                         f"{stress[bad][0].tolist()} Pa: give others")
    return found
