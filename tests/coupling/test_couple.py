"""The loop and its ledger on two partitions of one mass each, weakly coupled."""
import numpy as np
import pytest

from coupling import Scheme, count_windows, couple
from coupling.ledger.exchange import COLUMNS, Ledger
from tests.coupling.toys import BALL, COPY, INNER, SPEED, T_END, WEIGHT, Ball, Oscillator, exact


def run(substeps, t_end=T_END, gravity=0.0):
    """Both partitions after the run, and the ledger's rows as arrays."""
    solid, grains = Oscillator(), Ball(gravity)
    ledger, rows = Ledger(solid, grains, gravity), []
    couple(solid, grains, COPY, Scheme(substeps * INNER, t_end, substeps=substeps),
           on_window=[lambda window: rows.append(ledger(window))])
    return solid, grains, {name: np.array([row[name] for row in rows]) for name in COLUMNS}


def test_second_order_in_the_window():
    """Extrapolated wall motion and a mean force that acts over the whole window: the error falls with dt
    squared."""
    sizes, reference = np.array([160, 80, 40, 20]), exact()
    errors = []
    for substeps in sizes:
        solid, grains, _ = run(substeps)
        errors.append(np.abs((solid.u, solid.v, grains.y, grains.v) - reference).max())
    rates = np.diff(np.log(errors)) / np.diff(np.log(sizes))
    assert errors[-1] < 6e-5, errors  # of values of about 0.1 to 1
    assert rates == pytest.approx([2.33, 1.84, 1.94], abs=0.02), (errors, rates)  # 1.98 with 10 substeps


@pytest.mark.parametrize("gravity", [0.0, WEIGHT])
def test_impulse_balances_to_round_off(gravity):
    solid, grains, books = run(80, gravity=gravity)
    assert abs(books["impulse_grains"]).max() > 1.0  # it bounced
    assert abs(books["impulse_grains"]
               + books["impulse_solid"]).max() < 1e-13 * abs(books["impulse_grains"]).max()
    assert books["impulse_solid"][-1] == pytest.approx(-(BALL * (grains.v + SPEED - gravity * T_END)),
                                                       rel=1e-13)


def test_energy_error_is_made_at_the_interface_and_falls_with_the_window():
    """The oscillator's Newmark conserves energy and the ball's error is tiny: what is left, and booked, is of
    the scheme. It is of third order."""
    coarse, fine = run(80)[2], run(40)[2]
    for books in (coarse, fine):
        energy = 0.5 * BALL * SPEED**2
        assert books["energy_grains"][0] + books["energy_solid"][0] == pytest.approx(energy, rel=1e-3)
        assert books["interface_error"] * energy == pytest.approx(books["work_solid"] - books["work_wall"],
                                                                  rel=1e-12)
        assert books["interface_error"][-1] == pytest.approx(books["energy_error"][-1], rel=0.05)
    assert abs(coarse["energy_error"]).max() < 2.5e-3
    assert abs(fine["energy_error"]).max() < abs(coarse["energy_error"]).max() / 6.0
    assert abs(fine["interface_error"][-1]) < abs(coarse["interface_error"][-1]) / 6.0


def test_ledger_at_rest_divides_by_nothing():
    solid, grains = Oscillator(), Ball()
    grains.v = 0.0
    ledger, rows = Ledger(solid, grains), []
    couple(solid, grains, COPY, Scheme(INNER, INNER), on_window=[lambda window: rows.append(ledger(window))])
    assert not any(rows[0].values())


def test_goes_on_bit_for_bit():
    solid, grains, _ = run(40)
    again, ball, windows = Oscillator(), Ball(), []
    couple(again, ball, COPY, Scheme(40 * INNER, T_END / 2, substeps=40), on_window=[windows.append])
    assert windows[-1].wall_force[0, 1] < 0.0  # in contact
    states = again.get_state(), ball.get_state()
    couple(again, ball, COPY, Scheme(40 * INNER, T_END, substeps=40))  # disturbs both
    again.set_state(states[0]), ball.set_state(states[1])
    couple(again, ball, COPY, Scheme(40 * INNER, T_END, substeps=40), last=windows[-1])
    assert (again.u, again.v, ball.y, ball.v) == (solid.u, solid.v, grains.y, grains.v)


def test_windows_tell_what_happened():
    windows, solid = [], Oscillator()
    couple(solid, Ball(), COPY, Scheme(80 * INNER, 4 * 80 * INNER, substeps=80), on_window=[windows.append])
    assert [w.number for w in windows] == [1, 2, 3, 4]
    assert [w.time for w in windows] == pytest.approx(0.012 * np.arange(1, 5))
    for before, after in zip(windows, windows[1:]):
        assert (after.wall_x == before.x).all() and (after.v_start == before.v).all()
        assert (after.moved == after.x - before.x).all()
    for first, second, third in zip(windows, windows[1:], windows[2:]):
        assert third.wall_v == pytest.approx((2 * second.moved - first.moved) / third.dt)
    assert set(windows[0].seconds) == {"DEM", "mapping", "MPM"}


@pytest.mark.parametrize("where, quantity", [("force", "force on the wall"), ("x", "position of a particle"),
                                             ("v", "velocity of a particle"),
                                             ("u", "position of the interface"),
                                             ("speed", "velocity of the interface")])
def test_lost_numbers_are_named(where, quantity):
    solid, grains = Oscillator(), Ball()
    if where == "force":
        grains._force = lambda wall: np.inf
    elif where in "xv":
        healthy = grains.particles()
        healthy[where][0, 1] = np.nan
        grains.particles = lambda: healthy
    else:
        step = solid.advance
        lost = 0 if where == "u" else 1
        solid.advance = lambda dt, force: tuple(np.full((1, 2), np.nan) if k == lost else a
                                                for k, a in enumerate(step(dt, force)))
    with pytest.raises(FloatingPointError, match=f"the {quantity} is not a finite number in window 1, .* "
                       "0.00015 s: "):
        couple(solid, grains, COPY, Scheme(INNER, 2 * INNER))


def test_large_numbers_are_not_lost():
    grains = Ball()
    balls = grains.particles()
    balls["x"] = 1.5e308  # their sum overflows
    grains.particles = lambda: balls
    windows = []
    couple(Oscillator(), grains, COPY, Scheme(INNER, INNER), on_window=[windows.append])
    assert len(windows) == 1 and (windows[0].particles["x"] == 1.5e308).all()


@pytest.mark.parametrize("t_end, dt, substeps, start, count",
                         [(4e-4, 1e-6, 20, 0.0, 400), (4e-4, 5e-8, 1, 0.0, 8000), (0.3, 0.1, 1, 0.0, 3),
                          (4e-4, 1e-6, 1, 1e-4, 300)])
def test_count_windows(t_end, dt, substeps, start, count):
    assert count_windows(t_end, dt, substeps, start) == count


@pytest.mark.parametrize("t_end, dt, substeps, text",
                         [(4.05e-4, 1e-5, 1, "t_end is 0.000405 s, .* dt = " "1e-05 s: take t_end=0.0004$"),
                          (1.0, 0.0, 1, "dt is 0.0 s: "), (1.0, -0.1, 1, "dt is -0.1 s: "),
                          (1.0, np.nan, 1, "dt is nan s: "), (-1.0, 0.1, 1, "t_end is -1.0 s: "),
                          (np.inf, 0.1, 1, "t_end is inf s: "),
                          (1.0, 1e-12, 1, "dt is 1e-12 s: that makes 1e.12 windows " ".* more than 1e.09"),
                          (1.0, 0.1, 0, "substeps is 0: "), (1.0, 0.1, 1.5, "substeps is 1.5: ")])
def test_count_windows_refuses(t_end, dt, substeps, text):
    with pytest.raises(ValueError, match=text):
        count_windows(t_end, dt, substeps)


def test_substeps_must_fill_the_window():
    with pytest.raises(ValueError,
                       match="3 substeps of the DEM's 0.00015 s do not make a window of 0.0003 s"):
        couple(Oscillator(), Ball(), COPY, Scheme(2 * INNER, 4 * INNER, substeps=3))
