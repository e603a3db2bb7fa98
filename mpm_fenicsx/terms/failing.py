"""Which material point has no stress, where a residual is not a number."""
from typing import Any, NamedTuple, Optional, Sequence

import numpy as np

from ..compiled import specialise
from ..laws.stress_state import point_functions
from .bodies import BodyTerm
from .fields import Deformation
from .weakform import time_of_law

D = 2  # fixed by specialise
point_stress = None


class NoStress(NamedTuple):
    """Number of a material point, and what is said of it."""

    gid: int
    text: str


def first_failing(old: Deformation, F, params, dt):
    """The first point whose law has no finite stress at F, shape (n, D, D), or -1."""
    scratch, P, A = old.state[:1].copy(), np.empty(D * D + 1), np.empty((D * D + 1, D * D + 1))
    for q in range(len(F)):
        P[:] = 0.0
        F33 = point_stress(params, F[q], old.F33[q], time_of_law(dt), old.state[q], scratch[0], P, A)
        if not np.isfinite(P[:D * D].sum() + F33):
            return q
    return -1


def find_failing(terms: Sequence[Any], of_terms: Sequence[Any], origin: np.ndarray) -> Optional[NoStress]:
    """Of this rank, the first point of the first of the ``terms`` that is a body where a law fails in the
    trials ``of_terms``; origin: of places [m], shape (D,). The kernel is compiled when it is needed."""
    for term, trial in zip(terms, of_terms):
        if not isinstance(term, BodyTerm) or not np.isfinite(trial.increment.u).all():
            continue
        p, record = term.points, term.body
        stress, _ = point_functions(record.law, record.stress_state, record.dim)
        kernel = specialise(first_failing, D=record.dim, point_stress=stress)
        q = kernel(Deformation(p.F, p.F33, p.state), trial.new.F, record.law.params, trial.increment.dt)
        if q >= 0:
            return NoStress(int(p.gid[q]), _sentence(term, trial, q, origin))
    return None


def _sentence(term: BodyTerm, trial: Any, q: int, origin: np.ndarray) -> str:
    """Point, place and state."""
    p, law = term.points, term.body.law
    with np.errstate(all="ignore"):  # it may have become as large as numbers can be
        before, after = np.linalg.det(p.F[q]), np.linalg.det(trial.new.F[q])
    place = ", ".join(f"{x:.9g}" for x in p.x[q] + origin)
    numbers = [f"{name} = {float(p.state[name][q]):.4g}" for name in law.state.names
               if p.state[name].ndim == 1 and law.state[name].kind == "f"]
    state = f", with {', '.join(numbers)}" if numbers else ""
    return (f"{law.name} has no stress at material point {int(p.gid[q])}, x = [{place}] m, where det F goes "
            f"from {before:.4g} to {after:.4g}{state}")
