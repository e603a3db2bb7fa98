"""Laws at a batch of points at once, as the kernels of the weak form call them.

    batch_stress(p, dt, old, new, part, work, P)
    batch_tangent(p, dt, old, new, part, V0, work, (P, B))

fill P (SIZE, D D + 1) with the stress of a ``part`` of the points, their numbers, at most SIZE, and B (SIZE,
D, D, D, D) with V0 F A F^T on the second and fourth index of A = dP/dF, of which the tangent of the weak form
is made. old, new: groups of F, F33 and state, at the start and at the end of the step, where new.F is given;
work: of ``new_work()`` and ``new_tangent_work()``. Laws of ``hencky`` have functions of their own, but not
in plane stress; all others go point by point.
"""
from typing import Callable, NamedTuple

import numpy as np

from ..compiled import multiply, specialise
from . import hencky
from .hencky_batches import SIZE, rows_functions
from .hencky_in_plane import plane_functions
from .law import Law
from .stress_state import point_functions

__all__ = ["SIZE", "OfBatches", "batch_functions"]

D, DD = 2, 4  # fixed by specialise, as are the functions below
point_stress = point_tangent = None


def one_by_one(p, dt, old, new, part, work, P):
    """The stress for any law, by its ``point_stress``."""
    (_, F33, before), (F, F33_new, after) = old, new
    for n in range(len(part)):
        q = part[n]
        F33_new[q] = point_stress(p, F[q], F33[q], dt, before[q], after[q], P[n], work)


def one_by_one_tangent(p, dt, old, new, part, V0, work, out):
    """The tangent for any law, by its ``point_tangent``, from new.F33 on."""
    (A, half, turned), (P, B) = work, out
    (F, F33, after), before = new, old.state
    for n in range(len(part)):
        q = part[n]
        F33[q] = point_tangent(p, F[q], F33[q], dt, before[q], after[q], P[n], A)
        pull(A, F[q], V0[q], half, turned, B[n])


def pull(A, F, weight, half, turned, B):
    """B = weight F A F^T on the second and fourth index, one after the other. half, in the shape of B, and
    turned (D, D): work."""
    for i in range(D):
        for j in range(D):
            turned[i, j] = weight * F[j, i]
        multiply((D, D, DD), False, (half, i * D * DD, DD), (F, 0, D, 1), (A, i * D * (DD + 1), DD + 1))
    for i in range(D):
        multiply((DD, D, D), False, (B, i * D * DD, D), (half, i * D * DD, D, 1), (turned, 0, D))


def one_modulus():
    """Work of ``one_by_one``."""
    return np.empty((D * D + 1, D * D + 1))


def one_pull():
    """Work of ``one_by_one_tangent``."""
    return np.empty((D * D + 1, D * D + 1)), np.empty((D, D, D, D)), np.empty((D, D))


class OfBatches(NamedTuple):
    """The jitted functions of a law, see above, each with what makes its work."""

    stress: Callable
    work: Callable
    tangent: Callable
    tangent_work: Callable


def batch_functions(law: Law, stress_state: str, D: int) -> OfBatches:
    """Of a ``law`` in a stress state in ``D`` dimensions."""
    if law.stress is not hencky.stress or stress_state == "plane_stress":
        point_stress, point_tangent = point_functions(law, stress_state, D)
        return OfBatches(
            specialise(one_by_one, point_stress=point_stress), specialise(one_modulus, D=D),
            specialise(one_by_one_tangent, point_tangent=point_tangent, pull=specialise(pull, D=D, DD=D * D)),
            specialise(one_pull, D=D))
    return OfBatches(*(plane_functions if D == 2 else rows_functions)(law))
