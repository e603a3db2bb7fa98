"""Pictures of a flow at given times, side by side in one file."""
from pathlib import Path
from typing import Any, Callable, Dict, List, Optional, Sequence

import numpy as np
from mpi4py import MPI

from . import frames
from .views import gathered


class FlowPictures:
    """NAME_flow.png: the points of the solid by speed at ``times`` [s], those that the run reaches. shapes:
    polygons [m], shape (m, corners, 2), at the moment, a function without arguments; walls: see
    ``frames.draw``. Observer of a run, to be called after the one that gives the shapes; made at the start,
    which is the first picture where 0 is among the times. Collective.

    >>> from types import SimpleNamespace as Toy
    >>> x, data = np.zeros((1, 2)), {"velocity": np.ones((1, 2)), "gid": np.zeros(1, int)}
    >>> solid = Toy(time=0.0, snapshot=lambda: {"points": (x, {"vertex": np.zeros((1, 1), int)}, data)})
    >>> list(FlowPictures("chute", (0.0, 0.1), solid).pictures())
    ['chute_flow.png']
    """

    def __init__(self, name: str, times: Sequence[float], solid: Any, shapes: Optional[Callable] = None,
                 walls: Sequence[str] = ()) -> None:
        self._name, self._solid, self._shapes, self._walls = name, solid, shapes, walls
        self._times = sorted(times)
        self._frames: List[tuple] = []
        self._drawn: List[np.ndarray] = []
        if self._times and self._times[0] <= solid.time:
            self._take(solid.time)

    def __call__(self, window: Any) -> None:
        """A picture when the time of the next one has come."""
        if self._times and window.time > self._times[0] - 0.5 * window.dt:
            self._take(window.time)

    def _take(self, time: float) -> None:
        self._times = [t for t in self._times if t > time + 1e-12]
        points = gathered(self._solid.snapshot().get("points"))
        shapes = self._shapes() if self._shapes else None
        if points is not None:  # on rank 0
            x, _, data = points
            speed = np.sqrt(np.einsum("pi,pi->p", data["velocity"], data["velocity"]))
            self._frames.append((f"t = {time:.2f} s", x.copy(), speed))
            self._drawn += [] if shapes is None else [shapes]

    def get_state(self) -> tuple:
        """What has been taken so far, for checkpoints, on rank 0."""
        return tuple(self._times), tuple(self._frames), tuple(self._drawn)

    def set_state(self, state: tuple) -> None:
        """The counterpart."""
        times, frames, drawn = state
        self._times, first = list(times), MPI.COMM_WORLD.rank == 0
        self._frames, self._drawn = list(frames) if first else [], list(drawn) if first else []

    def pictures(self) -> Dict[str, Callable]:
        """For the record of the run."""
        return {f"{self._name}_flow.png": self._draw}

    def _draw(self, path: Path) -> None:
        if self._frames:
            frames.draw(path, self._frames, "speed [m/s]", self._drawn, self._walls)
