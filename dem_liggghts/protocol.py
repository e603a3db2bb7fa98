"""What both DEM back ends offer. It is matched by structure: there is no base class to inherit from."""
from typing import Protocol

import numpy as np

PARTICLE = np.dtype([("id", np.int64), ("x", float, 3), ("v", float, 3), ("omega", float, 3),
                     ("radius", float), ("mass", float)])


class DEM(Protocol):
    """One discrete element partition. All arrays are the same on every rank; every method is collective."""

    dt: float  # DEM time step [s]
    time: float  # [s]

    def advance(self, steps: int, x: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Advance ``steps`` DEM steps while wall node i moves along x_i + v_i t, t from 0 to steps * dt.

        x, v: wall nodes at the start of the window [m], [m/s], shape (n, dim). Returns the mean force on the wall
        nodes over the window [N], shape (n, dim): impulse / (steps dt), where the impulse is the sum of velocity
        Verlet's own half kicks, so that it is minus the change of the particles' momentum to round-off.
        """

    def particles(self) -> np.ndarray:
        """Copy of the particles sorted by id, dtype ``PARTICLE``, shape (n,): SI units, three components always."""

    def energy(self) -> dict:
        """``kinetic`` (translation and spin), ``contact`` (elastic energy of the normal contacts), ``potential``
        (in gravity, zero at the origin) [J]."""

    def get_state(self) -> dict:
        """Everything that decides the future (positions, velocities, forces, tangential history, time, wall), as
        name → array copies."""

    def set_state(self, state: dict) -> None:
        """Go back to ``state``: the run continues bit for bit as it did from there."""

    def close(self) -> None:
        """Free what the back end holds."""
