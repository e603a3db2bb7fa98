"""Corrections of the interface force on residuals that are known: linear ones, and a contact that opens."""
import numpy as np
import pytest

from coupling.loop.control import StepControl
from coupling.loop.relaxation import RELAXATIONS, Aitken, Constant, Quasi, norm

RATIO = np.array([0.1, 3.0, 100.0])  # added mass ratios: eigenvalues of -dr/dF less 1
TURN = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
MAP, LOAD = TURN @ np.diag(RATIO) @ TURN.T, np.array([3.0, -1.0, 2.0])


def iterate(relax, answer, force, most=200):
    """Norms of the residuals until they vanish or grow beyond measure."""
    relax.start()
    norms = []
    while len(norms) < most:
        given = answer(force)
        residual = given - force
        norms.append(norm(residual))
        if norms[-1] < 1e-10 or norms[-1] > 1e10:
            break
        force = relax(force, residual, given)
    return norms


def linear(force):
    return (LOAD - MAP @ force.ravel()).reshape(3, 1)


def scalar(force):
    """As one contact: a load that falls by the added mass ratio of 50."""
    return 10.0 - 50.0 * force


def opening(force):
    """The contact opens at a third of its answer to no force."""
    return np.maximum(1.0 - 300.0 * force, 0.0)


def test_constant_relaxation_has_a_limit():
    """F + omega r contracts for ratios below 2 / omega - 1, and then as 1 - omega (1 + ratio)."""
    force = np.zeros((1, 1))
    assert iterate(Constant(0.03), scalar, force)[-1] < 1e-10 and iterate(Constant(0.05), scalar,
                                                                          force)[-1] > 1e10
    norms = iterate(Constant(0.03), scalar, force)
    assert norms[5] / norms[4] == pytest.approx(abs(1 - 0.03 * 51))


def test_aitken_is_exact_for_one_mode():
    """Two residuals give the slope; later windows know it from the start."""
    relax = Aitken()
    assert len(iterate(relax, scalar, np.zeros((1, 1)))) == 3
    assert len(iterate(relax, lambda force: 20.0 - 50.0 * force, np.zeros((1, 1)))) == 2


def test_quasi_newton_is_exact_after_as_many_columns_as_modes():
    relax, force = Quasi(), np.zeros((3, 1))
    assert len(iterate(relax, linear, force)) <= 6
    # another load, the same columns
    assert len(iterate(relax, lambda force: 2.0 * linear(0.5 * force), force)) == 2
    assert iterate(Aitken(), linear, force, most=12)[-1] > 1e-6  # one number for three modes is slower


@pytest.mark.parametrize("name", ["aitken", "iqn"])
def test_contact_that_opens(name):
    """An answer of nothing tells no slope: the force goes back, and the next step is shorter."""
    for start in (0.0, 1.0, 100.0):
        assert iterate(RELAXATIONS[name](), opening, np.full((1, 1), start), most=12)[-1] < 1e-10


def test_aitken_stays_below_its_cap():
    relax = Aitken(cap=0.2)
    # the best would be 2 / 3
    assert len(iterate(relax, lambda force: 1.0 - 0.5 * force, np.zeros((1, 1)))) > 10
    assert relax.get_state() == (0.2,)


def test_quasi_newton_leaves_out_columns_that_add_nothing():
    """Two places that always move together: their matrix of differences is singular."""
    relax = Quasi()
    norms = iterate(relax, lambda force: np.array([[1.0], [2.0]]) * (3.0 - 40.0 * force.sum()),
                    np.zeros((2, 1)))
    assert norms[-1] < 1e-10 and len(norms) < 8


def test_quasi_newton_forgets_when_other_places_touch():
    relax, places = Quasi(), np.array([[1.0], [0.0]])
    iterate(relax, lambda force: places * (1.0 - 40.0 * force), np.zeros((2, 1)))
    relax.start()
    assert relax.get_state()[0]
    relax(np.zeros((2, 1)), places[::-1].copy(), places[::-1].copy())
    assert not relax.get_state()[0]


@pytest.mark.parametrize("name", RELAXATIONS)
def test_state_goes_on_bit_for_bit(name):
    one, other = RELAXATIONS[name](), RELAXATIONS[name]()
    iterate(one, linear, np.zeros((3, 1)), most=5)
    other.set_state(one.get_state())
    start = np.ones((3, 1))
    assert iterate(one, linear, start, most=6) == iterate(other, linear, start, most=6)


def test_steps_are_halved_and_grow_back():
    control, sizes = StepControl(20, 0.0), []
    for fails in [True, True, *[False] * 20]:
        sizes.append(control.next(1000))
        assert control.shorten(sizes[-1]) if fails else not control.refuses(1.0, sizes[-1])
    assert sizes[:3] == [20, 10, 5] and sizes[-1] == 20 and set(sizes) == {20, 10, 5}
    assert control.next(3) == 3


def test_steps_are_not_shortened_below_one_or_unless_asked():
    assert not StepControl(1, 0.0).shorten(1) and not StepControl(20).shorten(20)
    control = StepControl(20)
    assert not control.active and not control.refuses(1e9, 20) and control.next(100) == 20


def test_step_length_settles_where_the_error_asks():
    """An error of the square of the length: 0.9 of the length that meets the tolerance."""
    control, wanted = StepControl(1000, 0.01), 100
    for _ in range(20):
        steps = control.next(10**6)
        control.refuses(0.01 * (steps / wanted) ** 2, steps)
    assert abs(control.next(10**6) - 0.9 * wanted) <= 1
