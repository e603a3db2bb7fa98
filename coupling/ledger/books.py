"""Books of momentum: who has given which impulse to solid and grains, and whether that is all.

A partition with a method ``impulses()`` says by name what has been given to its matter since the start,
linear [N s] and angular about zero [N m s]. For each side, and for both together,

    momentum - momentum at the start = sum of the impulses from outside,

where "interface" is outside for one side, and sums to zero over both. The errors of this identity are
relative to the largest number in it so far, a momentum or the impulse of a name since the start.
"""
import re
from typing import Any, Callable, Dict, Iterable, List, Optional, Tuple

import numpy as np

from .departures import left
from .limit import say
from .momentum import AXES, Momentum

# no regions: nothing is pushed there
SCHEME = "gravity", "base", "body force", "interface", "inflow", "outflow", "numerical"
SIDES = "solid", "grains"
MATTER = {"solid": "soil", "grains": "rock"}
WARN = 1e-8  # error from which a run says that its books do not close
ERRORS = {
    "momentum_error": ("1", "momentum of both sides that no impulse from outside explains, relative to the "
                            "largest momentum or impulse so far"),
    "angular_error": ("1", "the same of the angular momentum about zero"),
}


def regions(solid: Any, grains: Any) -> Dict[str, Tuple[str, ...]]:
    """By the names that columns have, the names of what both sides meet: structures, walls and supports."""
    names: List[str] = [*getattr(solid, "regions", ())]
    if hasattr(grains, "impulses"):
        names += [name for name in grains.impulses() if name not in SCHEME]
    found: Dict[str, Tuple[str, ...]] = {}
    for name in dict.fromkeys(names):
        key = re.sub(r"\W+", "_", name).strip("_")
        key = f"region_{key}" if key in SIDES else key
        found[key] = (*found.get(key, ()), name)
    return found


class Side:
    """The books of one partition. ``given``: impulses since the start, shape (names, numbers), in the order
    of ``names``; ``base``: momentum that they do not explain, from the start. momentum: linear and angular in
    one array as a function of a ``Window``, or of None at the start."""

    def __init__(self, partition: Any, momentum: Callable[[Any], np.ndarray],
                 booked: Optional[np.ndarray] = None) -> None:
        """booked: mask of the numbers that nothing else changes, None for all."""
        self._partition, self._momentum, self._booked = partition, momentum, booked
        given = partition.impulses()
        self.names, self.given = [*given], np.array([*given.values()])
        self.base = momentum(None) - self.given.sum(axis=0)

    def look(self) -> np.ndarray:
        """The impulses of now become those that are ``given``; returns those before."""
        before = self.given
        self.given = np.array([*self._partition.impulses().values()])
        return before

    def errors(self, window: Any) -> Tuple[np.ndarray, np.ndarray]:
        """What nothing explains, and the largest numbers of the books."""
        momentum = self._momentum(window)
        largest = np.maximum(np.abs(momentum), np.abs(self.given).max(axis=0))
        rest = momentum - self.base - self.given.sum(axis=0)
        return rest if self._booked is None else np.where(self._booked, rest, 0.0), largest

    def picks(self, keys: Dict[str, Tuple[str, ...]]) -> np.ndarray:
        """By the names of each key, shape (keys, names): which of its own to sum."""
        return np.array([[name in names for name in self.names] for names in keys.values()], float).reshape(
            len(keys), len(self.names))


def open_books(solid: Any, grains: Any) -> Dict[str, Side]:
    """Of the sides that keep some."""
    sides: Dict[str, Side] = {}
    if hasattr(solid, "impulses"):
        sides["solid"] = Side(solid, lambda window: np.concatenate(
            [solid.momentum(), np.ravel(solid.angular_momentum())]))
    if hasattr(grains, "impulses"):
        dim = grains.scene.wall.nodes.shape[1]
        gravity = np.asarray(getattr(grains.scene, "gravity", 0.0), float)
        own = Momentum(grains, gravity if gravity.ndim else gravity * np.eye(dim)[1], 0.0)

        def momentum(window: Any) -> np.ndarray:
            linear, angular = own.now(grains.particles() if window is None else window.particles)
            return np.concatenate([linear + left(grains, "momentum"), angular])

        sides["grains"] = Side(grains, momentum, free_of(grains, dim))
    return sides


def free_of(grains: Any, dim: int) -> np.ndarray:
    """Mask of the linear and angular numbers of their momentum in which no cluster is held by its flags: what
    holds one is in no book."""
    free = np.array([cluster.flags for cluster in getattr(grains.scene, "clusters", ())], bool).reshape(-1, 6)
    turns = free[:, [0, 1, 5] if dim == 2 else slice(None)].all()
    return np.append(free[:, :dim].all(axis=0), np.full(1 if dim == 2 else 3, turns))


class Books:
    """Of ``solid`` and ``grains`` (or None); call it with each ``Window``. ``columns``: name → (unit,
    meaning), none where no side keeps books. Collective."""

    def __init__(self, solid: Any, grains: Any) -> None:
        self._sides = open_books(solid, grains)
        self.columns: Dict[str, Tuple[str, str]] = {}
        self._scale, self._told, self._repeats = np.zeros(2), False, False
        if not self._sides:
            return
        width = next(iter(self._sides.values())).given.shape[1]
        self._dim = 2 if width == 3 else 3
        found = regions(solid, grains)
        keys: Dict[str, List[str]] = {}
        self._rows = {name: side.picks(found) for name, side in self._sides.items()}
        for name, picks in self._rows.items():
            keys[name] = [key for key, some in zip(found, picks.any(axis=1)) if some]
        self._means = {name: [*means_of(MATTER[name], own, self._dim)] for name, own in keys.items()}
        self._wholes = [f"impulse_{key}_{axis}" for key in found for axis in AXES[:self._dim]]
        for name, own in keys.items():
            self.columns |= means_of(MATTER[name], own, self._dim)
        self.columns |= {column: ("N s", "impulse of soil and rock on it since the start")
                         for column in self._wholes} | ERRORS

    def __call__(self, window: Any) -> Dict[str, float]:
        """Entries after this window, name → number."""
        found: Dict[str, float] = {}
        whole: Any = 0.0
        for name, side in self._sides.items():
            picks, before = self._rows[name], side.look()
            whole = whole - picks @ side.given[:, :self._dim]
            mean = (picks @ (before - side.given))[picks.any(axis=1)] / window.dt
            found |= zip(self._means[name], mean.ravel().tolist())
        if self._sides:
            found |= zip(self._wholes, whole.ravel().tolist())
            found |= zip(ERRORS, self._errors(window))
        return found

    def _errors(self, window: Any) -> List[float]:
        """Of both sides together; warns of the first that does not close, or of the interface."""
        errors, largest = zip(*(side.errors(window) for side in self._sides.values()))
        open_ends = dict(zip(self._sides, errors))
        if len(open_ends) == len(SIDES):
            pair = [side.given[side.names.index("interface")] for side in self._sides.values()]
            open_ends["interface"] = pair[0] + pair[1]
        parts = slice(self._dim), slice(self._dim, None)
        now = np.max(largest, axis=0)
        self._scale = np.maximum(self._scale, [now[part].max() for part in parts])
        scale = np.where(self._scale > 0.0, self._scale, 1.0)
        self._repeats |= getattr(window, "iterations", 1) > 1  # then both sides agree to its tolerance
        for where, row in open_ends.items():
            if where == "interface" and self._repeats:
                continue
            self._warn(where, np.abs(row[parts[0]]).max() / scale[0], window)
        unexplained = np.abs(np.sum([*open_ends.values()], axis=0))
        return [float(unexplained[part].max() / size) for part, size in zip(parts, scale)]

    def _warn(self, where: str, error: float, window: Any) -> None:
        if error > WARN and not self._told:
            self._told = True
            say(f"the books of momentum do not close: until t = {window.time:.6g} s (window {window.number}) "
                f"{error:.2g} of the largest impulse came from nowhere, at the {where}; forces and impulses "
                "in the history are wrong by as much")

    # ---------------------------------------------------------------- state

    def get_state(self) -> Dict[str, Any]:
        """Everything that decides the entries to come, as name → numbers."""
        return {"scale": self._scale.copy(), "told": self._told, "repeats": self._repeats}

    def set_state(self, state: Dict[str, Any]) -> None:
        """Go on from there, with both sides as they are then."""
        self._scale, self._told = state["scale"].copy(), state["told"]
        self._repeats = bool(state["repeats"])
        for side in self._sides.values():
            side.look()


def means_of(matter: str, keys: Iterable[str], dim: int) -> Dict[str, Tuple[str, str]]:
    """Columns of the force and the moment of that ``matter`` on the regions with these ``keys``."""
    kinds = ("force", "N", "along", AXES[:dim]), ("moment", "N m", "about", AXES[-1 if dim == 2 else 0:])
    return {f"{kind}_{matter}_{key}_{axis}": (
                unit, f"{kind} of the {matter} on it {way} {axis}, mean over the window")
            for key in keys for kind, unit, way, axes in kinds for axis in axes}
