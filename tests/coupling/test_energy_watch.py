"""A solid that gains energy out of nothing is warned of and stopped; work done on it at its interface is
none."""
import warnings
from types import SimpleNamespace

import numpy as np
import pytest

from coupling import Scheme, Steps, couple, march
from coupling.ledger.energy_watch import EVERY, EnergyWatch
from coupling.ledger.exchange import UnstableError
from tests.coupling.toys import COPY, INNER, Ball, Oscillator


class Watched(Oscillator):
    """An oscillator that may draw energy from nowhere: its velocity grows by a part in every step."""

    driven, springs, count = False, False, 1

    def __init__(self, growth=0.0, **more):
        super().__init__()
        self.growth = growth
        self.__dict__.update(more)

    def advance(self, dt, force=None):
        moved = super().advance(dt, np.zeros((1, 2)) if force is None else force)
        self.v *= 1.0 + self.growth
        return moved

    def energy(self):
        return {**super().energy(), "potential": 0.0}


def swing(solid, windows=400):
    """The oscillator alone, from a velocity on."""
    solid.v = 1.0
    march(solid, Steps(1e-3, windows * 1e-3))


def test_what_gains_is_warned_of_and_stopped():
    warned = r"the solid has gained energy .* J until t = .* s, 1\d% of the 1 J it had"
    stopped = r"until t = .* s, 10\d% of the 1 J it had to spend: take a smaller dt"
    with pytest.warns(UserWarning, match=warned) as seen, pytest.raises(UnstableError, match=stopped):
        swing(Watched(1e-3), 5000)
    assert len(seen) == 1


@pytest.mark.parametrize("solid", [Watched(), Watched(-1e-3), Watched(2e-3, driven=True), Watched(1e-4)],
                         ids=["sound", "damped", "driven", "little"])
def test_what_does_not_gain_is_left_alone(solid):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        swing(solid)


def test_work_at_the_interface_is_no_gain():
    """The ball sets the oscillator in motion."""
    solid = Watched()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        couple(solid, Ball(), COPY, Scheme(20 * INNER, 0.48, substeps=20))
    assert solid.energy()["kinetic"] > 0.01


@pytest.mark.parametrize("springs", [False, True])
def test_springs_may_give_back_what_they_took(springs):
    """Without springs, what comes after a loss is a gain."""
    solid = SimpleNamespace(driven=False, springs=springs, count=1)
    energies = iter([1.0, 0.2, 0.9])
    solid.energy = lambda: {"kinetic": next(energies), "strain": 0.0, "potential": 0.0}
    watch = EnergyWatch(solid)
    at_rest = SimpleNamespace(force=np.zeros((1, 2)), moved=np.zeros((1, 2)),
                              particles=Ball().particles()[:0])
    look = lambda k: watch(SimpleNamespace(number=k * EVERY, time=float(k), **vars(at_rest)))
    look(1)
    if springs:
        look(2)
    else:
        with pytest.warns(UserWarning, match="0.7 J until t = 2 s, 70%"):
            look(2)
