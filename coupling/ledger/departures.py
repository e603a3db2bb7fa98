"""What has left the solid and the grains: columns of the history, and what the ledger adds so that nothing is
lost.

A partition that lets something go, as its ``outflow`` or that of its scene says, has a property ``removed``:
"count", "mass" [kg], "momentum" [kg m/s], shape (dim,), "energy" [J], sums since the start.
"""
from typing import Any, Dict, Tuple

import numpy as np

QUANTITIES = {"": ("1", "number of {} that have left, held at the edge or removed, since the start"),
              "_mass": ("kg", "mass of the {} that have left"),
              "_energy": ("J", "energy that the {} had as they left")}
PIECES = {"solid": "material points", "grains": "particles"}


def lets_go(partition: Any) -> bool:
    """Whether something may leave the partition without an end of the run."""
    of_scene = getattr(getattr(partition, "scene", None), "outflow", "stop")
    outflow = getattr(partition, "outflow", None) or of_scene
    return any(way != "stop" for way in (outflow.values() if isinstance(outflow, dict) else [outflow]))


class Departures:
    """Of ``solid`` and ``grains`` (or None). ``columns``: name → (unit, meaning), none when nothing can
    leave."""

    def __init__(self, solid: Any, grains: Any, axes: str = "xyz") -> None:
        sides = {"solid": solid, "grains": grains}
        self._sides = {side: partition for side, partition in sides.items()
                       if partition is not None and lets_go(partition)}
        self._axes: Dict[str, str] = {}
        self.columns: Dict[str, Tuple[str, str]] = {}
        for side, partition in self._sides.items():
            self._axes[side] = axes[:len(partition.removed["momentum"])]
            momentum = {f"_momentum_{axis}": ("kg m/s", f"momentum along {axis} of the {{}} that have left")
                        for axis in self._axes[side]}
            self.columns |= {f"left_{side}{name}": (unit, text.format(PIECES[side]))
                             for name, (unit, text) in {**QUANTITIES, **momentum}.items()}

    def entries(self) -> Dict[str, float]:
        """Name → number, now."""
        found: Dict[str, float] = {}
        for side, partition in self._sides.items():
            left = partition.removed
            values = {"": left["count"], "_mass": left["mass"], "_energy": left["energy"],
                      **{f"_momentum_{axis}": p for axis, p in zip(self._axes[side], left["momentum"])}}
            found |= {f"left_{side}{name}": float(value) for name, value in values.items()}
        return found


def left(partition: Any, what: str) -> Any:
    """"mass", "momentum" or "energy" of what has left the partition, 0 when nothing can."""
    return np.asarray(partition.removed[what]) if lets_go(partition) else 0.0
