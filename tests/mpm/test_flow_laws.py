"""Laws whose stress depends on the rate of flow, against closed forms at one point."""
import numpy as np
import pytest

from mpm_fenicsx import (
    MPM,
    Body,
    Box,
    Grid,
    Numerics,
    Support,
    drucker_prager,
    herschel_bulkley,
    mohr_coulomb,
    mu_i,
    von_mises,
)

# Glass beads of Jop, Forterre & Pouliquen 2006, as soil of 10 MPa under 100 Pa.
MU_S, MU_2, I_0, GRAIN, RHO_S, E, NU, P0 = 0.382, 0.644, 0.279, 0.53e-3, 2450.0, 1e7, 0.3, 100.0
BEADS = mu_i(E, NU, MU_S, MU_2, I_0, GRAIN, RHO_S)
K_BEADS = E / (3 * (1 - 2 * NU))
K, TAU_Y, CONSISTENCY = 1e6, 50.0, 20.0


@pytest.fixture(params=[2, 3])
def dim(request):
    return request.param


def friction(inertial):
    """mu(I) of the beads."""
    return MU_S + (MU_2 - MU_S) / (1.0 + I_0 / inertial)


def q_of(tau):
    """sqrt(J2) and pressure of a stress."""
    deviator = tau - np.trace(tau) / 3 * np.eye(3)
    return np.sqrt(0.5 * np.sum(deviator**2)), -np.trace(tau) / 3


def squeezed(point, pressure, bulk):
    """A gradient, shape (dim, dim), that puts the point under an even pressure."""
    if point.dim == 2:  # the same across the plane
        point.old["plastic"][2] = np.exp(-2 * pressure / bulk / 3) - 1
    return np.exp(-pressure / bulk / 3) * np.eye(point.dim)


def pure(gamma, dim):
    """Pure shear: principal axes that stay, so that rates add up to round-off."""
    F = np.eye(dim)
    F[0, 0], F[1, 1] = np.exp(0.5 * gamma), np.exp(-0.5 * gamma)
    return F


def simple(gamma, dim):
    F = np.eye(dim)
    F[0, 1] = gamma
    return F


def sheared(point, kind, rate, gammas, pressure, bulk):
    """Stress after shear through ``gammas`` at a constant rate [1/s] and pressure [Pa]."""
    start = squeezed(point, pressure, bulk)
    for before, gamma in zip([0.0, *gammas], gammas):
        point.dt = (gamma - before) / rate
        tau = point.step(kind(gamma, point.dim) @ start)
    return tau


@pytest.mark.parametrize("inertial", [1e-4, 0.03, 0.279, 3.0, 1e4])
def test_sheared_grains_rub_by_mu_of_I(element, dim, inertial):
    """At constant pressure: exactly in pure shear, in simple shear but for elastic strain, which turns."""
    rate = inertial * np.sqrt(P0 / RHO_S) / GRAIN
    tau = sheared(element(BEADS, dim), pure, rate, np.linspace(0.01, 1.0, 100), P0, K_BEADS)
    q, pressure = q_of(tau)
    round_off = 100 * np.finfo(float).eps * K_BEADS / P0  # of the strain, a step after the other
    assert pressure == pytest.approx(P0, rel=round_off)
    assert q / P0 == pytest.approx(friction(inertial), rel=round_off)
    tau = sheared(element(BEADS, dim), simple, rate, np.linspace(0.001, 1.0, 1000), P0, K_BEADS)
    assert tau[0, 1] / P0 == pytest.approx(friction(inertial), rel=2e-4)


def test_grains_sheared_infinitely_slowly_rub_as_at_rest(element, dim):
    point = element(BEADS, dim, dt=np.inf)
    tau = point.step(pure(0.1, dim) @ squeezed(point, P0, K_BEADS))
    assert q_of(tau)[0] / P0 == pytest.approx(MU_S, rel=1e-10)
    A = point.A(pure(0.1, dim) @ squeezed(point, P0, K_BEADS))
    assert np.isfinite(A).all()


@pytest.mark.parametrize("law", [BEADS, herschel_bulkley(K, CONSISTENCY, TAU_Y, 0.4),
                                 herschel_bulkley(K, CONSISTENCY)], ids=["beads", "mud", "Newton"])
def test_in_no_time_nothing_flows(element, dim, law):
    """The stress that is there is that of the last step, and a jump from it is elastic."""
    point = element(law, dim, dt=1e-3)
    F = pure(0.1, dim) @ squeezed(point, P0, K)
    tau = point.step(F)
    point.dt = 0.0
    np.testing.assert_allclose(point.tau(F), tau, rtol=1e-10, atol=1e-8 * P0)
    jump = pure(1e-6, dim)
    change, mu = point.tau(jump @ F) - tau, law.params.mu
    np.testing.assert_allclose(change[:2, :2], mu * 1e-6 * np.diag([1, -1]), rtol=0, atol=1e-6 * mu * 1e-6)


@pytest.mark.parametrize("exponent", [0.3, 0.5, 1.0, 1.7])
@pytest.mark.parametrize("yield_stress", [0.0, TAU_Y])
@pytest.mark.parametrize("rate", [1e-3, 1.0, 100.0])
def test_sheared_fluids(element, dim, exponent, yield_stress, rate):
    """tau = tau_y + k g^n, exactly in pure shear."""
    point = element(herschel_bulkley(K, CONSISTENCY, yield_stress, exponent), dim)
    expected = yield_stress + CONSISTENCY * rate**exponent
    stress = sheared(point, pure, rate, np.linspace(0.05, 2.0, 40), P0, K)
    q, pressure = q_of(stress)
    assert q == pytest.approx(expected, rel=1e-6) and pressure == pytest.approx(P0, rel=1e-6)
    np.testing.assert_allclose(stress[:2, :2] + P0 * np.eye(2), q * np.diag([1, -1]), atol=1e-6 * P0)


def test_simple_shear_of_bingham_fluid(element, dim):
    """The shear stress of a viscometer; elastic strain makes a normal stress of 2 tau^2 / G besides, and a
    step through dgamma, at whose end the flow counts, another tau dgamma."""
    tau = sheared(element(herschel_bulkley(K, CONSISTENCY, TAU_Y), dim), simple, 5.0,
                  np.linspace(0.001, 1.0, 1000), P0, K)
    assert tau[0, 1] == pytest.approx(TAU_Y + 5.0 * CONSISTENCY, rel=1e-3)
    assert tau[0, 0] - tau[1, 1] == pytest.approx(tau[0, 1] * (2 * tau[0, 1] / K + 0.001), rel=1e-3)


def test_below_the_yield_stress_mud_is_elastic(element, dim):
    point, gamma = element(herschel_bulkley(K, CONSISTENCY, TAU_Y, 0.5, shear_modulus=1e5), dim), 4e-4
    tau = point.step(pure(gamma, dim) @ squeezed(point, P0, K))
    assert q_of(tau)[0] == pytest.approx(1e5 * gamma, rel=1e-9)
    assert point.old["plastic_strain"] == 0.0


def test_held_the_overstress_decays(element, dim):
    """By Euler's backward method: q - tau_y falls by 1 + G dt / k a step. Infinitely slowly, it is gone."""
    law, dt = herschel_bulkley(K, CONSISTENCY, TAU_Y), 1e-5
    point, F = element(law, dim, dt), pure(1e-3, dim)
    over = q_of(point.step(F))[0] - TAU_Y
    for _ in range(5):
        over /= 1.0 + law.params.mu * dt / CONSISTENCY
        assert q_of(point.step(F))[0] - TAU_Y == pytest.approx(over, rel=1e-8)
    point.dt = np.inf
    assert q_of(point.step(F))[0] == pytest.approx(TAU_Y, rel=1e-10)


def test_fluid_has_the_given_bulk_modulus_and_bears_no_tension(element):
    point = element(herschel_bulkley(K, CONSISTENCY, TAU_Y), 3)
    for volume, pressure in ((-0.01, 0.01 * K), (0.1, 0.0), (-0.02, 0.02 * K)):
        tau = point.step(np.exp(volume / 3) * np.eye(3))
        np.testing.assert_allclose(tau, -pressure * np.eye(3), atol=1e-9 * K)


# ---------------------------------------------------------------- viscosity beside a soil

SOILS = {"pyramid": lambda **k: mohr_coulomb(E, NU, 30.0, cohesion=50.0, **k),
         "cone": lambda **k: drucker_prager(E, NU, 30.0, cohesion=50.0, **k),
         "metal": lambda **k: von_mises(E, NU, 80.0, **k)}


@pytest.mark.parametrize("soil", SOILS)
def test_viscosity_adds_to_what_the_soil_bears(element, dim, soil):
    """In pure shear at the rate g: eta g, by a step of length dt eta / dt times dev(1 - c)."""
    eta, rate, dt = 7.0, 3.0, 1e-4
    plain, viscous = (element(SOILS[soil](**k), dim, dt) for k in ({}, dict(viscosity=eta)))
    for gamma in rate * dt * np.arange(1, 101):
        F = pure(gamma, dim) @ squeezed(plain, P0, K_BEADS)
        squeezed(viscous, P0, K_BEADS)
        if gamma == rate * dt:  # the squeeze itself is quick
            for point in (plain, viscous):
                point.dt = np.inf
                point.step(F)
                point.dt = dt
        else:
            more = viscous.step(F) - plain.step(F)
    c = np.exp(rate * dt * np.array([-1.0, 1.0, 0.0]))
    np.testing.assert_allclose(more, eta / dt * np.diag(c.mean() - c), rtol=1e-5, atol=1e-6)
    assert more[0, 0] == pytest.approx(eta * rate, rel=1e-3)
    dissipated = viscous.old["plastic_work"] - plain.old["plastic_work"]
    assert dissipated == pytest.approx(eta * rate**2 * 99 * dt, rel=1e-3)


@pytest.mark.parametrize("angle", [0.01, 1.0, 3.0])
def test_a_turn_is_no_flow(element, dim, angle):
    """Of any angle in one step."""
    point, Q = element(SOILS["cone"](viscosity=10.0), dim, 1e-4), np.eye(dim)
    Q[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    F = simple(0.2, dim) @ squeezed(point, P0, K_BEADS)
    point.step(F)
    point.dt = np.inf
    P = point.P(F)
    point.dt = 1e-4
    np.testing.assert_allclose(point.P(Q @ F), Q @ P, rtol=0, atol=1e-8 * P0)


@pytest.mark.parametrize("soil", SOILS)
def test_the_stress_that_is_there_has_its_viscous_part(element, dim, soil):
    """That of the step, to round-off, and of load steps none; also when the body has turned since."""
    point, Q = element(SOILS[soil](viscosity=7.0), dim, 1e-4), np.eye(dim)
    Q[:2, :2] = [[0.6, -0.8], [0.8, 0.6]]
    start = squeezed(point, P0, K_BEADS)
    for gamma in 1e-3 * np.arange(1, 21):
        F = simple(gamma, dim) @ start
        tau = point.step(F)
    point.dt = 0.0
    np.testing.assert_allclose(point.tau(F), tau, rtol=0, atol=1e-7 * abs(tau).max())
    assert tau[0, 1] > 7.0 * 10.0
    assert abs(point.old["right_cauchy_green_rate"]).max() == pytest.approx(10.0, rel=0.1)
    np.testing.assert_allclose(point.tau(Q @ F)[:dim, :dim], Q @ tau[:dim, :dim] @ Q.T, rtol=0,
                               atol=1e-7 * abs(tau).max())
    new = point.step(F)
    np.testing.assert_allclose(point.tau(F), new, rtol=0, atol=1e-9 * abs(tau).max())
    point.dt = np.inf
    point.step(F)
    point.dt = 0.0
    assert not point.old["right_cauchy_green_rate"].any() and abs(point.tau(F)[0, 1]) < tau[0, 1] - 0.9 * 70.0


def test_the_tangent_of_the_stress_that_is_there(element, dim, taylor_rate):
    """At a given rate of C, of a soil that does not yield."""
    point, random = element(mohr_coulomb(1e3, NU, 30.0, cohesion=1e9, viscosity=7.0), dim, 0.1), (
        np.random.default_rng(1))
    point.step(np.eye(dim) + 0.2 * random.normal(size=(dim, dim)))
    F = np.eye(dim) + 0.2 * random.normal(size=(dim, dim))
    point.step(F)
    point.dt = 0.0
    dF = random.normal(size=(dim, dim))
    assert taylor_rate(lambda h: point.P(F + h * dF), np.tensordot(point.A(F), dF, 2)) == pytest.approx(
        2.0, abs=0.05)


@pytest.mark.parametrize("transfer", ["newmark", "tpic"])
@pytest.mark.parametrize("restarts", [False, True])
def test_the_stress_of_the_points_has_its_viscous_part(transfer, restarts, tmp_path):
    """A layer that is sheared at 2 /s: strength and eta g, in what is shown, and after a restart."""
    eta, rate, strength = 50.0, 2.0, 100.0
    mud = von_mises(1e6, 0.3, np.sqrt(3.0) * strength, viscosity=eta)
    body = Body(Box((0.0, 0.0), (0.1, 0.2)), (1, 2), 2, mud, 1.0)
    held = [Support(lambda x: x[:, 1] > -1.0, "y"), Support(lambda x: x[:, 1] < 1e-9, "x"),
            Support(lambda x: x[:, 1] > 0.2 - 1e-9, "x", lambda t: 0.2 * rate * t)]
    make = lambda: MPM(Grid(Box((0.0, 0.0), (0.1, 0.2)), (1, 2)), body, held, inertia="lumped",  # noqa: E731
                       numerics=Numerics(transfer=transfer))
    solid = make()
    for _ in range(40):
        solid.advance(1e-4)
    if restarts:
        solid.save(tmp_path / "sheared.h5")
        solid.close()
        solid = make()
        solid.load(tmp_path / "sheared.h5")
    assert solid.cauchy_stress()[:, 0, 1] == pytest.approx(strength + eta * rate, rel=1e-2)
    shown = solid.snapshot()["points"][2]["cauchy_stress"]
    assert shown.reshape(len(shown), -1)[:, 1] == pytest.approx(strength + eta * rate, rel=1e-2)
    solid.close()


def test_without_viscosity_it_costs_nothing():
    assert SOILS["cone"](viscosity=0.0).state == SOILS["cone"]().state
    with pytest.raises(ValueError, match="viscosity is -1.0 Pa s"):
        SOILS["cone"](viscosity=-1.0)


@pytest.mark.parametrize("make, values, message", [
    (mu_i, dict(mu_2=0.3), "mu_2 is 0.3: friction grows with the rate, give at least mu_s"),
    (mu_i, dict(I_0=0.0), "I_0 is 0.0"), (mu_i, dict(grain_diameter=-1.0), "grain_diameter is -1.0 m"),
    (mu_i, dict(mu_s=np.nan), "mu_s is nan"), (mu_i, dict(nu=0.5), "nu is 0.5"),
    (herschel_bulkley, dict(bulk_modulus=0.0), "bulk_modulus is 0.0 Pa"),
    (herschel_bulkley, dict(consistency=-1.0), "consistency is -1.0"),
    (herschel_bulkley, dict(exponent=0.0), "exponent is 0.0"),
    (herschel_bulkley, dict(tension_cutoff=-1.0), "tension_cutoff is -1.0 Pa")])
def test_impossible_numbers(make, values, message):
    good = {mu_i: dict(E=E, nu=NU, mu_s=MU_S, mu_2=MU_2, I_0=I_0, grain_diameter=GRAIN, grain_density=RHO_S),
            herschel_bulkley: dict(bulk_modulus=K, consistency=1.0)}[make]
    with pytest.raises(ValueError, match=message):
        make(**{**good, **values})
