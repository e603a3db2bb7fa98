"""Whether a law is one: what ``law`` promises of its kernels, tested at deformations of several sizes."""
from typing import NamedTuple, Optional, Sequence, Tuple

import numpy as np

from .law import ELASTIC_STATE, Law, check_declared
from .single_point import SinglePoint, refuse

SIZES = (1e-4, 1e-3, 1e-2, 0.1)  # of the deformations: soils yield at the first, rubber at none
SAMPLES = 8  # of each size
EXACT = 1e-10  # of the tangent's norm: what stresses may differ by that ought to be the same
RATE = 1.9  # least order of the remainder of the Taylor test, 2 for a derivative
LEGS, SUBSTEPS = 3, 50  # of the paths on which work is summed
ELASTIC_STEPS = 10  # at whose end the energy is compared
WORK = 2e-3  # of the work: error of its sum


class LawReport(NamedTuple):
    """What ``check_law`` has found of the law with that ``name``.

    rate: of the remainder |P(F + h dF) - P(F) - h A:dF| as h is halved, the lowest of all samples (infinite:
    nothing remained); turned: |P(QF) - Q P(F)|, at_rest: |P(1)|, asymmetry: |A - A^T|, each over the norm of
    A, the greatest; dissipated: least of (work - energy) / sum of |work| on closed and open paths from rest;
    samples: how many deformations there were.
    """

    name: str
    rate: float
    turned: float
    at_rest: float
    asymmetry: float
    dissipated: float
    samples: int

    def __str__(self) -> str:
        """A line for each number."""
        texts = {"tangent": f"remainder of order {self.rate:.3g}", "objectivity": f"{self.turned:.1e}",
                 "stress at rest": f"{self.at_rest:.1e}", "asymmetry": f"{self.asymmetry:.1e}",
                 "dissipated share of work": f"{self.dissipated:.1e}"}
        lines = [f"  {name:26}{text}" for name, text in texts.items()]
        return "\n".join([f"{self.name}: {self.samples} deformations", *lines])


def _where(point: SinglePoint, size: float) -> str:
    return f"in {point.dim} dimensions, at strains of {size:g}"


def _taylor(point: SinglePoint, x: np.ndarray, old: np.ndarray, dt: float, size: float,
            random: np.random.Generator) -> float:
    """Order of the remainder along a random direction, over steps so small that an error of A shows,
    infinite where it then is right to six digits. Beside a kink, such as the onset of flow, the order is that
    of the side without."""
    A, P, _ = point.tangent(x, old, dt)
    change = point.direction(random)

    def order(h: float) -> float:
        slope = A @ change
        rest = [np.linalg.norm((point.stress(x + s * change, old, dt)[0] - P - s * slope)[:point.free])
                for s in (h, 0.5 * h)]
        exact = rest[1] <= 1e-6 * abs(h) * np.linalg.norm(slope) + 1e-15 * np.linalg.norm(A)
        return np.inf if exact else np.log2(rest[0] / rest[1])

    found = max(order(1e-4 * size), order(-1e-4 * size))
    coarse = order(1e-2 * size) if found >= RATE else found
    return coarse if coarse >= RATE else found


def _alike(one: np.ndarray, other: np.ndarray) -> bool:
    """Whether two states are the same but for round-off of strains, and of the largest part of each field."""
    return all(np.allclose(one[name], other[name], 1e-10, max(1e-14, 1e-12 * np.abs(one[name]).max()),
                           equal_nan=True) for name in one.dtype.names or ())


def _check_tangent(point: SinglePoint, x: np.ndarray, old: np.ndarray, dt: float, size: float,
                   random: np.random.Generator) -> Tuple[float, float]:
    """Order of the remainder, and asymmetry."""
    law, n = point.law, point.free
    A, P, new = point.tangent(x, old, dt)
    plain, plain_new = point.stress(x, old, dt)
    norm = np.linalg.norm(A)
    if not (np.linalg.norm(plain - P) <= EXACT * norm and _alike(new, plain_new)):
        refuse(law, f"has another stress or new state with its tangent than without, {_where(point, size)}",
               "let tangent call stress")
    rate = _taylor(point, x, old, dt, size, random)
    if not rate >= RATE:
        refuse(law, "has a tangent that is not the derivative of its stress: the remainder falls with order "
               f"{rate:.2g} in place of 2, {_where(point, size)}",
               "look at A, also at its last row and column, at fixed dt and old state")
    asymmetry = np.linalg.norm((A - A.T)[:n, :n]) / norm if norm > 0.0 else 0.0
    if law.symmetric and asymmetry > EXACT:
        refuse(law, f"is said to be symmetric and has a tangent that differs from its transpose by "
               f"{asymmetry:.1e} of its norm, {_where(point, size)}", "state it with symmetric=False")
    return rate, asymmetry


def _check_turn(point: SinglePoint, path: Sequence[np.ndarray], dt: float, size: float,
                random: np.random.Generator) -> float:
    """The body is turned in the last two steps of the path."""
    dim = point.dim
    Q = np.linalg.qr(random.normal(size=(dim, dim)))[0]
    Q[:, 0] *= np.linalg.det(Q)
    plain, turned, largest = point.zero(), point.zero(), 0.0
    for n, x in enumerate(path):
        first = n < len(path) - 2
        norm = np.linalg.norm(point.tangent(x, plain, dt)[0])
        P, plain = point.stress(x, plain, dt)
        found, turned = point.stress(x if first else point.turn(Q, x), turned, dt)
        error = np.linalg.norm(found - (P if first else point.turn(Q, P)))
        if not error <= EXACT * norm:
            refuse(point.law, "is not objective: the stress of a body that is turned differs from the turned "
                   f"stress by {error / norm:.1e} of the tangent's norm, {_where(point, size)}",
                   "compute it from F^T F, and remember what belongs to the undeformed body")
        largest = max(largest, error / norm if norm > 0.0 else 0.0)
    return largest


def _check_rest(point: SinglePoint, dt: float) -> float:
    """At rest, whatever the length of the step."""
    largest = 0.0
    for step in (0.0, dt, np.inf):
        norm = np.linalg.norm(point.tangent(point.rest, point.zero(), step)[0])
        there = np.linalg.norm(point.stress(point.rest, point.zero(), step)[0])
        if not there <= EXACT * norm:
            refuse(point.law, f"has a stress of {there:.3g} Pa at the start, undeformed, for dt = {step:g} s",
                   "a state of zeros must be that of a body at rest without stress")
        largest = max(largest, there / norm if norm > 0.0 else 0.0)
    return largest


def _check_repeated(point: SinglePoint, x: np.ndarray, old: np.ndarray, size: float) -> None:
    """A step in which nothing moves, however long, changes nothing."""
    P, new = point.stress(x, old, np.inf)
    norm = np.linalg.norm(point.tangent(x, old, np.inf)[0])
    error = np.linalg.norm(point.stress(x, new, np.inf)[0] - P)
    if not error <= 10.0 * EXACT * norm + 1e-6 * np.linalg.norm(P):
        refuse(point.law, f"does not find the stress at the end of a slow step again from its new state, "
                f"which differs by {error:.3g} Pa, {_where(point, size)}",
                "fill new so that the same F gives the same stress")


def _history(state: np.ndarray) -> Tuple[bytes, ...]:
    """What changes when a law flows: all of its state but the stress, which elastic steps change too."""
    return tuple(state[name].tobytes() for name in state.dtype.names or ()
                 if name != "kirchhoff_stress")


def _check_work(point: SinglePoint, size: float, random: np.random.Generator) -> Optional[float]:
    """Slow work on a path from rest against the energy at its end: the energy is what an elastic law has
    taken, and no law gives back more. None where the path leaves the domain of the law."""
    x, state, start = point.rest, point.zero(), _history(point.zero())
    work, total, elastic = 0.0, 0.0, 0
    P = point.stress(x, state, np.inf)[0]
    for _ in range(LEGS):
        change = (point.deformed(random, size) - x) / SUBSTEPS
        for _ in range(SUBSTEPS):
            x = x + change
            before, (P, state) = P, point.stress(x, state, np.inf)
            done = 0.5 * (before + P) @ change
            work, total = work + done, total + abs(done)
            still = _history(state) == start
            elastic += still
            if still and elastic == ELASTIC_STEPS:  # sums over fewer steps are too coarse
                _compare(point, size, (work, total, change), point.energy(x, state), True)
    if not np.isfinite(work):
        return None
    elastic = point.law.state == ELASTIC_STATE
    return _compare(point, size, (work, total, change), point.energy(x, state), elastic)


def _compare(point: SinglePoint, size: float, sums: Tuple[float, float, np.ndarray], energy: float,
             elastic: bool) -> float:
    """(work - energy) / sum of |work|. sums: both, and the last substep: a kink in one adds to the whole."""
    work, total, change = sums
    norm = np.linalg.norm(point.tangent(point.rest, point.zero(), np.inf)[0])
    whole = total + norm * float(change @ change) / WORK
    share = (work - energy) / whole if whole > 0.0 else 0.0
    if not share >= -WORK or (elastic and not share <= WORK):
        refuse(point.law, f"has an energy of {energy:.4g} J/m^3 where the work from rest on was {work:.4g}, "
                f"{_where(point, size)}", "look at energy, which must not be more than the work, and where "
                "nothing flows the same")
    return share


def check_law(law: Law, dims: Sequence[int] = (2, 3), dt: float = 1e-3) -> LawReport:
    """Test what a law promises, see ``law``: its tangent is the derivative of its stress (Taylor test), it is
    objective, symmetric where it says so, free of stress at the start, finds its stress again from its state,
    and its energy is no more than the work done on it, and the same as long as it is elastic. Deformations
    are random ones of 1e-4 to 0.1, in steps of length ``dt`` [s] and of infinite length.

    dims: numbers of dimensions that the law is for. ValueError with one sentence where it fails.

    >>> from mpm_fenicsx import linear
    >>> check_law(linear(E=1e6, nu=0.3), dims=[2]).at_rest
    0.0
    """
    check_declared(law)
    rates, turned, asymmetries, dissipated, rest, count = [], [0.0], [], [], [], 0
    for dim in dims:
        point, random = SinglePoint(law, dim), np.random.default_rng(dim)
        rest.append(_check_rest(point, dt))
        for n, size in enumerate(np.repeat(SIZES, SAMPLES)):
            step, old = (dt, np.inf)[n % 2], point.zero()
            path = [point.deformed(random, size) for _ in range(3)]
            for x in path[:-1]:
                _, old = point.stress(x, old, step)
            if not np.isfinite(point.stress(path[-1], old, step)[0]).all():
                continue
            count += 1
            rate, asymmetry = _check_tangent(point, path[-1], old, step, size, random)
            rates.append(rate)
            asymmetries.append(asymmetry)
            turned.append(_check_turn(point, path, step, size, random))
            _check_repeated(point, path[-1], old, size)
            dissipated.append(_check_work(point, size, random))
    if not rates:
        refuse(law, "has no stress at any of the deformations tested, of 1e-4 to 0.1",
               "a law must bear small ones")
    return LawReport(law.name, min(rates), max(turned), max(rest), max(asymmetries),
                     min((share for share in dissipated if share is not None), default=np.nan), count)
