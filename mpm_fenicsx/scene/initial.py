"""The state of soil at the start by the keys of a case: of a checkpoint, or of the weight of its layers."""
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Callable, ClassVar, Dict, List, Literal, Optional, Sequence, Tuple

import numpy as np

import mpm_dem_checks as check

from ..laws.soil import Soil
from .bodies import Body
from .from_checkpoint import FromCheckpoint
from .ground import Ground, Layer
from .mesh import Box

NEAR = 1e-2  # of a row of cells: a depth is that of the row
Several = Optional[Tuple[float, ...]]


def _starts(keys: dict) -> bool:
    return keys["start"] is not None


def _rests(keys: dict) -> bool:
    return keys["initial"] == "geostatic" and not _starts(keys)


def _layered(keys: dict) -> bool:
    return bool(keys["layers"])


@dataclass(frozen=True)
class InitialState:
    """Soil that starts with the state of a checkpoint, see ``FromCheckpoint``. ``counts``: of a field as a
    key of a case, when it has an effect.

    >>> from mpm_fenicsx import linear
    >>> body = Body(Box((0.0, 0.0), (1.0, 1.0)), (4, 4), 2, linear(1e6, 0.3), 1000.0)
    >>> InitialState(start=Path("out/settled"), start_velocities=True).of(body).start.velocities
    True
    """

    start: Optional[Path] = None  # checkpoint, or folder of a run, whose soil this one is; none: as stated
    start_places: bool = True  # where it was there; no: where it is stated
    start_velocities: bool = False  # as fast as it was there; no: as stated

    counts: ClassVar[Dict[str, Tuple[Callable[[dict], bool], str]]] = dict.fromkeys(
        ("start_places", "start_velocities"), (_starts, "with start=, a checkpoint"))

    def of(self, body: Body, number: int = 0) -> Body:
        """The ``body`` as it starts; number: of the body there."""
        if self.start is None:
            return body
        return replace(body, stress=None, start=FromCheckpoint(self.start, number, self.start_places,
                                                               self.start_velocities))


@dataclass(frozen=True)
class InitialGround(InitialState):
    """The same, and level ground with the stress of its weight, of one soil or in layers of which each has
    its own numbers, see ``Ground``; water: as the reduction of weight that it is there."""

    initial: Literal["zero", "geostatic"] = "zero"  # stress at the start: none, or of the weight above
    ratio: Optional[float] = None  # of horizontal to vertical stress then, K0 [-]; none: 1 - sin phi
    water: Optional[float] = None  # depth of the water table under the surface [m]; none: dry
    layers: Several = None  # depth of the lower side of each layer but the last [m]; none: one soil
    layer_rho: Several = None  # density of each layer [kg/m^3]; none: that of the soil
    layer_phi: Several = None  # friction angle of each layer [degrees]; none: that of the soil
    layer_cohesion: Several = None  # cohesion of each layer [Pa]; none: that of the soil
    layer_ratio: Several = None  # K0 of each layer [-]; none: ratio, or 1 - sin phi of the layer

    counts: ClassVar[Dict[str, Tuple[Callable[[dict], bool], str]]] = {
        **InitialState.counts, "ratio": (_rests, "with initial=geostatic, without start="),
        **dict.fromkeys(("layer_rho", "layer_phi", "layer_cohesion"),
                        (_layered, "with layers=, their depths")),
        "layer_ratio": (lambda keys: _layered(keys) and _rests(keys), "with initial=geostatic and layers=")}

    def ground(self, body: Body, soil: Soil, gravity: Sequence[float]) -> Dict[str, Any]:
        """What ``MPM`` takes of a ``body``, a Box of ``soil`` with a level surface, in layers if there are:
        its ``body``, whether layers are ``bonded``, and the ``body_force`` of water.

        >>> soil = Soil(E=1e6, nu=0.3, rho=1600.0, phi=30.0)
        >>> body = Body(Box((0.0, 0.0), (1.0, 1.0)), (4, 4), 2, soil.material(2), soil.rho)
        >>> deep = InitialGround(initial="geostatic", layers=(0.25,), layer_rho=(1500.0, 1900.0))
        >>> stated = deep.ground(body, soil, (0.0, -10.0))
        >>> [(one.cells, one.rho) for one in stated["body"]]
        [((4, 1), 1500.0), ((4, 3), 1900.0)]
        """
        soils = self._soils(soil)
        rows = self._rows(body)
        row = body.box.size[1] / rows[-1]
        ratios = self._each("layer_ratio") or len(soils) * [self.ratio]
        layers = [Layer(row * count, one.rho, one.at_rest if ratio is None else ratio)
                  for count, one, ratio in zip(np.diff(rows), soils, ratios)]
        top = np.zeros(body.dim)
        top[1] = body.box.upper[1]
        ground = Ground(layers, top, gravity, water=self.water)
        bodies = [replace(part, law=one.material(body.dim), rho=one.rho) for part, one
                  in zip(_cut(body, rows), soils)]
        if self.initial == "geostatic":
            bodies = [replace(one, stress=ground.stress) for one in bodies]
        return dict(body=[self.of(one, number) for number, one in enumerate(bodies)],
                    bonded=len(bodies) > 1, body_force=None if self.water is None else ground.buoyancy)

    def _each(self, name: str) -> List[float]:
        """Numbers of the layers under this name; none where it is not given."""
        values = getattr(self, name)
        if values is None:
            return []
        return list(check.numbers(name, values, len(self.layers or ()) + 1))

    def _soils(self, soil: Soil) -> List[Soil]:
        """Of the layers, from the surface down."""
        given = {name: self._each(f"layer_{name}") for name in ("rho", "phi", "cohesion")}
        numbers: List[Dict[str, Any]] = [{name: values[n] for name, values in given.items() if values}
                                         for n in range(len(self.layers or ()) + 1)]
        return [replace(soil, **one) for one in numbers]

    def _rows(self, body: Body) -> List[int]:
        """Numbers of the rows of body cells, from the surface down, between which the layers lie."""
        if not self.layers:
            return [0, 1]
        if not isinstance(body.shape, Box) or body.cells is None:
            raise ValueError("the body is not a Box: layers are cut out of one, leave layers= out")
        depths = check.numbers("layers", self.layers, np.size(self.layers), "m", check.positive)
        height, count = body.shape.size[1], body.cells[1]
        ends = np.array(depths) / height * count
        rows = np.rint(ends).astype(int)
        if abs(ends - rows).max() > NEAR or (np.diff([0, *rows, count]) < 1).any():
            check.refuse("layers", self.layers, f"give growing depths below {height:g} m that are multiples "
                         f"of {height / count:g} m, the height of a row of body cells", "m")
        return [0, *map(int, rows), count]


def _cut(body: Body, rows: Sequence[int]) -> List[Body]:
    """The body in layers between the ``rows``, see ``InitialGround``."""
    if len(rows) == 2:
        return [body]
    lower, upper, size = body.box.lower, body.box.upper, body.box.size[1] / rows[-1]
    along, _, *others = body.cells or ()
    parts = []
    for first, last in zip(rows[:-1], rows[1:]):
        bottom = lower[1] if last == rows[-1] else upper[1] - last * size
        box = Box((lower[0], bottom, *lower[2:]), (upper[0], upper[1] - first * size, *upper[2:]))
        parts.append(replace(body, shape=box, cells=(along, last - first, *others)))
    return parts
