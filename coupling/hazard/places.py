"""Gauges and lines over time, and the balance of the volume: columns of the history."""
from functools import partial
from typing import Any, Dict, List, Sequence, Tuple

import numpy as np
from mpi4py import MPI

from . import kernels
from .maps import Maps

VOLUMES = {  # name → (unit, meaning)
    "volume_on_map": ("m^3", "material volume of the flow on the map, that at rest"),
    "volume_beyond_map": ("m^3", "of that which is in the grid and not on the map"),
    "volume_left": ("m^3", "of that which has left the grid"),
    "volume_error": ("1", "sum of the three less what was there at the start and has come in, over that")}


class Places:
    """Values of the gauges and lines of ``maps`` after each window, the same on every rank. dry: depth [m]
    below which there is no speed; ``now``: name → number."""

    def __init__(self, maps: Maps, dry: float, comm: MPI.Comm = MPI.COMM_WORLD) -> None:
        self._maps, self._dry, self._comm = maps, dry, comm
        dim = len(np.atleast_1d(maps.terrain.lower)) + 1
        gauges, lines = maps.gauges, maps.lines
        self._at = np.array([one.at for one in gauges], float).reshape(-1, dim - 1)
        self._half = 0.5 * np.array([one.width or maps.cell for one in gauges], float)
        start = np.zeros((len(lines), 2))
        start[:, :dim - 1] = np.reshape([one.a for one in lines], (-1, dim - 1))
        self._lines = (start, np.reshape([one.normal for one in lines], (-1, 2)).astype(float),
                       np.array([one.length for one in lines], float),
                       np.array([one.width or maps.cell for one in lines], float))
        self._sums = np.zeros((len(gauges), 2 + dim)), np.zeros(len(lines)), np.zeros(2)
        self.volumes, self.released = np.zeros(len(lines)), 0.0  # through the lines; at the start [m^3]
        self.now: Dict[str, float] = {}

    def look(self, bodies: Sequence[Any], inside: float, solid: Any, dt: float) -> None:
        """After a window of dt [s]; inside: material volume of this rank on the map [m^3]. Collective."""
        gauges, discharge, volumes = self._sums
        for sums in self._sums:
            sums[:] = 0.0
        volumes[:] = inside, sum(float(b.rest.sum()) for b in bodies)
        for b in bodies:
            volume = b.volume / b.thickness
            if len(gauges):
                kernels.to_gauges(b.x, b.v, b.mass / b.thickness, volume, float(self._maps.spread),
                                  self._at, self._half, gauges)
            if len(discharge):
                kernels.through_lines(b.x, b.v, volume, b.rest, self._lines, discharge)
        if self._comm.size > 1:
            flat = np.concatenate([sums.ravel() for sums in self._sums])
            self._comm.Allreduce(MPI.IN_PLACE, flat)
            for sums, part in zip(self._sums, np.split(flat, np.cumsum([gauges.size, discharge.size]))):
                sums[:] = part.reshape(sums.shape)
        self.volumes += dt * discharge
        self.now = {**self._of_gauges(), **self._of_lines(), **self._of_volumes(solid)}

    def _of_gauges(self) -> Dict[str, float]:
        found: Dict[str, float] = {}
        for one, half, sums in zip(self._maps.gauges, self._half, self._sums[0]):
            depth = sums[0] / (2.0 * half) ** len(one.at)
            found[f"depth_{one.name}"] = float(depth)
            wet = depth > self._dry
            found[f"speed_{one.name}"] = float(np.linalg.norm(sums[2:]) / sums[1]) if wet else 0.0
        return found

    def _of_lines(self) -> Dict[str, float]:
        found: Dict[str, float] = {}
        for one, discharge, volume in zip(self._maps.lines, self._sums[1].tolist(), self.volumes.tolist()):
            found |= {f"discharge_{one.name}": discharge, f"passed_{one.name}": volume}
        return found

    def _of_volumes(self, solid: Any) -> Dict[str, float]:
        inside, whole = self._sums[2].tolist()
        left, entered = left_volume(solid), entered_volume(solid)
        if not self.now:  # the start
            self.released = whole + left - entered
        there = self.released + entered
        values = inside, whole - inside, left, (whole + left - there) / (there or 1.0)
        return dict(zip(VOLUMES, values))

    def columns(self) -> Dict[str, tuple]:
        """For the history: name → (unit, meaning, function of the ``Window``)."""
        meanings: Dict[str, Tuple[str, str]] = {}
        for gauge in self._maps.gauges:
            at = ", ".join(f"{number:g}" for number in gauge.at)
            meanings |= {f"depth_{gauge.name}": ("m", f"of the flow at ({at})"),
                         f"speed_{gauge.name}": ("m/s", f"of the flow at ({at}), mean over the depth")}
        for line in self._maps.lines:
            through = f"material volume through the line {line.name}"
            meanings |= {f"discharge_{line.name}": ("m^3/s", through),
                         f"passed_{line.name}": ("m^3", f"{through} since the start")}
        return {name: (*meaning, partial(self._value, name)) for name, meaning in {**meanings,
                                                                                   **VOLUMES}.items()}

    def _value(self, name: str, window: Any) -> float:
        return self.now[name]

    def get_state(self) -> List[Any]:
        """Sums since the start."""
        return [self.volumes.copy(), self.released]

    def set_state(self, state: Sequence[Any]) -> None:
        """The counterpart."""
        self.volumes[:], self.released = state[0], float(state[1])


def left_volume(solid: Any) -> float:
    """Material volume that has left a solid since the start [m^3]."""
    return float((getattr(solid, "removed", None) or {}).get("volume", 0.0))


def entered_volume(solid: Any) -> float:
    """Material volume that has come into it since the start [m^3]."""
    return float((getattr(solid, "entered", None) or {}).get("volume", 0.0))
