"""Where energy has gone: friction, plastic flow, contacts of the grains, and what the schemes take.

Of the solid, with its energy E = kinetic + strain + potential + springs and the work W of interface, loads,
body forces and of supports and walls that move,

    E(start) + W = E + what has left + friction + hits + plastic
                   + stress + carried + transfers + inertia + iterations + numerical.

Plastic is what the laws of the points say that they have taken, zero where no law flows. The others of the
second line are no physics, and ``balance_error`` is their sum with the exchange. Each is computed on its own
(``MPM.works``): stress is inner work of the mean stress of each step, less what strain has gained and plastic
flow taken; transfers are what the kinetic energy of the nodes has gained in the steps more than that of the
points. Numerical is what is left of the whole, round-off. A coupled solid without plastic flow does not split
its works: there it holds what of stress, carried and inertia there is.

Of the grains, which give the wall the work W_wall, all that is missing is put to their contacts: damping,
friction and rolling, and the error of their steps with it. The exchange takes W_wall less the work that has
reached the solid.
"""
from typing import Any, Dict, Tuple

import numpy as np

from .departures import left, shaken
from .exchange import without_potential

COLUMNS = {
    "energy_springs": ("J", "energy in the springs of walls and contacts of the solid"),
    "energy_friction": ("J", "energy that friction of the solid with walls and of its bodies has taken"),
    "energy_hits": ("J", "energy that springs of walls and contacts of the solid have taken besides: of what "
                         "hits them, and goes round edges"),
    "energy_plastic": ("J", "energy that plastic flow has taken, as the laws of the points say"),
    "energy_stress": ("J", "energy that the error of the mean stress along finite steps has taken"),
    "energy_carried": ("J", "energy that forces of the last grid have taken, whose accelerations the points "
                            "carry to the next; with the midpoint rule, the stress in the middle of steps in "
                            "place of the mean"),
    "energy_transfers": ("J", "kinetic energy that transfers between points and grid have taken, and nodes "
                              "that supports stop"),
    "energy_inertia": ("J", "energy that consistent inertia, ghost penalties and the inertia of nearly empty "
                            "cells have taken, as lumped masses count it"),
    "energy_iterations": ("J", "energy that the tolerance of Newton's method has taken"),
    "energy_contact_damping": ("J", "energy that contacts of the particles have taken, by damping and "
                                    "friction, with the error of their steps"),
    "energy_exchange": ("J", "energy that the exchange at the interface has taken"),
    "energy_numerical": ("J", "what remains of the balance: round-off, but of coupled solids without plastic "
                              "flow stress, carried and inertia"),
    "balance_error": ("1", "minus the energy that no process of nature has taken, from energy_stress to "
                           "energy_numerical, relative to the energy that is in motion, strain and springs "
                           "and has been taken so far"),
}
WORK = "loads", "body force", "base", "interface", "supports", "walls"
GRAINS = "contact_damping", "exchange"  # columns of runs with grains only
SCHEME = "stress", "carried", "transfers", "inertia", "iterations", "exchange", "numerical"  # no physics


class Dissipation:
    """Of a ``solid`` with ``works()``, and ``grains`` or None; ``columns``: name → (unit, meaning), none
    where the solid has no such method, or a solid alone does not book losses: there it would cost an energy
    in each window. Collective."""

    def __init__(self, solid: Any, grains: Any) -> None:
        alone = grains is None
        self._solid, self._grains, self.columns = solid, grains, dict(COLUMNS)
        if not hasattr(solid, "works") or alone and solid.transfer_losses is None:
            self.columns = {}
            return
        if alone:
            for name in GRAINS:
                del self.columns[f"energy_{name}"]
        self._booked = solid.flows or solid.transfer_losses is not None
        if self._booked:
            solid.book_works()
        self._before, self._works_before = solid.energy(), solid.works()
        self._grains_start = 0.0 if alone else sum(grains.energy().values())

    def __call__(self, ledger: Any) -> Dict[str, float]:
        """Entries after a window, after those of the ``ledger``, None of a solid alone."""
        if not self.columns:
            return {}
        energy = self._solid.energy() if ledger is None else ledger.energies["solid"]
        found, works = self._of_solid(energy)
        there = energy["kinetic"] + energy["strain"] + abs(works["springs"])
        if ledger is not None:
            of_grains = ledger.energies["grains"]
            gone = sum(of_grains.values()) + float(left(self._grains, "energy"))
            outside = shaken(self._grains) - ledger.work_wall
            found["contact_damping"] = self._grains_start - gone + outside
            found["exchange"] = ledger.work_wall - works["interface"]
            there += without_potential(of_grains)
        spent = there + sum(map(abs, found.values()))
        lost = sum(found.get(name, 0.0) for name in SCHEME)
        return {**{f"energy_{name}": taken for name, taken in found.items()},
                "energy_springs": works["springs"], "balance_error": -lost / (spent or 1.0)}

    def _of_solid(self, energy: Dict[str, float]) -> Tuple[Dict[str, float], Dict[str, float]]:
        """What has been taken from the solid with this ``energy``, by what, and its works since the start."""
        now = self._solid.works()
        works = {kind: now[kind] - self._works_before[kind] for kind in now}
        gained = {kind: energy[kind] - self._before[kind] for kind in energy}
        gone = float(left(self._solid, "energy"))
        found = {kind: works[kind] for kind in ("friction", "hits", "carried", "inertia", "iterations")}
        found["transfers"] = works["nodes"] - gained["kinetic"] - (gone - works["left"])
        of_stress = works["inner"] - gained["strain"] - works["strain left"]
        # laws that flow and do not remember it, in plastic work that is not a number, have the balance
        found["plastic"] = works["plastic"] if np.isfinite(works["plastic"]) else of_stress
        found["stress"] = of_stress - found["plastic"] if self._booked else 0.0
        outside = sum(works[kind] for kind in WORK)
        whole = outside - sum(gained.values()) - gone - works["springs"]
        found["numerical"] = whole - sum(found.values())
        return found, {**works, "springs": now["springs"]}
