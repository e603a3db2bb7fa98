"""Where energy has gone: friction, plastic flow, contacts of the grains, and what the schemes take.

Of the solid, with its energy E = kinetic + strain + potential + springs and the work W of interface, loads,
body forces and of supports and walls that move,

    E(start) + W = E + what has left + friction + plastic + numerical;

plastic is the balance on the grid (``MPM.works``), zero where no law flows. Of the grains, which give the
wall the work W_wall, all that is missing is put to their contacts: damping, friction and rolling, and the
error of their steps with it. Numerical is what is left of the whole: transfers between points and grid, nodes
that supports stop, and W_wall less the work that has reached the solid.
"""
from typing import Any, Dict, Tuple

from .departures import left, shaken

COLUMNS = {
    "energy_springs": ("J", "energy in the springs of walls and contacts of the solid"),
    "energy_friction": ("J", "energy that friction of the solid with walls and of its bodies has taken"),
    "energy_plastic": ("J", "energy that plastic flow has taken, with the error of the stress in time"),
    "energy_contact_damping": ("J", "energy that contacts of the particles have taken, by damping and "
                                    "friction, with the error of their steps"),
    "energy_numerical": ("J", "energy that transfers, held nodes and the exchange have taken: what remains "
                              "of the balance"),
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
        """Energy with that of springs, the same without the kinetic one, less the work on it, and works."""
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
        plastic = self._start[1] - on_grid - friction if self._solid.flows else 0.0
        lost = self._start[0] - whole - float(left(self._solid, "energy")) - friction - plastic
        found = {"energy_springs": works["springs"], "energy_friction": friction, "energy_plastic": plastic}
        if ledger is not None:
            gone = sum(ledger.energies["grains"].values()) + float(left(self._grains, "energy"))
            outside = shaken(self._grains) - ledger.work_wall
            found["energy_contact_damping"] = self._grains_start - gone + outside
            lost += ledger.work_wall - works["interface"]
        return {**found, "energy_numerical": lost}
