"""Initial stress of soil, in equilibrium with its weight."""
from typing import Any, Callable, Optional

import numpy as np

import mpm_dem_checks as check

from ..laws import Law
from ..laws.algebra import stored
from ..laws.plastic_parts import strains_of
from .ground import Ground, Layer, check_ratio


def at_rest(top: float, rho: float, gravity: Any, ratio: float,
            phi: Optional[float] = None) -> Callable[[np.ndarray], np.ndarray]:
    """Stress under a plane surface at y = ``top`` [m]: a function from positions [m], shape (n, dim), to
    stresses [Pa], for the field ``stress`` of ``Body``. gravity: downward [m/s^2], a number, with the normal
    stresses along x, y and z, shape (n, 3); or a vector, shape (dim,), which for a layer on a slope has a
    part along the surface, with tensors, shape (n, 3, 3).

    ratio: of the normal stress along the surface to that across it, as 1 - sin phi (Jaky 1944) or nu / (1 -
    nu) (elastic, held at the sides). On a slope the weight is held by shear, as in an infinite layer of depth
    d: sigma_yy = rho g_y d, tau_xy = rho g_x d. Steep ones have no equilibrium with a low ratio: with
    ``phi``, the friction angle [degrees] of a soil without cohesion, the ratio is the nearest that it bears,
    if there is one (a slope of less than phi).

    >>> at_rest(top=2.0, rho=1500.0, gravity=10.0, ratio=0.5)(np.array([(0.0, 1.0)]))
    array([[ -7500., -15000.,  -7500.]])
    >>> at_rest(top=2.0, rho=1500.0, gravity=(3.0, -8.0), ratio=0.5)(np.array([(0.0, 1.0)]))[0, :2, :2]
    array([[ -6000.,   4500.],
           [  4500., -12000.]])
    """
    if np.ndim(gravity):
        up = [0.0, 1.0, 0.0][:len(gravity)]
        return Ground([Layer(None, rho, ratio, phi)], np.multiply(top, up), gravity, up).stress
    check_ratio(ratio)

    def stress(x: np.ndarray) -> np.ndarray:
        vertical = -rho * gravity * np.maximum(top - x[:, 1], 0.0)
        return np.column_stack([ratio * vertical, vertical, ratio * vertical])

    return stress


def put_stress(points: Any, law: Law, given: Callable) -> None:
    """Give the material points the stress ``given(x)`` [Pa], normal stresses along x, y and z, shape (n, 3),
    or symmetric tensors, (n, 3, 3), as elastic strain of a law of ``laws.hencky``, whose points as they are
    count as undeformed. ValueError for another law."""
    n = len(points.x)
    stress = check.values("stress of the body", given, (points.x,), (n, 3), (n, 3, 3), unit="Pa")
    axes = np.eye(3)
    if stress.ndim == 3:
        if np.abs(stress - np.swapaxes(stress, 1, 2)).max() > 1e-9 * np.abs(stress).max():
            raise ValueError("stress of the body has tensors that are not symmetric: give symmetric ones")
        stress, axes = np.linalg.eigh(stress)
    strain = strains_of(law, stress)
    for name, values in (("plastic", np.expm1(2.0 * strain)), ("kirchhoff_stress", stress)):
        points.state[name] = stored((axes * values[:, None, :]) @ np.swapaxes(axes, -1, -2))
    points.a[:] = 0.0
