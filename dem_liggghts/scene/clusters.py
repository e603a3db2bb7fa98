"""Rigid bodies made of spheres: where their spheres sit, how heavy they are, how they may move. Data only."""
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Iterable, Optional, Tuple

import numpy as np

import mpm_dem_checks as check

from .. import quaternion
from .arrays import Array, finite, per_sphere
from .cluster_checks import read_freedom, read_inertia, read_omega, read_orientation
from .filling import Filling, check_box, inscribed, lattice
from .materials import SPHERES
from .packing import pack
from .surface import Surface, closed_surface, read_faces, read_surface


@dataclass(frozen=True)
class Cluster:
    """One rigid body of n spheres, in dim 2 or 3.

    centres [m], shape (n, dim), and radii [m], scalar or (n,): the spheres in the cluster's own frame. x [m],
    (dim,): where the centre of mass is at the start; centre [m], (dim,): where it is in the cluster's frame.
    mass [kg]; inertia about the centre of mass in the cluster's frame [kg m^2]: a number in a plane, a tensor
    (3, 3) or its diagonal (3,) in space. v [m/s], (dim,). In a plane angle [rad] and omega [rad/s] are
    numbers; in space the orientation is a quaternion (w, x, y, z) from the cluster's frame to space, and
    omega has shape (3,). free: one truth value for all degrees of freedom, or one each: x, y, angle in a
    plane; x, y, z and the rotations about the axes of space in space. One that is not free keeps its
    velocity, whatever pushes.

    >>> block = Cluster.box(size=(0.02, 0.018), n=(8, 8), x=(0.31, 0.009), rho=500.0, depth=0.198)
    >>> len(block.radii), round(block.mass, 5), block.free
    (64, 0.03564, (True, True, True))
    """

    centres: Array
    radii: Array
    x: Array
    mass: float
    inertia: Array
    centre: Array = None
    v: Array = None
    angle: float = 0.0
    quaternion: Array = None
    omega: Array = 0.0
    free: Any = True
    material: str = SPHERES
    filling: Optional[Filling] = None  # how well the spheres fill a solid: of `from_surface` and `read`
    surface: Optional[Surface] = None  # of that solid in the cluster's frame: to be seen, nothing meets it

    def __post_init__(self) -> None:
        put = partial(object.__setattr__, self)  # the class is frozen
        put("centres", finite(self.centres, "centres of the cluster", (2, 3)))
        put("radii", per_sphere(self.radii, "radii of the cluster", len(self.centres)))
        for name in ("x", "centre", "v"):
            put(name, self._vector(name))
        check.positive("mass of the cluster", self.mass, "kg", "it must be positive")
        put("omega", read_omega(self.omega, self.dim))
        put("quaternion", read_orientation(self.quaternion, self.angle, self.dim))
        put("inertia", read_inertia(self.inertia, self.dim))
        put("free", read_freedom(self.free, self.dim))
        if self.surface is not None:
            put("surface", Surface(*read_faces(*self.surface)))

    def _vector(self, name: str) -> np.ndarray:
        value = getattr(self, name)
        array = finite(np.zeros(self.dim) if value is None else value, f"{name} of the cluster", (self.dim,))
        if array.shape != (1, self.dim):
            raise ValueError(f"{name} of the cluster has shape {np.shape(value)}: give {self.dim} numbers")
        return array[0]

    @property
    def dim(self) -> int:
        """2 in a plane scene, 3 in space."""
        return self.centres.shape[1]

    @property
    def flags(self) -> np.ndarray:
        """Whether it may move along and turn about each axis of space, shape (6,), bool."""
        x, y, *rest = self.free
        return np.array([x, y, False, False, False, rest[0]] if self.dim == 2 else self.free)

    @property
    def places(self) -> np.ndarray:
        """Centres of the spheres in space [m], shape (n, 3)."""
        return self.arms(quaternion.matrix(self.quaternion)) + np.pad(self.x, (0, 3 - self.dim))

    def arms(self, axes: Optional[np.ndarray] = None) -> np.ndarray:
        """From the centre of mass to the spheres in the cluster's frame, or in space with its ``axes`` [m],
        (n, 3)."""
        arms = np.zeros((len(self.centres), 3))
        arms[:, :self.dim] = self.centres - self.centre
        return arms if axes is None else arms @ axes.T

    def principal(self) -> Tuple[np.ndarray, np.ndarray]:
        """Principal moments of inertia [kg m^2], shape (3,), and the quaternion from their axes to the
        cluster's frame: no rotation when the tensor is diagonal."""
        diagonal = np.diag(self.inertia).copy()
        if np.array_equal(self.inertia, np.diag(diagonal)):
            return diagonal, quaternion.of_angle(0.0)
        moments, axes = np.linalg.eigh(self.inertia)
        return moments, quaternion.of_matrix(axes * np.linalg.det(axes))

    @classmethod
    def of_spheres(cls, centres: Array, radii: Array, rho: Array, x: Array, **more: Any) -> "Cluster":
        """Mass, centre and inertia are those of the balls of density rho [kg/m^3]; where balls overlap, both
        count. ``more``: orientation, motion, freedom and material as in the class."""
        centres = finite(centres, "centres of the cluster", (2, 3))
        radii = per_sphere(radii, "radii of the cluster", len(centres))
        mass = per_sphere(rho, "rho (density of the cluster)", len(centres)) * 4.0 / 3.0 * np.pi * radii**3
        centre = mass @ centres / mass.sum()
        arms = np.zeros((len(centres), 3))
        arms[:, :centres.shape[1]] = centres - centre
        squares = (arms**2).sum(axis=1)
        tensor = (mass @ (0.4 * radii**2 + squares)) * np.eye(3) - (mass[:, None] * arms).T @ arms
        tensor = 0.5 * (tensor + tensor.T)
        inertia = tensor[2, 2] if centres.shape[1] == 2 else tensor
        return cls(centres, radii, x, mass.sum(), inertia, centre, **more)

    @classmethod
    def box(cls, size: Array, n: Array, x: Array, rho: float, depth: Optional[float] = None,
            mass_of: str = "solid", rim: bool = False, radius: Optional[float] = None,
            **more: Any) -> "Cluster":
        """A box of ``size`` [m], (dim,), filled with n[0] x n[1] (x n[2]) spheres whose outer ones touch its
        faces.

        rho: density [kg/m^3]; depth: of the solid in a plane scene [m]. mass_of: "solid" (the box) or
        "spheres" (their balls). rim: only spheres at the faces. radius [m]: else half of the widest spacing,
        so that neighbours touch. ``more``: as in ``of_spheres``.
        """
        size, n = check_box(size, n)
        rho, rim = check.positive("rho", rho, "kg/m^3"), check.truth("rim", rim)
        radius = 0.5 * (size / n).max() if radius is None else check.positive("radius", radius, "m")
        if not 0 < 2 * radius <= size.min():
            raise ValueError(f"spheres of radius {radius} m do not fit into a box of {size} m: use more or "
                             "smaller ones")
        centres = lattice(size, n, radius, rim)
        if check.choice("mass_of", mass_of, ("solid", "spheres")) == "spheres":
            return cls.of_spheres(centres, radius, rho, x, **more)
        if len(size) == 2:
            check.positive("depth", depth, "m", "a solid box in a plane scene needs its depth for its mass")
        mass = rho * size.prod() * (depth if len(size) == 2 else 1.0)
        squares = size**2
        inertia = mass / 12.0 * (squares.sum() if len(size) == 2 else squares.sum() - squares)
        return cls(centres, radius, x, mass, inertia, **more)

    @classmethod
    def from_surface(cls, vertices: Array, triangles: Array, rho: float, x: Array = None,
                     spheres: Optional[int] = None, coverage: Optional[float] = None,
                     smallest: Optional[float] = None, **more: Any) -> "Cluster":
        """A rock inside a closed surface: ``triangles``, shape (m, 3), over ``vertices`` [m], shape (n, 3).

        Mass of density rho [kg/m^3], centre and inertia are exactly those of the solid. x: none, and the rock
        is where the surface is. ``more``: scale, or size (longest side of the box around it [m]), or volume
        [m^3]; and as in ``of_spheres``.

        Its spheres are inscribed: each point of a grid, of some 64,000 in the box around it, may be the
        centre of one that touches the surface, if its radius is at least ``smallest`` [m] (the spacing of the
        grid). The one comes next that covers most points that none has covered, until there are ``spheres``
        of them (20, or 1000 with a coverage), or they cover the part ``coverage`` of the points inside, or
        nothing is left. ``filling`` tells what came out: number, part covered, largest gap between surface
        and spheres. They overlap, and where several touch a wall, each pushes. Raises ValueError, too, when
        the coverage is not reached.

        >>> x = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
        >>> rock = Cluster.from_surface(x, [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], rho=2600.0, size=0.3)
        >>> round(rock.mass, 9), rock.centre, len(rock.radii), round(rock.filling.covered, 2)
        (11.7, array([0.075, 0.075, 0.075]), 20, 0.62)
        """
        sizes = {name: more.pop(name) for name in ("scale", "size", "volume") if name in more}
        solid = closed_surface(vertices, triangles, **sizes)
        rho = check.positive("rho", rho, "kg/m^3")
        centres, radii, filling = inscribed(solid, spheres, coverage, smallest)
        return cls(centres, radii, solid.centre if x is None else x, rho * solid.volume, rho * solid.inertia,
                   solid.centre, filling=filling, surface=Surface(solid.x, solid.triangles), **more)

    @classmethod
    def read(cls, path: Any, rho: float, x: Array = None, **more: Any) -> "Cluster":
        """A rock from a surface in a file that meshio reads (STL, OBJ, PLY, …); ``more``: as in
        ``from_surface``, such as scale=1e-3 for a file in millimetres."""
        return cls.from_surface(*read_surface(path), rho, x, **more)

    def scaled(self, factor: float, **changes: Any) -> "Cluster":
        """The same body with all lengths times ``factor``, of the same density; ``changes``: other fields."""
        f = check.positive("factor", factor)
        filling = self.filling and self.filling._replace(gap=f * self.filling.gap,
                                                         spacing=f * self.filling.spacing)
        surface = self.surface and self.surface._replace(x=f * self.surface.x)
        return self.changed(**{**dict(centres=f * self.centres, radii=f * self.radii, centre=f * self.centre,
                                    mass=f**3 * self.mass, inertia=f**5 * self.inertia, filling=filling,
                                    surface=surface), **changes})

    def changed(self, **changes: Any) -> "Cluster":
        """The same with other fields, checked."""
        if self.dim == 2:  # where numbers are given, which the fields hold as arrays in space
            inertia = np.asarray(changes.get("inertia", self.inertia))
            changes["inertia"] = inertia if inertia.ndim == 0 else inertia[2, 2]
            changes = {"angle": quaternion.angle(self.quaternion), "quaternion": None, **changes}
        return replace(self, **changes)

    @classmethod
    def packed(cls, clusters: Iterable["Cluster"], inside: Any, seed: int,
               gap: float = 0.0) -> Tuple["Cluster", ...]:
        """The ``clusters`` anywhere in a box, turned anyhow, at least ``gap`` [m] apart: as `Spheres.packed`.

        >>> from types import SimpleNamespace
        >>> brick = Cluster.box((0.02, 0.01, 0.01), (4, 2, 2), (0, 0, 0), rho=2600.0)
        >>> box = SimpleNamespace(lower=(0, 0, 0), upper=(0.1, 0.1, 0.1))  # or a Box of `mpm_fenicsx`
        >>> bricks = Cluster.packed([brick, brick.scaled(1.5)], inside=box, seed=3)
        >>> [round(b.mass, 6) for b in bricks], bool(bricks[0].places.min() > 0.0)
        ([0.0052, 0.01755], True)
        """
        given = check.records("clusters to pack", clusters, cls)
        x, turns = pack([c.arms()[:, :c.dim] for c in given], [c.radii for c in given], inside, seed, gap)
        return tuple(c.changed(x=at[:c.dim], angle=quaternion.angle(q)) if c.dim == 2 else
                     c.changed(x=at, quaternion=q) for c, at, q in zip(given, x, turns))
