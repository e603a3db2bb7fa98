"""Single spheres of a DEM scene: frozen data in SI units, checked when made."""
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

import mpm_dem_checks as check

from .arrays import Array, finite, per_sphere
from .materials import SPHERES
from .packing import pack, read_box
from .sizes import check_size


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

    @classmethod
    def packed(cls, count: int, radius: Array, inside: Any, rho: Array, seed: int, gap: float = 0.0,
               v: Array = None, **more: Any) -> "Spheres":
        """``count`` spheres anywhere in a box, at least ``gap`` [m] from each other (random sequential
        addition).

        radius [m]: a number, (low, high) for random ones between, or an array (count,). inside: anything with
        ``lower`` and ``upper`` [m], such as a Box of `mpm_fenicsx`. v [m/s]: one for all, (dim,), or one
        each. ``more``: omega and material. Places follow from the seed and are the same on every rank. Raises
        ValueError when they do not fit: equal spheres placed so end near 0.38 of the volume.

        >>> from types import SimpleNamespace
        >>> box = SimpleNamespace(lower=(0.0, 0.0, 0.0), upper=(1.0, 1.0, 0.5))
        >>> gravel = Spheres.packed(100, (0.02, 0.05), inside=box, rho=2600.0, seed=1)
        >>> len(gravel.x), bool(gravel.radius.min() > 0.02), bool((gravel.x[:, 2] < 0.5).all())
        (100, True, True)
        """
        count = check.count("count of the spheres", count)
        check_size(count, f"count={count}")
        lower, upper = read_box(inside)
        r = check.array("radius", radius, (), (2,), (count,), unit="m")
        if r.shape == (2,):
            if not 0.0 < r[0] <= r[1]:
                raise ValueError(f"radius is {check.shown(radius)} m: give (low, high) with 0 < low <= high")
            r = r[0] + (r[1] - r[0]) * np.random.default_rng([check.count("seed", seed, 0), 1]).random(count)
        r = per_sphere(r, "radius", count)
        if 2.0 * r.max() > (upper - lower).min():
            raise ValueError(f"a sphere of radius {r.max():g} m does not fit inside the box from {lower} to "
                             f"{upper} m: give smaller ones or a larger box")
        x, _ = pack(np.zeros((count, 1, len(lower))), r[:, None], inside, seed, gap, turned=False)
        x = x[:, :len(lower)]
        v = np.zeros(x.shape) if v is None else v
        v = check.array("v of the spheres", v, x.shape[1:], x.shape, unit="m/s")
        return cls(x, np.broadcast_to(v, x.shape), r, rho, **more)

    @property
    def dim(self) -> int:
        """2 in a plane scene, 3 in space."""
        return self.x.shape[1]

    @property
    def mass(self) -> np.ndarray:
        """Mass of each sphere [kg], shape (n,)."""
        return self.rho * 4.0 / 3.0 * np.pi * self.radius**3
