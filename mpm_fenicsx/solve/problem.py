"""What acts in every step of a scene."""
from types import ModuleType
from typing import NamedTuple

import numpy as np

from ..grid.supports import Supports
from ..terms.loads import PointForces
from .impulses import Impulses
from .losses import Losses
from .works import Works


class Problem(NamedTuple):
    """What acts in every step: ``bodies``, surface ``loads`` and ``penalties`` with their points, the
    ``interface``'s forces, ``supports``, ``gravity`` [m/s^2], shape (D,), whether inertia is ``consistent``,
    the linear ``solver``, the ``rule`` of time, see ``GridState``, and who books ``losses`` of transfers and
    ``impulses`` and ``works``."""

    bodies: list
    interface: PointForces
    loads: tuple
    penalties: tuple
    supports: Supports
    gravity: np.ndarray
    consistent: bool
    solver: str
    rule: ModuleType
    losses: Losses
    impulses: Impulses
    works: Works
