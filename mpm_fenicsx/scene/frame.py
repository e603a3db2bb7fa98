"""The frame in which the MPM computes: coordinates as in maps keep few digits, so its origin moves near the
scene.

At 5e6 m two doubles are 1e-9 m apart, more than points creep in a step and 1e-7 of a centimetre's cell. The
scene is therefore moved when it is taken over, what is given out is moved back, and functions of the user get
true positions. A frame of numbers in a map grid is a shift alone: no rotation, no scale.
"""
import copy
from dataclasses import replace
from functools import singledispatch
from typing import Any, Sequence, Union

import numpy as np

from .balls import Balls
from .bodies import Body, Cloud, Grid
from .column_grid import Columns
from .conditions import GridWall, Load, Penalty
from .interface import SIDES, Interface, Resampling
from .mesh import Box, Mesh
from .openings import Inflow, Outflow
from .solid import SolidScene
from .structures import Structure
from .supports import Support

FAR = 64.0  # distance from zero over the size of the grid: from there on six bits of the coordinates are lost


def find_origin(box: Box) -> np.ndarray:
    """Origin [m], shape (dim,), of the frame for a grid with this ``box``: zero along axes on which it is
    near zero.

    Elsewhere the multiple of a power of ten, larger than the grid, that is next to its lower corner:
    users move a scene to a map by such numbers, and in the frame it is then where it was. Differences to
    anything so near are exact.
    """
    lower, upper = np.asarray(box.lower, float), np.asarray(box.upper, float)
    near = np.where(lower > 0.0, lower, np.where(upper < 0.0, upper, 0.0))
    size = box.size.max()
    step = 10.0 ** np.ceil(np.log10(size))
    return np.where(np.abs(near) >= FAR * size, np.floor(lower / step + 0.5) * step, 0.0)


class Frame:
    """``origin`` [m], shape (dim,): x in the frame is x + origin in the user's coordinates."""

    def __init__(self, box: Box):
        self.origin = find_origin(box)
        self.moved = bool(self.origin.any())

    def enter(self, thing: Any) -> Any:
        """A scene, or a part of one, in the frame."""
        return shifted(thing, -self.origin) if self.moved else thing

    def leave(self, thing: Any) -> Any:
        """Positions, shape (n, dim), an ``Interface`` or None in the user's coordinates."""
        if not self.moved or thing is None:
            return thing
        return thing + self.origin if isinstance(thing, np.ndarray) else shifted(thing, self.origin)


@singledispatch
def shifted(thing: Any, by: np.ndarray) -> Any:
    """A part of a scene moved by ``by`` [m], shape (dim,); functions of positions move along."""
    raise TypeError(f"{type(thing).__name__} is no part of a scene")


def _of_shifted(f: Any, by: np.ndarray) -> Any:
    return (lambda x, *more: f(x - by, *more)) if callable(f) else f


@shifted.register(Box)
def _(box: Box, by: np.ndarray) -> Box:
    return Box(tuple(box.lower + by), tuple(box.upper + by))


@shifted.register(Grid)
def _(grid: Grid, by: np.ndarray) -> Grid:
    return replace(grid, box=shifted(grid.box, by))


@shifted.register(Mesh)
def _(mesh: Mesh, by: np.ndarray) -> Mesh:
    other = copy.copy(mesh)  # not made anew: its checks take time, and nothing has changed
    object.__setattr__(other, "vertices", mesh.vertices + by)
    return other


@shifted.register(Columns)
def _(grid: Columns, by: np.ndarray) -> Columns:
    return Columns([line + d for line, d in zip(grid.lines, by)], grid.z + by[-1], grid.h, grid.down, grid.up)


@shifted.register(Cloud)
def _(cloud: Cloud, by: np.ndarray) -> Cloud:
    return Cloud(cloud.x + by, cloud.volume, cloud.half)


@shifted.register(Body)
def _(body: Body, by: np.ndarray) -> Body:
    return replace(body, shape=shifted(body.shape, by), velocity=_of_shifted(body.velocity, by),
                   stress=_of_shifted(body.stress, by), force_cells=_of_shifted(body.force_cells, by))


@shifted.register(Support)
@shifted.register(GridWall)
def _(held: Union[Support, GridWall], by: np.ndarray) -> Union[Support, GridWall]:
    return replace(held, where=_of_shifted(held.where, by))


@shifted.register(Interface)
def _(interface: Interface, by: np.ndarray) -> Interface:
    rule = interface.resampling
    return replace(interface, x=np.asarray(interface.x, float) + by, resampling=rule and shifted(rule, by))


@shifted.register(Balls)
def _(balls: Balls, by: np.ndarray) -> Balls:
    return balls


@shifted.register(Resampling)
def _(rule: Resampling, by: np.ndarray) -> Resampling:
    return replace(rule, feet=tuple(foot and (foot[0], foot[1] + by[SIDES[foot[0]][0]])
                                    for foot in rule.feet))


@shifted.register(Penalty)
def _(penalty: Penalty, by: np.ndarray) -> Penalty:
    return replace(penalty, surface=shifted(penalty.surface, by),
                   at=None if penalty.at is None else np.asarray(penalty.at, float) + by)


@shifted.register(Structure)
def _(structure: Structure, by: np.ndarray) -> Structure:
    other = copy.copy(structure)  # not made anew: nothing that was checked has changed
    object.__setattr__(other, "x", structure.x + by)
    return other


@shifted.register(Inflow)
def _(inflow: Inflow, by: np.ndarray) -> Inflow:
    return replace(inflow, at=inflow.at + by, stress=_of_shifted(inflow.stress, by))


@shifted.register(Outflow)
def _(plane: Outflow, by: np.ndarray) -> Outflow:
    return replace(plane, at=plane.at + by, box=plane.box and shifted(plane.box, by))


@shifted.register(Load)
def _(load: Load, by: np.ndarray) -> Load:
    return replace(load, surface=shifted(load.surface, by))


@shifted.register(SolidScene)
def _(scene: SolidScene, by: np.ndarray) -> SolidScene:
    def several(things: Sequence) -> tuple:
        return tuple(shifted(thing, by) for thing in things)

    return replace(scene, grid=shifted(scene.grid, by), body=several(scene.bodies),
                   supports=several(scene.supports), loads=several(scene.loads),
                   penalties=several(scene.penalties), structures=several(scene.structures),
                   openings=several(scene.openings),
                   body_force=_of_shifted(scene.body_force, by),
                   interface=scene.interface and shifted(scene.interface, by))


class Seen:
    """Something as others see it: some attributes replaced, the rest is its own."""

    def __init__(self, of: Any, **replaced: Any):
        self.__dict__.update(replaced, _of=of)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._of, name)

    def __setattr__(self, name: str, value: Any) -> None:
        setattr(self._of, name, value)

    def __len__(self) -> int:
        return len(self._of)


def seen_points(points: Any, frame: Frame) -> Any:
    """Points whose positions, to be read only, are in the user's coordinates."""
    if not frame.moved:
        return points
    places = {name: frame.leave(getattr(points, name)) for name in ("x", "x0") if hasattr(points, name)}
    for x in places.values():
        x.flags.writeable = False  # a change would be lost
    return Seen(points, **places)
