"""The data of a DEM scene: frozen, in SI units, checked when made. No numerics, no MPI."""
from dataclasses import dataclass, field
from functools import partial
from typing import Any, ClassVar, Dict, FrozenSet, List, Optional, Set, Tuple, Union

import numpy as np

import mpm_dem_checks as check
from mpm_dem_series import over_time

from .arrays import Array, pair
from .clusters import Cluster
from .contacts import Contacts
from .domain import read_domain, read_ways
from .materials import SPHERES, WALL, Interaction, Material
from .spheres import Spheres
from .structures import by_region, check_structures, for_regions, wall_of
from .walls import Wall


@dataclass(frozen=True)
class SceneData:
    """The fields of a `Scene` (there with their meaning), checked when made."""

    spheres: Spheres = None  # type: ignore[assignment] # none given: no spheres
    wall: Wall = None  # type: ignore[assignment] # none given: no wall
    material: Optional[Material] = None
    wall_material: Optional[Material] = None
    between: Interaction = field(default_factory=Interaction)
    at_wall: Interaction = field(default_factory=Interaction)
    gravity: Array = None
    clusters: Tuple[Cluster, ...] = ()
    walls: Tuple[Wall, ...] = ()
    materials: Dict[str, Material] = field(default_factory=dict)
    interactions: Dict[Any, Interaction] = field(default_factory=dict)
    domain: Array = None
    outflow: Union[str, Dict[str, str]] = "stop"
    structures: Tuple[Any, ...] = ()
    base: Any = None
    contacts: Optional[Contacts] = None

    surfaces: ClassVar[Tuple[Wall, ...]]  # of the structures, one wall each

    def __post_init__(self) -> None:
        put = partial(object.__setattr__, self)  # the class is frozen
        put("clusters", check.records("clusters", self.clusters, Cluster))
        put("walls", check.records("walls", self.walls, Wall))
        given = check_structures(self.structures)
        put("interactions", for_regions(check.record("interactions", self.interactions, dict), given))
        put("structures", by_region(given))
        put("surfaces", tuple(map(wall_of, self.structures)))
        kinds: Dict[str, type] = {"spheres": Spheres, "wall": Wall, "material": Material,
                                  "wall_material": Material, "contacts": Contacts}
        for name, kind in kinds.items():
            check.record(name, getattr(self, name), kind, type(None))
        for name, kind in (("materials", Material), ("interactions", Interaction)):
            check.records(name, check.record(name, getattr(self, name), dict).values(), kind)
        check.records("between and at_wall", (self.between, self.at_wall), Interaction)
        members: Tuple[Any, ...] = (self.spheres, self.wall, *self.clusters, *self.fixed)
        dims = sorted({member.dim for member in members if member is not None})
        if len(dims) != 1:
            raise ValueError(f"the parts of the scene have dimensions {dims}: use one dimension, 2 or 3, for "
                             "all")
        put("spheres", Spheres.none(dims[0]) if self.spheres is None else self.spheres)
        put("wall", Wall.none(dims[0]) if self.wall is None else self.wall)
        put("gravity", check.numbers("gravity", (0.0,) * self.dim if self.gravity is None else self.gravity,
                                     self.dim, "m/s^2"))
        if self.base is not None:
            put("base", over_time("base", self.base, self.dim, "m/s^2"))
        self._check_domain()
        put("materials", self._all_materials())
        put("interactions", self._all_interactions())

    def _check_domain(self) -> None:
        ways = read_ways(self.outflow, self.dim)
        if self.domain is not None:
            object.__setattr__(self, "domain", read_domain(self.domain, self.dim))
        elif set(ways) != {"stop"}:
            raise ValueError(f"outflow is {self.outflow!r} without a domain to leave: give domain=(lower, "
                             "upper), its corners [m]")

    def _all_materials(self) -> Dict[str, Material]:
        own = {name: m for name, m in ((SPHERES, self.material), (WALL, self.wall_material)) if m is not None}
        known = {**own, **self.materials}
        moving = self.moving_materials()
        for surface in self.surfaces if moving and min(moving) in known else ():
            known.setdefault(surface.material, known[min(moving)])  # of a structure that nothing else says
        used = {p.material for p in self.clusters + self.fixed}
        used |= {self.spheres.material} if len(self.spheres.x) else set()
        used |= {self.wall.material} if self.wall.may_touch else set()
        for name in sorted(used - set(known)):
            raise ValueError(f"there is no material {name!r} in the scene: it has {sorted(known)}")
        return known

    def _all_interactions(self) -> Dict[FrozenSet[str], Interaction]:
        known = {frozenset((SPHERES, SPHERES)): self.between, frozenset((SPHERES, WALL)): self.at_wall}
        names = {SPHERES, WALL, *self.materials, *(surface.material for surface in self.surfaces)}
        known.update({pair(key, names): interaction for key, interaction in self.interactions.items()})
        for structure, surface in zip(self.structures, self.surfaces):
            for name in self.moving_materials():
                pair_of = frozenset((name, surface.material))
                known.setdefault(pair_of, Interaction(friction=structure.friction))
        for a, b in self.pairs() + self.wall_pairs():
            if frozenset((a, b)) not in known:
                raise ValueError(f"no interaction says how {a!r} meets {b!r}: add one for this pair")
        return known

    def pairs(self) -> List[Tuple[str, str]]:
        """Pairs of materials of spheres that may meet, sorted."""
        moving = [c.material for c in self.clusters] + [self.spheres.material] * min(2, len(self.spheres.x))
        return sorted({(min(a, b), max(a, b)) for i, a in enumerate(moving) for b in moving[:i]})

    def wall_pairs(self) -> List[Tuple[str, str]]:
        """Pairs (material of spheres, material of a wall) that may meet, sorted."""
        walls = {w.material for w in (self.wall, *self.fixed) if w.may_touch}
        return sorted((a, b) for a in self.moving_materials() for b in walls)

    def moving_materials(self) -> Set[str]:
        """Names of the materials of what moves."""
        single = {self.spheres.material} if len(self.spheres.x) else set()
        return {c.material for c in self.clusters} | single

    @property
    def fixed(self) -> Tuple[Wall, ...]:
        """All walls but the interface: those of ``walls`` and of structures, which may move by themselves."""
        return (*self.walls, *self.surfaces)

    def interaction(self, a: str, b: str) -> Interaction:
        """Contact constants of the materials named a and b."""
        return self.interactions[frozenset((a, b))]

    def frame_pull(self, time: float, span: float) -> Array:
        """Mean acceleration of what is free in the frame of the ``base``, without gravity, in ``span`` [s]
        from ``time`` [s] on, by Simpson's rule [m/s^2], shape (dim,)."""
        if self.base is None:
            return np.zeros(self.dim)
        first, middle, last = (self.base(time + part * span) for part in (0.0, 0.5, 1.0))
        return -(first + 4.0 * middle + last) / 6.0

    @property
    def names(self) -> Tuple[str, ...]:
        """Names of the materials in the order of their numbers."""
        return tuple(self.materials)

    @property
    def dim(self) -> int:
        """2 for a plane scene, 3 in space."""
        return self.wall.dim
