"""What laws of ``hencky`` remember: elastic strains, by Cp, plastic strain and work, the stress, and gaps.

Soil that separates remembers the volumetric strain by which it has *opened* beyond the strain of its greatest
tension. The trial strain of the next step starts with that much, so that the soil closes before it pushes
again: otherwise each opening would leave it larger than before.

Plastic work is that of the mean of the stresses at both ends of a step on its change of plastic strain, with
what has opened or closed in it. As elasticity is linear, work of the mean stress on the change of logarithmic
strain is then plastic work and change of elastic energy, exactly, and such work is what Newmark's method
does. The stress at the end alone would be of first order in the step. The price: in a step that turns the
stress round, or opens what was pressed, plastic work may be negative.
"""
import math

import numpy as np

from ..compiled import called
from .algebra import combine2, combine3

STATE = np.dtype([
    ("plastic", np.float64, (3, 3)),  # Cp^-1 - 1, zero at the start
    ("plastic_strain", np.float64),   # accumulated: the integral of sqrt(2/3 dev(d) : dev(d))
    ("opened", np.float64),           # volumetric strain to close before the soil pushes
    ("plastic_work", np.float64),     # taken by plastic flow, per undeformed volume [J/m^3]
    ("kirchhoff_stress", np.float64, (3, 3)),  # at the end of the step [Pa]
])
ELASTIC, OPEN = 0, 1

D = 2  # fixed by specialise


@called
def _along2(S, n):
    """n . S n in the plane."""
    return S[0, 0] * n[0] * n[0] + S[1, 1] * n[1] * n[1] + 2.0 * S[0, 1] * n[0] * n[1]


@called
def _along3(S, n):
    """The same in space."""
    return (S[0, 0] * n[0] * n[0] + S[1, 1] * n[1] * n[1] + S[2, 2] * n[2] * n[2]
            + 2.0 * (S[0, 1] * n[0] * n[1] + S[1, 2] * n[1] * n[2] + S[2, 0] * n[2] * n[0]))


def accumulate(old, new, n, e, ee, t, region):
    """Fill ``new`` but for Cp and stress: the elastic strains ee belong to the stresses t in the axes n, the
    rest of e is plastic, and what had opened before is not of this step. Returns whether Cp changes."""
    if region == ELASTIC and old.opened == 0.0:
        new.plastic_strain, new.opened = old.plastic_strain, 0.0
        new.plastic_work = old.plastic_work
        return False
    f1, f2, f3 = e[0] - ee[0], e[1] - ee[1], e[2] - ee[2]
    square = (f1 - f2) ** 2 + (f2 - f3) ** 2 + (f3 - f1) ** 2  # three times the square of the deviator
    new.plastic_strain = old.plastic_strain + math.sqrt(2.0 * square) / 3.0
    new.opened = max(f1 + f2 + f3, 0.0) if region == OPEN else 0.0
    S, ahead = old.kirchhoff_stress, old.opened / 3.0
    if D == 2:
        s1, s2, s3 = _along2(S, n[0]), _along2(S, n[1]), S[2, 2]
    else:
        s1, s2, s3 = _along3(S, n[0]), _along3(S, n[1]), _along3(S, n[2])
    new.plastic_work = old.plastic_work + 0.5 * (
        (s1 + t[0]) * (f1 - ahead) + (s2 + t[1]) * (f2 - ahead) + (s3 + t[2]) * (f3 - ahead))
    return True


def keep_stress(new, t, n):
    """The principal stresses t in the axes n."""
    for i in range(D):
        if D == 2:
            row = combine2(t[0] * n[0][i], t[1] * n[1][i], n)
            new.kirchhoff_stress[i, 0], new.kirchhoff_stress[i, 1] = row
        else:
            row = combine3(t[0] * n[0][i], t[1] * n[1][i], t[2] * n[2][i], n)
            for j in range(3):
                new.kirchhoff_stress[i, j] = row[j]
    if D == 2:
        new.kirchhoff_stress[2, 2] = t[2]


def remember(F33, old, new, m, ee, flows):
    """Cp in ``new``, where it ``flows`` that of the elastic strains ee in the axes m."""
    if not flows:
        for i in range(3):
            for j in range(3):
                new.plastic[i, j] = old.plastic[i, j]
        return
    squares = (math.exp(2.0 * ee[0]), math.exp(2.0 * ee[1]), math.exp(2.0 * ee[2]))
    for i in range(D):
        if D == 2:
            row = combine2(squares[0] * m[0][i], squares[1] * m[1][i], m)
            new.plastic[i, 0], new.plastic[i, 1] = row
        else:
            row = combine3(squares[0] * m[0][i], squares[1] * m[1][i], squares[2] * m[2][i], m)
            new.plastic[i, 0], new.plastic[i, 1], new.plastic[i, 2] = row
        new.plastic[i, i] -= 1.0
    if D == 2:
        new.plastic[2, 2] = squares[2] / (F33 * F33) - 1.0
