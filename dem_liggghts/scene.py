"""What a DEM scene consists of: frozen data in SI units, checked when made. No numerics and no MPI in here."""
from dataclasses import dataclass, field

import numpy as np

import mpm_dem_checks as check

from .arrays import finite, pair, per_sphere, rows
from .clusters import Cluster
from .outflow import read_domain, read_ways

BALLS, WALL = "spheres", "wall"  # names of Scene.material and Scene.wall_material


@dataclass(frozen=True)
class Material:
    """Elastic constants of one contact partner: Young's modulus E [Pa], Poisson's ratio nu [-]."""

    E: float
    nu: float

    def __post_init__(self):
        check.positive("E", self.E, "Pa", "Young's modulus must be positive")
        check.between("nu", self.nu, -1.0, 0.5, rule="Poisson's ratio must lie in (-1, 0.5]", ends="(]")


@dataclass(frozen=True)
class Interaction:
    """How two materials meet: coefficient of restitution (0 to 1), Coulomb's coefficient of friction [-], adhesion
    [Pa], which pulls with that stress on the area where the two overlap.

    attraction: whether the damper may pull at the end of a contact, by default only where there is adhesion. Either way
    the damping is chosen such that a sphere that hits and leaves has the given restitution; without attraction this
    takes more of it (1.2 times as much at a restitution of 0.5, 2.8 times at 0.05), and a restitution below 0.01 is met
    as 0.01. Friction and damping along the surface together never exceed ``friction`` times the normal force.
    """

    restitution: float = 1.0
    friction: float = 0.0
    adhesion: float = 0.0
    attraction: bool = None

    def __post_init__(self):
        check.between("restitution", self.restitution, 0.0, 1.0, rule="give a value from 0 to 1")
        for name, unit in (("friction", ""), ("adhesion", "Pa")):
            check.not_negative(name, getattr(self, name), unit, "it must not be negative")
        if self.attraction not in (None, False, True):
            raise ValueError(f"attraction is {self.attraction!r}: give True, False or None")

    @property
    def pulls(self):
        """Whether the damper may pull at the end of a contact."""
        return self.adhesion > 0 if self.attraction is None else bool(self.attraction)


@dataclass(frozen=True)
class Spheres:
    """Single spheres: centres x [m] and velocities v [m/s], shape (n, dim) with dim 2 or 3; radius [m] and density
    rho [kg/m^3], scalars or shape (n,); spin omega [rad/s], shape (n, 3); name of the material. A plane scene (dim 2)
    keeps the true mass of the ball and confines it to the plane z = 0."""

    x: np.ndarray
    v: np.ndarray
    radius: np.ndarray
    rho: np.ndarray
    omega: np.ndarray = None
    material: str = BALLS

    def __post_init__(self):
        put = lambda name, value: object.__setattr__(self, name, value)  # noqa: E731 - the class is frozen
        put("x", finite(self.x, "x of the spheres", (2, 3)))
        put("v", finite(self.v, "v of the spheres", (self.dim,)))
        put("omega", finite(np.zeros((len(self.x), 3)) if self.omega is None else self.omega, "omega", (3,)))
        put("radius", per_sphere(self.radius, "radius", len(self.x)))
        put("rho", per_sphere(self.rho, "rho (density of the spheres)", len(self.x)))
        if not len(self.x) == len(self.v) == len(self.omega):
            raise ValueError(f"{len(self.x)} positions, {len(self.v)} velocities, {len(self.omega)} spins: "
                             "give one of each per sphere")

    @classmethod
    def none(cls, dim):
        """No single spheres."""
        return cls(np.zeros((0, dim)), np.zeros((0, dim)), np.zeros(0), np.zeros(0))

    @property
    def dim(self):
        return self.x.shape[1]

    @property
    def mass(self):
        """Mass of each ball [kg], shape (n,)."""
        return self.rho * 4.0 / 3.0 * np.pi * self.radius**3


@dataclass(frozen=True)
class Wall:
    """A surface that spheres meet: nodes [m], shape (n, dim), and elements, shape (m, dim): segments in a plane
    scene, triangles in space. Seen from outside the body, a segment a→b has the outside on its left and a triangle
    runs counter-clockwise. Or discs (in space balls) of one ``radius`` [m] around the nodes: elements, shape (m, 1).

    Elements whose nodes lie in the same place hang together, whether or not they name the same ones (as in an STL
    file), and so do walls that meet: a sphere has one contact there, whose friction goes on. Each force acts on the
    nodes of the element that is touched.

    depth [m]: none, and both sides push; a number, and the wall pushes outwards only: a sphere whose centre is up to
    that far below the surface is pushed out, one that is deeper is left alone. material: its name.
    """

    nodes: np.ndarray
    elements: np.ndarray
    depth: float = None
    material: str = WALL
    radius: float = None

    def __post_init__(self):
        nodes = finite(self.nodes, "nodes of the wall", (2, 3))
        elements = check.indices("wall elements", rows(self.elements), len(nodes), (1, 2, 3), "nodes").astype(np.int32)
        if elements.shape[1] != (nodes.shape[1] if self.radius is None else 1):
            raise ValueError(f"wall elements have {elements.shape[1]} nodes in {nodes.shape[1]} dimensions: give "
                             "segments (2 nodes) in a plane, triangles (3 nodes), or discs (1 node) with a radius")
        if self.radius is not None:
            check.positive("radius of the discs of the wall", self.radius, "m", "it must be positive")
        if self.depth is not None and self.radius is not None:
            raise ValueError("the wall has discs and a depth: a depth is for segments and triangles, which have sides")
        if self.depth is not None:
            check.not_negative("depth of the wall", self.depth, "m",
                               "give none, or how far below the surface a centre is still pushed out")
        elements.flags.writeable = False
        object.__setattr__(self, "nodes", nodes)
        object.__setattr__(self, "elements", elements)

    @classmethod
    def discs(cls, x, radius, material=WALL):
        """Discs, in space balls, of ``radius`` [m] around x [m], shape (n, dim)."""
        x = finite(x, "nodes of the wall", (2, 3))
        return cls(x, np.arange(len(x))[:, None], material=material, radius=radius)

    @classmethod
    def none(cls, dim):
        """No wall: no nodes, no elements."""
        return cls(np.zeros((0, dim)), np.zeros((0, dim)))

    @property
    def dim(self):
        return self.nodes.shape[1]


@dataclass(frozen=True)
class Scene:
    """Everything a DEM back end needs to start. Lengths in m, gravity [m/s^2], (dim,).

    spheres and clusters: the bodies that move, either may be missing. wall: the interface that is moved from outside;
    walls: further ones at rest (a floor). Materials have names: ``material`` is "spheres", ``wall_material`` is "wall",
    ``materials`` holds others. ``interactions``: (name, name) → Interaction in either order; ``between`` is that of
    "spheres" with themselves, ``at_wall`` that of "spheres" with "wall". domain: lower and upper corner [m], (dim,)
    each; outflow: what happens to that which leaves it, "stop", "hold" or "remove" for all sides, or by side, such as
    {"+x": "remove"}, whose other sides stop (see ``outflow``); without a domain nothing ever leaves. Raises ValueError
    for what does not fit.
    """

    spheres: Spheres = None
    wall: Wall = None
    material: Material = None
    wall_material: Material = None
    between: Interaction = field(default_factory=Interaction)
    at_wall: Interaction = field(default_factory=Interaction)
    gravity: tuple = None
    clusters: tuple = ()
    walls: tuple = ()
    materials: dict = field(default_factory=dict)
    interactions: dict = field(default_factory=dict)
    domain: tuple = None
    outflow: object = "stop"

    def __post_init__(self):
        put = lambda name, value: object.__setattr__(self, name, value)  # noqa: E731 - the class is frozen
        put("clusters", check.records("clusters", self.clusters, Cluster))
        put("walls", check.records("walls", self.walls, Wall))
        for name, kind in (("spheres", Spheres), ("wall", Wall), ("material", Material), ("wall_material", Material)):
            check.record(name, getattr(self, name), kind, type(None))
        for name, kind in (("materials", Material), ("interactions", Interaction)):
            check.records(name, check.record(name, getattr(self, name), dict).values(), kind)
        check.records("between and at_wall", (self.between, self.at_wall), Interaction)
        parts = [p for p in (self.spheres, self.wall, *self.clusters, *self.walls) if p is not None]
        dims = sorted({part.dim for part in parts})
        if len(dims) != 1:
            raise ValueError(f"the parts of the scene have dimensions {dims}: use one dimension, 2 or 3, for all")
        put("spheres", Spheres.none(dims[0]) if self.spheres is None else self.spheres)
        put("wall", Wall.none(dims[0]) if self.wall is None else self.wall)
        put("gravity", check.numbers("gravity", (0.0,) * self.dim if self.gravity is None else self.gravity, self.dim,
                                     "m/s^2"))
        self._check_domain(put)
        put("materials", self._all_materials())
        put("interactions", self._all_interactions())

    def _check_domain(self, put):
        ways = read_ways(self.outflow, self.dim)
        if self.domain is not None:
            put("domain", read_domain(self.domain, self.dim))
        elif set(ways) != {"stop"}:
            raise ValueError(f"outflow is {self.outflow!r} without a domain to leave: give domain=(lower, upper), its "
                             "corners [m]")

    def _all_materials(self):
        own = {name: m for name, m in ((BALLS, self.material), (WALL, self.wall_material)) if m is not None}
        known = {**own, **self.materials}
        used = {p.material for p in self.clusters + self.walls}
        used |= {part.material for part, rows in ((self.spheres, self.spheres.x), (self.wall, self.wall.elements))
                 if len(rows)}
        for name in sorted(used - set(known)):
            raise ValueError(f"there is no material {name!r} in the scene: it has {sorted(known)}")
        return known

    def _all_interactions(self):
        known = {frozenset((BALLS, BALLS)): self.between, frozenset((BALLS, WALL)): self.at_wall}
        names = {BALLS, WALL, *self.materials}
        known.update({pair(key, names): meet for key, meet in self.interactions.items()})
        for a, b in self.pairs() + self.wall_pairs():
            if frozenset((a, b)) not in known:
                raise ValueError(f"no interaction says how {a!r} meets {b!r}: add one for this pair")
        return known

    def open(self, backend, dt, comm=None):
        """The partition (`protocol.DEM`) that computes this scene with the time step ``dt`` [s].

        backend: "reference" or "liggghts". Raises ValueError for an unknown back end, for spheres that overlap or lie
        inside the body at the start and for a cluster in two pieces; warns when the step is too long for the contact.
        Collective on ``comm`` (default: all ranks).
        """
        from .opening import open_scene  # not before it is asked for: a scene is plain data
        return open_scene(backend, self, dt, comm)

    def pairs(self):
        """Pairs of materials of spheres that may meet, sorted."""
        bodies = [c.material for c in self.clusters] + [self.spheres.material] * min(2, len(self.spheres.x))
        return sorted({tuple(sorted((a, b))) for i, a in enumerate(bodies) for b in bodies[:i]})

    def wall_pairs(self):
        """Pairs (material of spheres, material of a wall) that may meet, sorted."""
        bodies = {c.material for c in self.clusters} | ({self.spheres.material} if len(self.spheres.x) else set())
        walls = {w.material for w in (self.wall, *self.walls) if len(w.elements)}
        return sorted((a, b) for a in bodies for b in walls)

    def interaction(self, a, b):
        """How the materials named a and b meet."""
        return self.interactions[frozenset((a, b))]

    @property
    def names(self):
        """Names of the materials in the order of their numbers."""
        return tuple(self.materials)

    @property
    def dim(self):
        return self.wall.dim
