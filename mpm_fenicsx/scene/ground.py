"""Ground of several soils at rest under a plane surface, level or inclined."""
import math
from dataclasses import dataclass
from typing import Any, Optional, Sequence, Tuple

import numpy as np

import mpm_dem_checks as check

WATER = 1000.0  # density [kg/m^3]
LEVEL = 1e-9  # slope of what counts as level


def check_ratio(ratio: float) -> float:
    """The ratio of stresses along and across a surface; ValueError for one that cannot be."""
    return check.not_negative("ratio", ratio, rule="the ratio of horizontal to vertical stress must be 0 or "
                              "a positive number")


@dataclass(frozen=True)
class Layer:
    """Soil between two planes along the surface. thickness: across them [m]; rho: density [kg/m^3]; ratio: of
    the normal stress along the surface to that across it, K0, as 1 - sin phi (Jaky 1944) or nu / (1 - nu)
    (elastic, held at the sides); phi: friction angle [degrees] of a soil without cohesion, which on a slope
    has the nearest ratio that it bears; None: it bears any."""

    thickness: Optional[float]
    rho: float
    ratio: float
    phi: Optional[float] = None

    def __post_init__(self) -> None:
        if self.thickness is not None:
            check.positive("thickness of the layer", self.thickness, "m")
        check.positive("rho of the layer", self.rho, "kg/m^3", "the density must be positive")
        check_ratio(self.ratio)
        if self.phi is not None:
            check.between("phi", self.phi, 0, 90, "degrees", ends="[)")


class Ground:
    """Stress of ``layers``, from the surface downward, under a plane through ``at`` [m], shape (dim,);
    gravity: [m/s^2], shape (dim,); normal: of the surface, outward, shape (dim,), None: level, against
    gravity. The last layer goes as deep as there is soil; one before it has a thickness.

    As all depends on the depth d across the surface alone, the stress on planes along it is W(d) g, W being
    the mass above per area: so it is of the layers together, as on an infinite slope. The stress along the
    surface is that across it times the ``ratio`` of the layer.

    water: depth of the water table under a level surface [m]: below it the weight is less by that of the
    water, 1000 kg/m^3, and the stress is the effective one. Hand ``buoyancy`` to ``MPM`` as ``body_force``
    then.

    >>> sand, clay = Layer(1.0, 1600.0, ratio=0.5), Layer(None, 2000.0, ratio=0.8)
    >>> ground = Ground([sand, clay], at=(0.0, 5.0), gravity=(0.0, -10.0), water=2.0)
    >>> ground.stress(np.array([(0.0, 4.5), (0.0, 3.5), (0.0, 2.0)]))[:, 1, 1]
    array([ -8000., -26000., -46000.])
    >>> ground.stress(np.array([(0.0, 3.5)]))[0, 0, 0]  # 0.8 of it
    -20800.0
    """

    def __init__(self, layers: Sequence[Layer], at: Any, gravity: Any, normal: Any = None,
                 water: Optional[float] = None) -> None:
        self._layers = check.records("layers", layers, Layer)
        if not self._layers:
            raise ValueError("the ground has no layers: give at least one")
        for n, one in enumerate(self._layers[:-1]):
            if one.thickness is None:
                raise ValueError(f"layer {n} has no thickness and is not the last one: give it one [m]")
        self._gravity = g = check.array("gravity", gravity, (2,), (3,), unit="m/s^2")
        self._at = check.array("at", at, g.shape, unit="m")
        n = -g if normal is None else check.array("normal", normal, g.shape)
        if not np.linalg.norm(n) > 0.0:
            raise ValueError("the surface has no normal, as it or gravity is zero: give a direction")
        self._normal = n / np.linalg.norm(n)
        across = float(g @ self._normal)
        if not across < 0.0:
            raise ValueError(f"gravity is {g} m/s^2: its part along the normal of the surface, "
                             f"{self._normal}, must be negative, as the surface is above")
        self._across, self._along = across, g - across * self._normal
        self._water = self._checked(water)
        self._tops = np.cumsum([0.0, *(one.thickness or 0.0 for one in self._layers[:-1])])
        self._units = np.array([self._unit(one) for one in self._layers])

    def _checked(self, water: Optional[float]) -> Optional[float]:
        """ValueError for a water table that is not simply a reduction of weight."""
        if water is None:
            return None
        check.not_negative("water", water, "m", "give the depth of the water table, 0 or a positive number")
        if np.linalg.norm(self._along) > -LEVEL * self._across:
            raise ValueError(f"water is {water} m, and the surface is a slope, in which water flows and "
                             "pulls the soil: give a level surface, or no water")
        for n, one in enumerate(self._layers):
            if one.rho <= WATER:
                raise ValueError(f"layer {n} has a density of {one.rho:g} kg/m^3, that of water or less: "
                                 "under water it floats, give its density with the pores full")
        return water

    def _unit(self, layer: Layer) -> np.ndarray:
        """Stress over that across the surface, shape (3, 3). With t the tangent of the slope and s = sin phi,
        Mohr's circle through the stress across the surface, (1, t), and along it, (K, -t), touches the yield
        surface where (1 - s^2) K^2 - 2 (1 + s^2) K + 1 - s^2 + 4 t^2 = 0."""
        length = float(np.linalg.norm(self._along))
        t, ratio, side = -length / self._across, layer.ratio, layer.ratio
        down = np.resize(np.append(self._along / (length or 1.0), 0.0), 3)
        n = np.resize(np.append(self._normal, 0.0), 3)
        if layer.phi is not None:
            s = math.sin(math.radians(layer.phi))
            root = math.sqrt(max((1.0 + s**2) ** 2 - (1.0 - s**2) * (1.0 - s**2 + 4.0 * t**2), 0.0))
            ratio = min(max(ratio, (1.0 + s**2 - root) / (1.0 - s**2)), (1.0 + s**2 + root) / (1.0 - s**2))
            middle, radius = 0.5 * (1.0 + ratio), math.hypot(0.5 * (1.0 - ratio), t)
            side = min(max(side, middle - radius), middle + radius)
        unit = side * np.eye(3) + (1.0 - side) * np.outer(n, n) + (ratio - side) * np.outer(down, down)
        return unit - t * (np.outer(down, n) + np.outer(n, down))

    def _depth(self, x: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
        """Of places x under the surface [m], and number of the layer, shape (n,)."""
        d = np.maximum((self._at - x) @ self._normal, 0.0)
        return d, np.searchsorted(self._tops, d, side="right") - 1

    def stress(self, x: np.ndarray) -> np.ndarray:
        """At places x [m], shape (n, dim): tensors [Pa], shape (n, 3, 3), for ``stress`` of ``Body``."""
        d, layer = self._depth(x)
        rho = np.array([one.rho for one in self._layers])
        above = np.append(0.0, np.cumsum(rho[:-1] * np.diff(self._tops)))
        mass = above[layer] + rho[layer] * (d - self._tops[layer])
        if self._water is not None:
            mass -= WATER * np.maximum(d - self._water, 0.0)
        return (self._across * mass)[:, None, None] * self._units[layer]

    def buoyancy(self, x: np.ndarray, t: float) -> np.ndarray:
        """Of soil at places x [m], shape (n, dim), at rest, force per mass [m/s^2], shape (n, dim)."""
        d, layer = self._depth(x)
        if self._water is None:
            return np.zeros(np.shape(x))
        share = np.where(d > self._water, WATER / np.array([one.rho for one in self._layers])[layer], 0.0)
        return -share[:, None] * self._gravity
