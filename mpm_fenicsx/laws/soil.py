"""Soil by the numbers of a soil report: stiffness, density, angles and strengths, of which a law is made."""
import math
from dataclasses import dataclass, replace
from typing import ClassVar, Literal, Optional

import mpm_dem_checks as check

from .drucker_prager import drucker_prager
from .law import Law
from .mohr_coulomb import mohr_coulomb
from .mu_i import mu_i
from .softened import softened
from .von_mises import von_mises


def _rubs(keys: dict) -> bool:
    return keys["law"] != "von_mises"


def _rubs_evenly(keys: dict) -> bool:
    return keys["law"] not in ("von_mises", "mu_i")


def _no_flow(keys: dict) -> bool:
    return keys["law"] != "mu_i"


def _flows(keys: dict) -> bool:
    return keys["law"] == "mu_i"


def _softens(keys: dict) -> bool:
    return keys["softening"] is not None


@dataclass(frozen=True)
class Soil:
    """An elastic, perfectly plastic soil, or with ``softening`` one that loses strength and dilation, see
    ``softened``. ``counts``: of a field as a key of a case, when it has an effect. ValueError
    for impossible numbers comes with the ``material``.

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
    law: Literal["mohr_coulomb", "drucker_prager", "von_mises", "mu_i"] = "mohr_coulomb"  # of the soil
    softening: Optional[float] = None  # plastic shear strain to the residual strength [-]; none: keeps it
    softening_length: Optional[float] = None  # width of the bands in which that strain is meant [m]
    residual_phi: Optional[float] = None  # friction angle after softening [degrees]; none: as before
    residual_cohesion: Optional[float] = None  # cohesion after softening [Pa]; none: as before
    phi_2: float = 32.8  # angle of the friction of fast flow; of glass beads [degrees]
    I_0: float = 0.279  # inertial number half-way between phi and phi_2; of glass beads [-]
    grain_diameter: float = 1e-3  # [m]
    grain_density: float = 2450.0  # [kg/m^3]

    counts: ClassVar[dict] = {
        "phi": (_rubs, "for soil, not for law=von_mises"),
        **dict.fromkeys(("psi", "tension", "softening"), (_rubs_evenly, "with law=mohr_coulomb or "
                                                          "drucker_prager")),
        **dict.fromkeys(("cohesion", "viscosity"), (_no_flow, "for laws other than mu_i")),
        **dict.fromkeys(("phi_2", "I_0", "grain_diameter", "grain_density"), (_flows, "with law=mu_i")),
        **dict.fromkeys(("softening_length", "residual_phi", "residual_cohesion"),
                        (_softens, "with softening=, a plastic shear strain"))}

    def material(self, dim: int) -> Law:
        """The law in ``dim`` dimensions: Drucker–Prager matches Mohr–Coulomb in plane strain, in space in
        triaxial compression; von Mises yields in pure shear at the cohesion; mu(I) has the friction
        coefficients tan phi at rest and tan phi_2.

        >>> Soil(E=50e3, nu=0.4, rho=1300.0, phi=0.0, cohesion=100.0, law="von_mises").material(3).params.Y
        173.20508075688772
        >>> Soil(E=1e7, nu=0.3, rho=1800.0, phi=20.0, cohesion=2e4, softening=0.1, softening_length=0.05,
        ...      residual_cohesion=1e4).material(2).name
        'softening_mohr_coulomb'
        """
        if self.softening is not None:
            return self._softened(dim)
        if self.law == "von_mises":
            check.positive("cohesion", self.cohesion, "Pa",
                           "law=von_mises has its strength from it, give a positive number")
            return von_mises(self.E, self.nu, math.sqrt(3.0) * self.cohesion, viscosity=self.viscosity)
        check.between("phi", self.phi, 0, 90, "degrees",
                      "the friction angle must be at least 0 and less than 90", "[)")
        if self.law == "mu_i":
            return self._flowing()
        check.between("psi", self.psi, 0, self.phi, "degrees",
                      f"the dilation angle must lie from 0 to phi, {self.phi:g}")
        numbers = self.E, self.nu, self.phi, self.psi, self.cohesion, self.tension
        if self.law == "mohr_coulomb":
            return mohr_coulomb(*numbers, viscosity=self.viscosity)
        return drucker_prager(*numbers, "plane_strain" if dim == 2 else "compression", self.viscosity)

    def _flowing(self) -> Law:
        """See ``mu_i``."""
        check.between("phi_2", self.phi_2, self.phi, 90, "degrees",
                      f"friction grows with the rate, give from phi, {self.phi:g}, to less than 90", "[)")
        at_rest, fast = (math.tan(math.radians(angle)) for angle in (self.phi, self.phi_2))
        return mu_i(self.E, self.nu, at_rest, fast, self.I_0, self.grain_diameter, self.grain_density)

    def _softened(self, dim: int) -> Law:
        """See ``softened``."""
        if self.softening is None or self.softening_length is None:
            raise ValueError(f"softening_length is none: softening={self.softening:g} needs it, give a "
                             "length in m")
        phi = self.phi if self.residual_phi is None else self.residual_phi
        cohesion = self.cohesion if self.residual_cohesion is None else self.residual_cohesion
        check.between("residual_phi", phi, 0, self.phi, "degrees",
                      f"give at least 0 and at most phi, {self.phi:g}")
        check.between("residual_cohesion", cohesion, 0, self.cohesion, "Pa",
                      f"give at least 0 and at most the cohesion, {self.cohesion:g}")
        peak = replace(self, softening=None)
        residual = replace(peak, phi=phi, psi=0.0, cohesion=cohesion, tension=None)
        return softened(peak.material(dim), residual.material(dim), self.softening, self.softening_length)

    @property
    def at_rest(self) -> float:
        """Ratio of horizontal to vertical stress of soil as it was deposited (Jaky 1944) [-].

        >>> round(Soil(E=50e3, nu=0.4, rho=1300.0, phi=30.0).at_rest, 12)
        0.5
        """
        return 1.0 - math.sin(math.radians(self.phi))
