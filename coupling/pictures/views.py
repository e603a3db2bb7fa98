"""Pictures of any scene, of what partitions tell of themselves: at the end, and an animation."""
from pathlib import Path
from typing import Any, Callable, Dict, List, Optional, Tuple

import numpy as np
from mpi4py import MPI

from . import animation, picture
from .sights import Sight, magnified, sight
from .space import gravity_of

Angles = Optional[Tuple[float, float]]  # of the eye, see ``space.view_of``


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


def dimension(solid: Any) -> int:
    """2 in the plane, 3 in space. Collective."""
    return solid.surface()[0].shape[1]


def unit_of_stress(stress: np.ndarray) -> Tuple[float, str]:
    """In which the largest is a number of one digit or more: size [Pa] and name.

    >>> unit_of_stress(np.array([120.0, -3400.0]))
    (1000.0, 'kPa')
    """
    most = float(np.abs(stress).max(initial=0.0))
    return next(((size, name) for size, name in ((1e9, "GPa"), (1e6, "MPa"), (1e3, "kPa")) if most >= size),
                (1.0, "Pa"))


class EndPicture:
    """Picture of the end of a run, with the displacements since now times ``magnification`` and the normal
    stress along x in colour. Observer of the run; ``take`` it at the end. Collective."""

    def __init__(self, name: str, magnification: float, solid: Any, grains: Any,
                 angles: Angles = None) -> None:
        self._name, self._by, self._solid, self._grains = name, magnification, solid, grains
        self._angles, self._gravity = angles, gravity_of(solid, grains)
        self._start = self._look()
        self._end: Optional[Tuple[dict, Sight]] = None
        self._title = ""

    def _look(self) -> Tuple[dict, Sight]:
        parts = self._solid.snapshot()
        solid = {name: gathered(parts.get(name)) for name in ("points", "grid", "interface")}
        return solid, sight(self._solid, self._grains, dimension(self._solid), self._solid.time)

    def __call__(self, window: Any) -> None:
        """Nothing to do: what is shown is the end."""

    def take(self) -> None:
        """The run has come to its end."""
        self._end = self._look()
        by = f", displacements x {self._by:g}" if self._by != 1.0 else ""
        self._title = f"t = {self._solid.time:.4g} s{by}"

    def pictures(self) -> Dict[str, Callable]:
        """For the record of the run."""
        return {f"{self._name}_scene.png": self._draw}

    def _draw(self, path: Path) -> None:
        if self._end is None:
            return  # the run has stopped
        (start, before), (end, after) = self._start, self._end
        things = magnified(before, after, self._by)
        (x, _, first), (y, _, last) = start["points"], end["points"]
        _, old, new = np.intersect1d(first["gid"], last["gid"], return_indices=True)
        (vertices, around, _), by = start["grid"], self._by
        wall = (x[:0], np.zeros((0, x.shape[1]), int))
        if end["interface"] is not None and "vertex" not in end["interface"][1]:  # those are drawn already
            nodes, elements, surface = end["interface"]
            wall = nodes + (by - 1) * surface["displacement"], *elements.values()
        stress = last["cauchy_stress"][new, 0, 0]
        size, unit = unit_of_stress(stress)
        picture.draw(path, x[old] + by * (y[new] - x[old]), (vertices, *around.values()), wall, things,
                     stress / size, (self._title, f"stress along x [{unit}]"), (self._gravity, self._angles))


class Animation:
    """Animated GIF of the points of the solid by speed, with particles, rocks, structures and walls: a
    picture every so many windows, in space in perspective, see ``space.view_of`` for the ``angles``. shapes:
    polygons [m], shape (m, corners, 2), to be drawn in the place of the particles, seen along z, a function
    without arguments. Observer of the run, to be called after the one that gives the shapes. Collective."""

    def __init__(self, name: str, every: int, solid: Any, grains: Any, shapes: Optional[Callable] = None,
                 angles: Angles = None) -> None:
        self._name, self._every, self._solid, self._grains = name, every, solid, grains
        self._shapes, self._dim = shapes, 2 if shapes else dimension(solid)
        self._angles, self._gravity = angles, gravity_of(solid, grains)
        self._frames: List[tuple] = []

    def __call__(self, window: Any) -> None:
        """A picture when its turn has come."""
        if window.number % self._every:
            return
        points = gathered(self._solid.snapshot().get("points"))
        things = sight(self._solid, self._grains, self._dim, window.time)
        if self._shapes:
            things.pop("spheres", None)
            things["shapes"] = np.asarray(self._shapes()), np.zeros(0)
        if points is not None:
            x, _, data = points
            order, speed = np.argsort(data["gid"]), np.sqrt(np.einsum("pi,pi->p", data["velocity"],
                                                                      data["velocity"]))
            self._frames.append((f"t = {window.time:.3f} s", x[order, :self._dim].copy(), speed[order],
                                 things))

    def get_state(self) -> tuple:
        """The pictures so far, for checkpoints, on rank 0."""
        return tuple(self._frames)

    def set_state(self, state: tuple) -> None:
        """The counterpart."""
        self._frames = list(state) if MPI.COMM_WORLD.rank == 0 else []

    def pictures(self) -> Dict[str, Callable]:
        """For the record of the run."""
        return {f"{self._name}_flow.gif": self._draw}

    def _draw(self, path: Path) -> None:
        if self._frames:
            animation.save(path, self._frames, "speed [m/s]", (self._gravity, self._angles))
