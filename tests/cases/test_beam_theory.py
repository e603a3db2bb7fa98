"""The modal reference against closed forms, an ODE solver, its own conservation laws, and its published
numbers."""

from math import pi, sqrt

import numpy as np
import pytest
from scipy.integrate import solve_ivp, trapezoid
from scipy.linalg import eigh

from references.beam_theory import beam_modes, impact

STEEL = dict(E=215.82e9, nu=0.289, rho=7960.0)
SECTION = dict(height=0.01, width=0.01)
SHORT = dict(length=0.1535, radius=0.01, t_end=1e-3, v0=0.01, **SECTION, **STEEL)
LONG = dict(length=0.3070, radius=0.02, t_end=4e-3, v0=0.01, **SECTION, **STEEL)
AREA, INERTIA = 1e-4, 1e-8 / 12


def peaks(history):
    return [contact.peak for contact in history.contacts()]


def edges_ms(history):
    return [1e3 * time for contact in history.contacts() for time in (contact.start, contact.end)]


def deepest(history):
    i = history.u_beam.argmin()
    return history.u_beam[i], 1e3 * history.time[i]


def rates(errors):
    return np.log2(np.array(errors[:-1]) / errors[1:])


def test_short_euler_bernoulli_numbers():
    history = impact(**SHORT, theory="euler_bernoulli")
    assert edges_ms(history) == pytest.approx([0, 0.1568], abs=1e-4)
    assert peaks(history) == pytest.approx([4.966], abs=5e-4)
    assert 1e3 * history.contacts()[0].peak_time == pytest.approx(0.0728, abs=1e-4)
    assert deepest(history)[0] == pytest.approx(-1.1245e-6, abs=5e-11)
    assert deepest(history)[1] == pytest.approx(0.324, abs=5e-4)
    assert history.v_sphere[-1] == pytest.approx(0.003027, abs=5e-7)


def test_short_timoshenko_numbers():
    history = impact(**SHORT)
    assert edges_ms(history) == pytest.approx([0, 0.1588], abs=1e-4)
    assert peaks(history) == pytest.approx([4.923], abs=5e-4)
    assert 1e3 * history.contacts()[0].peak_time == pytest.approx(0.0723, abs=1e-4)
    assert deepest(history)[0] == pytest.approx(-1.1298e-6, abs=5e-11)
    assert deepest(history)[1] == pytest.approx(0.3336, abs=1e-4)
    assert history.v_sphere[-1] == pytest.approx(0.002989, abs=5e-7)


def test_long_beam_is_struck_three_times():
    history = impact(**LONG, theory="euler_bernoulli")
    assert edges_ms(history) == pytest.approx([0, 0.435, 1.336, 1.782, 2.801, 3.224], abs=1e-3)
    assert peaks(history) == pytest.approx([8.99, 10.33, 5.58], abs=5e-3)
    times = [1e3 * contact.peak_time for contact in history.contacts()]
    assert times == pytest.approx([0.092, 1.628, 2.884], abs=5e-4)
    assert deepest(history)[0] == pytest.approx(-8.709e-6, abs=5e-10)
    assert deepest(history)[1] == pytest.approx(2.121, abs=5e-4)
    assert history.v_sphere[-1] == pytest.approx(0.00970, abs=5e-6)


def test_long_timoshenko_peaks():
    first, second, third = peaks(impact(**LONG))
    assert (first, second) == pytest.approx((8.87, 11.62), abs=5e-3)
    # The weakest of three contacts is the last to converge: 6.70 N with 25 modes, 6.66 N with 50, 6.63 N with
    # 1000.
    assert third == pytest.approx(6.68, rel=4e-3)


@pytest.mark.parametrize("theory", ["timoshenko", "euler_bernoulli"])
@pytest.mark.parametrize("case", [SHORT, LONG])
def test_energy_and_momentum_are_kept(case, theory):
    history = impact(**case, theory=theory)
    energy = history.energy()
    assert energy[0] == pytest.approx(0.5 * history.sphere_mass * 0.01**2, rel=1e-14)
    assert np.abs(energy / energy[0] - 1).max() < 1e-6
    impulse = trapezoid(history.force, history.time)
    assert impulse == pytest.approx(history.sphere_mass * (history.v_sphere[-1] + 0.01), rel=1e-12)


@pytest.mark.parametrize("theory", ["timoshenko", "euler_bernoulli"])
def test_second_order_in_the_step(theory):
    """Force, energy and final velocity; the highest of the 50 modes has periods far below these steps."""
    steps = 1.6e-6 / 2 ** np.arange(4)
    fine = impact(**SHORT, theory=theory, dt=2e-8)
    runs = [impact(**SHORT, theory=theory, dt=dt) for dt in steps]
    force = [np.linalg.norm(fine.at(run.time).force - run.force) * sqrt(run.time[1]) for run in runs]
    energy = [abs(run.energy()[-1] / run.energy()[0] - 1) for run in runs]
    speed = [abs(run.v_sphere[-1] - fine.v_sphere[-1]) for run in runs]
    for errors in (force, energy, speed):
        assert np.mean(rates(errors)) == pytest.approx(2, abs=0.2)


def test_static_compliance_converges_with_the_modes():
    """Sum of 1/(m omega^2) to L^3/48EI + L/4kGA: with n^-3 without shear, n^-1 with it."""
    length, G = 0.1535, STEEL["E"] / 2 / 1.289
    bending, sheared = length**3 / 48 / STEEL["E"] / INERTIA, length / 4 / (5 / 6 * G * AREA)
    for theory, exact, rate in (("euler_bernoulli", bending, 3), ("timoshenko", bending + sheared, 1)):
        errors = []
        for modes in (20, 40, 80, 160):
            omega, mass = beam_modes(length, **SECTION, **STEEL, theory=theory, modes=modes)
            errors.append(exact - np.sum(1 / (mass * omega**2)))
        assert rates(errors) == pytest.approx(rate, abs=0.03)


def test_modes_of_any_body():
    """The modes of the beam, given as such, are the beam."""
    short = {**SHORT, "t_end": 2e-4}
    given = impact(**short, modes=beam_modes(short["length"], **SECTION, **STEEL, modes=10))
    assert np.array_equal(given.force, impact(**short, modes=10).force) and given.force.max() > 4.0


@pytest.mark.parametrize("theory, error_of_50", [("euler_bernoulli", 1e-6), ("timoshenko", 2e-4)])
def test_peak_converges_with_the_modes(theory, error_of_50):
    exact, = peaks(impact(**SHORT, theory=theory, modes=1600))
    errors = [abs(peaks(impact(**SHORT, theory=theory, modes=modes))[0] / exact - 1)
              for modes in (5, 50, 200)]
    assert errors[0] > errors[1] > errors[2]
    assert errors[1] < error_of_50


def test_first_frequencies():
    length = 0.1535
    omega, mass = beam_modes(length, **SECTION, **STEEL, theory="euler_bernoulli", modes=3)
    f1 = pi / 2 / length**2 * sqrt(STEEL["E"] * INERTIA / STEEL["rho"] / AREA)
    assert omega / 2 / pi == pytest.approx(f1 * np.array([1, 9, 25]), rel=1e-14)
    assert mass == pytest.approx(STEEL["rho"] * AREA * length / 2)
    slender = 1.535  # the correction is the first term in r^2/L^2
    f1 = pi / 2 / slender**2 * sqrt(STEEL["E"] * INERTIA / STEEL["rho"] / AREA)
    omega, _ = beam_modes(slender, **SECTION, **STEEL, modes=1)
    correction = pi**2 / 2 * INERTIA / AREA / slender**2 * (1 + 2 * 1.289 * 6 / 5)
    assert 1 - omega[0] / 2 / pi / f1 == pytest.approx(correction, rel=1e-3)


def test_timoshenko_modes_solve_the_eigenproblem():
    """Against a dense solver; modal mass = 1/(deflection)^2 of the mass-normalised mode."""
    length, E, rho = 0.1535, STEEL["E"], STEEL["rho"]
    omega, mass = beam_modes(length, **SECTION, **STEEL, modes=40)
    kGA = 5 / 6 * E / 2 / 1.289 * AREA
    for i, kappa in enumerate(np.arange(1, 80, 2) * pi / length):
        stiffness = np.array([[kGA * kappa**2, -kGA * kappa], [-kGA * kappa, E * INERTIA * kappa**2 + kGA]])
        values, vectors = eigh(length / 2 * stiffness, length / 2 * rho * np.diag([AREA, INERTIA]))
        assert omega[[i, i + 40]] ** 2 == pytest.approx(values, rel=1e-7)
        assert 1 / mass[[i, i + 40]] == pytest.approx(vectors[0] ** 2, rel=1e-6)


@pytest.mark.parametrize("theory", ["timoshenko", "euler_bernoulli"])
def test_agrees_with_an_ode_solver(theory):
    omega, mass = beam_modes(0.1535, **SECTION, **STEEL, theory=theory, modes=3)
    run = impact(**SHORT, theory=theory, modes=3, dt=2e-8)
    n = len(omega)

    def rhs(_, y):
        z, x, v, w = y[:n], y[n], y[n + 1:-1], y[-1]
        force = run.stiffness * max(z.sum() - x, 0) ** 1.5
        return np.concatenate((v, [w], -omega**2 * z - force / mass, [force / run.sphere_mass]))

    start = np.zeros(2 * n + 2)
    start[-1] = -0.01
    times = np.linspace(0, 4e-4, 9)
    exact = solve_ivp(rhs, (0, 4e-4), start, "DOP853", times, rtol=1e-10, atol=1e-18, max_step=2e-6).y
    assert run.at(times).u_beam == pytest.approx(exact[:n].sum(axis=0), rel=1e-6, abs=1e-13)
    assert run.at(times).u_sphere == pytest.approx(exact[n], rel=1e-6)
    assert run.at(times).v_sphere == pytest.approx(exact[-1], rel=1e-6, abs=1e-9)


def test_hertz_impact_on_a_rigid_beam():
    """Chung and Ooi (2011), test 2: aluminium sphere, 0.2 m/s: 11.37 kN and 0.7316 ms, and no loss of
    speed."""
    run = impact(1.0, 1.0, 1.0, 0.1, 0.2, E=1e20, nu=0.3, rho=1e12, t_end=1e-3, modes=10,
                 sphere=(7e10, 0.3, 2699.0))
    contact, = run.contacts()
    assert contact.peak == pytest.approx(11370, rel=5e-4)
    assert contact.end == pytest.approx(0.7316e-3, rel=5e-4)
    assert run.v_sphere[-1] == pytest.approx(0.2, rel=1e-5)


def test_at_interpolates_every_array():
    run = impact(**SHORT)
    middle = run.at(0.5 * (run.time[1000:1010] + run.time[1001:1011]))
    assert middle.force == pytest.approx(0.5 * (run.force[1000:1010] + run.force[1001:1011]))
    assert run.at(run.time).u_beam == pytest.approx(run.u_beam, rel=1e-14)
    assert middle.energy() == pytest.approx(run.energy()[0], rel=1e-6)
    for times in ([0, 1.01e-3], [-1e-9], [np.nan]):
        with pytest.raises(ValueError, match="t_end"):
            run.at(times)


def test_a_contact_cut_by_the_end_ends_there():
    run = impact(**{**SHORT, "t_end": 1e-4})
    assert run.contacts()[0].end == run.time[-1] == 1e-4


@pytest.mark.parametrize("bad, words", [
    (dict(nu=0.5), "nu is 0.5: give a number between -1 and 0.5"),
    (dict(nu=-1.2), "nu is -1.2: give"),
    (dict(radius=-0.01), "radius is -0.01: it must be a positive number"),
    (dict(rho=0), "rho is 0: it must be a positive number"),
    (dict(length=float("nan")), "length is nan: it must be a positive number"),
    (dict(v0=float("inf")), "v0 is inf: it must be a positive number"),
    (dict(t_end=0), "t_end is 0: it must be a positive number"),
    (dict(shear=-1), "shear is -1: it must be a positive number"),
    (dict(dt=0.0), "dt is 0.0: it must be a positive number"),
    (dict(dt=1e-4), "dt = 0.0001 s is too long .* take at most"),
    (dict(modes=0), "modes is 0: give a whole number of at least 1"),
    (dict(theory="bernoulli"), "theory is 'bernoulli': choose one of timoshenko, euler_bernoulli"),
    (dict(sphere=(2e11, 0.7, 7800)), "sphere's nu is 0.7: give"),
])
def test_bad_input_is_one_clear_sentence(bad, words):
    with pytest.raises(ValueError, match=words):
        impact(**{**SHORT, **bad})


@pytest.mark.parametrize("at", [0.0, 0.0322, -0.05])
def test_static_compliance_at_any_place(at):
    """Sum of 1/(m omega^2) to a^2 b^2/(3 EI L) + a b/(L k G A), a and b the distances to the supports."""
    length, a, b, G = 0.1535, 0.1535 / 2 + at, 0.1535 / 2 - at, STEEL["E"] / 2 / 1.289
    omega, mass = beam_modes(length, **SECTION, **STEEL, modes=2000, at=at)
    exact = a**2 * b**2 / (3 * STEEL["E"] * INERTIA * length) + a * b / length / (5 / 6 * G * AREA)
    assert np.sum(1 / (mass * omega**2)) == pytest.approx(exact, rel=2e-5)


def test_off_centre_energy_symmetry_and_nodes():
    """Energy is kept, left is as right, and a mode with its node at the place struck takes no part."""
    left, right = (impact(**{**SHORT, "t_end": 4e-4}, at=at) for at in (-0.0335, 0.0335))
    assert left.force == pytest.approx(right.force, abs=1e-9 * right.force.max())
    assert np.abs(right.energy() / right.energy()[0] - 1).max() < 1e-6
    omega, _ = beam_modes(0.1535, **SECTION, **STEEL, modes=3, at=0.1535 / 6)
    every, _ = beam_modes(0.1535, **SECTION, **STEEL, modes=3, at=0.01)
    assert len(every) == 10 and len(omega) == 8 and not set(omega.round(3)) & set(every[[2, 7]].round(3))
