"""Sphere on a beam, off centre: struck where there is neither a node nor the middle of a cell.

The beam of ``beam_impact.py``; the reference is Timoshenko's beam with Hertz's contact, struck at the
same place (``references/beam_theory.py``). Nothing crosses a cell here: what the basis changes is how
stiff the cells are in bending and how a force inside a cell reaches the nodes.
"""
from typing import Any, Dict

import beam_impact

from studies.crossing.common import of_case

SWEEP = [dict(h=5e-3), dict(h=2.5e-3), dict(h=2e-3)]
MEASURE = "u_beam"


def run(basis: str = "linear", h: float = 2e-3, at: float = 0.0335, points: int = 2, **others: Any) -> dict:
    """Cells of ``h`` [m], place of the impact from midspan [m], points per cell and direction; others:
    keys of ``beam_impact.py``. Returns its errors (force, deflection under the sphere, the sphere's final
    velocity, relative) and what it costs."""
    beam: Dict[str, Any] = dict(body=(round(0.1535 / h), round(0.01 / h)), points=points)
    keys = {**beam, "basis": basis, **others}
    return of_case(beam_impact.main, h=h, at=at, **keys)
