"""Where energy has gone: friction, plastic flow, contacts of the grains, and what the schemes take.

Of the solid, with its energy E = kinetic + strain + potential + springs and the work W of interface, loads,
body forces and of supports and walls that move,

    E(start) + W = E + what has left + friction + hits + plastic + stress + numerical;

plastic is what the laws of the points say that they have taken, zero where no law flows. The balance on the
grid (``MPM.works``), whose kinetic energy is that of the nodes, gives it a second time,

    work from outside - friction - hits
        - change of (kinetic of the nodes + strain + potential + springs) = plastic + stress;

stress is the error of the stress in time (forces act with the mean of a step, flow with its end), of
accelerations that points carry, of F-bar's mean, and with consistent inertia what lumped masses misjudge. Of
the grains, which give the wall the work W_wall, all that is missing is put to their contacts: damping,
friction and rolling, and the error of their steps with it. Numerical is what is left of the whole: what the
transfers between points and grid take, nodes that supports stop, and W_wall less the work that has reached
the solid. Stress and numerical are no physics: ``balance_error`` is their sum.
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
    "energy_stress": ("J", "energy that errors of the stress in time and of F-bar's mean have taken: what "
                           "the balance on the grid has lost besides"),
    "energy_contact_damping": ("J", "energy that contacts of the particles have taken, by damping and "
                                    "friction, with the error of their steps"),
    "energy_numerical": ("J", "energy that transfers, held nodes and the exchange have taken: what remains "
                              "of the balance"),
    "balance_error": ("1", "minus energy_stress and energy_numerical, relative to the energy that is in "
                           "motion, strain and springs and has been taken so far"),
}
WORK = "loads", "body force", "base", "interface", "supports", "walls"


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
            del self.columns["energy_contact_damping"]
        self._start = self._of_solid(solid.energy())
        self._grains_start = 0.0 if alone else sum(grains.energy().values())

    def _of_solid(self, energy: Dict[str, float]) -> Tuple[float, float, Dict[str, float]]:
        """Energy with that of springs less the work on it, the same with the kinetic energy of the nodes in
        the place of the points', and works."""
        works = self._solid.works()
        outside = sum(works[kind] for kind in WORK)
        whole = sum(energy.values()) + works["springs"] - outside
        return whole, whole - energy["kinetic"] + works["nodes"] + works["left"], works

    def __call__(self, ledger: Any) -> Dict[str, float]:
        """Entries after a window, after those of the ``ledger``, None of a solid alone."""
        if not self.columns:
            return {}
        energy = self._solid.energy() if ledger is None else ledger.energies["solid"]
        whole, on_grid, works = self._of_solid(energy)
        friction = works["friction"]
        hits = works["hits"]
        on_nodes = self._start[1] - on_grid - friction - hits if self._solid.flows else 0.0
        plastic = self._plastic(works, on_nodes)
        lost = self._start[0] - whole - float(left(self._solid, "energy")) - friction - hits - on_nodes
        there = energy["kinetic"] + energy["strain"] + abs(works["springs"])
        found = {"energy_springs": works["springs"], "energy_friction": friction, "energy_hits": hits,
                 "energy_plastic": plastic, "energy_stress": on_nodes - plastic}
        if ledger is not None:
            of_grains = ledger.energies["grains"]
            gone = sum(of_grains.values()) + float(left(self._grains, "energy"))
            outside = shaken(self._grains) - ledger.work_wall
            found["energy_contact_damping"] = self._grains_start - gone + outside
            lost += ledger.work_wall - works["interface"]
            there += without_potential(of_grains)
        found["energy_numerical"] = lost
        spent = there + sum(abs(taken) for name, taken in found.items() if name != "energy_springs")
        return {**found, "balance_error": -(found["energy_stress"] + lost) / (spent or 1.0)}

    def _plastic(self, works: Dict[str, float], on_nodes: float) -> float:
        """What plastic flow has taken; of laws that flow and do not remember it the balance ``on_nodes``."""
        taken = works["plastic"] - self._start[2]["plastic"]
        return taken if np.isfinite(taken) else on_nodes
