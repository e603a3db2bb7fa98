"""How the interface force is corrected from its residual, so that a window's iteration converges.

The residual r(F) is the force that the grains answer less the force F that moved the solid. More force moves
the wall away from the grains and lowers the answer, so that -dr/dF has eigenvalues from 1 (a solid that is
heavy and stiff beside the grains) up to 1 + added mass ratio: the right relaxation lies between 0 and 1, and
F + r diverges for ratios above 1.

All sums are those of numpy in a fixed order, without BLAS: every rank gets the same bits and takes the same
branches.
"""
from typing import List, Optional, Sequence, Tuple

import numpy as np

FIRST = 0.1  # relaxation before anything is known: small, so that the first step throws no bodies apart


Pair = Tuple[np.ndarray, np.ndarray]  # of two arrays of shape (n, dim)


def dot(a: np.ndarray, b: np.ndarray) -> float:
    """Sum of the products."""
    return float((a * b).sum())


def norm(a: np.ndarray) -> float:
    """Euclidean norm of an array of any shape."""
    return dot(a, a) ** 0.5


def lost_contact(answer: np.ndarray) -> bool:
    """Do the grains not answer at all?"""
    return not answer.any()


class Constant:
    """F + omega r. Converges for added mass ratios below 2 / omega - 1."""

    def __init__(self, omega: float = 0.5) -> None:
        self._omega = omega

    def start(self) -> None:
        """A new window begins."""

    def __call__(self, force: np.ndarray, residual: np.ndarray, answer: np.ndarray) -> np.ndarray:
        """The next force to try [N] from one, its residual and the grains' answer, arrays of shape (n,
        dim)."""
        return force + self._omega * residual

    def forget(self) -> None:
        """The interface has other points from now on."""

    def get_state(self) -> Tuple:
        """What goes over to the next window, as a tuple of numbers and arrays that nobody changes."""
        return ()

    def set_state(self, state: Tuple) -> None:
        """The counterpart."""


class Aitken:
    """Dynamic relaxation of Irons and Tuck (1969) in the form of Kuettler and Wall (2008, eq. 50): the secant
    of the last two forces in contact, at most ``cap``. It is kept from window to window.

    A force that drives the bodies apart tells nothing of the slope in contact: the next one is a tenth of the
    way there from the last one in contact, or none.
    """

    def __init__(self, cap: float = 1.0) -> None:
        self._cap, self._omega = cap, FIRST
        self._last: Optional[Pair] = None

    def start(self) -> None:
        """A new window begins."""
        self._last = None

    def __call__(self, force: np.ndarray, residual: np.ndarray, answer: np.ndarray) -> np.ndarray:
        """See ``Constant``."""
        if lost_contact(answer):
            if self._last is None:
                return force + residual
            self._omega *= 0.1
            return self._last[0] + self._omega * self._last[1]
        if self._last is not None:
            step, change = force - self._last[0], residual - self._last[1]
            slope = -dot(step, change)
            if slope > 0.0:
                self._omega = min(slope / dot(change, change), self._cap)
        self._last = force, residual
        return force + self._omega * residual

    def forget(self) -> None:
        """See ``Constant``."""
        self._last = None

    def get_state(self) -> Tuple:
        """See ``Constant``."""
        return (self._omega,)

    def set_state(self, state: Tuple) -> None:
        """See ``Constant``."""
        self._omega, = state


class Quasi:
    """Interface quasi-Newton with the inverse Jacobian from least squares, IQN-ILS (Degroote et al. 2009,
    algorithm 3): the differences of residuals and answers of this window and of the last ``reuse`` ones. A
    column that QR finds to add less than ``filtering`` of its length to the newer ones is left out. Older
    windows are forgotten when other places touch."""

    def __init__(self, reuse: int = 4, filtering: float = 1e-3) -> None:
        self._reuse, self._filter, self._aitken = reuse, filtering, Aitken()
        self._old: Tuple[Tuple[Pair, ...], ...] = ()
        self._new: List[Pair] = []
        self._last: Optional[Pair] = None
        self._touching: Optional[np.ndarray] = None

    def start(self) -> None:
        """See ``Aitken``."""
        if self._new:
            self._old = (tuple(self._new),) + self._old[:self._reuse - 1]
        self._new, self._last = [], None
        self._aitken.start()

    def __call__(self, force: np.ndarray, residual: np.ndarray, answer: np.ndarray) -> np.ndarray:
        """See ``Constant``."""
        touching = answer.any(axis=1)
        if self._touching is not None and not np.array_equal(touching, self._touching):
            self._old = ()
        self._touching = touching
        plain = self._aitken(force, residual, answer)
        if lost_contact(answer):
            return plain
        if self._last is not None:
            self._new.insert(0, (residual - self._last[0], answer - self._last[1]))
        self._last = residual, answer
        columns = [*self._new, *(column for window in self._old for column in window)]
        step = self._step(columns, residual)
        return plain if step is None else force + residual + step

    def _step(self, columns: Sequence[Pair], residual: np.ndarray) -> Optional[np.ndarray]:
        """Sum of the answers' differences with the weights that take most of the residual away; None without
        a column that tells anything."""
        basis: List[np.ndarray] = []
        weights: List[List[float]] = []
        used: List[np.ndarray] = []
        for column in columns:
            direction, row = column[0], []
            for q in basis:
                row.append(dot(q, direction))
                direction = direction - row[-1] * q
            length = norm(direction)
            if length > self._filter * norm(column[0]):
                basis.append(direction / length)
                weights.append([*row, length])
                used.append(column[1])
        if not basis:
            return None
        c = [-dot(q, residual) for q in basis]
        for k in reversed(range(len(c))):  # back substitution in the triangle of QR
            c[k] = (c[k] - sum(weights[j][k] * c[j] for j in range(k + 1, len(c)))) / weights[k][k]
        return np.asarray(sum(weight * answer for weight, answer in zip(c, used)))

    def forget(self) -> None:
        """See ``Constant``."""
        self._old, self._new, self._last, self._touching = (), [], None, None
        self._aitken.forget()

    def get_state(self) -> Tuple:
        """See ``Constant``."""
        return self._old, tuple(self._new), self._touching, self._aitken.get_state()

    def set_state(self, state: Tuple) -> None:
        """See ``Constant``."""
        self._old, new, self._touching, aitken = state
        self._new, self._last = list(new), None
        self._aitken.set_state(aitken)


RELAXATIONS = {"aitken": Aitken, "constant": Constant, "iqn": Quasi}
