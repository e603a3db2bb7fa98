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

STATE = np.dtype([
    ("plastic", np.float64, (6,)),           # Cp^-1 - 1, stored as in ``algebra``, zero at the start
    ("plastic_strain", np.float64),          # accumulated: the integral of sqrt(2/3 dev(d) : dev(d))
    ("opened", np.float64),                  # volumetric strain to close before the soil pushes
    ("plastic_work", np.float64),            # taken by plastic flow, per undeformed volume [J/m^3]
    ("kirchhoff_stress", np.float64, (6,)),  # at the end of the step [Pa], stored likewise
])
ELASTIC, OPEN = 0, 1
THIRD = 1.0 / 3.0  # products take less than divisions

D = 2  # fixed by specialise


@called
def _along2(S, n):
    """n . S n in the plane."""
    return S[0] * n[0] * n[0] + S[1] * n[1] * n[1] + 2.0 * S[3] * n[0] * n[1]


@called
def _along3(S, n):
    """The same in space."""
    return (S[0] * n[0] * n[0] + S[1] * n[1] * n[1] + S[2] * n[2] * n[2]
            + 2.0 * (S[3] * n[0] * n[1] + S[4] * n[1] * n[2] + S[5] * n[2] * n[0]))


@called
def _fill2(S, t, n):
    """S = t_1 n1 n1 + t_2 n2 n2, with t_3 across the plane."""
    S[0] = t[0] * n[0][0] * n[0][0] + t[1] * n[1][0] * n[1][0]
    S[1] = t[0] * n[0][1] * n[0][1] + t[1] * n[1][1] * n[1][1]
    S[2] = t[2]
    S[3] = t[0] * n[0][0] * n[0][1] + t[1] * n[1][0] * n[1][1]


@called
def _fill3(S, t, n):
    """The same in space."""
    for i in range(3):
        j = (i + 1) % 3
        S[i] = t[0] * n[0][i] * n[0][i] + t[1] * n[1][i] * n[1][i] + t[2] * n[2][i] * n[2][i]
        S[3 + i] = t[0] * n[0][i] * n[0][j] + t[1] * n[1][i] * n[1][j] + t[2] * n[2][i] * n[2][j]


def accumulate(old, new, n, e, ee, t, region):
    """Fill ``new`` but for Cp and stress: the elastic strains ee belong to the stresses t in the axes n, the
    rest of e is plastic, and what had opened before is not of this step. Returns whether Cp changes."""
    if region == ELASTIC and old.opened == 0.0:
        new.plastic_strain, new.opened = old.plastic_strain, 0.0
        new.plastic_work = old.plastic_work
        return False
    f1, f2, f3 = e[0] - ee[0], e[1] - ee[1], e[2] - ee[2]
    square = (f1 - f2) ** 2 + (f2 - f3) ** 2 + (f3 - f1) ** 2  # three times the square of the deviator
    new.plastic_strain = old.plastic_strain + THIRD * math.sqrt(2.0 * square)
    new.opened = max(f1 + f2 + f3, 0.0) if region == OPEN else 0.0
    S, ahead = old.kirchhoff_stress, THIRD * old.opened
    if D == 2:
        s1, s2, s3 = _along2(S, n[0]), _along2(S, n[1]), S[2]
    else:
        s1, s2, s3 = _along3(S, n[0]), _along3(S, n[1]), _along3(S, n[2])
    new.plastic_work = old.plastic_work + 0.5 * (
        (s1 + t[0]) * (f1 - ahead) + (s2 + t[1]) * (f2 - ahead) + (s3 + t[2]) * (f3 - ahead))
    return True


def keep_stress(new, t, n):
    """The principal stresses t in the axes n."""
    if D == 2:
        _fill2(new.kirchhoff_stress, t, n)
    else:
        _fill3(new.kirchhoff_stress, t, n)


def remember(F33, old, new, m, ee, flows):
    """Cp in ``new``, where it ``flows`` that of the elastic strains ee in the axes m."""
    C = new.plastic
    if not flows:
        for k in range(6):
            C[k] = old.plastic[k]
        return
    x, y, z = math.exp(2.0 * ee[0]), math.exp(2.0 * ee[1]), math.exp(2.0 * ee[2])
    if D == 2:
        _fill2(C, (x, y, z / (F33 * F33)), m)
    else:
        _fill3(C, (x, y, z), m)
    for i in range(3):
        C[i] -= 1.0
