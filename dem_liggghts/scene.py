"""What a DEM scene consists of: frozen data in SI units, checked when made. No numerics and no MPI in here."""
from dataclasses import dataclass, field

import numpy as np


def _array(value, name, columns):
    """Float array of shape (n, columns), finite, read-only."""
    array = np.array(value, dtype=float, ndmin=2)
    if array.ndim != 2 or array.shape[1] not in columns:
        wanted = " or ".join(f"(n, {c})" for c in columns)
        raise ValueError(f"{name} has shape {np.shape(value)}: give an array of shape {wanted}")
    if not np.isfinite(array).all():
        raise ValueError(f"{name} contains NaN or infinity: give finite numbers")
    array.flags.writeable = False
    return array


def _per_sphere(value, name, n):
    array = np.array(np.broadcast_to(np.asarray(value, dtype=float), (n,)))
    if not (np.isfinite(array).all() and (array > 0).all()):
        raise ValueError(f"{name} is {value}: it must be positive")
    array.flags.writeable = False
    return array


@dataclass(frozen=True)
class Material:
    """Elastic constants of one contact partner: Young's modulus E [Pa], Poisson's ratio nu [-]."""

    E: float
    nu: float

    def __post_init__(self):
        if not self.E > 0:
            raise ValueError(f"E is {self.E} Pa: Young's modulus must be positive")
        if not -1.0 < self.nu <= 0.5:
            raise ValueError(f"nu is {self.nu}: Poisson's ratio must lie in (-1, 0.5]")


@dataclass(frozen=True)
class Interaction:
    """How two materials meet: coefficient of restitution (0.05 to 1) and Coulomb's coefficient of friction [-]."""

    restitution: float = 1.0
    friction: float = 0.0

    def __post_init__(self):
        if not 0.05 <= self.restitution <= 1.0:
            raise ValueError(f"restitution is {self.restitution}: give a value from 0.05 to 1")
        if not self.friction >= 0.0:
            raise ValueError(f"friction is {self.friction}: it must not be negative")


@dataclass(frozen=True)
class Spheres:
    """Single spheres: centres x [m] and velocities v [m/s], shape (n, dim) with dim 2 or 3; radius [m] and density
    rho [kg/m^3], scalars or shape (n,); spin omega [rad/s], shape (n, 3). A plane scene (dim 2) keeps the true
    mass of the ball and confines it to the plane z = 0."""

    x: np.ndarray
    v: np.ndarray
    radius: np.ndarray
    rho: np.ndarray
    omega: np.ndarray = None

    def __post_init__(self):
        put = lambda name, value: object.__setattr__(self, name, value)  # noqa: E731 - the class is frozen
        put("x", _array(self.x, "x of the spheres", (2, 3)))
        put("v", _array(self.v, "v of the spheres", (self.dim,)))
        put("omega", _array(np.zeros((len(self.x), 3)) if self.omega is None else self.omega, "omega", (3,)))
        put("radius", _per_sphere(self.radius, "radius", len(self.x)))
        put("rho", _per_sphere(self.rho, "rho (density of the spheres)", len(self.x)))
        if not len(self.x) == len(self.v) == len(self.omega):
            raise ValueError(f"{len(self.x)} positions, {len(self.v)} velocities, {len(self.omega)} spins: "
                             "give one of each per sphere")

    @property
    def dim(self):
        return self.x.shape[1]

    @property
    def mass(self):
        """Mass of each ball [kg], shape (n,)."""
        return self.rho * 4.0 / 3.0 * np.pi * self.radius**3


@dataclass(frozen=True)
class Wall:
    """The interface as the DEM sees it: nodes [m], shape (n, dim), and elements, shape (m, dim): segments in a plane
    scene, triangles in space. Seen from outside the body, a segment a→b has the outside on its left and a triangle
    runs counter-clockwise."""

    nodes: np.ndarray
    elements: np.ndarray

    def __post_init__(self):
        nodes = _array(self.nodes, "nodes of the wall", (2, 3))
        elements = np.array(self.elements, dtype=np.int32, ndmin=2)
        if elements.shape[1] != nodes.shape[1]:
            raise ValueError(f"wall elements have {elements.shape[1]} nodes in {nodes.shape[1]} dimensions: "
                             "give segments (2 nodes) in a plane, triangles (3 nodes) in space")
        if elements.size and not (0 <= elements.min() and elements.max() < len(nodes)):
            raise ValueError(f"wall elements name nodes {elements.min()}..{elements.max()}, there are {len(nodes)}")
        elements.flags.writeable = False
        object.__setattr__(self, "nodes", nodes)
        object.__setattr__(self, "elements", elements)

    @property
    def dim(self):
        return self.nodes.shape[1]


@dataclass(frozen=True)
class Scene:
    """Everything a DEM back end needs to start: spheres, wall, materials, how they meet, gravity [m/s^2] (dim,)."""

    spheres: Spheres
    wall: Wall
    material: Material
    wall_material: Material
    between: Interaction = field(default_factory=Interaction)  # sphere against sphere
    at_wall: Interaction = field(default_factory=Interaction)  # sphere against wall
    gravity: tuple = None

    def __post_init__(self):
        if self.spheres.dim != self.wall.dim:
            raise ValueError(f"spheres are {self.spheres.dim}D, the wall is {self.wall.dim}D: use one dimension")
        gravity = (0.0,) * self.dim if self.gravity is None else tuple(float(g) for g in self.gravity)
        if len(gravity) != self.dim:
            raise ValueError(f"gravity {gravity} needs {self.dim} components")
        object.__setattr__(self, "gravity", gravity)

    @property
    def dim(self):
        return self.spheres.dim
