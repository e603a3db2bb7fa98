"""An interface of the material points themselves."""
from dataclasses import dataclass
from typing import Optional, Sequence

import mpm_dem_checks as check


@dataclass(frozen=True)
class Balls:
    """Material points as balls (discs in a plane scene) of one ``radius`` [m], which particles meet: an
    interface of an ``MPM`` that needs no surface of the body, whatever becomes of it.

    A force on a ball acts on the nodes that its material point has. Only points near particles take part, see
    ``MPM.select``: what a window costs follows their number. bodies: numbers of those whose points are balls;
    None: all.

    >>> Balls(0.025).radius, Balls(0.01, bodies=(1,)).bodies
    (0.025, (1,))
    """

    radius: float
    bodies: Optional[Sequence[int]] = None

    def __post_init__(self) -> None:
        radius = check.positive("radius of the balls", self.radius, "m", "it must be positive")
        object.__setattr__(self, "radius", float(radius))
        if self.bodies is not None:
            numbers = check.record("bodies of the balls", self.bodies, tuple, list)
            found = tuple(sorted({check.count("number of a body of the balls", n, 0) for n in numbers}))
            if not found:
                check.refuse("bodies of the balls", numbers, "give numbers of bodies, or None for all")
            object.__setattr__(self, "bodies", found)

    def radius_of(self, body: int) -> float:
        """Of the points of the body with that number [m]: 0 where they are no balls.

        >>> balls = Balls(0.01, bodies=(1,))
        >>> balls.radius_of(0), balls.radius_of(1)
        (0.0, 0.01)
        """
        return self.radius if self.bodies is None or body in self.bodies else 0.0

    def check_bodies(self, count: int) -> None:
        """ValueError unless its bodies are among ``count`` of them."""
        for n in self.bodies or ():
            if n >= count:
                raise ValueError(f"the balls are points of body {n}, and the numbers of the bodies end at "
                                 f"{count - 1}: give numbers of bodies that there are")
