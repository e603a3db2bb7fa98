"""A hyperelastic law that is stated as an energy: W = psi(F), P = dW/dF, A = dP/dF (Bonet & Wood, chapter 6).

The derivatives come from UFL and are exact. C functions compute them, see ``compat``; the kernels below call
these by names that are made of the formula, so that numba may keep the kernels on disk.
"""
import ctypes
import hashlib
import inspect
from functools import lru_cache
from typing import Callable, NamedTuple, NoReturn, Sequence, Tuple

import numpy as np

import mpm_dem_checks as check

from ..compiled import call_energy, link
from . import compat
from .law import ELASTIC_STATE, Law

D, ENERGY = 2, ""  # fixed by specialise: the latter is the key of the energy
FREE = 1e-10  # of the tangent's norm: stress undeformed


def stress(p, F, F33, dt, old, new, P):
    """P = dW/dF."""
    call_energy(ENERGY, D, p, F, F33, P)


def tangent(p, F, F33, dt, old, new, P, A):
    """A = dP/dF."""
    stress(p, F, F33, dt, old, new, P)
    call_energy(ENERGY, D, p, F, F33, A)


def energy(p, F, F33, old):
    """W [J/m^3]."""
    return call_energy(ENERGY, D, p, F, F33, None)


@lru_cache(maxsize=None)
def _params(names: Tuple[str, ...]) -> type:
    """Class of parameters with these names. It is a name of this module, where numba looks for it when it
    reads kernels from disk."""
    name = f"Params_{hashlib.sha1(' '.join(names).encode()).hexdigest()[:8]}"
    made = NamedTuple(name, [(one, float) for one in names])  # type: ignore[misc]
    made.__module__, made.__doc__ = __name__, "Parameters of an energy."
    globals()[name] = made
    return made


def _refuse(name: str, what: str, remedy: str) -> NoReturn:
    raise ValueError(f"{name} {what}: {remedy}")


def _check_arguments(psi: Callable, name: str, given: Sequence[str]) -> None:
    """Raise ValueError unless ``psi`` takes F and the parameters that are ``given``."""
    try:
        inspect.signature(psi).bind(None, **dict.fromkeys(given))
    except TypeError as error:
        _refuse(name, f"takes other arguments than F and {', '.join(given) or 'no parameter'} ({error})",
                "give from_energy a value for each parameter of the energy, by its name")


def _at_rest(functions: compat.Functions, kind: str, size: int, params: Sequence[float]) -> np.ndarray:
    """What the C function of that ``kind`` fills undeformed, in space, shape (size,)."""
    call = ctypes.CFUNCTYPE(None, *7 * [ctypes.c_void_p])(functions.addresses[kind, 3])
    given, found = np.append(np.eye(3).ravel(), params), np.zeros(size)
    call(found.ctypes.data, None, given.ctypes.data, None, None, None, None)
    return found


def _check_rest(functions: compat.Functions, name: str, params: Sequence[float]) -> None:
    """Raise ValueError unless there is no stress undeformed."""
    P = np.linalg.norm(_at_rest(functions, "stress", 9, params))
    A = np.linalg.norm(_at_rest(functions, "tangent", 45, params))
    if not np.isfinite([P, A, *_at_rest(functions, "energy", 1, params)]).all():
        _refuse(name, "or one of its derivatives is not a number at F = I", "write it so that it is smooth "
                "there; roots of sums that vanish are not")
    if P > FREE * A:
        _refuse(name, f"has a stress of {P:.4g} Pa at F = I", "let its derivative vanish there, as that of "
                "mu / 2 * (tr(F.T * F) - 3) - mu * ln(det(F)) does")


def formulas(law: Law) -> Tuple[str, ...]:
    """What tells the formula of the law's energy from others, where it has one of ``from_energy``: its own or
    those of the laws in it."""
    found: Tuple[str, ...] = ()
    for name, part in law.parts:
        found += formulas(part) if isinstance(part, Law) else (part,) if name == "ENERGY" else ()
    return found


def from_energy(psi: Callable, /, **parameters: float) -> Law:
    """The hyperelastic law with the strain energy ``psi(F, **parameters)`` per undeformed volume [J/m^3],
    written in UFL; F: deformation gradient, shape (3, 3), in the plane, too, where only F_33 is left of its
    third row and column. The constant that makes psi zero undeformed may be left out.

    parameters: name → value; another value does not compile anything anew. ValueError where psi is not a
    scalar, not a function of F, or has a stress at F = I; RuntimeError without a C compiler. Collective.

    >>> from ufl import det, ln, tr
    >>> law = from_energy(lambda F, mu: mu / 2 * (tr(F.T * F) - 3) - mu * ln(det(F)) + mu * ln(det(F))**2,
    ...                   mu=0.4)
    >>> law.name, law.params.mu
    ('energy', 0.4)
    """
    check.function("the energy", psi)
    name = getattr(psi, "__name__", "energy").replace("<lambda>", "energy")
    spoken = "the energy" if name == "energy" else f"the energy {name}"
    names = tuple(parameters)
    _check_arguments(psi, spoken, names)
    values = [check.finite(one, value) for one, value in parameters.items()]

    def in_order(F, *given):
        return psi(F, **dict(zip(names, given)))

    functions = compat.functions(in_order, spoken, len(names))
    _check_rest(functions, spoken, values)
    key = hashlib.sha1(" ".join((functions.key, *names)).encode()).hexdigest()[:16]
    for (kind, dim), address in functions.addresses.items():
        link(key, kind, dim, address)
    return Law(name, _params(names)(*values), ELASTIC_STATE, stress, tangent, energy,
               parts=(("ENERGY", key),))
