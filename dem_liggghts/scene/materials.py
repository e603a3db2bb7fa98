"""What things are made of and how two of them meet: frozen data in SI units, checked when made."""
from dataclasses import dataclass
from typing import Optional

import mpm_dem_checks as check

SPHERES, WALL = "spheres", "wall"  # names of Scene.material and Scene.wall_material


@dataclass(frozen=True)
class Material:
    """Elastic constants of one contact partner: Young's modulus E [Pa], Poisson's ratio nu [-].

    >>> Material(E=2.1e11, nu=0.3)
    Material(E=210000000000.0, nu=0.3)
    """

    E: float
    nu: float

    def __post_init__(self) -> None:
        check.positive("E", self.E, "Pa", "Young's modulus must be positive")
        check.between("nu", self.nu, -1.0, 0.5, rule="Poisson's ratio must lie in (-1, 0.5]", ends="(]")


@dataclass(frozen=True)
class Interaction:
    """Contact constants of two materials: coefficient of restitution (0 to 1), Coulomb's coefficient of
    friction [-], adhesion [Pa], which pulls with that stress on the area where the two overlap.

    attraction: whether the damper may pull at the end of a contact, by default only where there is adhesion.
    Either way the damping is chosen such that a sphere that hits and leaves has the given restitution;
    without attraction this takes more of it (1.2 times as much at a restitution of 0.5, 2.8 times at 0.05),
    and a restitution below 0.01 is met as 0.01. Friction and damping along the surface together never exceed
    ``friction`` times the normal force.

    rolling: coefficient of rolling friction (0 to 1), the tangent of the slope on which a sphere stays that
    would roll down: it keeps two bodies from rolling on each other with a torque of at most ``rolling`` times
    effective radius and normal force, see `contact.law.contact_force`.

    >>> Interaction(restitution=0.8, friction=0.3, rolling=0.1).pulls
    False
    """

    restitution: float = 1.0
    friction: float = 0.0
    adhesion: float = 0.0
    attraction: Optional[bool] = None
    rolling: float = 0.0

    def __post_init__(self) -> None:
        check.between("restitution", self.restitution, 0.0, 1.0, rule="give a value from 0 to 1")
        for name, unit in (("friction", ""), ("adhesion", "Pa")):
            check.not_negative(name, getattr(self, name), unit, "it must not be negative")
        check.between("rolling", self.rolling, 0.0, 1.0, rule="give a value from 0 to 1, the tangent of the "
                      "slope on which a sphere does not roll")
        if self.attraction not in (None, False, True):
            raise ValueError(f"attraction is {self.attraction!r}: give True, False or None")

    @property
    def springs(self) -> int:
        """How many springs a contact has: none, one along the surface with friction, two with rolling
        friction."""
        return 2 if self.rolling > 0 else int(self.friction > 0)

    @property
    def pulls(self) -> bool:
        """Whether the damper may pull at the end of a contact."""
        return self.adhesion > 0 if self.attraction is None else bool(self.attraction)
