"""Groups of arrays that the kernels of ``weakform`` and ``f_bar`` take, besides ``elements.PointElements``.
n: points; K: nodes of an element."""
from typing import NamedTuple

import numpy as np


class Quadrature(NamedTuple):
    """Material points as points of quadrature: ``element`` (n,); ``N`` (n, K) and ``G`` (n, D, K), basis
    values and gradients [1/m]; ``mass`` (n,) with consistent inertia [kg]; ``V0`` (n,) undeformed volume
    [m^3]; ``order`` (n,), their numbers element by element, for tangents."""

    element: np.ndarray
    N: np.ndarray
    G: np.ndarray
    mass: np.ndarray
    V0: np.ndarray
    order: np.ndarray


class Deformation(NamedTuple):
    """Of n points at one time: ``F`` (n, D, D), deformation gradient; ``F33`` (n,), stretch across a plane
    scene; ``state`` (n,), records of the law."""

    F: np.ndarray
    F33: np.ndarray
    state: np.ndarray


class Patches(NamedTuple):
    """Sums over F-bar's patches with M nodes each, see ``f_bar``: ``volume`` (patches, 2) at the end and at
    the start of the step [m^3]; ``bulk`` (patches, 2), sums of V0 tr(tau) / D and of V0 (s / D^2 - tr(tau) /
    D) [J]; ``gradient`` (patches, D, M), derivative of the first volume by the displacements of the nodes
    [m^2]; ``push``, ``pull`` (patches, D, M), sums of V0 dev(u) / D grad N and V0 dev(w) / D grad N [N].
    Where patches are cells the last three are those of one at a time, (1, D, M), while the tangent is
    made."""

    volume: np.ndarray
    gradient: np.ndarray
    bulk: np.ndarray
    push: np.ndarray
    pull: np.ndarray
