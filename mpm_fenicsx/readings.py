"""What an MPM says of its last step and of the whole: for other solvers, reports, ParaView and FEniCSx."""
from typing import Any

import numpy as np

from .output import functions, snapshots
from .output.resolution import resolution
from .output.scales import Scales, contact_scales, fastest
from .output.states import while_open
from .restarting import Restarting


class Readings(Restarting):
    """A model that is asked for more than numbers of its books, see ``Accounts`` for these."""

    def window_mass(self) -> np.ndarray:
        """See ``PointForces.window_mass``, of all boundary particles, the same on every rank."""
        return self._surface.gather_values(self.step.window_mass())

    def snapshot(self) -> dict:
        """This rank's piece of what ParaView shows, see ``snapshots``."""
        return snapshots.snapshot(self)

    @while_open
    def function(self, name: str) -> Any:
        """A nodal field of the last step as a new ``dolfinx.fem.Function``, linear (P1, Q1) on the background
        grid, in the user's coordinates; zero where there is no material.

        "mass" [kg] and "velocity" [m/s] at the start of the step, "displacement" over it [m],
        "acceleration" at its end [m/s^2], its mean with APIC and TPIC; bodies that do not stick are put
        together by mass. "density" [kg/m^3] and "momentum", per volume [kg/(m^2 s)], at its start: their
        integrals are mass and momentum of the points exactly, as each is the nodal sum over the integral of
        the node's basis function. In the plane they count the thickness of the bodies.

        Functions of one distribution over the ranks share their mesh and their spaces; a rebalancing brings
        new ones. The first call compiles, for which dolfinx needs a C compiler. Collective. Raises
        ValueError for another name, MPMError before the first step and after a restart.
        """
        return functions.function(self, name)

    @while_open
    def describe(self) -> dict:
        """Solver and imbalance, for the report: see ``snapshots``."""
        return snapshots.describe(self)

    @while_open
    def resolution(self) -> dict:
        """Sizes of the cells, points in them and explicit limit, see ``resolution``."""
        return resolution(self)

    @while_open
    def contact_scales(self) -> Scales:
        """Sizes of the points and of their motion, see ``scales.contact_scales``."""
        return contact_scales(self)

    @while_open
    def fastest(self) -> float:
        """Largest speed of a material point now [m/s]."""
        return fastest(self)
