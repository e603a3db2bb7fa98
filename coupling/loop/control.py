"""Lengths of time steps: they may fail or be too long, are halved then, and grow back later."""
from typing import Any, Optional, Tuple

import mpm_dem_checks as check

GROW_AFTER = 4  # good steps since the last that was given up
RULE = "give an error from 0 to 1, as a part of the largest force, or none for windows of one length"


class StepControl:
    """Steps as whole numbers of a shortest unit, so that an end is hit exactly: ``most`` at the longest.

    tolerance: None keeps all steps at ``most``; 0 shortens those that fail; above, also those whose error,
    see ``refuses``, is larger.
    """

    def __init__(self, most: int, tolerance: Optional[float] = None) -> None:
        most = check.count("most steps of a window", most)
        if tolerance is not None:
            tolerance = check.not_negative("adapt", tolerance, rule=RULE)
            tolerance = check.between("adapt", tolerance, 0, 1, rule=RULE)
        self.most, self.size, self.tolerance, self._good = most, most, tolerance, 0
        self.limit = most  # units of the next step at most

    @property
    def active(self) -> bool:
        """Can a step be given up?"""
        return self.tolerance is not None

    @property
    def can_shorten(self) -> bool:
        """Can the next step be given up for a shorter one?"""
        return self.active and self.most > 1

    def next(self, left: int) -> int:
        """Units of the next step, of which ``left`` are left to the end."""
        return min(self.size, self.limit, left)

    def shorten(self, taken: int) -> bool:
        """A step of ``taken`` units is given up: the next one is half as long. False when that cannot be."""
        if not self.active or taken < 2:
            return False
        self.size, self._good = taken // 2, 0
        return True

    def refuses(self, error: float, taken: int) -> bool:
        """Is the ``error`` of a step of ``taken`` units, which falls with its square, too large? It then
        counts as given up. Otherwise the next step is chosen, not more than twice as long."""
        if self.tolerance and error > 2.0 * self.tolerance and self.shorten(taken):
            return True
        self._good += 1
        if self.size < self.most and (self.tolerance or self._good >= GROW_AFTER):
            self.size = min(2 * self.size, self.most)
            self._good = 0
        if self.tolerance:
            wanted = 0.9 * taken * (self.tolerance / error) ** 0.5 if error > 0.0 else self.most
            self.size = int(min(max(wanted, taken // 2, 1), self.size))
        return False

    def get_state(self) -> Tuple[int, int]:
        """Length of the next step, and good steps since the last change."""
        return self.size, self._good

    def set_state(self, state: Tuple[int, int]) -> None:
        """The counterpart."""
        self.size, self._good = state


def limit_speed(control: StepControl, solid: Any, scheme: Any) -> None:
    """Let no material point of ``solid`` cross more than ``scheme.courant`` cells in the next step at the
    speed that it has now: the longest step is halved until that is so. Nothing where no step can be given up,
    and for a solid that tells no ``fastest()`` and no ``resolution()``. Collective."""
    control.limit = control.most
    if scheme.courant is None or not control.can_shorten or not hasattr(solid, "fastest"):
        return
    way = scheme.window * solid.fastest() / min(solid.resolution()["cell_size"])
    while control.limit > 1 and way * control.limit / control.most > scheme.courant:
        control.limit //= 2
