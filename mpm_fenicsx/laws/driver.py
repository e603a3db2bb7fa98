"""A single point of a material on a path of strain and stress: what a law does, without a mesh.

The deformation gradient is upper triangular, so that the point does not turn: exp of the logarithmic strains
on its diagonal, slides beside it. Components whose Cauchy stress is prescribed are found by Newton's method
with the law's exact tangent; of several solutions, as where the stress of a soil moves along an edge of its
yield surface, the least change of strain (so the sides of a triaxial sample stay alike). A step that does not
converge is cut in halves.
"""
from typing import Dict, List, NamedTuple, NoReturn, Optional, Sequence, Tuple

import numpy as np

import mpm_dem_checks as check

from ..errors import MPMDivergedError
from .law import Law, check_declared
from .paths import COMPONENTS, Stage
from .single_point import SinglePoint

PLACES = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))  # of the components in F and in the stress
SEEN = {2: [0, 1, 3, 4, 8], 3: [*range(9)]}  # entries of F, shape (9,), that a law sees: F and F33 of a plane
IN_PLANE = COMPONENTS[:4]
CUTS = 10  # a step may become 2^CUTS of its length
ITERATIONS, SHORTER = 30, 8  # of Newton's method; times that an iteration's step may be halved
TOLERANCE, ROUNDING = 1e-10, 1e-14  # of the stress asked for, and of the tangent


class Answer(NamedTuple):
    """Of the point at strains e, shape (6,): F, shape (3, 3), Cauchy stress [Pa], shape (6,), its derivative
    by e, shape (6, 6), norm of A [Pa], P and the new state."""

    F: np.ndarray
    stress: np.ndarray
    slope: np.ndarray
    norm: float
    P: np.ndarray
    new: np.ndarray


def deformed(e: np.ndarray) -> np.ndarray:
    """F, shape (3, 3), at strains e, shape (6,)."""
    F = np.diag(np.exp(e[:3]))
    for value, place in zip(e[3:], PLACES[3:]):
        F[place] = value
    return F


class Driver:
    """A point of ``law`` in ``dim`` dimensions with its state, strains e, shape (6,), and time."""

    def __init__(self, law: Law, dim: int):
        self.point, self.seen = SinglePoint(law, dim), SEEN[dim]
        self.components = COMPONENTS if dim == 3 else IN_PLANE
        self.e, self.state, self.time, self.work = np.zeros(6), self.point.zero(), 0.0, 0.0
        self.answer = self.at(self.e, 0.0)

    def _law_s(self, F: np.ndarray) -> np.ndarray:
        """F as the kernels of the law take it: (F, F33), where F33 is 1 in space."""
        return np.append(F.ravel()[self.seen], np.ones(self.point.size - len(self.seen)))

    def at(self, e: np.ndarray, dt: float) -> Answer:
        """What the law answers after a step of length ``dt`` [s] that ends at the strains e."""
        F, n, seen = deformed(e), len(self.seen), self.seen
        whole, found, new = self.point.tangent(self._law_s(F), self.state, dt)
        P, A, J = np.zeros(9), np.zeros((9, 9)), np.exp(e[:3].sum())
        P[seen], A[np.ix_(seen, seen)] = found[:n], whole[:n, :n]
        P, A = P.reshape(3, 3), A.reshape(3, 3, 3, 3)
        with np.errstate(all="ignore"):  # what is not finite is no answer, see ``_solve``
            sigma, slope = P @ F.T / J, np.empty((6, 6))
            for n, (i, j) in enumerate(PLACES):
                dF = np.zeros((3, 3))
                dF[i, j] = F[i, j] if i == j else 1.0
                change = (np.einsum("ijkl,kl", A, dF) @ F.T + P @ dF.T) / J - (i == j) * sigma
                slope[:, n] = [change[place] for place in PLACES]
            norm = float(np.linalg.norm(A))
        return Answer(F, np.array([sigma[place] for place in PLACES]), slope, norm, P, new)

    def _solve(self, e: np.ndarray, goal: np.ndarray, dt: float) -> Optional[np.ndarray]:
        """Strains with the stresses ``goal`` where that is not NaN, from e on; None when there are none."""
        free = ~np.isnan(goal)
        answer = self.at(e, dt)
        for _ in range(ITERATIONS):
            if not (np.isfinite(answer.slope).all() and np.isfinite(answer.stress).all()):
                return None
            left = (answer.stress - goal)[free]
            size = np.linalg.norm(left)
            if size <= TOLERANCE * np.linalg.norm(answer.stress) + ROUNDING * answer.norm:
                return e
            change = np.zeros(6)
            change[free] = -np.linalg.lstsq(answer.slope[np.ix_(free, free)], left, rcond=1e-10)[0]
            change *= min(1.0, 0.2 / max(abs(change).max(), 1e-300))
            for halved in range(SHORTER + 1):
                trial = self.at(e + 0.5**halved * change, dt)
                if np.linalg.norm((trial.stress - goal)[free]) < size:
                    break
            else:
                return None
            e, answer = e + 0.5**halved * change, trial
        return None

    def step(self, change: np.ndarray, goal: np.ndarray, dt: float) -> bool:
        """Go on by the ``change`` of strain, shape (6,), to the stresses ``goal`` [Pa], shape (6,), NaN where
        the strain counts; False when there is no way."""
        e = self.e + np.where(np.isnan(goal), change, 0.0)
        found = self._solve(e, goal, dt)
        if found is None:
            return False
        answer, before = self.at(found, dt), self.answer
        self.work += 0.5 * float(np.sum((answer.P + before.P) * (answer.F - before.F)))
        self.e, self.state, self.answer = found, answer.new, answer
        self.time += dt if np.isfinite(dt) else 0.0
        return True

    def row(self) -> Dict[str, float]:
        """What the table has of the point now."""
        answer, sigma = self.answer, self.answer.stress
        mean = sigma[:3].mean()
        deviator = np.sum((sigma[:3] - mean) ** 2) + 2.0 * np.sum(sigma[3:] ** 2)
        found = {"time": self.time, **{f"e_{name}": e for name, e in zip(self.components, self.e)},
                 **{f"s_{name}": s for name, s in zip(self.components, sigma)}, "p": 0.0 - mean,
                 "q": np.sqrt(1.5 * deviator), "volume": self.e[:3].sum(), "work": self.work,
                 "energy": self.point.energy(self._law_s(answer.F), self.state)}
        for name in self.state.dtype.names or ():
            values = self.state[name][0]
            for index in np.ndindex(np.shape(values)):
                found["_".join(filter(None, (name, _place(index, np.shape(values)))))] = float(values[index])
        found.pop("unused", None)
        return found


def _place(index: Tuple[int, ...], shape: Tuple[int, ...]) -> str:
    """The name of a component of an array of the state: ``xy`` of tensors, also of symmetric ones in six
    numbers, see ``algebra.PLACE``; ``x`` of vectors; otherwise its number."""
    if shape == (len(COMPONENTS),):
        return COMPONENTS[index[0]]
    return "".join("xyz"[i] for i in index) if max(shape, default=0) <= 3 else "_".join(map(str, index))


UNITS = {"time": "s", "p": "Pa", "q": "Pa", "work": "J/m^3", "energy": "J/m^3",
         **{f"s_{name}": "Pa" for name in COMPONENTS}}


def drive(law: Law, path: Sequence[Stage], dimensions: int = 3) -> Dict[str, np.ndarray]:
    """Lead a point of the ``law`` along the ``path``; a table, name → values after each step, the first at
    the start. dimensions: 3, or 2 for the kernels that plane scenes have, which know of ``xx``, ``yy``,
    ``xy`` and of the stretch across the plane, ``zz``: held it is plane strain, without stress plane stress.

    Columns: ``time`` [s], without stages that are infinitely slow; ``stage``, from 0 on; strains ``e_xx`` …
    and Cauchy stresses ``s_xx`` … [Pa], see ``paths.Stage``; pressure ``p`` and ``q``, von Mises' equivalent
    stress [Pa]; ``volume``, logarithmic change of volume; ``work`` done and strain ``energy`` [J/m^3]; and
    the state of the law by its names, tensors as ``plastic_xx``.

    MPMDivergedError where the law cannot follow: it says where.

    >>> from mpm_fenicsx import linear
    >>> table = drive(linear(E=1e6, nu=0.25), [Stage(strain={"yy": -1e-6}, steps=1)])
    >>> print(round(table["s_xx"][-1] / table["s_yy"][-1], 4))  # nu / (1 - nu)
    0.3333
    """
    check_declared(law)
    stages: List[Stage] = list(check.records("stages of the path", path, Stage))
    if check.choice("dimensions", dimensions, (2, 3)) == 2:
        for number, stage in enumerate(stages):
            for name in sorted({*stage.strain, *stage.stress} - {*IN_PLANE}):
                check.refuse(f"component of stage {number}", name,
                             "in the plane choose one of xx, yy, zz, xy, or give dimensions=3")
    driver = Driver(law, dimensions)
    rows = [{**driver.row(), "stage": 0.0}]
    for number, stage in enumerate(stages):
        _follow(driver, number, stage, rows)
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}


def _follow(driver: Driver, number: int, stage: Stage, rows: List[Dict[str, float]]) -> None:
    """One stage; its rows are added."""
    change = np.array([stage.strain.get(name, 0.0) for name in COMPONENTS])
    goal = np.array([stage.stress.get(name, np.nan) for name in COMPONENTS])
    begin, duration = driver.answer.stress.copy(), np.inf if stage.time is None else stage.time
    for n in range(stage.steps):
        place, end, size = n / stage.steps, (n + 1) / stage.steps, 1.0 / stage.steps
        while place < end - 1e-12:
            to = min(place + size, end)
            share = to - place
            if driver.step(share * change, begin + to * (goal - begin), share * duration):
                place = to
            elif size * stage.steps > 0.5**CUTS:
                size *= 0.5
            else:
                _stop(driver, number, place, goal)
        rows.append({**driver.row(), "stage": float(number)})


def _stop(driver: Driver, number: int, place: float, goal: np.ndarray) -> NoReturn:
    """Say where the path cannot be followed."""
    asked = {name: value for name, value in zip(COMPONENTS, goal) if not np.isnan(value)}
    there = ", ".join(f"s_{name} = {value:.6g} Pa" for name, value in zip(COMPONENTS, driver.answer.stress)
                      if name in asked)
    strains = ", ".join(f"e_{name} = {value:.4g}" for name, value in zip(COMPONENTS, driver.e) if value)
    raise MPMDivergedError(
        f"the path of {driver.point.law.name} ends at {place:.1%} of stage {number}, at "
        f"{', '.join(filter(None, (there, strains))) or 'no strain'}",
        "the law has no stress beyond (a limit point, or the end of its domain), prescribe strains there, or "
        "less stress" if asked else "the law gives NaN beyond, prescribe less strain")
