"""What acts in every step of a scene."""
from types import ModuleType
from typing import Any, Callable, NamedTuple, Optional

import numpy as np

from ..grid.supports import Supports
from ..laws import ELASTIC_STATE
from ..terms.loads import PointForces
from .impulses import Impulses
from .losses import Losses
from .on_bodies import OnBodies
from .works import Works


class Problem(NamedTuple):
    """What acts in every step: ``bodies``, surface ``loads`` and ``penalties`` with their points, the
    ``interface``'s forces, ``supports``, ``gravity`` [m/s^2], shape (D,), ``frame_pull``, what
    the motion of the base adds to it as a function of time, or None, whether inertia is ``consistent`` and
    nearly empty cells have more of it, see ``light_cells``, the linear ``solver``, the ``rule`` of time, see
    ``GridState``, and who books ``losses`` of transfers, ``impulses``, ``works`` and what acts
    ``on_bodies``."""

    bodies: list
    interface: PointForces
    loads: tuple
    penalties: tuple
    supports: Supports
    gravity: np.ndarray
    frame_pull: Optional[Callable]
    consistent: bool
    light_cells: bool
    solver: str
    rule: ModuleType
    losses: Losses
    impulses: Impulses
    works: Works
    on_bodies: OnBodies

    @property
    def plastic(self) -> bool:
        """Whether the stress of a body depends on more than its deformation."""
        return any(body.body.law.state != ELASTIC_STATE for body in self.bodies)

    @property
    def flows(self) -> bool:
        """Whether it is plastic and keeps its strength: where soil softens, a step may have several
        solutions, and little decides which one is found."""
        return self.plastic and all(body.body.law.by_cell is None for body in self.bodies)

    @property
    def symmetric(self) -> bool:
        """Whether the tangents of all laws are."""
        return all(body.body.law.symmetric for body in self.bodies)

    def base_pull(self, grid: Any) -> Any:
        """What the motion of the base adds to gravity in a step, where the rule of time takes forces, shape
        (D,) or 0; nothing in load steps without inertia."""
        if self.frame_pull is None or grid.dt == 0.0:
            return 0.0
        return self.frame_pull(grid.time + self.rule.PLACE * grid.dt)
