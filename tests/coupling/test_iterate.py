"""Iterated coupling and step control on two partitions of one mass each: rates, mass ratios, restarts,
failures."""
from types import SimpleNamespace

import numpy as np
import pytest

from coupling import NotConvergedError, Scheme, couple
from coupling.ledger.exchange import COLUMNS, Ledger
from coupling.loop.relaxation import RELAXATIONS
from tests.coupling.toys import COPY, INNER, T_END, Ball, Oscillator, exact

# an oscillator much lighter than the ball, and a contact much stiffer than its spring
LIGHT, STIFF = 1e-3, 1e4


def run(substeps, solid=None, grains=None, last=None, **keys):
    """Both partitions after the run, and its windows."""
    solid, grains, windows = solid or Oscillator(), grains or Ball(), []
    scheme = Scheme(substeps * INNER, T_END, substeps=substeps, **keys)
    couple(solid, grains, COPY, scheme, on_window=[windows.append], last=last)
    return solid, grains, windows


def error(solid, grains, reference):
    return np.abs((solid.u, solid.v, grains.y, grains.v) - reference).max()


def test_second_order_in_the_window():
    sizes, reference = np.array([160, 80, 40, 20]), exact()
    errors = [error(*run(substeps, iterate=20, tol=1e-8)[:2], reference) for substeps in sizes]
    rates = np.diff(np.log(errors)) / np.diff(np.log(sizes))
    assert errors[-1] < 5e-5, errors
    assert rates == pytest.approx([2.0, 2.0, 2.0], abs=0.01), (errors, rates)


@pytest.mark.parametrize("relax", RELAXATIONS)
def test_all_ways_lead_to_the_same(relax):
    solid, grains, windows = run(80, iterate=60, tol=1e-10, relax=relax)
    other, ball, _ = run(80, iterate=60, tol=1e-10)
    assert (solid.u, solid.v, grains.y, grains.v) == pytest.approx((other.u, other.v, ball.y, ball.v),
                                                                   rel=1e-8)
    assert np.mean([w.iterations for w in windows]) < (20 if relax == "constant" else 3)


def test_both_sides_move_alike_and_forces_agree():
    _, _, windows = run(80, iterate=20, tol=1e-6)
    largest = max(-w.force[0, 1] for w in windows)
    for before, w in zip(windows, windows[1:]):
        assert w.wall_x == pytest.approx(before.x) and w.wall_x + w.dt * w.wall_v == pytest.approx(w.x,
                                                                                                   rel=1e-14)
        assert abs(w.wall_force - w.force).max() < 4e-6 * largest


def test_impulse_and_energy_at_the_interface_agree_to_the_tolerance():
    solid, grains, rows = Oscillator(), Ball(), []
    ledger = Ledger(solid, grains)
    scheme = Scheme(80 * INNER, T_END, substeps=80, iterate=20, tol=1e-6)
    couple(solid, grains, COPY, scheme, on_window=[lambda window: rows.append(ledger(window))])
    books = {name: np.array([row[name] for row in rows]) for name in COLUMNS}
    assert abs(books["impulse_grains"]).max() > 1.0  # it bounced
    one_window = 1e-6 * 2 * 80 * INNER * 10.0  # tol times the scale of the force, of about 10 N
    assert abs(books["impulse_grains"] + books["impulse_solid"]).max() < one_window
    assert abs(books["interface_error"]).max() < 1e-6  # weakly coupled: 1e-3
    assert abs(books["energy_error"]).max() < 1e-4


def test_windows_without_contact_are_computed_once():
    grains = Ball()
    grains.y, grains.v = 0.5, 0.0
    _, _, windows = run(20, grains=grains, iterate=20)
    assert {w.iterations for w in windows} == {1}


@pytest.mark.parametrize("relax", ["aitken", "iqn"])
def test_light_solid_under_a_heavy_ball(relax):
    """The ball is a thousand times as heavy: weak coupling blows up, the iterated one is right."""
    reference = exact(LIGHT, STIFF)
    with np.errstate(over="ignore", invalid="ignore"):
        try:
            _, weak, _ = run(40, Oscillator(LIGHT), Ball(contact=STIFF))
        except FloatingPointError:
            pass
        else:
            assert abs(weak.v - reference[3]) > 1.0
    _, grains, windows = run(40, Oscillator(LIGHT), Ball(contact=STIFF), iterate=40, relax=relax)
    assert grains.v == pytest.approx(reference[3], abs=2e-3)
    assert np.mean([w.iterations for w in windows]) < 6


@pytest.mark.parametrize("relax", RELAXATIONS)
def test_goes_on_bit_for_bit(relax):
    keys = dict(iterate=60, tol=1e-6, relax=relax, adapt=0.005)
    solid, grains, kept = Oscillator(), Ball(), []

    def keep(window):
        if window.time > T_END / 3 and not kept:
            kept[:] = window, solid.get_state(), grains.get_state()

    couple(solid, grains, COPY, Scheme(40 * INNER, T_END, substeps=40, **keys), on_window=[keep])
    window, again, ball = kept[0], Oscillator(), Ball()
    assert window.wall_force[0, 1] < 0.0 and window.substeps < 40
    again.set_state(kept[1]), ball.set_state(kept[2])
    run(40, again, ball, last=window, **keys)
    assert (again.u, again.v, ball.y, ball.v) == (solid.u, solid.v, grains.y, grains.v)


def test_not_converged_is_an_error_with_a_remedy():
    with pytest.raises(NotConvergedError, match=r"in window 1, which ends at t = 0.006 s: after 2 "
                       r"repetitions .* differ by "
                       r"[\d.e+-]+ N, .*\(tol=1e-08\): .* \(iterate=4\).* left .* \(adapt=0\)"):
        run(40, Oscillator(LIGHT), Ball(contact=STIFF), iterate=2, tol=1e-8, adapt=None)


def test_shorter_windows_where_the_iteration_fails():
    _, grains, windows = run(40, Oscillator(LIGHT), Ball(contact=STIFF), iterate=4, adapt=0)
    assert grains.v == pytest.approx(exact(LIGHT, STIFF)[3], abs=2e-3)
    assert sum(w.failed for w in windows) > 0 and not any(w.refused for w in windows)
    assert {w.substeps for w in windows} > {20, 40}  # halved, and grown back
    assert windows[-1].time == pytest.approx(T_END, rel=1e-14)
    assert [w.time for w in windows] == pytest.approx(np.cumsum([w.dt for w in windows]), rel=1e-12)


@pytest.mark.parametrize("keys", [{}, {"iterate": 20}])
def test_window_length_follows_the_error(keys):
    """With 320 steps a window, contact lasts ten windows: with windows as the force asks, fewer do more."""
    reference = exact()
    coarse, fine = (run(320, adapt=adapt, **keys) for adapt in (0.1, 0.02))
    fixed = run(320, **keys)
    assert error(*fine[:2], reference) < error(*coarse[:2], reference) < error(*fixed[:2], reference)
    assert len(fixed[2]) < len(coarse[2]) < len(fine[2]) < T_END / (20 * INNER)
    assert sum(w.refused for w in fine[2]) > 0 and fine[2][-1].time == pytest.approx(T_END, rel=1e-14)
    assert max(w.substeps for w in fine[2]) > 8 * min(w.substeps for w in fine[2])


@pytest.mark.parametrize("keys", [{}, {"iterate": 20, "tol": 1e-8}])
@pytest.mark.parametrize("side", ["solid", "grains"])
def test_failures_of_a_partition_are_repeated_with_a_shorter_window(side, keys):
    class Failing(Oscillator):
        def advance(self, dt, force):
            if dt > 12 * INNER and 0.1 < self.time < 0.11:
                raise FloatingPointError("too long")
            return super().advance(dt, force)

    class Lost(Ball):
        time = 0.0

        def advance(self, steps, x, v):
            self.time += steps * INNER
            if steps > 12 and 0.1 < self.time < 0.11:
                self.y = np.nan  # must not survive
                raise FloatingPointError("too long")
            return super().advance(steps, x, v)

    sides = {"solid": (Failing, Ball), "grains": (Oscillator, Lost)}[side]
    solid, grains, windows = run(20, *(side() for side in sides), adapt=0, **keys)
    assert error(solid, grains, exact()) < 6e-5
    assert sum(w.failed for w in windows) == sum(w.failed > 0 for w in windows) > 0
    assert min(w.substeps for w in windows) == 10 and windows[-1].substeps == 20
    with pytest.raises(FloatingPointError, match="too long"):
        run(20, *(side() for side in sides), adapt=None, **keys)


@pytest.mark.parametrize("relax", RELAXATIONS)
def test_interface_that_is_resampled(relax):
    """Every third window the one point becomes two that share the load, or one again: the motion stays as it
    was."""
    class Change:
        keeps_numbers = True
        elements = np.zeros((0, 2), int)

        def __init__(self, n):
            self.n = n

        def interpolate(self, values):
            return np.repeat(values[:1], self.n, axis=0)

        def redistribute(self, loads):
            return np.repeat(loads.sum(axis=0, keepdims=True) / self.n, self.n, axis=0)

    class Divided(Oscillator):
        n, asked = 1, 0

        def resample(self):
            self.asked += 1
            if self.asked % 3:
                return None
            self.n = 3 - self.n
            return Change(self.n)

        def surface(self):
            return tuple(np.repeat(a, self.n, axis=0) for a in super().surface())

        def advance(self, dt, force):
            assert len(force) == self.n
            return super().advance(dt, force.sum(axis=0, keepdims=True))

    class Shared(Ball):
        scene = SimpleNamespace(wall=SimpleNamespace(elements=Change.elements))

        def advance(self, steps, x, v):
            return np.repeat(super().advance(steps, x[:1], v[:1]) / len(x), len(x), axis=0)

    keys = dict(iterate=60, tol=1e-9, relax=relax)
    plain, ball, windows = run(40, **keys)
    solid, grains, others = run(40, Divided(), Shared(), **keys)
    assert (solid.u, solid.v, grains.y, grains.v) == pytest.approx((plain.u, plain.v, ball.y, ball.v),
                                                                   rel=1e-7)
    assert {len(w.x) for w in others} == {1, 2} and sum(w.change is not None
                                                        for w in others) == len(others) // 3
    assert sum(w.iterations for w in others) <= 1.5 * sum(w.iterations for w in windows)


@pytest.mark.parametrize("error", [RuntimeError, ZeroDivisionError])
def test_errors_of_the_scene_and_mistakes_are_not_repeated(error):
    class Wrong(Oscillator):
        tried = 0

        def advance(self, dt, force):
            Wrong.tried += 1
            raise error("no support holds the body")

        def fall_back(self):
            raise AssertionError("nothing has failed")

    with pytest.raises(error, match="no support"):
        run(20, Wrong(), adapt=0)
    assert Wrong.tried == 1


@pytest.mark.parametrize("keys, text", [({"iterate": -1}, "iterate is -1: "),
                                        ({"iterate": 1.5}, "iterate is 1.5: "),
                                        ({"tol": 0.0}, "tol is 0.0: "), ({"tol": 1.0}, "tol is 1.0: "),
                                        ({"tol": np.nan}, "tol is nan: "),
                                        ({"adapt": -0.1}, "adapt is -0.1: "),
                                        ({"adapt": np.nan}, "adapt is nan: "),
                                        ({"adapt": 1.5}, "adapt is 1.5: give an " "error from 0 to 1, as a "
                                         "part of"), ({"iterate": 1001}, "iterate is 1001: .* at most 1000"),
                                        ({"relax": "newton"}, "relax is 'newton': choose one of aitken, "
                                         "constant, iqn")])
def test_refuses(keys, text):
    with pytest.raises(ValueError, match=text):
        run(20, **keys)
