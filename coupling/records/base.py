"""Where the ground of a scene with ``base=`` has gone: all else is told in its frame."""
from typing import Any, Dict

import numpy as np

from .paraview import Piece


class BaseMotion:
    """Of the base that the ``solid`` or the ``grains`` have, or none, from rest at ``solid.time`` on; tell it
    the end of each window."""

    def __init__(self, solid: Any, grains: Any) -> None:
        scenes = [getattr(side, "scene", None) for side in (solid, grains)]
        self._base = next((base for base in (getattr(one, "base", None) for one in scenes) if base), None)
        self._time = solid.time
        self._v: Any = 0.0
        self._u: Any = 0.0  # numbers at the start, then one per axis of the scene

    @property
    def moves(self) -> bool:
        """Whether there is a base that is accelerated."""
        return self._base is not None

    def follow(self, time: float) -> None:
        """Until the end of a window at ``time`` [s]: integrals of the acceleration by Simpson's rule."""
        if self._base is None:
            return
        dt = time - self._time
        first, middle, last = (np.asarray(self._base(self._time + part * dt)) for part in (0.0, 0.5, 1.0))
        self._u = self._u + dt * self._v + dt**2 / 6.0 * (first + 2.0 * middle)
        self._v = self._v + dt / 6.0 * (first + 4.0 * middle + last)
        self._time = time

    def show(self, parts: Dict[str, Piece]) -> None:
        """Give each of the ``parts`` of a time of ParaView ``base_displacement`` [m] at its points, alike: in
        space they are there beyond their places."""
        for name, (x, cells, data, *of_cells) in parts.items() if self.moves else ():
            shift = np.zeros((len(x), 3))
            shift[:, :np.size(self._u) if np.ndim(self._u) else 3] = self._u
            parts[name] = x, cells, {**data, "base_displacement": shift}, *of_cells

    def get_state(self) -> Dict[str, Any]:
        """As plain data."""
        return {"time": self._time, "v": np.asarray(self._v, float), "u": np.asarray(self._u, float)}

    def set_state(self, state: Dict[str, Any]) -> None:
        """The counterpart."""
        self._time, self._v, self._u = float(state["time"]), np.array(state["v"]), np.array(state["u"])
