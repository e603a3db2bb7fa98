"""What acts in every step of a scene."""
from types import ModuleType
from typing import Any, Callable, NamedTuple, Optional

import numpy as np

from ..grid.supports import Supports
from ..terms.loads import PointForces
from .impulses import Impulses
from .losses import Losses
from .on_bodies import OnBodies
from .works import Works


class Problem(NamedTuple):
    """What acts in every step: ``bodies``, surface ``loads`` and ``penalties`` with their points, the
    ``interface``'s forces, ``supports``, ``gravity`` [m/s^2], shape (D,), ``frame_pull``, what
    the motion of the base adds to it as a function of time, or None, whether inertia is ``consistent``,
    the linear ``solver``, the ``rule`` of time, see ``GridState``, and who books ``losses`` of transfers,
    ``impulses``, ``works`` and what acts ``on_bodies``."""

    bodies: list
    interface: PointForces
    loads: tuple
    penalties: tuple
    supports: Supports
    gravity: np.ndarray
    frame_pull: Optional[Callable]
    consistent: bool
    solver: str
    rule: ModuleType
    losses: Losses
    impulses: Impulses
    works: Works
    on_bodies: OnBodies

    def base_pull(self, grid: Any) -> Any:
        """What the motion of the base adds to gravity in a step, where the rule of time takes forces, shape
        (D,) or 0; nothing in load steps without inertia."""
        if self.frame_pull is None or grid.dt == 0.0:
            return 0.0
        return self.frame_pull(grid.time + self.rule.PLACE * grid.dt)
