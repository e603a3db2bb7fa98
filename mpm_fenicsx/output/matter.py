"""The material points of each body as those that make maps of a flow want them."""
from typing import List, NamedTuple, Union

import numpy as np

from ..scene.balls import Balls
from ..scene.interface import Interface


class Matter(NamedTuple):
    """Points of one body on this rank: places x [m] and velocities v [m/s], shape (n, D); mass [kg]; volume
    now, without what has opened between soil that separated, and rest, that at the start [m^3], shape (n,)
    each; thickness [m] of a plane body, 1 in space; ball: their radius as balls [m], 0 without."""

    x: np.ndarray
    v: np.ndarray
    mass: np.ndarray
    volume: np.ndarray
    rest: np.ndarray
    thickness: float
    ball: float


def matter(bodies, interface: Union[Interface, Balls, None]) -> List[Matter]:
    """``Matter`` of each of the ``bodies``, see ``MPM.bodies``, in a scene with that interface."""
    found = []
    for number, body in enumerate(bodies):
        p, volume = body.points, body.volume()
        if "opened" in (p.state.dtype.names or ()):
            volume = volume * np.exp(-p.state["opened"])
        ball = interface.radius_of(number) if isinstance(interface, Balls) else 0.0
        found.append(Matter(p.x, p.v, p.mass, volume, p.V0, body.thickness, ball))
    return found
