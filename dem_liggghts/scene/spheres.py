"""Single spheres of a DEM scene: frozen data in SI units, checked when made."""
from dataclasses import dataclass
from functools import partial

import numpy as np

from .arrays import Array, finite, per_sphere
from .materials import SPHERES


@dataclass(frozen=True)
class Spheres:
    """Single spheres: centres x [m] and velocities v [m/s], shape (n, dim) with dim 2 or 3; radius [m] and
    density rho [kg/m^3], scalars or shape (n,); angular velocity omega [rad/s], shape (n, 3); name of the
    material. A plane scene (dim 2) keeps the true mass of the sphere and confines it to the plane z = 0.

    >>> pair = Spheres(x=[[0.0, 0.01], [0.03, 0.01]], v=np.zeros((2, 2)), radius=0.01, rho=7800.0)
    >>> pair.dim, pair.mass.round(4)
    (2, array([0.0327, 0.0327]))
    """

    x: Array
    v: Array
    radius: Array
    rho: Array
    omega: Array = None
    material: str = SPHERES

    def __post_init__(self) -> None:
        put = partial(object.__setattr__, self)  # the class is frozen
        put("x", finite(self.x, "x of the spheres", (2, 3)))
        put("v", finite(self.v, "v of the spheres", (self.dim,)))
        put("omega", finite(np.zeros((len(self.x), 3)) if self.omega is None else self.omega, "omega", (3,)))
        put("radius", per_sphere(self.radius, "radius", len(self.x)))
        put("rho", per_sphere(self.rho, "rho (density of the spheres)", len(self.x)))
        if not len(self.x) == len(self.v) == len(self.omega):
            raise ValueError(f"{len(self.x)} positions, {len(self.v)} velocities, {len(self.omega)} spins: "
                             "give one of each per sphere")

    @classmethod
    def none(cls, dim: int) -> "Spheres":
        """No single spheres."""
        return cls(np.zeros((0, dim)), np.zeros((0, dim)), np.zeros(0), np.zeros(0))

    @property
    def dim(self) -> int:
        """2 in a plane scene, 3 in space."""
        return self.x.shape[1]

    @property
    def mass(self) -> np.ndarray:
        """Mass of each sphere [kg], shape (n,)."""
        return self.rho * 4.0 / 3.0 * np.pi * self.radius**3
