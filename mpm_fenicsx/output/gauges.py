"""Gauges of soil that flows: how far and how high it has come, how fast it is, its energy and volume."""
from typing import Any, Dict, Tuple

import numpy as np

from ..collective import total

FLOW = {  # name → (unit, meaning)
    "front": ("m", "largest x of a material point"), "x99": ("m", "99 % quantile of x of the points"),
    "height": ("m", "largest height of a material point"),
    "speed": ("m/s", "largest speed of a material point"),
    "kinetic": ("J", "kinetic energy (plane: per metre)"),
    "potential": ("J", "potential energy, zero at the floor"), "elastic": ("J", "elastic energy"),
    "energy": ("J", "sum of the three"),
    "volume": ("m^3", "volume of the material points as deformed"),
    "gaps": ("m^3", "of it what has opened between soil that separated")}
QUANTILE = 0.99


class FlowGauges:
    """Columns of the history for the bodies of an ``MPM``, plastic soils, that flow along x; observer of a
    run. ``now``: name → number, after each window. Collective.

    >>> from mpm_fenicsx import MPM, Body, Box, Grid, mohr_coulomb
    >>> soil = mohr_coulomb(50e3, 0.4, friction_angle=22.0)
    >>> body = Body(Box((0.0, 0.0), (1.0, 1.0)), (2, 2), 2, soil, rho=1300.0)
    >>> solid = MPM(Grid(Box((0.0, 0.0), (2.0, 2.0)), (4, 4)), body)
    >>> gauges = FlowGauges(solid)
    >>> gauges(None)
    >>> round(gauges.now["volume"], 12)
    1.0
    """

    def __init__(self, solid: Any):
        self._solid = solid
        self.now: Dict[str, float] = {}

    def columns(self) -> Dict[str, Tuple]:
        """For the record of the run: name → (unit, meaning, function of the ``Window``)."""
        return {name: (*meaning, lambda _, name=name: self.now[name]) for name, meaning in FLOW.items()}

    def __call__(self, window: Any) -> None:
        """Read all gauges."""
        solid, energy = self._solid, self._solid.energy()
        x, y, square = self._gathered()
        own = np.zeros(2)
        for body in solid.bodies:
            volume, opened = body.volume(), body.points.state["opened"]
            some = np.flatnonzero(opened)
            own += volume.sum(), volume[some] @ -np.expm1(-opened[some])
        volume, gaps = total(solid.comm, own)
        self.now = dict(front=x.max(), x99=_quantile(x, QUANTILE), height=y.max(),
                        speed=np.sqrt(square.max()), kinetic=energy["kinetic"],
                        potential=energy["potential"], elastic=energy["strain"],
                        energy=sum(energy.values()), volume=volume, gaps=gaps)

    def _gathered(self) -> Tuple[np.ndarray, ...]:
        """x and height [m], and squared speed [m^2/s^2], of all points, on every rank, shape (n,) each."""
        own = [(p.x[:, 0], p.x[:, 1], sum(v * v for v in p.v.T)) for p in
               (body.points for body in self._solid.bodies)]
        comm = self._solid.comm
        pieces = own if comm.size == 1 else sum(comm.allgather(own), [])
        return tuple(np.concatenate(values) for values in zip(*pieces))


def _quantile(values: np.ndarray, part: float) -> float:
    """What numpy.quantile gives, which takes three times as long."""
    place = part * (len(values) - 1)
    below = int(place)
    above = min(below + 1, len(values) - 1)
    low, high = np.partition(values, (below, above))[[below, above]].tolist()
    return low + (place - below) * (high - low)
