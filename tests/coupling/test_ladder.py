"""What the loop does where a window fails: another rung of the solid, shorter windows, a message; coupled and
alone."""
import numpy as np
import pytest

from coupling import Scheme, Steps, couple, march
from tests.coupling.toys import COPY, INNER, T_END, Ball, Oscillator, exact


class Failing(Oscillator):
    """Cannot do steps longer than ``longest`` [s] between two times, until it has fallen back ``rungs``
    times."""

    def __init__(self, longest, begin=0.1, end=0.11, rungs=0):
        super().__init__()
        self.longest, self.begin, self.end = longest, begin, end
        self.rungs, self.left, self.tried = rungs, rungs, []

    def advance(self, dt, force=None):
        if dt > self.longest and self.begin < self.time < self.end and (not self.rungs or self.left):
            self.tried.append((self.time, dt))
            raise FloatingPointError("too long")
        return super().advance(dt, np.zeros((1, 2)) if force is None else force)

    def fall_back(self):
        if not self.left:
            return ""
        self.left -= 1
        return f"rung {self.rungs - self.left}"


def run(solid, grains=None, substeps=20, **keys):
    """The windows of both, or of the solid alone."""
    windows = []
    if grains is None:
        march(solid, Steps(substeps * INNER, T_END, **keys), [windows.append])
    else:
        couple(solid, grains, COPY, Scheme(substeps * INNER, T_END, substeps=substeps, **keys),
               [windows.append])
    return windows


@pytest.mark.parametrize("keys", [{}, {"iterate": 20, "tol": 1e-8}, {"adapt": 0.5}],
                         ids=["weak", "iterated", "error"])
def test_a_rung_of_the_solid_keeps_the_window(keys):
    """The same motion to the last bit, and two attempts that failed."""
    solid, grains, plain, ball = Failing(0.0, rungs=2), Ball(), Oscillator(), Ball()
    windows, others = run(solid, grains, **keys), run(plain, ball, **keys)
    assert sum(w.failed for w in windows) == 2 == len(solid.tried) and len(windows) == len(others)
    assert {t for t, _ in solid.tried} == {solid.tried[0][0]}
    assert (solid.u, solid.v, grains.y, grains.v) == (plain.u, plain.v, ball.y, ball.v)


def test_a_solid_alone_does_the_same():
    solid, plain = Failing(0.0, rungs=1), Failing(1.0)
    solid.v = plain.v = 1.0
    windows, others = run(solid), run(plain)
    assert sum(w.failed for w in windows) == 1 and (solid.u, solid.v) == (plain.u, plain.v)
    assert [w.time for w in windows] == [w.time for w in others] and {w.dt for w in windows} == {20 * INNER}


def test_steps_of_a_solid_alone_are_halved_and_grow_back():
    solid = Failing(12 * INNER)
    solid.v = 1.0
    windows = run(solid)
    lengths = [round(w.dt / INNER) for w in windows]
    assert set(lengths) == {10, 20} and lengths[-1] == 20 and sum(w.failed for w in windows) > 0
    assert windows[-1].time == pytest.approx(T_END, rel=1e-14) and solid.time == pytest.approx(T_END,
                                                                                               rel=1e-12)
    assert all(w.fraction == w.dt / (20 * INNER) and w.substeps == 0 for w in windows)


def test_shorter_windows_with_weak_coupling_keep_only_the_grains(monkeypatch):
    """The state of the solid is not asked for: where its step fails it is as it was. What the grains did is
    undone."""
    monkeypatch.delattr(Oscillator, "get_state")
    solid, grains = Failing(12 * INNER), Ball()
    windows = run(solid, grains)
    assert np.abs(np.array((solid.u, solid.v, grains.y, grains.v)) - exact()).max() < 6e-5
    assert {w.substeps for w in windows} == {10, 20} and sum(w.failed for w in windows) > 0


def test_grains_that_remember_are_not_asked_for_their_state():
    class Remembering(Ball):
        get_state = None

        def remember(self):
            kept = dict(self.__dict__)
            return lambda: self.__dict__.update(kept)

    solids, balls = (Failing(12 * INNER), Failing(12 * INNER)), (Remembering(), Ball())
    for solid, ball in zip(solids, balls):
        run(solid, ball)
    assert (solids[0].u, balls[0].y, balls[0].v) == (solids[1].u, balls[1].y, balls[1].v)


@pytest.mark.parametrize("alone", [True, False])
def test_at_the_end_the_error_says_what_was_tried(alone):
    grains = None if alone else Ball()
    kind, shortest = ("steps", 20 * INNER / 32) if alone else ("windows", INNER)
    solid = Failing(0.0)
    longer = r"; left to try: more DEM steps per window \(substeps=40\), so that it can be shorter$"
    more = "$" if alone else longer
    with pytest.raises(FloatingPointError, match=f"^too long; tried before: {kind} down to {shortest:.3g} "
                       f"s{more}"):
        run(solid, grains)
    assert len(solid.tried) == (6 if alone else 5) and len({t for t, _ in solid.tried}) == 1
    solid = Failing(0.0, rungs=1)
    solid.fall_back = iter(["another law", ""]).__next__
    with pytest.raises(FloatingPointError, match="^too long; tried before: another law; left to try: "
                       f"shorter {kind} where " r"one fails \(adapt=0\)$"):
        run(solid, grains, adapt=None)


def test_a_run_alone_goes_on_bit_for_bit():
    """From a step in the middle of shorter ones."""
    straight, kept = Failing(12 * INNER), []
    straight.v = 1.0

    def keep(step):
        if step.fraction < 1.0 and len(kept) == 0:
            kept[:] = step, straight.get_state()

    march(straight, Steps(20 * INNER, T_END), [keep])
    again = Failing(12 * INNER)
    again.set_state(kept[1])
    march(again, Steps(20 * INNER, T_END), last=kept[0])
    assert (again.u, again.v) == (straight.u, straight.v)


def test_a_solid_that_has_moved_on_is_not_set_back():
    """Numbers that are lost in a step that the solid took for good: with weak coupling its state was not
    kept."""
    class Lost(Oscillator):
        def advance(self, dt, force):
            super().advance(dt, force)
            self.u = np.nan
            return self.surface()

    solid = Lost()
    with pytest.raises(FloatingPointError, match="position of the interface is not a finite number in window "
                       "1, "):
        run(solid, Ball())
    assert solid.time == 20 * INNER
