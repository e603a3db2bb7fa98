"""A new reference for material that has flowed far, with the laws of ``hencky``.

Stress, elastic strain and volume depend on F and Cp only by b = F Cp^-1 F^T and det F: with any G of
det G = 1, F G and G^-1 Cp^-1 G^-T are the same state. F of what flows grows without bound, and b is
then a small difference of large numbers: in an avalanche that is stopped at a structure entries of 1e4
were seen, of which b has no digit left. So where an entry of F gets beyond FAR the state goes on with F
= (det F)^(1/D) 1.
"""
from typing import Callable, Optional

import numpy as np

from ..compiled import specialise
from . import hencky
from .algebra import PLACE, determinant
from .hencky import trial_b
from .law import Law, constants_of

FAR = 4.0  # b has lost some 4 digits of 16 then

D = 2  # fixed by specialise


def renew(F, state):
    """Take a new reference, in place, for points whose F, shape (n, D, D), has an entry beyond FAR; state:
    (n,) records of the law."""
    b = np.empty((D, D))
    for q in range(len(F)):
        far = False
        for i in range(D):
            for j in range(D):
                far |= abs(F[q, i, j]) > FAR
        J = determinant(F[q], D)
        if not far or not J > 0.0:
            continue
        C, size = state[q].plastic, J ** (1.0 / D)  # across a plane F33 and C stay
        for i in range(D):
            for j in range(D):
                b[i, j] = trial_b(F[q], C, i, j, D) / (size * size)
        for i in range(D):
            for j in range(D):
                F[q, i, j] = size if i == j else 0.0
                C[PLACE[i][j]] = 0.5 * (b[i, j] + b[j, i]) - (1.0 if i == j else 0.0)


def renewal(law: Law, D: int) -> Optional[Callable]:
    """``renew`` compiled for a ``law`` in ``D`` dimensions; None for one whose F tells more than b."""
    if law.stress is not hencky.stress:
        return None
    return specialise(renew, **constants_of(law, D))
