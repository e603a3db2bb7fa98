"""How deep rocks are pressed into the balls that stand for the material points of the soil."""
from typing import Any, Dict, Tuple

import numpy as np

from .limit import say

DEEP = 0.1  # spacings of the points, from which on a run warns


class DepthWatch:
    """Observer that tells how deep the grains press the balls of the interface, in spacings of the points: in
    the history as ``deepest_ball``, in the report as the largest, with a warning beyond a tenth, once.

    From the largest mean force on a ball in a window, by Hertz's law: ``grains.scene.depth_at_wall``."""

    def __init__(self, solid: Any, grains: Any) -> None:
        self._depth_of_one = grains.scene.depth_at_wall(1.0) / solid.contact_scales().spacing
        self._most, self._now = 0.0, 0.0

    def __call__(self, window: Any) -> None:
        """Look at a window."""
        square = np.einsum("ni,ni->n", window.wall_force, window.wall_force).max(initial=0.0)
        self._now = self._depth_of_one * float(square) ** (1.0 / 3.0)  # to the power 2/3 of the force
        if self._now > DEEP >= self._most:
            say(f"a rock is {self._now:.2g} of the points' spacing deep in the balls of the soil at t = "
                f"{window.time:.6g} s, more than {DEEP}: take {(self._now / DEEP) ** 1.5:.2g} times the "
                "modulus of the contact, with shorter windows, see Scene.fitted")
        self._most = max(self._most, self._now)

    def columns(self) -> Dict[str, Tuple[str, str, Any]]:
        """Of the history."""
        return {"deepest_ball": ("1", "deepest overlap of a rock and a point's ball, in spacings of the "
                                 "points",
                            lambda window: self._now)}

    def entries(self, history: Any) -> Dict[str, float]:
        """Of the report."""
        return {"deepest_ball": self._most}

    def get_state(self) -> Tuple[float, float]:
        """Largest so far, and now."""
        return self._most, self._now

    def set_state(self, state: Tuple[float, float]) -> None:
        """The counterpart."""
        self._most, self._now = map(float, state)


def watches_depth(solid: Any, grains: Any) -> bool:
    """Whether material points are balls that grains meet, so that they are watched."""
    wall = getattr(getattr(grains, "scene", None), "wall", None)
    return (wall is not None and hasattr(solid, "contact_scales") and hasattr(grains.scene, "depth_at_wall")
            and getattr(wall, "radius", None) is not None)
