"""Element tests of the plastic laws against closed forms, and what their parameters may be. Stresses in units
of E."""
import numpy as np
import pytest
from scipy.optimize import newton

from mpm_fenicsx import drucker_prager, mohr_coulomb, von_mises
from mpm_fenicsx.laws import algebra
from mpm_fenicsx.laws.algebra import whole

PHI, PSI, C, P0 = 30.0, 10.0, 0.002, 0.01
N = np.tan(np.radians(45 + PHI / 2)) ** 2
M = np.tan(np.radians(45 + PSI / 2)) ** 2
K = 1 / (3 * (1 - 2 * 0.3))  # bulk modulus


def soil(make, psi=PSI, c=C, **others):
    return make(1.0, 0.3, PHI, psi, c, **others)


def compressed(point, axial, lateral_stress, guess):
    """Step to the axial log strain under that lateral stress; returns stresses (lateral, across, axial) and
    the lateral log strain. Axis: the last of the space or the plane."""
    dim = point.dim

    def F(lateral):
        return np.diag(np.exp([lateral] * (dim - 1) + [axial]))

    lateral = newton(lambda e: point.tau(F(e))[0, 0] - lateral_stress, guess, tol=1e-15, maxiter=100)
    tau = point.step(F(lateral))
    return (tau[0, 0], tau[2, 2], tau[1, 1]) if dim == 2 else (tau[0, 0], tau[1, 1], tau[2, 2]), lateral


def but_for_stress(state):
    """What a law remembers besides, as bytes."""
    return [state[name].tobytes() for name in state.dtype.names if name != "kirchhoff_stress"]


def path(point, strains, lateral_stress=-P0):
    """Axial log strains under constant lateral stress; rows of stresses (lateral, across, axial), lateral
    strains."""
    rows, guess = [], 0.0
    for axial in strains:
        stresses, guess = compressed(point, axial, lateral_stress, guess)
        rows.append((*stresses, guess))
    return np.array(rows)


# ---------------------------------------------------------------- soils

@pytest.mark.parametrize("make", [mohr_coulomb, drucker_prager])
def test_triaxial_compression(make, element):
    """-t3 = N p0 + 2 c sqrt(N), d ln J / d e3 = 1 - M; the cone touches the pyramid here."""
    strains = -np.linspace(0.005, 0.15, 30)
    rows = path(element(soil(make), 3), strains)
    np.testing.assert_allclose(rows[-20:, 2], -(N * P0 + 2 * C * np.sqrt(N)), rtol=1e-12)
    np.testing.assert_allclose(rows[:, 0], rows[:, 1], rtol=1e-12)
    volume = 2 * rows[:, 3] + strains
    np.testing.assert_allclose(np.diff(volume)[-20:] / np.diff(strains)[-20:], 1 - M, rtol=1e-9)


@pytest.mark.parametrize("make, others", [(mohr_coulomb, {}), (drucker_prager, dict(match="extension"))])
def test_triaxial_extension(make, others, element):
    """-t1 = (p0 - 2 c sqrt(N)) / N, d ln J / d e1 = 1 - 1/M."""
    strains = np.linspace(0.005, 0.15, 30)
    rows = path(element(soil(make, **others), 3), strains)
    np.testing.assert_allclose(rows[-20:, 2], -(P0 - 2 * C * np.sqrt(N)) / N, rtol=1e-11)
    volume = 2 * rows[:, 3] + strains
    np.testing.assert_allclose(np.diff(volume)[-20:] / np.diff(strains)[-20:], 1 - 1 / M, rtol=1e-9)


@pytest.mark.parametrize("make, others", [(mohr_coulomb, {}), (drucker_prager, dict(match="plane_strain"))])
@pytest.mark.parametrize("psi", [0.0, PSI, PHI])
def test_plane_strain_compression(make, others, psi, element):
    """As triaxial compression, with the stress across the plane in between; the cone gets there as it
    flows."""
    strains = -np.linspace(0.005, 0.6, 120)
    rows = path(element(soil(make, psi, **others), 2), strains)
    rtol = 1e-11 if make is mohr_coulomb else 1e-6
    np.testing.assert_allclose(rows[-20:, 2], -(N * P0 + 2 * C * np.sqrt(N)), rtol=rtol)
    assert (rows[20:, 1] < rows[20:, 0]).all() and (rows[20:, 1] > rows[20:, 2]).all()
    slope = 1 - np.tan(np.radians(45 + psi / 2)) ** 2
    volume = rows[:, 3] + strains
    np.testing.assert_allclose(np.diff(volume)[-20:] / np.diff(strains)[-20:], slope, rtol=rtol, atol=rtol)


@pytest.mark.parametrize("make, others", [(mohr_coulomb, {}), (drucker_prager, dict(match="plane_strain"))])
def test_simple_shear_without_dilation(make, others, element, dim):
    """Shear keeps the volume, so the mean stress stays at -p0 and the radius grows to p0 sin(phi) + c
    cos(phi)."""
    point = element(soil(make, 0.0, **others), dim)
    squeezed = np.exp(-P0 / K / 3) * np.eye(dim)
    if dim == 2:  # the same pressure across the plane
        point.old["plastic"][2] = np.exp(-2 * P0 / K / 3) - 1
    for gamma in np.linspace(0, 2, 40):
        shear = np.eye(dim)
        shear[0, 1] = gamma
        tau = point.step(shear @ squeezed)
        assert np.trace(tau) / 3 == pytest.approx(-P0, rel=1e-11)
    radius = np.hypot(0.5 * (tau[0, 0] - tau[1, 1]), tau[0, 1])
    assert radius == pytest.approx(P0 * np.sin(np.radians(PHI)) + C * np.cos(np.radians(PHI)), rel=1e-9)


@pytest.mark.parametrize("make", [mohr_coulomb, drucker_prager])
@pytest.mark.parametrize("cutoff", [None, 0.0, 0.001])
def test_isotropic_tension(make, cutoff, element):
    """tau = K ln J up to the apex c cot(phi) or the cut-off; what is beyond has opened, and closes before it
    pushes."""
    limit = C / np.tan(np.radians(PHI)) if cutoff is None else cutoff
    point, opened = element(soil(make, tension_cutoff=cutoff), 3), 0.0
    for volume in (0.001, 0.01, 0.2, 0.05, 0.01, 0.0, -0.01, 0.1, 0.3, -0.02, 0.005, 0.0):
        tau = point.step(np.exp(volume / 3) * np.eye(3))
        np.testing.assert_allclose(tau, min(K * volume, limit) * np.eye(3), rtol=0, atol=2e-15)
        opened = max(volume - limit / K, 0.0)
        assert point.old["opened"] == pytest.approx(opened, abs=2e-15)


@pytest.mark.parametrize("make", [mohr_coulomb, drucker_prager])
def test_separated_soil_is_not_larger_when_it_comes_together(make, element, dim):
    """Torn apart and turned about, it bears at its old volume again, and only there. (Dilation would fill the
    gap.)"""
    random = np.random.default_rng(0)
    point = element(soil(make, psi=0.0, c=0.0), dim)
    for _ in range(50):
        change = random.normal(0, 0.05, (dim, dim))
        F = np.eye(dim) + change
        F *= (np.exp(random.uniform(0.02, 0.3)) / np.linalg.det(F)) ** (1 / dim)
        assert not point.step(F).any()
        assert point.old["opened"] == pytest.approx(np.log(np.linalg.det(F)), rel=1e-11)
    F *= (np.exp(1e-6) / np.linalg.det(F)) ** (1 / dim)
    assert not point.step(F).any()
    F *= (np.exp(-0.02) / np.linalg.det(F)) ** (1 / dim)
    assert np.trace(point.step(F)) / 3 == pytest.approx(-0.02 * K, rel=1e-11) and point.old["opened"] == 0.0


# ---------------------------------------------------------------- metals

Y, H = 0.003, 0.05


@pytest.mark.parametrize("hardening", [0.0, H])
def test_uniaxial_stress_of_a_metal(hardening, element):
    """tau = Y + H (e - tau / E), and the plastic strain is e - tau / E: logarithmic strains add up. Unloading
    is elastic, and the metal yields again, the other way round, at -(Y + H alpha)."""
    point, strains = element(von_mises(1.0, 0.3, Y, hardening), 3), np.linspace(0.005, 0.3, 60)
    rows = path(point, strains, lateral_stress=0.0)
    tau = (Y + hardening * strains) / (1 + hardening)
    np.testing.assert_allclose(rows[:, 2], tau, rtol=1e-10)
    alpha = strains[-1] - tau[-1]
    assert point.old["plastic_strain"] == pytest.approx(alpha, rel=1e-10)
    # the mean of the stresses at both ends of a step; at the start of the first there is none in place of Y
    work = Y * alpha + 0.5 * hardening * alpha**2 - 0.5 * Y * (strains[0] - tau[0])
    assert point.old["plastic_work"] == pytest.approx(work, rel=1e-9)
    kept, guess = but_for_stress(point.old), rows[-1, 3]
    for change in (0.5, 1.0, 1.5, 1.9):
        stresses, guess = compressed(point, strains[-1] - change * tau[-1], 0.0, guess)
        assert stresses[2] == pytest.approx((1 - change) * tau[-1], abs=1e-13)
        assert but_for_stress(point.old) == kept
    stresses, _ = compressed(point, strains[-1] - 2.5 * tau[-1], 0.0, guess)
    assert stresses[2] == pytest.approx(-tau[-1] - hardening / (1 + hardening) * 0.5 * tau[-1], rel=1e-9)


def test_simple_shear_of_a_metal(element, dim):
    """The radius stays at Y / sqrt(3), however far it is sheared."""
    point = element(von_mises(1.0, 0.3, Y), dim)
    for gamma in np.linspace(0.01, 5, 100):
        F = np.eye(dim)
        F[0, 1] = gamma
        tau = point.step(F)
        assert np.hypot(0.5 * (tau[0, 0] - tau[1, 1]), tau[0, 1]) == pytest.approx(Y / np.sqrt(3), rel=1e-9)
        assert abs(np.trace(tau)) < 1e-12


# ---------------------------------------------------------------- all

ALL = {"pyramid": soil(mohr_coulomb, c=0.0), "cone": soil(drucker_prager, c=0.0),
       "pyramid, c": soil(mohr_coulomb), "cone, c": soil(drucker_prager), "metal": von_mises(1.0, 0.3, Y, H)}


@pytest.fixture(params=[2, 3])
def dim(request):
    return request.param


@pytest.fixture(params=ALL)
def any_law(request):
    return ALL[request.param]


def trial_strain(point, F):
    """ln b / 2 of b = F Cp_old^-1 F^T in space."""
    stretch2, n = np.linalg.eigh(F @ (np.eye(3) + whole(point.old["plastic"])) @ F.T)
    return n @ np.diag(0.5 * np.log(stretch2)) @ n.T


def elastic_strain(tau):
    return 1.3 * tau - 0.3 * np.trace(tau) * np.eye(3)


def test_flow_does_no_negative_work(element, any_law):
    """tau : (trial strain - elastic strain), the trial strain of F Cp_old^-1 F^T, which has the axes of
    tau."""
    point, random, total = element(any_law, 3), np.random.default_rng(1), 0.0
    for _ in range(300):
        F = np.eye(3) + random.normal(0, 0.02, (3, 3)) + random.normal(-0.01, 0.02) * np.eye(3)
        strain, opened, tau = trial_strain(point, F), point.old["opened"], point.step(F)
        work = np.sum(tau * (strain - elastic_strain(tau)))
        total += work
        assert work > -1e-15 or opened > 0  # closing at a tension gives back the work of opening
        assert total > 0 or work > -1e-15
    assert total > 1e-3


def test_work_of_the_mean_stress_is_energy_and_plastic_work(element, any_law):
    """On the change of logarithmic strain, in every step to round-off: elastic ones, those in which soil
    begins to flow, turns round, opens and closes. In leaps as long as these some work is negative."""
    point, random, tau, taken = element(any_law, 3), np.random.default_rng(2), np.zeros((3, 3)), []
    regions = set()
    for _ in range(300):
        F = np.eye(3) + random.normal(0, 0.01, (3, 3)) + random.normal(-0.002, 0.01) * np.eye(3)
        before, plastic, mean = elastic_strain(tau), float(point.old["plastic_work"]), 0.5 * tau
        strain, opened = trial_strain(point, F), point.old["opened"] > 0.0
        tau = point.step(F)
        regions.add((bool(opened), point.region))
        mean = mean + 0.5 * tau
        work = np.sum(mean * (strain - before))
        gained = np.sum(mean * (elastic_strain(tau) - before))  # of the energy, which is quadratic
        taken.append(float(point.old["plastic_work"]) - plastic)
        assert taken[-1] == pytest.approx(work - gained, rel=1e-8, abs=1e-15)
        np.testing.assert_allclose(whole(point.old["kirchhoff_stress"]), tau, rtol=0, atol=1e-14)
    assert max(taken) > 1e-6 and len(regions) >= (2 if any_law is ALL["metal"] else 4)


def test_elastic_cycles_leave_no_trace(element, any_law, dim):
    """Unloaded from the yield surface and cycled inside, the state but for its stress stays bit for bit."""
    point = element(any_law, dim)
    F, shear = 0.98 * np.eye(dim), np.eye(dim, k=1)
    point.step(F + 0.1 * shear)
    kept = but_for_stress(point.old)
    first, second = (point.step(F + g * shear) for g in (0.0999, 0.0995))
    for _ in range(20):
        assert np.array_equal(point.step(F + 0.0999 * shear), first)
        assert np.array_equal(point.step(F + 0.0995 * shear), second)
    assert but_for_stress(point.old) == kept and point.old["plastic_strain"] > 0


def test_closed_cycles_of_flow_settle(element, any_law):
    """After the first cycles the same path gives the same stresses again (with hardening: elastic
    shakedown)."""
    point, last = element(any_law, 2), None
    for cycle in range(60):
        taus = np.array([point.step([[0.98, g], [0.0, 0.99]])
                         for g in 0.05 * np.sin(np.linspace(0, 2 * np.pi, 20))])
        if cycle > 50:
            np.testing.assert_allclose(taus, last, rtol=0, atol=1e-3 * abs(taus).max())
        last = taus


@pytest.mark.parametrize("make, values, message",
                         [(mohr_coulomb, dict(friction_angle=90.0), "friction_angle is 90.0 degrees: give at "
                           "least 0 and " "less than 90"), (mohr_coulomb, dict(friction_angle=-1.0),
                                                            "friction_angle is -1.0 degrees"),
                          (mohr_coulomb, dict(friction_angle=np.nan), "friction_angle is nan"),
                          (drucker_prager, dict(friction_angle=20.0, dilation_angle=21.0),
                           "dilation_angle is 21.0 .* at most the friction"),
                          (mohr_coulomb, dict(friction_angle=20.0, dilation_angle=-1.0),
                           "dilation_angle is -1.0"), (mohr_coulomb, dict(friction_angle=20.0, cohesion=-5.0),
                                                       "cohesion is -5.0 Pa: give 0 or a positive number"),
                          (mohr_coulomb, dict(friction_angle=0.0), "both 0: give one of them"),
                          (mohr_coulomb, dict(friction_angle=45.0, cohesion=5.0, tension_cutoff=5.1),
                           "tension_cutoff is 5.1 Pa: .* apex"),
                          (drucker_prager, dict(friction_angle=45.0, cohesion=5.0, tension_cutoff=-1.0),
                           "tension_cutoff is -1.0 Pa"),
                          (drucker_prager, dict(friction_angle=45.0, match="best"),
                           "match is 'best': choose one of compression, extension, plane_strain"),
                          (von_mises, dict(yield_stress=0.0),
                           "yield_stress is 0.0 Pa: give a positive number"),
                          (von_mises, dict(yield_stress=1.0, hardening=-1.0), "hardening is -1.0 Pa"),])
def test_impossible_strengths(make, values, message):
    with pytest.raises(ValueError, match=message):
        make(1e6, 0.3, **values)


# ---------------------------------------------------------------- principal values

@pytest.mark.parametrize("values", [(3.0, 2.0, 1.0), (1.0, 1.0, 1.0), (2.0, 2.0, 1.0), (2.0, 1.0, 1.0),
                                    (1e4, 1.0, 1e-4), (1.0 + 1e-9, 1.0, 1.0 - 1e-9), (1.0, 1e-8, 0.0)])
def test_principal_axes_are_orthogonal_and_rebuild_the_matrix(values):
    for seed in range(50):
        Q = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
        B = Q @ np.diag(values) @ Q.T
        found, *n = algebra.symmetric3(B[0, 0], B[1, 1], B[2, 2], B[0, 1], B[1, 2], B[2, 0])
        n = np.array(n)
        assert list(found) == sorted(found, reverse=True)
        np.testing.assert_allclose(found, values, rtol=0, atol=4e-15 * values[0])
        np.testing.assert_allclose(n @ n.T, np.eye(3), rtol=0, atol=4e-15)
        np.testing.assert_allclose(n.T @ np.diag(found) @ n, 0.5 * (B + B.T), rtol=0, atol=1e-14 * values[0])
        found, n = algebra.symmetric2(B[0, 0], B[1, 1], B[0, 1])
        np.testing.assert_allclose(np.transpose(n) @ np.diag(found) @ n, B[:2, :2], rtol=0,
                                   atol=1e-14 * values[0])
