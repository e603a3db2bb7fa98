"""The limit of weak windows: where two masses become unstable, what is said of it, and of energy made."""
import warnings

import numpy as np
import pytest

from coupling import Scheme, couple
from coupling.ledger import limit
from tests.coupling.toys import COPY, INNER, Ball, Oscillator

MASS, BALL, STIFFNESS = 0.5, 100.0, 40.0  # of the wall point, of the ball that lies on it, of their contact


class Free:
    """A mass without a spring that a constant force moves exactly."""

    def __init__(self, v=1e-3):
        self.time, self.u, self.v = 0.0, 0.0, v
        self.applied = np.zeros(2)

    def surface(self):
        return np.array([[0.0, self.u]]), np.array([[0.0, self.v]])

    def advance(self, dt, force):
        after = self.v + dt * force[0, 1] / MASS
        self.time, self.u, self.v = self.time + dt, self.u + 0.5 * dt * (self.v + after), after
        return self.surface()

    def window_mass(self):
        return np.array([MASS])

    get_state, set_state = Oscillator.get_state, Oscillator.set_state


class Spring:
    """A ball, by default much heavier than the wall point, about rest: a spring and a damper to where it
    is."""

    def __init__(self, dt, damping, mass=BALL):
        self.dt, self.damping, self.mass = dt, damping, mass

    def advance(self, steps, x, v):
        return -STIFFNESS * (x + 0.5 * steps * self.dt * v) - self.damping * v

    def particles(self):
        return np.zeros(1, [("x", float, 2), ("v", float, 2), ("mass", float)])

    def contact_at_wall(self, force):
        return np.array([[STIFFNESS], [self.damping], [self.mass]])

    get_state, set_state = Ball.get_state, Ball.set_state


def damping(restitution):
    """As in the DEM, for the stiffness and the mass of the ball [kg/s]."""
    ln_e = np.log(restitution)
    return -2.0 * np.sqrt(5.0 / 6.0) * ln_e / np.hypot(ln_e, np.pi) * np.sqrt(STIFFNESS * BALL)


def growth(dt, c):
    """How much larger the motion gets from the first to the last quarter of 200 windows."""
    path = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        couple(Free(), Spring(dt, c), COPY, Scheme(dt, 200 * dt), [lambda w: path.append(abs(w.v[0, 1]))])
    return max(path[150:]) / max(path[:50])


@pytest.mark.parametrize("restitution", [0.05, 0.3, 0.7, 1.0])
def test_limit_is_where_two_masses_become_unstable(restitution):
    """Weakly coupled windows ring beyond it, by bisection, and not below: within 6 %, on the safe side."""
    c = damping(restitution)
    expected = limit.longest(MASS, STIFFNESS, c)
    assert limit.load(expected, MASS, STIFFNESS, c) == pytest.approx(1.0)
    good, bad = 0.5 * expected, 2.0 * expected
    assert growth(good, c) < 1.0 < growth(bad, c)
    while bad > 1.002 * good:
        middle = 0.5 * (good + bad)
        good, bad = (middle, bad) if growth(middle, c) < 1.0 else (good, middle)
    assert 0.995 < good / expected < 1.06


def test_limit_without_stiffness_and_without_damping():
    assert limit.longest(2.0, 3.0, 0.0) == pytest.approx(np.sqrt(4.0 / 3.0 * 2.0 / 3.0))
    assert limit.longest(2.0, 0.0, 3.0) == pytest.approx(2.0 / np.sqrt(3.0) * 2.0 / 3.0)


def run(factor, windows=100, mass=BALL, **more):
    c = damping(0.05)
    dt = factor * limit.longest(MASS, STIFFNESS, c)
    couple(Free(), Spring(dt, c, mass), COPY, Scheme(dt, windows * dt, **more))


def test_says_so_at_once_and_when_energy_is_made():
    with pytest.warns(UserWarning) as said:
        run(1.5)
    first, second = (str(warning.message) for warning in said)
    longest = limit.longest(MASS, STIFFNESS, damping(0.05))
    assert first.startswith(f"the window of {1.5 * longest:.3g} s that ends at t = {1.5 * longest:.6g} s "
                            f"exceeds the {longest:.3g} s that weak coupling bears") and "iterate=20" in first
    assert second.startswith("weak coupling has made") and "iterate=20" in second


def test_nothing_is_said_below_the_limit_or_when_iterated():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        run(0.95)
        run(1.5, iterate=20)


def test_light_balls_are_no_danger(monkeypatch):
    """Half as heavy as the wall point: it cannot push it away, whatever the contact. Nor does it where
    nothing is known of masses, and energy made is still seen."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        run(1.5, windows=10, mass=0.5 * MASS)
    monkeypatch.delattr(Free, "window_mass")
    with pytest.warns(UserWarning, match="weak coupling has made") as said:
        run(1.5)
    assert len(said) == 1


def test_energy_made_by_a_heavy_ball_on_a_light_solid():
    """Hertz, resting under gravity on an oscillator of a hundredth of its mass: thrown off, and said so."""
    for substeps, thrown in ((40, False), (80, True)):
        grains = Ball(gravity=-2.0)
        grains.v = 0.0
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            couple(Oscillator(mass=1e-2), grains, COPY,
                   Scheme(substeps * INNER, 300 * substeps * INNER, substeps=substeps))
        assert (abs(grains.v) > 1.0) == thrown and len(said) == thrown  # undamped, it bounces at up to 0.5
    assert "weak coupling has made" in str(said[0].message)
