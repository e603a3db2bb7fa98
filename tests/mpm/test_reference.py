"""What has flowed far goes on from a new reference, as if nothing had been."""
import numpy as np
import pytest

from mpm_fenicsx import MPM, Body, Box, Grid, Support, drucker_prager, mohr_coulomb, neo_hooke, von_mises
from mpm_fenicsx.laws import kernels
from mpm_fenicsx.laws.reference import FAR, renewal

LAWS = {"Mohr-Coulomb": mohr_coulomb(1e6, 0.3, 30.0, cohesion=1e3),
        "Drucker-Prager": drucker_prager(1e6, 0.3, 30.0, cohesion=1e3),
        "von Mises": von_mises(1e6, 0.3, 1e3, 1e4)}


def led(law, step, count, renew=None):
    """Kirchhoff stresses of a point that is deformed by ``step`` again and again, and its F and state at the
    end; ``renew`` before each step."""
    dim, (stress, _) = len(step), kernels(law, len(step))
    F, old, new, taus = np.eye(dim)[None], np.zeros(1, law.state), np.zeros(1, law.state), []
    for _ in range(count):
        if renew is not None:
            renew(F, old)
        F, P = (step @ F[0])[None], np.zeros(dim * dim + 1)
        stress(law.params, F[0], 1.0, 0.1, old[0], new[0], P)
        taus.append(P[:dim * dim].reshape(dim, dim) @ F[0].T)
        old, new = new, old
    return np.array(taus), F, old


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("name", LAWS)
def test_nothing_changes(name, dim):
    law, step = LAWS[name], np.eye(dim)
    step[0, 1] = 0.05  # simple shear
    expected, F, state = led(law, step, 240)
    found, F_new, state_new = led(law, step, 240, renewal(law, dim))
    assert np.abs(F).max() > 11.0 and np.abs(F_new).max() <= FAR + 1.0
    scale = np.abs(expected).max()
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9 * scale)  # of which b has lost some digits
    assert np.linalg.det(F_new) == pytest.approx(np.linalg.det(F), rel=1e-12)
    for field in ("plastic_strain", "opened", "plastic_work"):
        np.testing.assert_allclose(state_new[field], state[field], rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("name", ["Mohr-Coulomb", "Drucker-Prager"])
def test_flow_goes_on_for_ever(name):
    """Stretched by e^20 in a direction that is not an axis; without a new reference the stress is lost."""
    law, Q = LAWS[name], np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    step = Q @ np.diag(np.exp([0.01, 0.0, -0.01])) @ Q.T
    taus, _, _ = led(law, step, 2000, renewal(law, 3))
    kept = taus[100]  # perfectly plastic
    np.testing.assert_allclose(taus[-1], kept, rtol=0, atol=1e-6 * np.abs(kept).max())
    assert not np.allclose(led(law, step, 2000)[0][-1], kept, rtol=0, atol=0.1 * np.abs(kept).max())


def test_only_where_b_is_all_there_is():
    for law in neo_hooke(1e6, 0.3), mohr_coulomb(1e6, 0.3, 30.0, viscosity=1.0):
        assert renewal(law, 3) is None


def test_a_body_that_flows_gets_new_references():
    """A layer of soil that is dragged along at its top."""
    grid = Grid(Box((0.0, 0.0), (1.0, 0.5)), (4, 2))
    body = Body(grid.box, (4, 2), 2, von_mises(1e4, 0.3, 10.0), 1000.0)
    ends = [Support(lambda x: x[:, 1] < 0.01, "xy"),
            Support(lambda x: x[:, 1] > 0.49, "xy", lambda t: (t, 0.0))]
    solid = MPM(grid, body, ends, outflow="remove")
    for _ in range(60):
        solid.advance(0.01)
    assert np.abs(solid.points.F).max() <= FAR + 1.0
