"""Soil by the numbers of a soil report: stiffness, density, angles and strengths, of which a law is made."""
import math
from dataclasses import dataclass
from typing import ClassVar, Literal, Optional

import mpm_dem_checks as check

from .drucker_prager import drucker_prager
from .law import Law
from .mohr_coulomb import mohr_coulomb
from .von_mises import von_mises


def _rubs(keys: dict) -> bool:
    return keys["law"] != "von_mises"


@dataclass(frozen=True)
class Soil:
    """An elastic, perfectly plastic soil. ``counts``: of a field as a key of a case, when it has an effect.
    ValueError for impossible numbers comes with the ``material``.

    >>> Soil(E=50e3, nu=0.4, rho=1300.0, phi=22.0).material(dim=2).name
    'mohr_coulomb'
    """

    E: float  # Young's modulus of the soil [Pa]
    nu: float  # its Poisson's ratio [-]
    rho: float  # its density [kg/m^3]
    phi: float  # its friction angle [degrees]
    psi: float = 0.0  # its dilation angle [degrees]
    cohesion: float = 0.0  # [Pa]; of von_mises: its strength in shear
    tension: Optional[float] = None  # greatest tension [Pa]; none: up to the apex of the yield surface
    viscosity: float = 0.0  # beside its strength [Pa s]
    law: Literal["mohr_coulomb", "drucker_prager", "von_mises"] = "mohr_coulomb"  # of the soil

    counts: ClassVar[dict] = dict.fromkeys(("phi", "psi", "tension"),
                                           (_rubs, "for soil, not for law=von_mises"))

    def material(self, dim: int) -> Law:
        """The law in ``dim`` dimensions: Drucker–Prager matches Mohr–Coulomb in plane strain, in space in
        triaxial compression; von Mises yields in pure shear at the cohesion.

        >>> Soil(E=50e3, nu=0.4, rho=1300.0, phi=0.0, cohesion=100.0, law="von_mises").material(3).params.Y
        173.20508075688772
        """
        if self.law == "von_mises":
            check.positive("cohesion", self.cohesion, "Pa",
                           "law=von_mises has its strength from it, give a positive number")
            return von_mises(self.E, self.nu, math.sqrt(3.0) * self.cohesion, viscosity=self.viscosity)
        check.between("phi", self.phi, 0, 90, "degrees",
                      "the friction angle must be at least 0 and less than 90", "[)")
        check.between("psi", self.psi, 0, self.phi, "degrees",
                      f"the dilation angle must lie from 0 to phi, {self.phi:g}")
        numbers = self.E, self.nu, self.phi, self.psi, self.cohesion, self.tension
        if self.law == "mohr_coulomb":
            return mohr_coulomb(*numbers, viscosity=self.viscosity)
        return drucker_prager(*numbers, "plane_strain" if dim == 2 else "compression", self.viscosity)

    @property
    def at_rest(self) -> float:
        """Ratio of horizontal to vertical stress of soil as it was deposited (Jaky 1944) [-].

        >>> round(Soil(E=50e3, nu=0.4, rho=1300.0, phi=30.0).at_rest, 12)
        0.5
        """
        return 1.0 - math.sin(math.radians(self.phi))
