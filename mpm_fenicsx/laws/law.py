"""What a constitutive law is, and how its kernels are compiled.

A law is a ``Law`` record. Its kernels are pure functions of one point that fill arrays of the caller, plain
functions that ``specialise`` compiles for a dimension D:

    stress(p, F, F33, dt, old, new, P)        first Piola–Kirchhoff stress at the end of a step
    tangent(p, F, F33, dt, old, new, P, A)    the same, and A = dP/dF
    energy(p, F, F33, old) -> float           strain energy per undeformed volume [J/m^3]

p: parameters (NamedTuple). F: deformation gradient at the end of the step, shape (D, D). F33: stretch across
the plane of a plane scene, and 1 in space. dt: length of the step [s]; 0 for the stress of a state that is
there already (F and ``old`` belong to the same time: what the rate was, ``old`` must tell); infinite in load
steps without inertia (however fast F changes does not matter: rates, over dt, are zero). old, new: what the
law remembers, at the start and at the end of the step: records with the fields of ``Law.state``, read and
written by name (``new.plastic_strain``); zero at the start of a run. ParaView and checkpoints have them under
these names, none of which may be among ``SHOWN``. A law that depends on rates keeps there what it needs of
the last step, such as F^T F - 1, which a turn of the body does not change. ``stress`` fills ``new`` and never
changes ``old``; it may be called any number of times in a step. P [Pa], shape (D*D + 1,): P[D*i + j] is P_ij,
the last entry is P_33. A [Pa], shape (D*D + 1, D*D + 1), in the same order; it is the derivative at fixed dt
and ``old``. Outside its domain a law fills NaN: the line search then backs off. ``checking.check_law`` tests
all this.

Every formula is written so that F33 covers two and three dimensions from one source. The name D and the names
of ``Law.parts`` are constants there; ``tangent`` may call ``stress``.
"""
from typing import Any, Callable, Dict, Iterable, NamedTuple, Optional, Tuple

import numpy as np

import mpm_dem_checks as check

from ..compiled import specialise

# An elastic law remembers nothing; numba refuses an empty record.
ELASTIC_STATE = np.dtype([("unused", np.int8)])
# What ParaView shows of points besides what their law remembers.
SHOWN = ("x", "gid", "velocity", "acceleration", "mass", "F", "cauchy_stress", "force_cell", "body")


class Law(NamedTuple):
    """Parameters, state record and kernels of one material; ``thickness`` is the closed form of the stretch
    across the plane in plane stress, for laws that have one: thickness(p, F). ``parts``: names and templates
    of functions that the kernels call by these names, and those after them, where several laws share their
    kernels, or constants; a law among them brings ``NAME_stress``, ``NAME_tangent`` and ``NAME_energy``.
    ``symmetric``: A is, and so may be the solver. ``by_cell``: of a law that depends on the size of the
    background cells, the law for cells of that size [m]; ``cell``: what it is made for [m], None where
    ``MPM`` is to put that of its grid."""

    name: str
    params: NamedTuple
    state: np.dtype
    stress: Callable
    tangent: Callable
    energy: Callable
    thickness: Optional[Callable] = None
    parts: Tuple[Tuple[str, Any], ...] = ()
    symmetric: bool = True
    by_cell: Optional[Callable[[float], "Law"]] = None
    cell: Optional[float] = None


def lame(E: float, nu: float) -> Tuple[float, float]:
    """Lamé parameters lam and mu [Pa] from Young's modulus E [Pa] and Poisson's ratio nu.

    Raises ValueError unless E > 0 and -1 < nu < 0.5.

    >>> lame(1.0, 0.25)
    (0.4, 0.4)
    """
    E = check.positive("E", E, "Pa", "Young's modulus must be positive")
    nu = check.between("nu", nu, -1, 0.5, rule="Poisson's ratio must lie between -1 and 0.5, both excluded",
                       ends="()")
    return E * nu / ((1 + nu) * (1 - 2 * nu)), E / (2 * (1 + nu))


def check_declared(law: Law) -> None:
    """Raise ValueError unless parameters and state of the law have names, as kernels and files need them.

    >>> check_declared(Law("rubber", (1.0,), ELASTIC_STATE, *3 * [lambda: None]))
    Traceback (most recent call last):
    ValueError: the parameters of the law rubber are (1.0,): give a NamedTuple of numbers
    """
    check.record("law of the body", law, Law)
    if not (isinstance(law.params, tuple) and hasattr(law.params, "_fields")):
        raise ValueError(f"the parameters of the law {law.name} are {check.shown(law.params)}: give a "
                         "NamedTuple of numbers")
    if not isinstance(law.state, np.dtype) or law.state.names is None:
        raise ValueError(f"the state of the law {law.name} is {check.shown(law.state)}: give a numpy dtype "
                         'with named fields, as np.dtype([("plastic_strain", float)]), or ELASTIC_STATE')
    for name in law.state.names:
        if name in SHOWN:
            raise ValueError(f"the law {law.name} calls a part of its state {name!r}, as ParaView calls "
                             "something else of each point: give it another name")


def check_together(laws: Iterable[Law]) -> None:
    """Raise ValueError where two laws of a scene give one name to parts of their states that differ in kind
    or shape, which ParaView shows in one field."""
    seen: Dict[str, Tuple[str, np.dtype]] = {}
    for law in laws:
        for name in law.state.names or ():
            first, kind = seen.setdefault(name, (law.name, law.state[name]))
            if kind != law.state[name]:
                raise ValueError(f"the laws {first} and {law.name} both remember {name!r}, one as {kind}, "
                                 f"one as {law.state[name]}: give one of them another name")


def compiled_parts(law: Law, constants: Dict[str, Any]) -> Dict[str, Any]:
    """``Law.parts`` by name, functions with the ``constants`` (D at least) fixed."""
    parts: Dict[str, Any] = {}
    for name, part in law.parts:
        if isinstance(part, Law):
            stress, tangent = kernels(part, constants["D"], law.name)
            parts |= {f"{name}_stress": stress, f"{name}_tangent": tangent,
                      f"{name}_energy": bound(part, part.energy, constants["D"], law.name)}
        elif not callable(part):
            parts[name] = part
        else:
            known = {other: parts[other] for other in part.__code__.co_names if other in parts}
            parts[name] = specialise(part, **constants, **known)
    return parts


def constants_of(law: Law, D: int, within: str = "") -> Dict[str, Any]:
    """What is fixed in all kernels of a law in ``D`` dimensions; ``within``: name of the law that it is part
    of, whose records are longer. What several laws share is compiled for each size of their records: numba
    would take kernels of shorter ones for it, and warn."""
    within = within or (f"{law.state.itemsize} bytes" if law.parts else "")
    return dict(D=D, WITHIN=within) if within else dict(D=D)


def bound(law: Law, template: Callable, D: int, within: str = "", **others: Any) -> Callable:
    """``template`` compiled for ``D`` dimensions with the law's parts; within: see ``constants_of``."""
    constants = constants_of(law, D, within)
    parts = compiled_parts(law, constants)
    return specialise(template, **constants, **parts, **others)


def kernels(law: Law, D: int, within: str = "") -> Tuple[Callable, Callable]:
    """The law's stress and tangent compiled for ``D`` dimensions, see ``bound``."""
    stress = bound(law, law.stress, D, within)
    return stress, bound(law, law.tangent, D, within, stress=stress)
