"""What the loop needs of its two partitions: arrays, shapes and units, written down once.

Both are matched by structure, so that neither solver package is imported here. n: interface points of the solid, m: wall
nodes of the grains, dim: 2 or 3. All arrays are the same on every rank, and every method is collective.
"""
from typing import Protocol, Tuple

import numpy as np


class Solid(Protocol):
    """The continuum: takes forces, answers with motion (eq. 26)."""

    time: float  # [s]

    def surface(self) -> Tuple[np.ndarray, np.ndarray]:
        """Positions [m] and velocities [m/s] of the interface, shape (n, dim) each."""

    def advance(self, dt: float, force: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
        """Advance by dt [s] under ``force`` [N], shape (n, dim), constant meanwhile; returns ``surface()``."""

    def get_state(self) -> dict: ...

    def set_state(self, state: dict) -> None: ...


class Grains(Protocol):
    """The discrete elements: take motion, answer with forces (eq. 25)."""

    dt: float  # inner step [s]

    def advance(self, steps: int, x: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Advance ``steps`` inner steps while wall node i moves along x_i + v_i t [m], shape (m, dim); returns the mean
        force on the wall nodes [N], shape (m, dim): impulse / (steps dt)."""

    def get_state(self) -> dict: ...

    def set_state(self, state: dict) -> None: ...
