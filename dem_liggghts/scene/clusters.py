"""Rigid bodies made of spheres: where their spheres sit, how heavy they are, how they may move. Data only."""
from dataclasses import dataclass
from functools import partial
from itertools import product
from typing import Any, Optional, Tuple

import numpy as np

import mpm_dem_checks as check

from .. import quaternion
from .arrays import Array, finite, per_sphere
from .materials import SPHERES
from .sizes import check_size


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

    def __post_init__(self) -> None:
        put = partial(object.__setattr__, self)  # the class is frozen
        put("centres", finite(self.centres, "centres of the cluster", (2, 3)))
        put("radii", per_sphere(self.radii, "radii of the cluster", len(self.centres)))
        for name in ("x", "centre", "v"):
            put(name, self._vector(name))
        check.positive("mass of the cluster", self.mass, "kg", "it must be positive")
        put("omega", self._omega())
        put("quaternion", self._orientation())
        put("inertia", self._tensor())
        put("free", self._freedom())

    def _vector(self, name: str) -> np.ndarray:
        value = getattr(self, name)
        array = finite(np.zeros(self.dim) if value is None else value, f"{name} of the cluster", (self.dim,))
        if array.shape != (1, self.dim):
            raise ValueError(f"{name} of the cluster has shape {np.shape(value)}: give {self.dim} numbers")
        return array[0]

    def _omega(self) -> np.ndarray:
        omega = np.zeros(3)
        name = "omega of the cluster"
        given = np.atleast_1d(check.array(name, self.omega, (), (1,), (3,), unit="rad/s"))
        if self.dim == 2 and given.shape == (1,):
            omega[2] = check.finite(name, given[0], "rad/s")
        elif given.shape == (3,):
            omega[:] = check.numbers(name, given, 3, "rad/s")
        elif given.shape != (1,) or given[0] != 0:
            raise ValueError(f"{name} is {self.omega}: give a number in a plane, three in space")
        if self.dim == 2 and omega[:2].any():
            raise ValueError(f"{name} is {omega} rad/s: a plane body spins about the third axis only")
        return omega

    def _orientation(self) -> np.ndarray:
        if self.quaternion is None:
            return quaternion.of_angle(check.finite("angle of the cluster", self.angle, "rad"))
        q = check.array("quaternion of the cluster", self.quaternion, (4,))
        if self.dim == 2 or self.angle:
            raise ValueError("the cluster has a quaternion and lies in a plane or has an angle: give angle "
                             "in a plane, quaternion in space")
        if q.shape != (4,) or not abs(np.sqrt(q @ q) - 1.0) < 1e-6:
            raise ValueError(f"quaternion of the cluster is {self.quaternion}: give four numbers (w, x, y, "
                             "z) of norm 1")
        return q / np.sqrt(q @ q)

    def _tensor(self) -> np.ndarray:
        inertia = check.array("inertia of the cluster", self.inertia, (), (1,), (3,), (3, 3), unit="kg m^2")
        if self.dim == 2 and inertia.size != 1 or self.dim == 3 and inertia.shape not in ((3,), (3, 3)):
            raise ValueError(f"inertia of the cluster has shape {inertia.shape}: give a number in a plane, "
                             "(3, 3) or (3,) in space")
        tensor = np.diag(inertia) if inertia.ndim == 1 else inertia
        tensor = inertia.item() * np.eye(3) if self.dim == 2 else tensor
        if not (np.isfinite(tensor).all() and np.array_equal(tensor, tensor.T) and
                np.linalg.eigvalsh(tensor).min() >= check.LEAST):
            raise ValueError(f"inertia of the cluster is {self.inertia}: it must be symmetric and positive")
        return tensor

    def _freedom(self) -> Tuple[bool, ...]:
        count = 3 if self.dim == 2 else 6
        free = (self.free,) * count if np.ndim(self.free) == 0 else tuple(self.free)
        if len(free) != count or any(f not in (0, 1) for f in free):
            raise ValueError(f"free of the cluster is {self.free}: give one truth value, or {count}")
        return tuple(map(bool, free))

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
        size, n = _check_box(size, n)
        rho, rim = check.positive("rho", rho, "kg/m^3"), check.truth("rim", rim)
        radius = 0.5 * (size / n).max() if radius is None else check.positive("radius", radius, "m")
        if not 0 < 2 * radius <= size.min():
            raise ValueError(f"spheres of radius {radius} m do not fit into a box of {size} m: use more or "
                             "smaller ones")
        centres = _lattice(size, n, radius, rim)
        if check.choice("mass_of", mass_of, ("solid", "spheres")) == "spheres":
            return cls.of_spheres(centres, radius, rho, x, **more)
        if len(size) == 2:
            check.positive("depth", depth, "m", "a solid box in a plane scene needs its depth for its mass")
        mass = rho * size.prod() * (depth if len(size) == 2 else 1.0)
        squares = size**2
        inertia = mass / 12.0 * (squares.sum() if len(size) == 2 else squares.sum() - squares)
        return cls(centres, radius, x, mass, inertia, **more)


def _check_box(size: Array, n: Array) -> Tuple[np.ndarray, np.ndarray]:
    """Size [m] and numbers of spheres along each side of a box, (dim,) each. Raises ValueError."""
    size = check.array("size of the cluster", size, (2,), (3,), unit="m")
    n = check.array("n of the cluster", n, (2,), (3,))
    if size.shape not in ((2,), (3,)) or n.shape != size.shape or not ((n >= 2) & (n % 1 == 0)).all() or \
            not ((size > 0) & (size < np.inf)).all():
        raise ValueError(f"a box of size {size} m with {n} spheres: give 2 or 3 positive lengths and at "
                         "least two spheres along each")
    check_size(float(n.prod()), f"{check.shown(n)} in a cluster")
    return size, n.astype(int)


def _lattice(size: np.ndarray, n: np.ndarray, radius: float, rim: bool) -> np.ndarray:
    """Centres [m] of n spheres along each side of a box around zero; with ``rim`` only those at its faces."""
    axes = [np.linspace(radius - s / 2, s / 2 - radius, k) for s, k in zip(size, n)]
    index = np.array(list(product(*(range(k) for k in n))))
    if rim:
        index = index[((index == 0) | (index == n - 1)).any(axis=1)]
    return np.column_stack([axis[i] for axis, i in zip(axes, index.T)])
