"""Laws at a batch of points at once give what they give point by point."""
import numpy as np
import pytest

from mpm_fenicsx import (
    cam_clay,
    drucker_prager,
    herschel_bulkley,
    mohr_coulomb,
    mu_i,
    neo_hooke,
    von_mises,
)
from mpm_fenicsx.laws import kernels
from mpm_fenicsx.laws.batches import SIZE, batch_functions
from mpm_fenicsx.terms.fields import Deformation

DT, COUNT = 0.1, SIZE + 11  # a whole batch and a part of one
MC = dict(E=1.0, nu=0.3, friction_angle=30.0, dilation_angle=10.0, cohesion=0.01)
LAWS = {"Mohr-Coulomb": mohr_coulomb(**MC), "cut": mohr_coulomb(**MC, tension_cutoff=0.004),
        "viscous": mohr_coulomb(**MC, viscosity=0.02), "Drucker-Prager": drucker_prager(**MC),
        "von Mises": von_mises(1.0, 0.3, 0.03, 0.2), "clay": cam_clay(25.0, 0.1, 0.02, 0.4, 0.01, 0.005),
        "grains": mu_i(1.0, 0.3, 0.38, 0.64, 0.28, 0.1, 1.0),
        "mud": herschel_bulkley(0.8, 0.02, 0.01, 0.5, 0.4),
        "rubber": neo_hooke(1.0, 0.3)}


def random_points(size, D, seed=0):
    """F of points that are deformed by about that ``size``, the first of them not at all, and F33."""
    change = np.random.default_rng(seed).standard_normal((COUNT, 3, 3))
    change[0] = 0.0
    F = np.eye(3) + size * change
    return np.ascontiguousarray(F[:, :D, :D]), np.ones(COUNT) if D == 3 else np.maximum(F[:, 2, 2], 0.1)


def in_batches(law, old, F, V0):
    """P, B and the new state."""
    D = F.shape[1]
    batch = batch_functions(law, "plane_strain", D)
    P, B = np.zeros((COUNT, D * D + 1)), np.zeros((COUNT, D, D, D, D))
    stress, new = P.copy(), Deformation(F, np.zeros(COUNT), old.state.copy())
    for first in range(0, COUNT, SIZE):
        here = part = np.arange(first, min(first + SIZE, COUNT), dtype=np.int32)
        out = (np.zeros((SIZE, D * D + 1)), np.zeros((SIZE, D, D, D, D)))
        batch.stress(law.params, DT, old, new, part, batch.work(), out[0])
        stress[here] = out[0][:len(part)]
        new.F33[here] = old.F33[here]  # the tangent starts with what the stress has found
        batch.tangent(law.params, DT, old, new, part, V0, batch.tangent_work(), out)
        P[here], B[here] = out[0][:len(part)], out[1][:len(part)]
    # both are compiled apart, so round-off may differ
    np.testing.assert_allclose(stress, P, rtol=0, atol=1e-13 * np.nanmax(np.abs(P)))
    return P, B, new


def one_by_one(law, old, F, V0):
    D = F.shape[1]
    _, tangent = kernels(law, D)
    P, B, new = np.zeros((COUNT, D * D + 1)), np.zeros((COUNT, D, D, D, D)), old.state.copy()
    for q in range(COUNT):
        A = np.zeros((D * D + 1, D * D + 1))
        tangent(law.params, F[q], old.F33[q], DT, old.state[q], new[q], P[q], A)
        B[q] = V0[q] * np.einsum("jJ,iJkL,lL->ijkl", F[q], A[:-1, :-1].reshape(D, D, D, D), F[q])
    return P, B, new


@pytest.mark.parametrize("size", [0.003, 0.03, 0.3])
@pytest.mark.parametrize("name, D", [*((name, 3) for name in LAWS), ("Mohr-Coulomb", 2), ("cut", 2),
                                     ("clay", 2), ("rubber", 2)])
def test_batches_are_points(name, D, size):
    """Two steps, so that what the law remembers counts; up to strains beyond the reach of the series."""
    law, V0 = LAWS[name], np.linspace(1.0, 2.0, COUNT)
    F, F33 = random_points(size, D)
    old = Deformation(np.tile(np.eye(D), (COUNT, 1, 1)), F33, np.zeros(COUNT, law.state))
    for seed in (1, 2):
        P, B, new = in_batches(law, old, F, V0)
        expected = one_by_one(law, old, F, V0)
        good = np.linalg.det(F) > 0.0
        assert good.sum() > COUNT // 2
        for found, right in ((P, expected[0]), (B, expected[1])):
            scale = np.nanmax(np.abs(right[good]))
            np.testing.assert_allclose(found[good], right[good], rtol=0, atol=1e-11 * scale)
        assert name == "rubber" or np.isnan(P[~good]).any(axis=1).all()  # turned inside out
        for field in law.state.names:
            right = expected[2][field][good]
            np.testing.assert_allclose(new.state[field][good], right, rtol=0,
                                       atol=1e-12 * max(1.0, np.nanmax(np.abs(right))))
        old = Deformation(F, F33, np.where(good, expected[2], old.state))
        F = F @ random_points(0.5 * size, D, seed)[0]
