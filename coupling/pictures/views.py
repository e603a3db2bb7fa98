"""Pictures of any scene, of what partitions tell of themselves: at the end, and an animation."""
from pathlib import Path
from typing import Any, Callable, Dict, List, Optional, Tuple

import numpy as np
from mpi4py import MPI

from . import animation, picture

ROUND = np.linspace(0.0, 2.0 * np.pi, 17)[:-1]  # [rad] corners of the polygon that stands for a sphere


def gathered(part: Optional[tuple], comm: MPI.Comm = MPI.COMM_WORLD) -> Optional[tuple]:
    """A part of a snapshot, (positions, {cell type: connectivity}, data) or None, of all ranks together; on
    the others than rank 0 None. Collective."""
    pieces = comm.gather(part)
    pieces = [piece for piece in pieces or () if piece is not None]
    if not pieces:
        return None
    first = np.cumsum([0, *(len(x) for x, _, _ in pieces)])
    cells = {kind: np.concatenate([start + c[kind] for start, (_, c, _) in zip(first, pieces)])
             for kind in pieces[0][1]}
    return (np.concatenate([x for x, _, _ in pieces]), cells,
            {name: np.concatenate([data[name] for _, _, data in pieces]) for name in pieces[0][2]})


def particles_of(grains: Any, dim: int) -> Tuple[np.ndarray, np.ndarray]:
    """Centres [m], shape (n, dim), and radii [m], shape (n,), of the particles; none without ``grains``."""
    if grains is None:
        return np.zeros((0, dim)), np.zeros(0)
    particles = grains.particles()
    return particles["x"][:, :dim], particles["radius"]


class EndPicture:
    """Picture of the end of a run, with the displacements since now times ``magnification`` and the normal
    stress along x in colour. Observer of the run; ``take`` it at the end. Collective."""

    def __init__(self, name: str, magnification: float, solid: Any, grains: Any) -> None:
        self._name, self._by, self._solid, self._grains = name, magnification, solid, grains
        self._start = self._look()
        self._end: Optional[Tuple[dict, tuple]] = None

    def _look(self) -> Tuple[dict, tuple]:
        parts = self._solid.snapshot()
        solid = {name: gathered(parts.get(name)) for name in ("points", "grid", "interface")}
        dim = self._solid.surface()[0].shape[1]
        return solid, particles_of(self._grains, dim)

    def __call__(self, window: Any) -> None:
        """Nothing to do: what is shown is the end."""

    def take(self) -> None:
        """The run has come to its end."""
        self._end = self._look()

    def pictures(self) -> Dict[str, Callable]:
        """For the record of the run."""
        return {f"{self._name}_scene.png": self._draw}

    def _draw(self, path: Path) -> None:
        if self._end is None:
            return  # the run has stopped
        (start, (centre, _)), (end, (moved, radius)) = self._start, self._end
        (x, _, before), (y, _, after) = start["points"], end["points"]
        _, old, new = np.intersect1d(before["gid"], after["gid"], return_indices=True)
        (vertices, around, _), by = start["grid"], self._by
        wall = (x[:0], np.zeros((0, x.shape[1]), int))
        if end["interface"] is not None:
            nodes, elements, surface = end["interface"]
            wall = nodes + (by - 1) * surface["displacement"], *elements.values()
        picture.draw(path, x[old] + by * (y[new] - x[old]), (vertices, *around.values()), wall,
                     (centre + by * (moved - centre), radius), 1e-6 * after["cauchy_stress"][new, 0, 0],
                     "stress along x [MPa]")


class Animation:
    """Animated GIF of the points of the solid by speed and of the particles, seen along z: a picture every so
    many windows. shapes: polygons [m], shape (m, corners, 2), to be drawn in the place of the particles, a
    function without arguments. Observer of the run, to be called after the one that gives the shapes.
    Collective."""

    def __init__(self, name: str, every: int, solid: Any, grains: Any,
                 shapes: Optional[Callable] = None) -> None:
        self._name, self._every, self._solid, self._grains = name, every, solid, grains
        self._shapes = shapes or self._particles
        self._frames: List[tuple] = []

    def __call__(self, window: Any) -> None:
        """A picture when its turn has come."""
        if window.number % self._every:
            return
        points = gathered(self._solid.snapshot().get("points"))
        shapes = self._shapes()
        if points is not None:
            x, _, data = points
            order, speed = np.argsort(data["gid"]), np.sqrt(np.einsum("pi,pi->p", data["velocity"],
                                                                      data["velocity"]))
            self._frames.append((f"t = {window.time:.3f} s", x[order, :2].copy(), speed[order], shapes))

    def get_state(self) -> tuple:
        """The pictures so far, for checkpoints, on rank 0."""
        return tuple(self._frames)

    def set_state(self, state: tuple) -> None:
        """The counterpart."""
        self._frames = list(state) if MPI.COMM_WORLD.rank == 0 else []

    def _particles(self) -> np.ndarray:
        """Each as a polygon."""
        centre, radius = particles_of(self._grains, 2)
        return centre[:, None] + radius[:, None, None] * np.column_stack([np.cos(ROUND), np.sin(ROUND)])

    def pictures(self) -> Dict[str, Callable]:
        """For the record of the run."""
        return {f"{self._name}_flow.gif": self._draw}

    def _draw(self, path: Path) -> None:
        if self._frames:
            animation.save(path, self._frames, "speed [m/s]")
