"""The kernels of a law at one point, called from Python: for tests of laws and paths of strain and stress."""
from typing import NoReturn, Tuple

import numpy as np

from .law import Law, bound, kernels


class SinglePoint:
    """The kernels of a law in ``dim`` dimensions as functions of x = (F, F33), shape (n,), and the state."""

    def __init__(self, law: Law, dim: int):
        self.law, self.dim, self.size = law, dim, dim * dim + 1
        self.free = self.size if dim == 2 else dim * dim  # in space F33 stays 1
        try:
            self._stress, self._tangent = kernels(law, dim)
            self._energy = bound(law, law.energy, dim)
            self.rest = np.append(np.eye(dim).ravel(), 1.0)
            self.tangent(self.rest, self.zero(), 1.0)
            self.energy(self.rest, self.zero())
        except Exception as error:  # numba's errors have no class in common
            lines = [line.strip() for line in str(error).splitlines() if "pipeline" not in line]
            said = " ".join([line for line in lines if line][:2]) or type(error).__name__
            raise ValueError(f"the law {law.name} does not run in {dim} dimensions ({said}): "
                             "look at its kernels, or leave these dimensions out") from error

    def zero(self) -> np.ndarray:
        """The state at the start of a run."""
        return np.zeros(1, self.law.state)

    def _split(self, x: np.ndarray) -> Tuple[np.ndarray, float]:
        return np.ascontiguousarray(x[:-1].reshape(self.dim, self.dim)), float(x[-1])

    def stress(self, x: np.ndarray, old: np.ndarray, dt: float) -> Tuple[np.ndarray, np.ndarray]:
        """P, shape (n,), and the new state."""
        P, new = np.zeros(self.size), self.zero()
        F, F33 = self._split(x)
        before = old.tobytes(), F.tobytes()
        self._stress(self.law.params, F, F33, dt, old[0], new[0], P)
        if before != (old.tobytes(), F.tobytes()):
            refuse(self.law, "changes F or its old state", "write to new and P alone")
        return P, new

    def tangent(self, x: np.ndarray, old: np.ndarray, dt: float) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
        """A, shape (n, n), P and the new state as they come with it."""
        P, A, new = np.zeros(self.size), np.zeros((self.size, self.size)), self.zero()
        F, F33 = self._split(x)
        self._tangent(self.law.params, F, F33, dt, old[0], new[0], P, A)
        return A, P, new

    def energy(self, x: np.ndarray, old: np.ndarray) -> float:
        """W [J/m^3]."""
        return float(self._energy(self.law.params, *self._split(x), old[0]))

    def turn(self, Q: np.ndarray, x: np.ndarray) -> np.ndarray:
        """F or P turned; the entry across the plane stays."""
        return np.append((Q @ x[:-1].reshape(self.dim, self.dim)).ravel(), x[-1])

    def deformed(self, random: np.random.Generator, size: float) -> np.ndarray:
        """A random x, ``size`` from rest, with as much change of volume as of shape."""
        change = self.direction(random) + random.normal() * self.rest
        change[self.free:] = 0.0
        return self.rest + size * change

    def direction(self, random: np.random.Generator) -> np.ndarray:
        """A random change of x."""
        change = random.uniform(-1.0, 1.0, self.size)
        change[self.free:] = 0.0
        return change


def refuse(law: Law, what: str, remedy: str) -> NoReturn:
    """Raise the ValueError of a law that is not what a law must be."""
    raise ValueError(f"the law {law.name} {what}: {remedy}")
