"""Constitutive laws, one per file.

A law is a ``Law`` record. Its kernels are pure functions of one point that fill arrays of the caller, templates that
``specialise`` compiles for a dimension D:

    stress(p, F, F33, old, new, P)        first Piola–Kirchhoff stress
    tangent(p, F, F33, old, new, P, A)    the same, and A = dP/dF
    energy(p, F, F33, old) -> float       strain energy per undeformed volume [J/m^3]

p: parameters (NamedTuple). F: deformation gradient, shape (D, D). F33: stretch across the plane of a plane scene, and 1
in space; every formula below is written so that this covers two and three dimensions from one source. old, new: state
records (named fields) at the start and the end of the step. P [Pa], shape (D*D + 1,): P[D*i + j] is P_ij, the last
entry is P_33. A [Pa], shape (D*D + 1, D*D + 1), in the same order. Outside its domain a law fills NaN: the line search
then backs off.
"""
from typing import Callable, NamedTuple, Optional, Tuple

import numpy as np

import mpm_dem_checks as check

from ..compiled import specialise

ELASTIC_STATE = np.dtype([("unused", np.int8)])  # an elastic law remembers nothing; numba refuses an empty record


class Law(NamedTuple):
    """Parameters, state record and kernels of one material; ``thickness`` is the closed form of the stretch across
    the plane in plane stress, for laws that have one. ``parts``: names and templates of functions that the kernels call
    by these names, where several laws share their kernels. ``symmetric``: A is, and so may be the solver."""

    name: str
    params: NamedTuple
    state: np.dtype
    stress: Callable
    tangent: Callable
    energy: Callable
    thickness: Optional[Callable] = None
    parts: Tuple[Tuple[str, Callable], ...] = ()
    symmetric: bool = True


def lame(E: float, nu: float):
    """Lamé parameters [Pa] from Young's modulus E [Pa] and Poisson's ratio nu.

    Raises ValueError unless E > 0 and -1 < nu < 0.5.
    """
    E = check.positive("E", E, "Pa", "Young's modulus must be positive")
    nu = check.between("nu", nu, -1, 0.5, rule="Poisson's ratio must lie between -1 and 0.5, both excluded", ends="()")
    return E * nu / ((1 + nu) * (1 - 2 * nu)), E / (2 * (1 + nu))


def bound(law: Law, template, D: int, **others):
    """``template`` compiled for ``D`` dimensions with the law's parts."""
    parts = {name: specialise(part, D=D) for name, part in law.parts}
    return specialise(template, D=D, **parts, **others)


def kernels(law: Law, D: int):
    """The law's stress and tangent compiled for ``D`` dimensions. A tangent may call ``stress``."""
    stress = bound(law, law.stress, D)
    return stress, bound(law, law.tangent, D, stress=stress)


from .drucker_prager import drucker_prager  # noqa: E402 - the laws need the names above
from .linear import linear  # noqa: E402
from .mohr_coulomb import mohr_coulomb  # noqa: E402
from .neo_hooke import neo_hooke  # noqa: E402
from .von_mises import von_mises  # noqa: E402

LAWS = {"linear": linear, "neo_hooke": neo_hooke, "mohr_coulomb": mohr_coulomb, "drucker_prager": drucker_prager,
        "von_mises": von_mises}
