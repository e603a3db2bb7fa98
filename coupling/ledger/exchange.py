"""Momentum and energy exchanged at the interface, window by window."""
from typing import Any, Dict, Tuple

import numpy as np

from .departures import left, shaken
from .limit import work_on_wall
from .momentum import AXES, Momentum, turning

COLUMNS = {
    "impulse_grains": ("N s", "vertical impulse of the interface on the particles since the start: their "
                              "change of momentum less gravity's share"),
    "impulse_solid": ("N s", "vertical impulse of the interface on the solid's grid nodes since the start; "
                             "the sum with impulse_grains is round-off, unless particles touch what is "
                             "at rest"),
    "work_wall": ("J", "work of the exchanged force on the wall since the start, in windows and jumps "
                       "between them"),
    "work_solid": ("J", "work of the exchanged force along the path of the interface, since the start"),
    "energy_grains": ("J", "energy of the particles and their contacts"),
    "energy_solid": ("J", "energy of the solid"),
    "interface_error": ("1", "energy that the staggered scheme has made at the interface, work_solid - "
                             "work_wall, relative to the largest energy but in gravity so far"),
    "energy_error": ("1", "change of the total energy, with what left and less the work of the base, to the "
                          "largest energy but in gravity so far; of a closed system without damping, "
                          "friction, plastic flow and moving supports: the error"),
}
VERTICAL = 1  # axis: y is up in a plane as in space
LINEAR = {"grains": "impulse of the interface on the particles along {} since the start",
          "solid": "impulse of the interface on the solid's grid nodes along {} since the start"}
ANGULAR = {"grains": "impulse about the {} axis of the interface on the particles since the start: their "
                     "change of angular momentum less gravity's share",
           "solid": "the same on the solid; the sum with that of the grains is what angular_exchange "
                    "tells"}

SUMS = "impulse", "angular", "work_wall", "work_solid", "scale", "whole"  # since the start
MADE = 0.25  # energy out of nothing, relative to the largest so far, beyond which a closed system is stopped


def without_potential(energies: Dict[str, float]) -> float:
    """Sum of the ``energies`` by kind, but for that in gravity."""
    return sum(energy for kind, energy in energies.items() if kind != "potential")


class UnstableError(RuntimeError):
    """A closed system has gained energy."""


def columns(dim: int) -> Dict[str, Tuple[str, str]]:
    """Those of ``COLUMNS``, and the components of impulse and angular impulse in a scene of dimension
    ``dim``."""
    more = {f"impulse_{side}_{AXES[k]}": ("N s", text.format(AXES[k]))
            for k in range(dim) if k != VERTICAL for side, text in LINEAR.items()}
    more |= {f"angular_{side}_{axis}": ("N m s", text.format(axis))
             for axis in AXES[-1 if dim == 2 else 0:] for side, text in ANGULAR.items()}
    return {**COLUMNS, **more}


def impulse_error(history: Any) -> float:
    """Largest sum of the impulses on grains and solid, in all components of a ``history`` with the ledger's
    columns, relative to the largest impulse. It is round-off unless particles touch what is at rest."""
    pairs = [(history[f"impulse_grains{axis}"], history[f"impulse_solid{axis}"])
             for axis in ("", "_x", "_z") if f"impulse_grains{axis}" in history.columns]
    largest = max(np.abs(taken).max(initial=0.0) for _, taken in pairs)
    return float(max(np.abs(given + taken).max(initial=0.0) for given, taken in pairs) / (largest or 1.0))


class Ledger:
    """Momentum and energy exchanged at the interface since the start, and the energy of both sides; call it
    with each ``Window``. The entries are those of ``columns``.

    gravity: on the particles [m/s^2], upward, or all components, shape (dim,). ``energies``: of both sides by
    kind, after the last window.
    """

    def __init__(self, solid: Any, grains: Any, gravity: Any = 0.0) -> None:
        self._solid, self._grains = solid, grains
        dim = solid.surface()[0].shape[1]
        self.columns, self._axes = columns(dim), AXES[:dim]
        pull = np.asarray(gravity, float)
        self._about = getattr(solid, "origin", 0.0)  # far from zero moments about zero would be round-off
        pull = pull if pull.ndim else pull * np.eye(dim)[VERTICAL]
        self.of_grains = self._momentum = Momentum(grains, pull, solid.time, self._about)
        self._last: Any = None
        self._impulse, self._angular = np.zeros(dim), np.zeros(1 if dim == 2 else 3)
        self._work_wall = self._work_solid = 0.0
        both = self._energies()
        self._start, self._scale, self._whole = sum(both), self._largest(), max(map(abs, both))

    @property
    def work_wall(self) -> float:
        """Of the exchanged force on the wall since the start [J]."""
        return self._work_wall

    @property
    def share(self) -> float:
        """Largest energy but in gravity so far over the largest energy, at most 1."""
        return self._scale / max(self._scale, self._whole, 1e-300)

    def _energies(self) -> Tuple[float, float]:
        self.energies = {"grains": self._grains.energy(), "solid": self._solid.energy()}
        return sum(self.energies["grains"].values()), sum(self.energies["solid"].values())

    def _largest(self) -> float:
        """Of the energies of both sides now, but for the potential one, whose zero is anywhere."""
        return max(abs(without_potential(parts)) for parts in self.energies.values())

    def __call__(self, window: Any) -> Dict[str, float]:
        """Entries after this window, name → number."""
        self._work_wall += work_on_wall(window, self._last)
        self._last = window
        self._work_solid += float(np.vdot(window.force, window.moved))
        grains, solid = self._energies()
        gone = float(left(self._grains, "energy") + left(self._solid, "energy"))
        gone -= shaken(self._grains) + shaken(self._solid)
        self._scale = max(self._scale, self._largest())
        self._whole = max(self._whole, abs(grains), abs(solid))
        scale = self._scale or 1.0  # nothing has moved yet
        return {**self._impulses(window), "work_wall": self._work_wall,
                "work_solid": self._work_solid, "energy_grains": grains, "energy_solid": solid,
                "interface_error": (self._work_solid - self._work_wall) / scale,
                "energy_error": (grains + solid + gone - window.indentation_energy - self._start) / scale}

    def get_state(self) -> dict:
        """Everything that decides the entries to come, but for the last ``Window``, as name → numbers."""
        return {**{name: getattr(self, f"_{name}") for name in SUMS}, "momentum": self._momentum.get_state()}

    def set_state(self, state: dict, last: Any) -> None:
        """Go on from there, after the ``last`` window."""
        self._last = last
        for name in SUMS:
            setattr(self, f"_{name}", state[name])
        self._momentum.set_state(state["momentum"])

    def _impulses(self, window: Any) -> Dict[str, float]:
        """Linear and angular, on both sides."""
        turned = turning(window.x - self._about - 0.5 * window.moved, window.force)
        self._impulse = self._impulse + self._solid.applied * window.dt
        self._angular = self._angular + turned * window.dt
        linear, angular = self._momentum.gained(window.particles, window.time)
        found = {}
        for side, impulse, turned in (("grains", linear, angular), ("solid", self._impulse, self._angular)):
            for axis, value in zip(self._axes, impulse):
                found[f"impulse_{side}" + ("" if axis == AXES[VERTICAL] else f"_{axis}")] = float(value)
            for axis, value in zip(AXES[-len(turned):], turned):
                found[f"angular_{side}_{axis}"] = float(value)
        return found


def check_closed(entries: Dict[str, float], time: float, share: float = 1.0) -> None:
    """UnstableError when a ledger's ``entries`` at ``time`` [s] show more energy than a closed system has.
    share: see ``Ledger.share``; what lies still under its weight has little energy but in gravity, which may
    grow by a large part of itself."""
    total, interface = share * entries["energy_error"], share * entries["interface_error"]
    if max(total, interface) > MADE:
        raise UnstableError(f"the coupled run has gained energy until t = {time:.6g} s, {total:.0%} of the "
                            f"largest so far, {interface:.0%} at the interface: it is unstable or far too "
                            "coarse, repeat the windows (iterate=20) or take a smaller dt, 10 or more to a "
                            "contact")
