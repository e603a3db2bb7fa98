"""A law of one's own that depends on the rate of deformation: creep, relaxation, its tangent."""
import numpy as np
import pytest

from mpm_fenicsx import Body, Box, Grid, Interface, Support
from tests.mpm.kelvin_voigt import D, kelvin_voigt

E, ETA, RHO, DT, RATE = 1e6, 1e5, 1e-3, 1e-3, 50.0  # [Pa], [Pa s], [kg/m^3], [s], [Pa/s]
KELVIN_VOIGT = kelvin_voigt(E, ETA)


@pytest.fixture
def make_bar(start):
    """``make_bar()``: one element, 1 m x 1 m, held at the left, with boundary particles on the right."""
    def make():
        box, line = Box((0.0, 0.0), (1.0, 1.0)), Interface.line((1.0, 0.0), (1.0, 1.0), 1)
        hold = [Support(lambda x: x[:, 0] < 0.1, "x"), Support(lambda x: x[:, 1] > -1.0, "y")]
        return start(Grid(Box((0.0, 0.0), (1.2, 1.2)), (1, 1)), Body(box, (1, 1), 2, KELVIN_VOIGT, RHO), hold,
                     line)

    return make


def creep(solid, dt, t_end):
    """Times [s] and strains after each step under a stress that rises at RATE."""
    strain, time = [], dt * np.arange(1, round(t_end / dt) + 1)
    for t in time:
        solid.advance(dt, 0.5 * RATE * t * np.array([[1.0, 0.0], [1.0, 0.0]]))
        strain.append(solid.points.F[:, 0, 0] - 1.0)
    np.testing.assert_allclose(np.ptp(strain, axis=1), 0.0, atol=1e-12)
    return time, np.mean(strain, axis=1)


def exact(t):
    """E e + eta e' = RATE t, from rest."""
    tau = ETA / E
    return RATE / E * (t - tau * (1.0 - np.exp(-t / tau)))


def test_creep_tends_to_the_exact_curve(make_bar):
    """By the first power of dt, as the rate is that of Euler's backward method; inertia is nothing here."""
    error = []
    for dt in (2 * DT, DT):
        t, strain = creep(make_bar(), dt, 0.3)
        error.append(abs(strain - exact(t)).max() / exact(0.3))
    assert error[1] < 0.01 and error[0] / error[1] == pytest.approx(2.0, abs=0.2)


def test_the_stress_that_is_there_has_no_viscous_part(make_bar):
    bar = make_bar()
    strain = creep(bar, DT, 20 * DT)[1][-1]
    np.testing.assert_allclose(bar.bodies[0].cauchy_stress()[:, 0, 0], E * strain, rtol=1e-4)


def test_relaxation(element):
    """The stress of a stretch in one step, then held: E h + eta h / dt, and E h from then on."""
    point, h = element(KELVIN_VOIGT, D, DT), 1e-3
    F = np.diag([1.0 + h, 1.0])
    stresses = []
    for _ in range(3):
        stresses.append(point.P(F)[0, 0])
        point.step(F)
    np.testing.assert_allclose(stresses, [E * h + ETA * h / DT, E * h, E * h], rtol=1e-12)


def test_tangent_is_the_derivative(element):
    point, random = element(KELVIN_VOIGT, D, DT), np.random.default_rng(0)
    F, dF = np.eye(D) + random.uniform(-0.1, 0.1, (D, D)), random.uniform(-1, 1, (D, D))
    change = np.einsum("ijkl,kl", point.A(F), dF)
    np.testing.assert_allclose(point.P(F + 1e-3 * dF) - point.P(F), 1e-3 * change, rtol=1e-9, atol=1e-6)
