"""Books of momentum: who has given which impulse to solid and grains, and whether that is all.

A partition with a method ``impulses()`` says by name what has been given to its matter since the start,
linear [N s] and angular about zero [N m s]. For each side, and for both together,

    momentum - momentum at the start = sum of the impulses from outside,

where "interface" is outside for one side. Over both it sums to zero with the row "exchange", what the scheme
of the coupling itself makes: the grains push a wall that goes before or after the interface, at the ends of
``Window.arms``, and what they answer beyond the force on the solid is ``owed`` to it. It is computed from
these arms and forces, not from the books of the sides: one of them that takes the force elsewhere does not
close. The errors of this identity are relative to the largest number in it so far, a momentum or the impulse
of a name since the start, and of the angular one not less than the largest linear number at the particle
that was the farthest from zero then.
"""
import re
from typing import Any, Callable, Dict, Iterable, List, NamedTuple, Optional, Tuple

import numpy as np

from .departures import left
from .limit import say
from .momentum import AXES, Momentum, turning

# no regions: nothing is pushed there
SCHEME = "gravity", "base", "body force", "interface", "arms", "exchange", "inflow", "outflow", "numerical"
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
        key = key_of(name)
        found[key] = (*found.get(key, ()), name)
    return found


def key_of(name: str) -> str:
    """What columns have of a ``name``.

    >>> key_of("grid wall"), key_of("solid")
    ('grid_wall', 'region_solid')
    """
    key = re.sub(r"\W+", "_", name).strip("_")
    return f"region_{key}" if key in SIDES else key


class Side(NamedTuple):
    """The books of one ``partition``: ``names`` of its impulses; ``momentum``, linear and angular in one
    array, as a function of a ``Window``, or of None at the start; ``booked``: mask of the numbers in it that
    nothing else changes."""

    partition: Any
    names: List[str]
    momentum: Callable[[Any], np.ndarray]
    booked: np.ndarray

    def picks(self, keys: Dict[str, Tuple[str, ...]]) -> np.ndarray:
        """By the names of each key, shape (keys, names): which of its own to sum."""
        return np.array([[name in names for name in self.names] for names in keys.values()], float).reshape(
            len(keys), len(self.names))


def open_books(solid: Any, grains: Any, of_grains: Optional[Momentum]) -> Dict[str, Side]:
    """Of the sides that keep some."""
    sides: Dict[str, Side] = {}
    if hasattr(solid, "impulses"):
        names = [*solid.impulses()]
        sides["solid"] = Side(solid, names, lambda window: solid.momenta(),
                              np.ones(len(solid.momenta()), bool))
    if hasattr(grains, "impulses"):
        dim = grains.scene.wall.nodes.shape[1]
        gravity = np.asarray(getattr(grains.scene, "gravity", 0.0), float)
        own = of_grains or Momentum(grains, gravity if gravity.ndim else gravity * np.eye(dim)[1], 0.0)

        def momentum(window: Any) -> np.ndarray:
            row = own.about_zero(grains.particles() if window is None else window.particles)
            row[:dim] += left(grains, "momentum")
            return row

        sides["grains"] = Side(grains, [*grains.impulses()], momentum, free_of(grains, dim))
    return sides


def free_of(grains: Any, dim: int) -> np.ndarray:
    """Mask of the linear and angular numbers of their momentum in which no cluster is held by its flags: what
    holds one is in no book."""
    free = np.array([cluster.flags for cluster in getattr(grains.scene, "clusters", ())], bool).reshape(-1, 6)
    turns = free[:, [0, 1, 5] if dim == 2 else slice(None)].all()
    return np.append(free[:, :dim].all(axis=0), np.full(1 if dim == 2 else 3, turns))


class Books:
    """Of ``solid``, which has its momentum as ``momenta()``, and ``grains``, or None; call it with each
    ``Window``. of_grains: what else looks at their momentum, or None. ``columns``: name → (unit, meaning),
    none where no side keeps books. Collective."""

    def __init__(self, solid: Any, grains: Any, of_grains: Optional[Momentum] = None) -> None:
        self._sides = open_books(solid, grains, of_grains)
        self.columns: Dict[str, Tuple[str, str]] = {}
        self._scale, self._told = [0.0, 0.0], False
        if not self._sides:
            return
        sides, found = [*self._sides.values()], regions(solid, grains)
        self._booked = np.array([side.booked for side in sides])
        self._dim = 2 if self._booked.shape[1] == 3 else 3
        self._both, self._exchange = len(sides) == len(SIDES), np.zeros(self._booked.shape[1])
        self._put_together(sides, found)
        given = self._given()
        sums = self._matrix @ given
        self._before = sums[:self._means]
        self._base = self._momenta(None) - sums[self._ends:self._ends + len(sides)]

    def _put_together(self, sides: List[Side], found: Dict[str, Tuple[str, ...]]) -> None:
        """Columns, and the matrix that gives from the impulses of all names: what each side has given to each
        region, and both together, then the sum of each side, and that of the interface over both."""
        whole = np.hstack([-side.picks(found) for side in sides])
        of_side = np.repeat(np.eye(len(sides)), [len(side.names) for side in sides], axis=1)
        means = []
        for name, mine in zip(self._sides, of_side):
            some = (whole * mine).any(axis=1)
            means.append((whole * mine)[some])
            keys = [key for key, one in zip(found, some) if one]
            self.columns |= means_of(MATTER[name], keys, self._dim)
        self.columns |= {f"impulse_{key}_{axis}": ("N s", "impulse of soil and rock on it since the start")
                         for key in found for axis in AXES[:self._dim]}
        self.columns |= (exchange_columns(self._dim) if self._both else {}) | ERRORS
        exchanged = [name == "interface" for side in sides for name in side.names]
        between = [exchanged] if self._both else []
        self._means = sum(map(len, means))
        self._ends = self._means + len(whole)
        self._matrix = np.vstack([*means, whole, of_side, *between])

    def _given(self) -> np.ndarray:
        """Impulses since the start, of all names."""
        return np.array([row for side in self._sides.values() for row in side.partition.impulses().values()])

    def _momenta(self, window: Any) -> np.ndarray:
        """Of each side, at the end of a ``window``, or None at the start."""
        return np.array([side.momentum(window) for side in self._sides.values()])

    def __call__(self, window: Any) -> Dict[str, float]:
        """Entries after this window, name → number."""
        if not self._sides:
            return {}
        given, n, m = self._given(), self._means, self._ends
        if self._both:
            self._exchange = self._exchange + exchange(window, self._dim)
        sums = self._matrix @ given
        mean, self._before = (sums[:n] - self._before) / window.dt, sums[:n]
        return dict(zip(self.columns, [*mean.ravel().tolist(), *sums[n:m, :self._dim].ravel().tolist(),
                                       *self._exchange[:len(self._exchange) * self._both].tolist(),
                                       *self._errors(window, given, sums[m:])]))

    def _errors(self, window: Any, given: np.ndarray, sums: np.ndarray) -> List[float]:
        """Of both sides together; warns of the first that does not close, or of the interface. sums: of each
        side, and of the interface."""
        momenta, k, linear = self._momenta(window), len(self._sides), slice(self._dim)
        rest = np.where(self._booked, momenta - self._base - sums[:k], 0.0)
        open_ends = np.concatenate([rest, sums[k:] + self._exchange])
        largest = np.abs(np.concatenate([given, momenta])).max(axis=0).tolist()
        parts = linear, slice(self._dim, None)
        before = self._scale[0]
        self._scale = [max(size, *largest[part]) for size, part in zip(self._scale, parts)]
        if self._scale[0] > before:  # else there is no look at all particles
            self._scale[1] = max(self._scale[1], farthest(window) * self._scale[0])
        scale = [size or 1.0 for size in self._scale]
        for part, size in zip(parts, scale):
            for where, error in zip((*self._sides, "interface"),
                                    np.abs(open_ends[:, part]).max(axis=1).tolist()):
                self._warn(where, error / size, window)
        unexplained = np.abs(open_ends.sum(axis=0)).tolist()
        return [max(unexplained[part]) / size for part, size in zip(parts, scale)]

    def _warn(self, where: str, error: float, window: Any) -> None:
        if error > WARN and not self._told:
            self._told = True
            say(f"the books of momentum do not close: until t = {window.time:.6g} s (window {window.number}) "
                f"{error:.2g} of the largest impulse came from nowhere, at the {where}; forces and impulses "
                "in the history are wrong by as much")

    # ---------------------------------------------------------------- state

    def get_state(self) -> Dict[str, Any]:
        """Everything that decides the entries to come, as name → numbers."""
        return {"scale": np.array(self._scale), "told": self._told,
                **({"exchange": self._exchange.copy()} if self._sides else {})}

    def set_state(self, state: Dict[str, Any]) -> None:
        """Go on from there, with both sides as they are then."""
        self._scale, self._told = state["scale"].tolist(), state["told"]
        if self._sides:
            self._exchange = np.array(state["exchange"])
            self._before = (self._matrix @ self._given())[:self._means]


def farthest(window: Any) -> float:
    """Largest distance of a particle from zero along an axis [m]: times an impulse, the size of moments about
    zero, which may themselves cancel, as over the middle of a symmetric scene."""
    particles = getattr(window, "particles", None)
    return 0.0 if particles is None else float(np.abs(particles["x"]).max(initial=0.0))


def exchange(window: Any, dim: int) -> np.ndarray:
    """What the interface gives both sides together in a ``window``, negative: linear [N s], then angular
    about zero [N m s], see above. shape (3,) in a plane, else (6,)."""
    row = np.zeros(3 if dim == 2 else 6)
    arms, owed = getattr(window, "arms", None), getattr(window, "owed", None)
    if arms is not None:
        row[dim:] += turning(arms, window.wall_force)
    if owed is not None:
        row[:dim] += owed.sum(axis=0)
        row[dim:] += turning(window.x - 0.5 * window.moved, owed)
    return window.dt * row


def exchange_columns(dim: int) -> Dict[str, Tuple[str, str]]:
    """Of the row "exchange", name → (unit, meaning)."""
    what = "of the exchange itself since the start, which"
    return {**{f"impulse_exchange_{axis}": ("N s", f"impulse along {axis} {what} the solid is still to get")
               for axis in AXES[:dim]},
            **{f"angular_exchange_{axis}": (
                "N m s", f"impulse about {axis} {what} acts at other places on both sides")
               for axis in AXES[-1 if dim == 2 else 0:]}}


def means_of(matter: str, keys: Iterable[str], dim: int) -> Dict[str, Tuple[str, str]]:
    """Columns of the force and the moment of that ``matter`` on the regions with these ``keys``."""
    kinds = ("force", "N", "along", AXES[:dim]), ("moment", "N m", "about", AXES[-1 if dim == 2 else 0:])
    return {f"{kind}_{matter}_{key}_{axis}": (
                unit, f"{kind} of the {matter} on it {way} {axis}, mean over the window")
            for key in keys for kind, unit, way, axes in kinds for axis in axes}
