"""From a law for the full deformation gradient to plane strain, plane stress and three dimensions.

Templates: ``specialise`` fixes D and the law's functions. All share one signature and return the stretch
across the plane; ``point_stress`` fills P (D*D + 1,) [Pa], ``point_tangent`` also A (D*D + 1, D*D + 1) [Pa],
of which the caller uses the first D*D rows and columns.

Plane stress works with any law: the stretch F33 is found by Newton's method on P_33(F33) = 0, starting from
its last value, and the tangent is condensed, A - A_.3 A_3. / A_33 (Klinkel & Govindjee 2002, doi
10.1108/02644400210423918). A law that knows its stretch in closed form saves the iteration.
"""
import math
from typing import Callable, Tuple

from ..compiled import specialise, within
from .law import Law, kernels

D = 2
stress = tangent = thickness = find_stretch = None  # bound by specialise


@within
def plain_stress(p, F, F33, dt, old, new, P, A):
    """Plane strain and three dimensions: F33 stays."""
    stress(p, F, F33, dt, old, new, P)
    return F33


def plain_tangent(p, F, F33, dt, old, new, P, A):
    """The same with the tangent."""
    tangent(p, F, F33, dt, old, new, P, A)
    return F33


@within
def closed_stretch(p, F, F33, dt, old, new, P, A):
    """F33 with P_33 = 0 in closed form."""
    return thickness(p, F)


def newton_stretch(p, F, F33, dt, old, new, P, A):
    """F33 with P_33 = 0. The last correction is below 1e-9, so that, converging quadratically, it is
    exact."""
    for _ in range(40):
        tangent(p, F, F33, dt, old, new, P, A)
        change = -P[D * D] / A[D * D, D * D]
        if not abs(change) < 1e9:
            return math.nan
        F33 += max(change, -0.5 * F33)  # a stretch stays positive
        if abs(change) <= 1e-9 * F33:
            return F33
    return math.nan


@within
def plane_stress(p, F, F33, dt, old, new, P, A):
    """Plane stress: F33 is found, from F33 on."""
    F33 = find_stretch(p, F, F33, dt, old, new, P, A)
    stress(p, F, F33, dt, old, new, P)
    return F33


def plane_stress_tangent(p, F, F33, dt, old, new, P, A):
    """The same with the condensed tangent."""
    F33 = find_stretch(p, F, F33, dt, old, new, P, A)
    tangent(p, F, F33, dt, old, new, P, A)
    for i in range(D * D):
        for j in range(D * D):
            A[i, j] -= A[i, D * D] * A[D * D, j] / A[D * D, D * D]
    return F33


def point_functions(law: Law, stress_state: str, dim: int) -> Tuple[Callable, Callable]:
    """The two jitted functions ``point_stress, point_tangent`` for a law in a stress state."""
    stress, tangent = kernels(law, dim)
    if stress_state != "plane_stress":
        return specialise(plain_stress, stress=stress), specialise(plain_tangent, tangent=tangent)
    if law.thickness is not None:
        find = specialise(closed_stretch, thickness=specialise(law.thickness, D=dim))
    else:
        find = specialise(newton_stretch, D=dim, tangent=tangent)
    return (specialise(plane_stress, find_stretch=find, stress=stress),
            specialise(plane_stress_tangent, D=dim, find_stretch=find, tangent=tangent))
