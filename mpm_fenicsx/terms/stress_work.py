"""Work of the stresses at both ends of a step along the displacement of the nodes, for the books.

A state of stress tau at the points makes inner forces f on the grid of the step: at its start, where nothing
is deformed yet, with the stress that is there, and at its end as in ``weakform``. With H = du/dx and f = 1 +
H, V0 being undeformed volumes,

    f . u = sum V0 tau : H,        f' . u = sum V0 tau' : H f^-1,

and with F-bar (see ``f_bar``) the deviators in these, and tr(tau) / D times the change of volume of the whole
patch: sum V_old tr H / sum V_old at the start, u . d(sum V_old j)/du / sum V_old j at the end.
"""
from typing import Any, Callable, NamedTuple, Tuple

import numpy as np

from mpm_dem_direct import direct

from ..basis.shape import invert
from ..compiled import specialise
from ..grid.elements import PointElements
from ..laws.algebra import PLACE, determinant
from .f_bar import displacement_gradient
from .fields import Deformation, Quadrature

D, K, FBAR = 2, 4, False


class Stresses(NamedTuple):
    """Kirchhoff stress of the points [Pa] ``before`` and ``after`` a step, (n, 6) as in ``algebra``."""

    before: np.ndarray
    after: np.ndarray


def work(points: Quadrature, elements: PointElements, old: Deformation, stresses: Stresses, u, sums):
    """The two sums above [J], of displacements u (nodes, D) [m], with FBAR of deviators. Adds to sums
    (patches, 4) what patches need: V_old tr H and V_old j tr(H f^-1), which are the changes of volume [m^3],
    and V0 tr(tau) / D before and after [J]."""
    element, G, V0, cells, patch = points.element, points.G, points.V0, elements.nodes, elements.patch
    before, after = stresses
    H, f, inverse = np.empty((D, D)), np.empty((D, D)), np.empty((D, D))
    first = last = 0.0
    for q in range(len(element)):
        c = element[q]
        displacement_gradient(c, q, cells, G, u, D, K, H)
        for i in range(D):
            for j in range(D):
                f[i, j] = H[i, j] + (1.0 if i == j else 0.0)
        invert(f, D, inverse)
        mean = mean_after = 0.0
        if FBAR:
            grown = grown_after = 0.0
            for i in range(D):
                grown += H[i, i]
                for k in range(D):
                    grown_after += H[i, k] * inverse[k, i]
                mean += before[q, i] / D
                mean_after += after[q, i] / D
            V_old = V0[q] * determinant(old.F[q], D) * old.F33[q]
            row = sums[patch[c]]
            row[0] += V_old * grown
            row[1] += V_old * determinant(f, D) * grown_after
            row[2] += V0[q] * mean
            row[3] += V0[q] * mean_after
        for i in range(D):
            for j in range(D):
                at_end = 0.0
                for k in range(D):
                    at_end += H[i, k] * inverse[k, j]
                one = 1.0 if i == j else 0.0
                first += V0[q] * (before[q, PLACE[i][j]] - mean * one) * H[i, j]
                last += V0[q] * (after[q, PLACE[i][j]] - mean_after * one) * at_end
    return first, last


def make_stress_work(body: Any, background: Any) -> Callable[..., Tuple[float, float]]:
    """Of a ``body`` on the elements of its points in ``background``: a function of the active cells, points,
    elements, the deformation before, ``Stresses``, and the trial of the step, see ``bodies.BodyTrial``, that
    returns this rank's share of both sums [J]. Collective."""
    size = dict(D=body.dim, K=background.basis.nodes(body.dim, background.cells.shape[1]))
    kernel = direct(specialise(work, **size, FBAR=body.f_bar))

    def stress_work(cells: Any, points: Any, elements: Any, old: Any, stresses: Stresses,
                    trial: Any) -> Tuple[float, float]:
        u, volume = trial.increment.u, trial.patches.volume
        sums = np.zeros((len(volume), 4))
        first, last = kernel(points, elements, old, stresses, u, sums)
        if not body.f_bar:
            return first, last
        cells.share(sums[:, :2])
        there = np.maximum(volume, 1e-300)  # of patches without points nothing is asked
        return (first + float(sums[:, 2] @ (sums[:, 0] / there[:, 1])),
                last + float(sums[:, 3] @ (sums[:, 1] / there[:, 0])))

    return stress_work
