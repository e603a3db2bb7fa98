"""The flow on a raster: sums over the points in each window, and the largest values since the start."""
from typing import Any, Dict, Sequence

import numpy as np
from mpi4py import MPI

from . import kernels
from .maps import Maps
from .raster import Raster


class FlowMap:
    """Sums over the cells of a ``raster``, and the largest values since the start, complete on rank 0 alone.

    bodies: the points of the flow, see ``protocols.Matter``. ``dry``: depth [m] below which a cell is not
    reached and has no speed.

    Depth is the volume of the points now over the area of a cell, each point spread over a square, so that
    the depths of all cells times their area are the volume on the map. Speed is that of the mean velocity
    over the depth, weighted by mass; pressure is the mean density times its square.
    """

    def __init__(self, raster: Raster, bodies: Sequence[Any], maps: Maps, time: float,
                 comm: MPI.Comm = MPI.COMM_WORLD) -> None:
        self.raster, self._spread, self._comm = raster, float(maps.spread), comm
        dim = len(raster.lower) + 1
        widest = max((float((b.volume / b.thickness).max(initial=0.0)) for b in bodies), default=0.0)
        widest = comm.allreduce(widest, MPI.MAX) ** (1.0 / dim)
        self.dry = 0.1 * widest if maps.dry is None else float(maps.dry)
        self._own = np.zeros((*raster.shape, 2 + dim))  # volume, mass, momentum
        self._sums = self._own if comm.size == 1 else np.zeros_like(self._own)
        self.largest = {name: np.zeros(raster.shape) for name in ("depth", "speed", "pressure")}
        self.largest["arrival"] = np.full(raster.shape, np.nan)
        self.inside = self.look(bodies, time)

    def look(self, bodies: Sequence[Any], time: float) -> float:
        """Where the points are at a ``time`` [s]; returns the material volume on the map [m^3], of this rank.
        Collective."""
        self._own[:] = 0.0
        inside = 0.0
        for b in bodies:
            inside += kernels.to_raster(b.x, b.v, b.mass / b.thickness, b.volume / b.thickness, b.rest,
                                        self._spread, (self.raster.lower, self.raster.cell), self._own)
        if self._comm.size > 1:  # the largest of a sum over ranks is not the sum of the largest
            self._comm.Reduce(self._own, self._sums)
        if self._comm.rank == 0:
            kernels.keep_largest(self._sums, self.raster.area, self.dry, time, *self.largest.values())
        return inside

    @property
    def depth(self) -> np.ndarray:
        """Now [m], shape (rows, columns)."""
        return self._sums[..., 0] / self.raster.area

    @property
    def speed(self) -> np.ndarray:
        """Now [m/s], shape (rows, columns), NaN where it is dry."""
        wet = self.depth > self.dry
        speed = np.full(self.raster.shape, np.nan)
        speed[wet] = np.linalg.norm(self._sums[wet, 2:] / self._sums[wet, 1, None], axis=1)
        return speed

    def get_state(self) -> Dict[str, np.ndarray]:
        """The largest values so far, of rank 0."""
        return {name: values.copy() for name, values in self.largest.items()}

    def set_state(self, state: Dict[str, np.ndarray]) -> None:
        """The counterpart."""
        for name, values in state.items():
            self.largest[name][:] = values
