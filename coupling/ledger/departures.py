"""What has left the solid and the grains, and what has come: columns of the history, and what the ledger adds
so that nothing is lost.

A partition that lets something go, as its ``outflow``, that of its scene or its ``outlets`` say, has a
property ``removed``: "count", "mass" [kg], "momentum" [kg m/s], shape (dim,), "energy" [J], sums since the
start. One into which something flows says the same in ``entered``, which is None where nothing can.
"""
from typing import Any, Dict, Tuple

import numpy as np

QUANTITIES = {"": ("1", "number of {} that have {}, since the start"),
              "_mass": ("kg", "mass of the {} that have {}"),
              "_energy": ("J", "energy that the {} had as they have {}"),
              "_momentum": ("kg m/s", "momentum along {{}} of the {} that have {}")}
WAYS = {"left": "left, held at the edge or removed", "entered": "come in"}
PIECES = {"solid": "material points", "grains": "particles"}


def lets_go(partition: Any) -> bool:
    """Whether something may leave the partition without an end of the run."""
    of_scene = getattr(getattr(partition, "scene", None), "outflow", "stop")
    outflow = getattr(partition, "outflow", None) or of_scene
    if getattr(partition, "outlets", ()):
        return True
    return outflow != "stop" and not (isinstance(outflow, dict) and set(outflow.values()) == {"stop"})


class Departures:
    """Of ``solid`` and ``grains`` (or None). ``columns``: name → (unit, meaning), none when nothing can
    leave or come."""

    def __init__(self, solid: Any, grains: Any) -> None:
        self._sides: Dict[Tuple[str, str], Any] = {}
        self.columns: Dict[str, Tuple[str, str]] = {}
        for side, partition in {"solid": solid, "grains": grains}.items():
            if partition is not None and lets_go(partition):
                self._sides["left", side] = lambda partition=partition: partition.removed
            if getattr(partition, "entered", None) is not None:
                self._sides["entered", side] = lambda partition=partition: partition.entered
        for (way, side), sums in self._sides.items():
            for what, (unit, text) in QUANTITIES.items():
                text = text.format(PIECES[side], WAYS[way])
                axes = "xyz"[:len(sums()["momentum"])] if what == "_momentum" else ""
                name = f"{way}_{side}{what}"
                self.columns |= {f"{name}_{axis}": (unit, text.format(axis)) for axis in axes} or {
                    name: (unit, text)}

    def entries(self) -> Dict[str, float]:
        """Name → number, now."""
        found: Dict[str, float] = {}
        for (way, side), sums in self._sides.items():
            now = sums()
            values = {"": now["count"], "_mass": now["mass"], "_energy": now["energy"],
                      **{f"_momentum_{axis}": p for axis, p in zip("xyz", now["momentum"])}}
            found |= {f"{way}_{side}{name}": float(value) for name, value in values.items()}
        return found


def shaken(partition: Any) -> float:
    """Work that the motion of the base has done on the partition since the start [J]."""
    return float(getattr(partition, "base_work", 0.0))


def left(partition: Any, what: str) -> Any:
    """"mass", "momentum" or "energy" of what has left the partition less what has come, 0 when nothing
    can."""
    gone = np.asarray(partition.removed[what]) if lets_go(partition) else 0.0
    came = getattr(partition, "entered", None)
    return gone if came is None else gone - np.asarray(came[what])
