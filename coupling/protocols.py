"""What the coupling needs of its two partitions: arrays, shapes and units, written down once.

Both are matched by structure, so that neither solver package is imported here. n: interface points of the solid, m:
wall nodes of the grains, p: particles, dim: 2 or 3. All arrays are the same on every rank, every method is collective.
"""
from typing import Protocol, Tuple

import numpy as np


class Solid(Protocol):
    """The continuum as the loop sees it: takes forces, answers with motion (eq. 26). It may have a method
    ``resample()`` that renews the points of its interface between two steps, see ``resampling``, and a method
    ``window_mass()``: of each interface point, the mass [kg] of a free body that a force would have moved as far over
    the last step, shape (n,). With it and with that of the grains the loop checks the length of weak windows.
    One that has ``energy()``, ``count`` and the truth values ``driven`` and ``springs`` is watched for energy out of
    nothing, see ``gain``."""

    time: float  # [s]

    def surface(self) -> Tuple[np.ndarray, np.ndarray]:
        """Positions [m] and velocities [m/s] of the interface, shape (n, dim) each."""

    def advance(self, dt: float, force: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
        """Advance by dt [s] under ``force`` [N], shape (n, dim), constant meanwhile; returns ``surface()``."""

    def get_state(self) -> dict: ...

    def set_state(self, state: dict) -> None: ...


class Grains(Protocol):
    """The discrete elements as the loop sees them: take motion, answer with forces (eq. 25). They may have a method
    ``contact_at_wall(force)``: tangent stiffness [N/m] and damping [kg/s] of the contact of each particle with the
    moving wall under ``force`` [N], and its mass [kg], shape (p,) each."""

    dt: float  # inner step [s]

    def advance(self, steps: int, x: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Advance ``steps`` inner steps while wall node i moves along x_i + v_i t [m], shape (m, dim); returns the mean
        force on the wall nodes [N], shape (m, dim): impulse / (steps dt)."""

    def particles(self) -> np.ndarray:
        """Structured array with at least ``x`` [m] and ``v`` [m/s], shape (p, dim or 3), and ``mass`` [kg], (p,)."""

    def get_state(self) -> dict: ...

    def set_state(self, state: dict) -> None: ...


class BookedSolid(Solid, Protocol):
    """What the ledger and the record of a case ask besides. It may have a method ``columns()`` with what else belongs
    into the history: name → (unit, meaning, function without arguments)."""

    applied: np.ndarray  # sum of the interface forces that arrived in the last step [N], shape (dim,)
    iterations: int  # of Newton's method in the last step
    phases: dict  # name of a phase of the step → seconds spent in it so far
    count: int  # material points in all

    def energy(self) -> dict:
        """Kinds of energy now [J], name → number."""

    def snapshot(self) -> dict:
        """For ParaView, this rank's piece: name → (positions, {cell type: connectivity}, data); "interface" is among
        them on rank 0. The one method whose answer differs from rank to rank."""

    def describe(self) -> dict:
        """Entries of report.json that only the solid knows."""

    def resolution(self) -> dict:
        """``cell_size`` along each axis [m], ``points_per_cell`` (least, mean, most), ``explicit_limit`` [s] or None."""

    def options(self) -> dict:
        """Options of the user that changed the run, name → text. Not collective."""

    def unused_options(self) -> list:
        """Options that nobody asked for."""


class BookedGrains(Grains, Protocol):
    """What the ledger and the record of a case ask besides. ``scene.wall`` has ``nodes`` [m], shape (m, dim), and
    ``elements``, shape (k, dim). With ``scene.clusters`` (``mass`` [kg], ``flags``: free along each axis) there is a
    method ``bodies()``, with their ``mass`` and ``v`` [m/s], and particles have ``body``: 0 for single spheres."""

    scene: object

    def energy(self) -> dict:
        """Kinds of energy now [J], name → number."""
