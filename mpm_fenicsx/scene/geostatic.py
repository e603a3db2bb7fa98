"""Initial stress of soil, in equilibrium with its weight."""
from typing import Any, Callable

import numpy as np

import mpm_dem_checks as check

from ..laws import Law


def at_rest(top: float, rho: float, gravity: float, ratio: float) -> Callable[[np.ndarray], np.ndarray]:
    """Stress under a level surface at height ``top`` [m]: a function from positions [m], shape (n, dim), to
    the normal stresses along x, y and z [Pa], shape (n, 3), for the field ``stress`` of ``Body``. gravity:
    downward [m/s^2]; ratio: of horizontal to vertical stress, as 1 - sin phi (Jaky 1944) or nu / (1 - nu)
    (elastic, held at the sides).

    >>> at_rest(top=2.0, rho=1500.0, gravity=10.0, ratio=0.5)(np.array([(0.0, 1.0)]))
    array([[ -7500., -15000.,  -7500.]])
    """
    check.not_negative("ratio", ratio, rule="the ratio of horizontal to vertical stress must be 0 or a "
                       "positive number")

    def stress(x: np.ndarray) -> np.ndarray:
        vertical = -rho * gravity * np.maximum(top - x[:, 1], 0.0)
        return np.column_stack([ratio * vertical, vertical, ratio * vertical])

    return stress


def put_stress(points: Any, law: Law, stress: np.ndarray) -> None:
    """Give the material points the normal ``stress`` along x, y and z [Pa], shape (n, 3), as elastic strain
    of a law of ``laws.hencky``, whose points as they are count as undeformed. ValueError for another law."""
    if "plastic" not in (law.state.names or ()):
        raise ValueError(f"the law {law.name} cannot start with a stress: take one of the plastic ones")
    p: Any = law.params
    lam, mu = p.lam, p.mu
    mean = lam / (3.0 * lam + 2.0 * mu) * stress.sum(axis=1)
    strain = (stress - mean[:, None]) / (2.0 * mu)
    points.state["plastic"] = np.expm1(2.0 * strain)[:, :, None] * np.eye(3)
    points.a[:] = 0.0
