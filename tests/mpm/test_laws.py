"""Every law in every stress state: derivatives, invariance, limits, domain. Stresses are in units of E =
1."""
import numpy as np
import pytest

from mpm_fenicsx import LAWS, linear, neo_hooke
from mpm_fenicsx.laws import lame

EPS = np.finfo(float).eps
SEEDS = range(4)


def deformation(dim, seed, size=0.3):
    """Gradient with entries up to ``size`` around the identity, and a direction to change it in."""
    random = np.random.default_rng(seed)
    return np.eye(dim) + random.uniform(-size, size, (dim, dim)), random.uniform(-1, 1, (dim, dim))


def rotation(dim, seed):
    Q = np.linalg.qr(np.random.default_rng(seed).normal(size=(dim, dim)))[0]
    return Q * np.linalg.det(Q) if dim == 3 else np.column_stack([Q[:, 0], np.linalg.det(Q) * Q[:, 1]])


@pytest.mark.parametrize("seed", SEEDS)
def test_tangent_is_the_derivative_of_the_stress(law, stress_state, at_point, taylor_rate, seed):
    point = at_point(law, stress_state)
    F, dF = deformation(point.dim, seed)
    rate = taylor_rate(lambda h: point.P(F + h * dF), np.einsum("ijkl,kl", point.A(F), dF))
    assert rate == pytest.approx(2.0, abs=0.01)


@pytest.mark.parametrize("seed", SEEDS)
def test_stress_is_the_derivative_of_the_energy(law, stress_state, at_point, taylor_rate, seed):
    point = at_point(law, stress_state)
    F, dF = deformation(point.dim, seed)
    assert taylor_rate(lambda h: point.W(F + h * dF), np.sum(point.P(F) * dF)) == pytest.approx(2.0, abs=0.01)


@pytest.mark.parametrize("seed", SEEDS)
def test_rotating_the_deformed_body_rotates_the_stress(law, stress_state, at_point, seed):
    """P(QF) = Q P(F), W(QF) = W(F)."""
    point = at_point(law, stress_state)
    F, Q = deformation(point.dim, seed)[0], rotation(point.dim, seed)
    np.testing.assert_allclose(point.P(Q @ F), Q @ point.P(F), rtol=0, atol=30 * EPS)
    assert point.W(Q @ F) == pytest.approx(point.W(F), abs=30 * EPS)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_rotation_makes_no_stress(law, stress_state, at_point, seed):
    point = at_point(law, stress_state)
    Q = rotation(point.dim, seed)
    assert abs(point.P(Q)).max() < 10 * EPS and abs(point.W(Q)) < 10 * EPS
    assert point.F33(Q) == pytest.approx(1.0, abs=10 * EPS)


@pytest.mark.parametrize("seed", SEEDS)
def test_tangent_is_symmetric(law, stress_state, at_point, seed):
    """It is the second derivative of an energy."""
    point = at_point(law, stress_state)
    A = point.A(deformation(point.dim, seed)[0])
    np.testing.assert_allclose(A, A.transpose(2, 3, 0, 1), rtol=0, atol=30 * EPS)


@pytest.mark.parametrize("seed", SEEDS)
def test_stress_comes_out_the_same_with_and_without_tangent(law, stress_state, at_point, seed):
    point = at_point(law, stress_state)
    F = deformation(point.dim, seed)[0]
    np.testing.assert_allclose(point.tangent_P(F), point.P(F), rtol=0, atol=10 * EPS)


def test_at_rest_the_tangent_is_hookes(law, stress_state, at_point):
    """lam 1x1 + 2 mu sym, with lam* = 2 lam mu / (lam + 2 mu) in plane stress."""
    point = at_point(law, stress_state)
    lam, mu = lame(1.0, 0.3)
    if stress_state == "plane_stress":
        lam = 2 * lam * mu / (lam + 2 * mu)
    one = np.eye(point.dim)
    hooke = (lam * np.einsum("ij,kl->ijkl", one, one)
             + mu * (np.einsum("ik,jl->ijkl", one, one) + np.einsum("il,jk->ijkl", one, one)))
    np.testing.assert_allclose(point.A(one), hooke, rtol=0, atol=10 * EPS)


def test_the_plane_is_a_slice_of_space(law, at_point):
    """Plane strain equals three dimensions with F33 = 1; plane stress with the F33 that frees the
    thickness."""
    F, space = deformation(2, 0)[0], at_point(law, "three_dimensional")
    for plane in (at_point(law, "plane_strain"), at_point(law, "plane_stress")):
        full = np.eye(3)
        full[:2, :2], full[2, 2] = F, plane.F33(F)
        P = space.P(full)
        np.testing.assert_allclose(plane.P(F), P[:2, :2], rtol=0, atol=10 * EPS)
        assert plane.P33(F) == pytest.approx(P[2, 2], abs=10 * EPS)
        assert plane.W(F) == pytest.approx(space.W(full), abs=10 * EPS)


@pytest.mark.parametrize("seed", SEEDS)
def test_plane_stress_leaves_the_thickness_free(law, at_point, seed):
    point = at_point(law, "plane_stress")
    F = deformation(2, seed)[0]
    assert abs(point.P33(F)) < 10 * EPS
    # the same F does press where the thickness is held
    assert abs(at_point(law, "plane_strain").P33(F)) > 1e-3


@pytest.mark.parametrize("seed", SEEDS)
def test_general_plane_stress_agrees_with_the_closed_form(at_point, seed):
    """The Newton iteration on F33 finds what the linear law knows."""
    law = LAWS["linear"](1.0, 0.3)
    closed, general = at_point(law, "plane_stress"), at_point(law._replace(thickness=None), "plane_stress")
    F = deformation(2, seed)[0]
    assert general.F33(F) == pytest.approx(closed.F33(F), rel=10 * EPS)
    np.testing.assert_allclose(general.P(F), closed.P(F), rtol=0, atol=30 * EPS)
    np.testing.assert_allclose(general.A(F), closed.A(F), rtol=0, atol=100 * EPS)


@pytest.mark.parametrize("nu", [-0.5, 0.0, 0.49])
def test_derivatives_hold_over_the_range_of_nu(make_law, nu, at_point, taylor_rate):
    for stress_state in ("plane_strain", "plane_stress"):
        point = at_point(make_law(1.0, nu), stress_state)
        F, dF = deformation(2, 5, size=0.1)
        rate = taylor_rate(lambda h, P=point.P, F=F, dF=dF: P(F + h * dF), np.einsum("ijkl,kl", point.A(F),
                                                                                     dF))
        assert rate == pytest.approx(2.0, abs=0.01)


@pytest.mark.parametrize("stress_state", ["plane_strain", "plane_stress", "three_dimensional"])
def test_a_body_turned_inside_out_has_no_neo_hookean_stress(stress_state, at_point):
    point = at_point(neo_hooke(1.0, 0.3), stress_state)
    F = np.eye(point.dim)
    F[0, 0] = -0.5
    assert np.isnan(point.P(F)).all() and np.isnan(point.A(F)).any() and np.isnan(point.W(F))


def test_no_stretch_frees_a_linear_body_that_is_drawn_too_far(at_point):
    """S33 = 0 needs F33^2 = 1 - 2 lam / (lam + 2 mu) tr E > 0."""
    law, F = linear(1.0, 0.3), 2.0 * np.eye(2)
    for point in (at_point(law, "plane_stress"), at_point(law._replace(thickness=None), "plane_stress")):
        assert np.isnan(point.F33(F)) and np.isnan(point.P(F)).all()


def test_old_state_stays(law, at_point):
    stress, tangent = at_point(law, "three_dimensional").kernels
    old, new = np.ones(2, law.state)[:, None]
    P, A, F = np.zeros(10), np.zeros((10, 10)), deformation(3, 1)[0]
    for call in (lambda: stress(law.params, F, 1.0, 0.1, old[0], new[0], P),
                 lambda: tangent(law.params, F, 1.0, 0.1, old[0], new[0], P, A)):
        before, F_before = old.tobytes(), F.copy()
        call()
        assert old.tobytes() == before and np.array_equal(F, F_before)


def test_lame_parameters():
    """Uniaxial stress: E = mu (3 lam + 2 mu) / (lam + mu), nu = lam / 2 (lam + mu)."""
    lam, mu = lame(210e9, 0.3)
    assert mu * (3 * lam + 2 * mu) / (lam + mu) == pytest.approx(210e9)
    assert lam / (2 * (lam + mu)) == pytest.approx(0.3)


@pytest.mark.parametrize("E, nu, word", [(0.0, 0.3, "E is 0.0 Pa"), (-1.0, 0.3, "E is"),
                                         (np.nan, 0.3, "E is"), (1.0, 0.5, "nu is 0.5"), (1.0, -1.0, "nu is"),
                                         (1.0, np.nan, "nu is")])
def test_impossible_elastic_constants(make_law, E, nu, word):
    with pytest.raises(ValueError, match=word):
        make_law(E, nu)
